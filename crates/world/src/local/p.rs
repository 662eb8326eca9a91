//! `p`: a spring to the surface (Barbagli et al. 2003, §2.1).

use glam::DVec3;

use super::contact::{ContactInput, LocalContact};
use super::law::LocalLaw;
use super::sticking::StickingContacts;
use crate::linear_block::LinearBlock;

/// F = K_h·e (Barbagli et al. 2003, (3)).
#[derive(Clone, Copy, Debug)]
pub(super) struct PLaw;

impl LocalLaw for PLaw {
    fn force(&self, input: &ContactInput<'_>, contact: &mut LocalContact) -> DVec3 {
        contact.spring_force(input)
    }

    fn linear(&self, contacts: &StickingContacts<'_>) -> LinearBlock {
        LinearBlock::gain(contacts.stiffness())
    }
}
