//! One tick of all contacts with a soft body: what every finger feels, and how its contact goes on.

use cotouch_scene::scene::LocalModelKind;
use cotouch_world::contact::Phase;
use cotouch_world::local::compliance::{JointContact, joint_forces};
use cotouch_world::local::{LocalContact, LocalGains, LocalLaw, SurfaceInUse};
use glam::DVec3;

use super::SlowFrame;
use super::contacts::Slots;
use crate::contacts::Touching;
use crate::output::{ContactPoint, ContactRecord, ContactSurface, CouplerOutput, TickOutput};

/// One tick of all contacts of a host, as far as it is known beforehand.
pub(super) struct Present<'a> {
    pub(super) law: &'a LocalLaw,
    /// One a slot.
    pub(super) gains: Slots<LocalGains>,
    pub(super) surface: SurfaceInUse<'a>,
    pub(super) frame: &'a SlowFrame,
    pub(super) is_hold_tick: bool,
}

impl Present<'_> {
    /// The force on every finger, N, its contact one tick on.
    pub(super) fn act(&self, contacts: &mut [LocalContact], fingers: &[Touching]) -> Slots<DVec3> {
        match self.law.kind {
            LocalModelKind::Compliance => self.act_together(contacts, fingers),
            _ => contacts
                .iter_mut()
                .zip(fingers)
                .zip(&self.gains)
                .map(|((contact, finger), gains)| self.act_alone(contact, finger, gains))
                .collect(),
        }
    }

    fn act_alone(&self, contact: &mut LocalContact, finger: &Touching, gains: &LocalGains) -> DVec3 {
        let Some((centre, velocity)) = finger.place else { return self.forget(contact) };
        if self.law.kind == LocalModelKind::Hold && !self.is_hold_tick {
            return contact.force;
        }
        self.meet(contact, centre);
        if contact.touching && !self.law.two_sided && contact.depth_m(&self.surface, centre) <= 0.0 {
            contact.come_off(&self.surface, gains, centre);
        }
        contact.force = if contact.touching {
            self.press(contact, gains, centre, velocity)
        } else {
            let force = contact.normal * contact.integral_n;
            contact.drain();
            force
        };
        contact.force
    }

    /// The force of a finger that touches, N.
    fn press(&self, contact: &mut LocalContact, gains: &LocalGains, centre: DVec3, velocity: DVec3) -> DVec3 {
        let stiffness = gains.stiffness_n_per_m;
        let mut stretch = contact.stretch(&self.surface, centre);
        // A contact that slides has another normal afterwards.
        let normal = contact.normal;
        let depth_m = stretch.dot(normal);
        if !self.law.two_sided {
            let push_n = stiffness * depth_m + contact.integral_n;
            stretch = contact.slide(self.law, &self.surface, stretch, self.law.friction * push_n / stiffness);
        }
        let force = stiffness * stretch + normal * contact.integral_n;
        if self.law.kind == LocalModelKind::Pi {
            contact.integrate(self.law, gains, &self.surface, (depth_m, velocity));
        }
        force
    }

    fn meet(&self, contact: &mut LocalContact, centre: DVec3) {
        if !contact.touching {
            contact.meet(self.law, &self.surface, centre);
        }
    }

    /// Of a finger of which nothing is known.
    fn forget(&self, contact: &mut LocalContact) -> DVec3 {
        if self.law.two_sided {
            (contact.integral_n, contact.force) = (0.0, DVec3::ZERO);
        } else {
            *contact = LocalContact::default();
        }
        DVec3::ZERO
    }

    /// All contacts by the joint compliance of the frame.
    fn act_together(&self, contacts: &mut [LocalContact], fingers: &[Touching]) -> Slots<DVec3> {
        let mut joint = Slots::<JointContact>::new();
        let mut slots = Slots::<usize>::new();
        for (slot, (contact, finger)) in contacts.iter_mut().zip(fingers).enumerate() {
            let Some((centre, _)) = finger.place else {
                self.forget(contact);
                continue;
            };
            self.meet(contact, centre);
            let place = self.frame.slots.iter().position(|&known| usize::from(known) == slot);
            if let Some(place) = place.filter(|_| contact.touching && finger.fade > 0.0) {
                slots.push(slot);
                joint.push(JointContact {
                    place,
                    stiffness_n_per_m: finger.fade * self.gains[slot].stiffness_n_per_m,
                    stretch: contact.stretch(&self.surface, centre),
                    normal: contact.normal,
                    two_sided: self.law.two_sided,
                });
            }
        }
        let solved = joint_forces(&self.frame.compliance, &self.frame.forces_n, &joint);
        let mut forces = Slots::<DVec3>::new();
        for (slot, (contact, finger)) in contacts.iter_mut().zip(fingers).enumerate() {
            let known = solved.as_ref().and_then(|forces| {
                let at = slots.iter().position(|&known| known == slot)?;
                Some((forces[at] / finger.fade, joint[at].place))
            });
            forces.push(match known {
                Some((force, place)) => self.yield_to((contact, finger), &self.gains[slot], force, place),
                None => self.act_alone(contact, finger, &self.gains[slot]),
            });
        }
        forces
    }

    /// The force of a finger for which the joint compliance gives `force`, N.
    fn yield_to(
        &self,
        (contact, finger): (&mut LocalContact, &Touching),
        gains: &LocalGains,
        force: DVec3,
        place: usize,
    ) -> DVec3 {
        let Some((centre, _)) = finger.place else { return self.forget(contact) };
        let push_n = force.dot(contact.normal);
        contact.force = force;
        if self.law.two_sided {
            return force;
        }
        if push_n <= 0.0 && contact.depth_m(&self.surface, centre) <= 0.0 {
            contact.force = DVec3::ZERO;
            contact.come_off(&self.surface, gains, centre);
            return DVec3::ZERO;
        }
        // In units of the anchor's slip: the surface gives way as well as the spring.
        let yields = 1.0 / gains.stiffness_n_per_m + finger.fade * self.own_compliance(place);
        let stretch =
            contact.slide(self.law, &self.surface, force * yields, self.law.friction * push_n * yields);
        contact.force = stretch / yields;
        contact.force
    }

    /// Mean of the compliance at a place over all directions, m/N.
    fn own_compliance(&self, place: usize) -> f64 {
        let width = 3 * self.frame.slots.len();
        let entry = |axis: usize| self.frame.compliance[(3 * place + axis) * (width + 1)];
        (0..3).map(entry).sum::<f64>() / 3.0
    }
}

impl Present<'_> {
    /// Lists a contact that is not free.
    pub(super) fn record(
        &self,
        output: &mut TickOutput,
        (slot, contact): (usize, &LocalContact),
        finger: &Touching,
        coupler: u16,
    ) {
        let Some((centre, _)) = finger.place else { return };
        if !contact.touching && contact.force == DVec3::ZERO {
            return;
        }
        let force = finger.fade * contact.force;
        let stiffness = self.gains[slot].stiffness_n_per_m;
        // What finds no place in the list counts all the same.
        let _ = output.contacts.try_push(ContactRecord {
            point: ContactPoint::Finger { host: finger.host, finger: finger.finger as u8 },
            surface: ContactSurface::Soft,
            phase: if contact.sliding { Phase::Slide } else { Phase::PreSlide },
            force,
            depth_m: if contact.touching { contact.depth_m(&self.surface, centre) } else { 0.0 },
        });
        let _ = output.couplers.try_push(CouplerOutput {
            slot: coupler,
            held: true,
            stiffness_n_per_m: finger.fade * stiffness,
            stretch: if stiffness > 0.0 { contact.force / stiffness } else { DVec3::ZERO },
        });
    }
}
