//! What a law is: the door behind which every local model stands, and one tick of it.

use std::fmt::Debug;

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_SOFT_CONTACTS;
use glam::DVec3;

use super::contact::{ContactInput, LawState, LocalContact};
use super::gains::LocalGains;
use super::model::SoftContactModel;
use super::sticking::StickingContacts;
use super::surface::SurfaceInUse;
use crate::linear_block::LinearBlock;

/// One value a finger slot.
pub type Slots<T> = ArrayVec<T, MAX_SOFT_CONTACTS>;

/// The forces on all fingers, N, one a finger slot.
pub type FingerForces = Slots<DVec3>;

/// The law of a local model: the force on a finger that touches a slowly simulated soft body, at the haptic rate.
///
/// A law says the same twice: [`force`](Self::force) (or [`forces`](Self::forces)) for the running host, and
/// [`linear`](Self::linear) for the analysis. While contacts stick, both must be the same map: a test holds every law of the
/// table to that. Functions that run in a tick allocate nothing, take no lock and do bounded work.
pub trait LocalLaw: Debug + Sync {
    /// What the law needs besides K_h.
    fn needs(&self) -> LawNeeds {
        LawNeeds::default()
    }

    /// When forces are computed.
    fn clock(&self) -> LawClock {
        LawClock::Tick
    }

    /// What the law remembers of every contact from one instant to the next: an integral's force, whose input counts INT for
    /// a whole slow period, or numbers of its own.
    fn states(&self) -> &'static [LawState] {
        &[]
    }

    /// The force on a finger that touches, N, its state one instant of the clock on.
    fn force(&self, input: &ContactInput<'_>, contact: &mut LocalContact) -> DVec3;

    /// The forces on all fingers of a host, N, their contacts one tick on: by default each finger by itself.
    fn forces(
        &self,
        tick: &LocalTick<'_>,
        contacts: &mut [LocalContact],
        fingers: &[LocalFinger],
    ) -> FingerForces {
        let pairs = contacts.iter_mut().zip(fingers).enumerate();
        pairs.map(|(slot, (contact, finger))| tick.force_alone(self, slot, contact, finger)).collect()
    }

    /// The linear block of m contacts that stick, at the law's [clock](Self::clock). The input stacks the errors
    /// e = x_a + o − x_h of all contacts (3m, m) and, of a law that needs the joint compliance, the forces on the body with
    /// which the frame in use was made (3m, N); the output stacks the forces on the fingers (3m, N); the state stacks the
    /// law's numbers contact by contact.
    fn linear(&self, contacts: &StickingContacts<'_>) -> LinearBlock;
}

/// What a law needs besides K_h.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LawNeeds {
    /// Gains that the analysis suggests are a pair K_h and INT, found for the loop of `pi` with its pure integrator (Barbagli
    /// et al. 2003, (6)); without this, K_h alone, as for `p`. A law with another integral leaves it out, and its loop gets
    /// a rule of its own in `cotouch_analysis::gain_ratios`.
    pub gains_of_pi: bool,
    /// The joint compliance of all contacts, and the forces with which the frame in use was made.
    pub joint_compliance: bool,
}

/// When a law computes its forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LawClock {
    /// FingerForces are computed in every tick.
    Tick,
    /// In the first tick of every period of the simulation; they are held until the next.
    SlowPeriod,
}

/// A finger as one tick knows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFinger {
    /// Its centre (m) and velocity (m/s), if they are known.
    pub place: Option<(DVec3, DVec3)>,
    /// How much its force counts on the body, 0 to 1.
    pub fade: f64,
}

/// The compliance that comes with the frame in use.
#[derive(Clone, Copy, Debug)]
pub struct FrameCompliance<'a> {
    /// The finger slots of which it tells.
    pub slots: &'a [u8],
    /// Their joint compliance W, m/N: row-major, three rows and columns each; empty where the body does not tell.
    pub compliance: &'a [f64],
    /// The forces on the body with which the frame was made, N, one a slot in `slots`.
    pub forces_n: &'a [DVec3],
}

impl FrameCompliance<'_> {
    /// The place of a finger slot in the compliance.
    #[must_use]
    pub fn place(&self, slot: usize) -> Option<usize> {
        self.slots.iter().position(|&known| usize::from(known) == slot)
    }

    /// Mean of the compliance at a place over all directions, m/N.
    ///
    /// # Panics
    /// When there is no such place.
    #[must_use]
    pub fn own_compliance(&self, place: usize) -> f64 {
        let width = 3 * self.slots.len();
        let entry = |axis: usize| self.compliance[(3 * place + axis) * (width + 1)];
        (0..3).map(entry).sum::<f64>() / 3.0
    }
}

/// One tick of all contacts of a host, as far as it is known beforehand.
#[derive(Clone, Debug)]
pub struct LocalTick<'a> {
    /// Constants of all contacts.
    pub model: &'a SoftContactModel,
    /// One a finger slot.
    pub gains: Slots<LocalGains>,
    /// The surface as it is in this tick.
    pub surface: SurfaceInUse<'a>,
    /// What the frame in use tells of the body's compliance.
    pub frame: FrameCompliance<'a>,
    /// Whether the forces of laws with the clock [`LawClock::SlowPeriod`] are computed in this tick.
    pub begins_period: bool,
}

impl LocalTick<'_> {
    /// What there is to know about the finger in a slot; `None` where its place is not known.
    #[must_use]
    pub fn input(&self, slot: usize, finger: &LocalFinger) -> Option<ContactInput<'_>> {
        let (centre, velocity) = finger.place?;
        let (model, gains, surface) = (self.model, &self.gains[slot], &self.surface);
        Some(ContactInput { model, gains, surface, centre, velocity })
    }

    /// Looks whether a free finger at `centre` (m) touches.
    pub fn meet(&self, contact: &mut LocalContact, centre: DVec3) {
        if !contact.touching {
            contact.meet(self.model, &self.surface, centre);
        }
    }

    /// The force on a finger by itself, N: it meets the surface, is pressed as the law says, and comes off.
    pub fn force_alone<L: LocalLaw + ?Sized>(
        &self,
        law: &L,
        slot: usize,
        contact: &mut LocalContact,
        finger: &LocalFinger,
    ) -> DVec3 {
        let Some(input) = self.input(slot, finger) else {
            contact.forget(self.model);
            return DVec3::ZERO;
        };
        if law.clock() == LawClock::SlowPeriod && !self.begins_period {
            return contact.force;
        }
        self.meet(contact, input.centre);
        if contact.touching && !self.model.two_sided && contact.depth_m(&self.surface, input.centre) <= 0.0 {
            contact.come_off(&input);
        }
        contact.force = if contact.touching {
            law.force(&input, contact)
        } else {
            let force = contact.normal * contact.integral_n;
            contact.drain();
            force
        };
        contact.force
    }
}
