//! `compliance`: springs to a surface that gives way by the joint compliance of all contacts, a period before the
//! simulation does.
//!
//! ```text
//! (1/K_h + W)·f = −e + W·f_frame,   F = −f
//! ```
//!
//! with the forces `f_frame` on the body that the frame in use was made with. A contact of which the frame does not tell
//! the compliance has a spring alone, as in `p`.

use glam::DVec3;
use nalgebra::DMatrix;

use super::contact::{ContactInput, LocalContact};
use super::joint::{JointContact, joint_forces};
use super::law::{FingerForces, LawNeeds, LocalFinger, LocalLaw, LocalTick, Slots};
use super::sticking::StickingContacts;
use crate::linear_block::LinearBlock;

/// (1/K_h + W)·f = −e + W·f_frame, F = −f.
#[derive(Clone, Copy, Debug)]
pub(super) struct ComplianceLaw;

impl LocalLaw for ComplianceLaw {
    fn needs(&self) -> LawNeeds {
        LawNeeds { joint_compliance: true, ..LawNeeds::default() }
    }

    fn force(&self, input: &ContactInput<'_>, contact: &mut LocalContact) -> DVec3 {
        contact.spring_force(input)
    }

    fn forces(
        &self,
        tick: &LocalTick<'_>,
        contacts: &mut [LocalContact],
        fingers: &[LocalFinger],
    ) -> FingerForces {
        let mut joint = Slots::<JointContact>::new();
        let mut slots = Slots::<usize>::new();
        for (slot, (contact, finger)) in contacts.iter_mut().zip(fingers).enumerate() {
            let Some((centre, _)) = finger.place else { continue };
            tick.meet(contact, centre);
            let place = tick.frame.place(slot);
            if let Some(place) = place.filter(|_| contact.touching && finger.fade > 0.0) {
                slots.push(slot);
                joint.push(JointContact {
                    place,
                    stiffness_n_per_m: finger.fade * tick.gains[slot].stiffness_n_per_m,
                    stretch: contact.stretch(&tick.surface, centre),
                    normal: contact.normal,
                    two_sided: tick.model.two_sided,
                });
            }
        }
        let solved = joint_forces(tick.frame.compliance, tick.frame.forces_n, &joint);
        let mut forces = FingerForces::new();
        for (slot, (contact, finger)) in contacts.iter_mut().zip(fingers).enumerate() {
            let known = solved.as_ref().and_then(|forces| {
                let at = slots.iter().position(|&known| known == slot)?;
                let yields = finger.fade * tick.frame.own_compliance(joint[at].place);
                Some((tick.input(slot, finger)?, forces[at] / finger.fade, yields))
            });
            forces.push(match known {
                Some((input, force, yields)) => yielding_force(&input, contact, force, yields),
                None => tick.force_alone(self, slot, contact, finger),
            });
        }
        forces
    }

    fn linear(&self, contacts: &StickingContacts<'_>) -> LinearBlock {
        let size = 3 * contacts.count();
        let mut d = DMatrix::zeros(size, 2 * size);
        match contacts.compliance.and_then(|compliance| Some((compliance, sharing(contacts, compliance)?))) {
            Some((compliance, sharing)) => {
                d.columns_mut(size, size).copy_from(&(&sharing * -compliance));
                d.columns_mut(0, size).copy_from(&sharing);
            }
            None => d.columns_mut(0, size).copy_from(&contacts.stiffness()),
        }
        LinearBlock::gain(d)
    }
}

/// (1/K_h + W)⁻¹, N/m. Where K_h is 0, which it is for all contacts or for none, nobody feels anything.
fn sharing(contacts: &StickingContacts<'_>, compliance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    if contacts.gains.iter().any(|gains| gains.stiffness_n_per_m == 0.0) {
        return Some(DMatrix::zeros(compliance.nrows(), compliance.ncols()));
    }
    let mut sum = compliance.clone();
    for row in 0..sum.nrows() {
        sum[(row, row)] += contacts.gains[row / 3].stiffness_n_per_m.recip();
    }
    sum.try_inverse()
}

/// The force on a finger for which the joint compliance gives `force` (N), where the surface yields by `yields` (m/N): it
/// slides and comes off as others do.
fn yielding_force(
    input: &ContactInput<'_>,
    contact: &mut LocalContact,
    force: DVec3,
    yields_m_per_n: f64,
) -> DVec3 {
    let push_n = force.dot(contact.normal);
    contact.force = force;
    if input.model.two_sided {
        return force;
    }
    if push_n <= 0.0 && contact.depth_m(input.surface, input.centre) <= 0.0 {
        contact.force = DVec3::ZERO;
        contact.come_off(input);
        return DVec3::ZERO;
    }
    // In units of the anchor's slip: the surface gives way as well as the spring.
    let yields = 1.0 / input.gains.stiffness_n_per_m + yields_m_per_n;
    let stretch = contact.slide(input, force * yields, input.model.friction * push_n * yields);
    contact.force = stretch / yields;
    contact.force
}
