//! `hold`: the force of a spring to the surface, computed once a slow period and held.

use glam::DVec3;

use super::contact::{ContactInput, LocalContact};
use super::law::{LawClock, LocalLaw};
use super::sticking::StickingContacts;
use crate::linear_block::LinearBlock;

/// F = K_h·e of the first tick of a slow period, held.
#[derive(Clone, Copy, Debug)]
pub(super) struct HoldLaw;

impl LocalLaw for HoldLaw {
    fn clock(&self) -> LawClock {
        LawClock::SlowPeriod
    }

    fn force(&self, input: &ContactInput<'_>, contact: &mut LocalContact) -> DVec3 {
        contact.spring_force(input)
    }

    fn linear(&self, contacts: &StickingContacts<'_>) -> LinearBlock {
        LinearBlock::gain(contacts.stiffness())
    }
}
