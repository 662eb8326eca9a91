//! `p`: a spring to the surface (Barbagli et al. 2003, §2.1).

use glam::DVec3;

use super::contact::{ContactInput, LocalContact};
use super::law::LocalLaw;
use super::linear::{LinearLaw, StickingContacts};

/// F = K_h·e (Barbagli et al. 2003, (3)).
#[derive(Clone, Copy, Debug)]
pub(super) struct P;

impl LocalLaw for P {
    fn force(&self, input: &ContactInput<'_>, contact: &mut LocalContact) -> DVec3 {
        contact.spring_force(input)
    }

    fn linear(&self, contacts: &StickingContacts<'_>) -> LinearLaw {
        LinearLaw::stateless(contacts.stiffness())
    }
}
