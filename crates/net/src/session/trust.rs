//! How far a peer's samples are believed.

use crate::packet::StatePacket;
use crate::plausibility::Before;

/// A sample that cannot be weighs as much as so many that can: who goes on sending some now and then is expelled too.
const WEIGHT: u32 = 8;
/// The same where it may be a finger whose device fell silent and came back somewhere else.
const WEIGHT_OF_AN_ACCIDENT: u32 = 4;

/// What a sample that cannot be means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Offence {
    /// It is the first one since all was well.
    First,
    /// There were others lately.
    Again,
    /// There were too many.
    TooMany,
}

/// What a peer's samples were like so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Trust {
    /// The newest that could be.
    last: Option<StatePacket>,
    /// The newest one since then that could be but for its fingers.
    bodies: Option<StatePacket>,
    /// The step of the newest one since then that could not.
    refused: Option<u64>,
    /// Whether one since then cannot have been an accident.
    is_lying: bool,
    offences: u32,
    /// So many more must follow from one another before one is used.
    probation: u32,
}

impl Trust {
    /// From what the sample of `step` is to follow. What came in between and could not be is no excuse for being far from what could.
    pub(super) fn before(&self, step: u64) -> Option<Before<'_>> {
        let fingers = self.last.as_ref()?;
        let bodies = self.bodies.as_ref().unwrap_or(fingers);
        let refused = self.refused.filter(|refused| *refused < step).unwrap_or(0);
        let fingers_since = fingers.step.max(refused);
        let bodies_since = if self.is_lying { bodies.step.max(refused) } else { bodies.step };
        Some(Before { fingers, fingers_since, bodies, bodies_since })
    }

    /// Takes note of a sample that can be; whether it is to be used.
    pub(super) fn believe(&mut self, packet: &StatePacket) -> bool {
        self.offences = self.offences.saturating_sub(1);
        (self.refused, self.bodies, self.is_lying) = (None, None, false);
        if self.last.as_ref().is_none_or(|last| last.step < packet.step) {
            self.last = Some(packet.clone());
        }
        let is_used = self.probation == 0;
        self.probation = self.probation.saturating_sub(1);
        is_used
    }

    /// Takes note of one that cannot be but for an accident to its fingers; `most` times two of them in a row are too many.
    pub(super) fn excuse(&mut self, packet: &StatePacket, most: u32) -> Offence {
        if self.bodies.as_ref().is_none_or(|bodies| bodies.step < packet.step) {
            self.bodies = Some(packet.clone());
        }
        self.count(packet.step, WEIGHT_OF_AN_ACCIDENT, most)
    }

    /// Takes note of one of `step` that cannot be; `most` of them in a row are too many.
    pub(super) fn refuse(&mut self, step: u64, most: u32) -> Offence {
        self.is_lying = true;
        self.count(step, WEIGHT, most)
    }

    fn count(&mut self, step: u64, weight: u32, most: u32) -> Offence {
        let is_first = self.offences == 0;
        self.offences = self.offences.saturating_add(weight);
        self.refused = self.refused.max(Some(step));
        self.probation = if self.probation > 0 { most } else { 0 };
        match self.offences {
            offences if offences >= most.saturating_mul(WEIGHT) => Offence::TooMany,
            _ if is_first => Offence::First,
            _ => Offence::Again,
        }
    }

    /// Its coupling fades out: it may come back somewhere else, if it has not lied. Where that is must be clear from `most` samples
    /// in a row if some could not be.
    pub(super) fn forget(&mut self, most: u32) {
        if !self.is_lying {
            self.probation = if self.refused.is_some() { most } else { 0 };
            (self.last, self.bodies, self.refused) = (None, None, None);
        }
    }
}
