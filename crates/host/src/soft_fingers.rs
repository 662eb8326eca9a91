//! The fingers of all users on a host's soft body: own ones as read, those of others as held.

use arrayvec::ArrayVec;
use cotouch_scene::geometry::{Readings, Wrench};
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_world::Phase;
use cotouch_world::local::{LocalFinger, Slots};
use glam::DVec3;

use crate::output::{ContactPoint, ContactRecord, ContactSurface, TickOutput};
use crate::peers::PeerState;
use crate::soft::{SoftContactOutput, SoftContacts, SoftHostState};
use crate::touching::Touching;

/// The fingers that may touch a soft body, and their contacts with it.
#[derive(Clone, Debug)]
pub(crate) struct SoftFingers {
    pub(crate) contacts: SoftContacts,
    host: HostIndex,
    /// Every finger of every user, in the order of slots.
    fingers: Vec<(HostIndex, usize)>,
}

impl SoftFingers {
    /// For users with so many fingers each.
    pub(crate) fn new(scene: &Scene, host: HostIndex, fingers: &[u8]) -> Self {
        let contacts = SoftContacts::new(scene);
        let all = (0..).map(HostIndex).zip(fingers);
        let all =
            all.flat_map(|(host, &fingers)| (0..usize::from(fingers)).map(move |finger| (host, finger)));
        Self { fingers: all.take(contacts.slots()).collect(), contacts, host }
    }

    /// All contacts one tick on: forces on own fingers and what goes to the simulation, into `output`.
    pub(crate) fn touch(
        &self,
        state: &mut SoftHostState,
        peers: &[PeerState],
        tick: u64,
        readings: &Readings,
        output: &mut TickOutput,
    ) {
        let fingers = self.fingers(peers, readings);
        let Some(touch) = self.contacts.touch(state, tick, &as_local(&fingers)) else { return };
        for ((finger, &force), contact) in fingers.iter().zip(&touch.forces).zip(&touch.contacts) {
            if !finger.is_held {
                output.device[finger.finger] = Wrench::force(output.device[finger.finger].force + force);
            }
            if let Some(contact) = contact {
                self.list(output, finger, contact);
            }
        }
        output.slow = touch.slow;
    }

    /// What the tick will find for the fingers of another host, N; nothing moves on.
    pub(crate) fn forces_on_held(
        &self,
        state: &SoftHostState,
        peers: &[PeerState],
        tick: u64,
        readings: &Readings,
        host: HostIndex,
    ) -> ArrayVec<DVec3, MAX_FINGERS> {
        let fingers = self.fingers(peers, readings);
        let forces = self.contacts.forces(state, tick, &as_local(&fingers));
        let on_held = fingers.iter().zip(&forces).filter(|(finger, _)| finger.host == host);
        on_held.map(|(finger, force)| finger.fade * *force).collect()
    }

    /// A finger's contact begins anew; one that is two-sided holds what it holds.
    pub(crate) fn begin_anew(&self, state: &mut SoftHostState, host: HostIndex, finger: usize) {
        let slot = self.fingers.iter().position(|&known| known == (host, finger));
        if let Some(contact) = slot.and_then(|slot| state.contacts.get_mut(slot)) {
            self.contacts.begin_anew(contact);
        }
    }

    fn fingers<'a>(&self, peers: &'a [PeerState], readings: &Readings) -> Slots<Touching<'a>> {
        let finger = |&(host, finger): &(HostIndex, usize)| {
            if host == self.host {
                Touching::own(host, finger, readings.get(finger))
            } else {
                Touching::held(peers, host, finger)
            }
        };
        self.fingers.iter().map(finger).collect()
    }

    /// Lists a contact that is not free.
    fn list(&self, output: &mut TickOutput, finger: &Touching<'_>, contact: &SoftContactOutput) {
        output.list_contact(ContactRecord {
            point: ContactPoint::Finger { host: finger.host, finger: finger.finger as u8 },
            surface: ContactSurface::Soft,
            phase: if contact.sliding { Phase::Slide } else { Phase::PreSlide },
            force: finger.fade * contact.force,
            depth_m: contact.depth_m,
        });
    }
}

fn as_local(fingers: &[Touching<'_>]) -> Slots<LocalFinger> {
    fingers.iter().map(|finger| LocalFinger { place: finger.place(), fade: finger.fade }).collect()
}
