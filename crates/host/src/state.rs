//! Everything about one host that changes: a plain value that can be copied, compared, saved and restored.

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_USERS;
use cotouch_scene::names::HostIndex;
use cotouch_world::{BodyState, ContactState};
use serde::{Deserialize, Serialize};

use crate::contacts::ContactStates;
use crate::model::HostModel;
use crate::peers::PeerState;
use crate::rejoining::FingerOffset;
use crate::soft::SoftHostState;

/// A host's state between two ticks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HostState {
    /// Ticks done so far.
    pub ticks_done: u64,
    /// The last network step that was done.
    pub last_step: Option<u64>,
    /// This host's copy of every body, in the scene's order; at a client, the server's bodies as last heard of.
    pub bodies: Vec<BodyState>,
    /// Every contact with a surface that there can be at this host.
    pub contacts: ContactStates,
    /// What there is of a soft body; empty where there is none, and at a client.
    pub soft: SoftHostState,
    /// One entry a host; the own entry stays empty.
    pub peers: Vec<PeerState>,
    /// How far each own finger counts as elsewhere than it is.
    pub fingers: Vec<FingerOffset>,
    /// Set when own fingers may have moved while nobody looked, until they are read again.
    pub moved_unseen: bool,
    /// Set while a late joiner waits for the world's present state.
    pub adopting: bool,
    /// Set for good when the world left all bounds; it no longer moves and no force is rendered.
    pub diverged: bool,
}

impl HostState {
    /// The state before the first tick: everything at rest where the scene puts it, every peer absent.
    #[must_use]
    pub fn new(model: &HostModel) -> Self {
        Self {
            ticks_done: 0,
            last_step: None,
            bodies: model.bodies.start(),
            contacts: model.contacts.start(),
            soft: SoftHostState::new(model.soft_slots()),
            peers: model.peers.start(|host| model.memory_of(host)),
            fingers: vec![FingerOffset::default(); model.own_fingers()],
            moved_unseen: false,
            adopting: false,
            diverged: false,
        }
    }

    /// Whether this is a state of `model`: one that was read may be of another scene.
    #[must_use]
    pub fn fits(&self, model: &HostModel) -> bool {
        self.bodies.len() == model.body_count()
            && model.contacts.fit(&self.contacts)
            && self.soft.contacts.len() == model.soft_slots()
            && self.soft.returned_n.len() == model.soft_slots()
            && self.peers.len() == usize::from(model.users)
            && self.fingers.len() == model.own_fingers()
            && (0..).map(HostIndex).zip(&self.peers).all(|(host, peer)| model.memory_of(host).fits(peer))
    }

    /// Takes note that a peer is there, or is not any more; its coupling fades.
    pub fn set_present(&mut self, peer: HostIndex, present: bool) {
        if let Some(peer) = self.peers.get_mut(peer.index()) {
            peer.set_present(present);
        }
    }

    /// Takes note that own fingers may have moved while nobody looked: a host or a device stood still. What they hold is not thrown to
    /// where they are now, but comes there slowly.
    pub fn fingers_moved_unseen(&mut self) {
        self.moved_unseen = true;
    }

    /// The network step of the sample in use from each host.
    #[must_use]
    pub fn steps_in_use(&self) -> ArrayVec<Option<u64>, MAX_USERS> {
        self.peers.iter().map(|peer| peer.samples.held().map(|packet| packet.step)).collect()
    }

    /// The contact between a user's finger and a body; `None` where the body has no surface, or the host no world.
    #[must_use]
    pub fn finger_contact(
        &self,
        model: &HostModel,
        user: HostIndex,
        finger: usize,
        body: usize,
    ) -> Option<&ContactState> {
        model.contacts.finger(&self.contacts, user, finger, body)
    }
}
