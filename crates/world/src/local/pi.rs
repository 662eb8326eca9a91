//! `pi`: a spring to the surface and an integral along its normal (Barbagli et al. 2003, §3.4), with thresholds (10), (11).
//!
//! Barbagli et al. write the error as `x_proxy − x_haptic` and call `e > 0` contact; here `e_n` is that distance, counted from
//! the finger to where it is held, so that all conditions read the same. The third line of (11) as printed, `θ̄₂/I_tot`,
//! falls as the integral grows, while the text says that θ "grows linearly … up to a certain limit"; it is taken as
//! `θ̄₂·I_tot/Ī_tot`, which meets the fourth line.

use glam::DVec3;
use nalgebra::DMatrix;

use super::contact::{ContactInput, LawState, LocalContact};
use super::law::{LawNeeds, LocalLaw};
use super::sticking::StickingContacts;
use crate::linear_block::LinearBlock;

/// F = K_h·e + n·I, I⁺ = I + (INT/N)·(e_n − θ) (Barbagli et al. 2003, (6)).
#[derive(Clone, Copy, Debug)]
pub(super) struct PiLaw;

impl LocalLaw for PiLaw {
    fn needs(&self) -> LawNeeds {
        LawNeeds { gains_of_pi: true, ..LawNeeds::default() }
    }

    fn states(&self) -> &'static [LawState] {
        &[LawState::Integral]
    }

    fn force(&self, input: &ContactInput<'_>, contact: &mut LocalContact) -> DVec3 {
        // A contact that slides has another normal afterwards.
        let depth_m = contact.depth_m(input.surface, input.centre);
        let force = contact.spring_force(input);
        let opening_m_per_s = (input.surface.velocity(&contact.anchor) - input.velocity).dot(contact.normal);
        let threshold_m = threshold_m(input, contact.integral_n, depth_m, opening_m_per_s);
        contact.integral_n += input.gains.integral_per_tick_n_per_m * (depth_m - threshold_m);
        if !input.model.two_sided {
            contact.integral_n = contact.integral_n.max(0.0);
        }
        force
    }

    fn linear(&self, contacts: &StickingContacts<'_>) -> LinearBlock {
        let count = contacts.count();
        let normals = DMatrix::from_fn(3 * count, count, |row, contact| {
            if row / 3 == contact { contacts.normals[contact][row % 3] } else { 0.0 }
        });
        let mut b = normals.transpose();
        for (mut row, gains) in b.row_iter_mut().zip(contacts.gains) {
            row *= gains.integral_per_tick_n_per_m;
        }
        LinearBlock { a: DMatrix::identity(count, count), b, c: normals, d: contacts.stiffness() }
    }
}

/// θ, m, with ė, m/s. A finger that stays where it is counts as one that goes in.
fn threshold_m(input: &ContactInput<'_>, integral_n: f64, depth_m: f64, opening_m_per_s: f64) -> f64 {
    let model = input.model;
    if model.two_sided || depth_m <= 0.0 {
        return 0.0;
    }
    if opening_m_per_s < 0.0 {
        return model.exit_threshold_m;
    }
    let reached = if model.threshold_force_n > 0.0 { integral_n / model.threshold_force_n } else { 1.0 };
    model.entry_threshold_m * reached.clamp(0.0, 1.0)
}
