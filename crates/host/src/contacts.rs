//! All contacts of spheres with surfaces at a host, one tick on: fingers on bodies, corners of bodies on walls and on other
//! bodies.
//!
//! Before corners are looked at closely, the spheres around whole bodies are: what is far costs next to nothing.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Scene, SpringDamper};
use cotouch_world::wall::FixedPlane;
use cotouch_world::{BodyState, Cancellation, ContactModel, ContactState, Sphere, touch_plane};
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::bodies::Bodies;
use crate::contact_table::{ContactTable, Group, Obstacle};
use crate::output::{ContactPoint, ContactRecord, ContactSurface, TickOutput};
use crate::touching::Touching;

/// Bodies so far (m) from touching are near all the same: what comes fast is known from outside before it is inside.
const NEAR_M: f64 = 0.05;

/// The constants of all contacts.
#[derive(Clone, Debug)]
pub(crate) struct Contacts {
    table: ContactTable,
    finger_radius_m: f64,
    walls: Vec<FixedPlane>,
    /// Own fingers.
    own: ContactModel,
    /// Held fingers of others.
    held: ContactModel,
    /// Corners and walls.
    wall: ContactModel,
    /// Corners and bodies.
    body: ContactModel,
}

/// What all contacts remember between ticks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactStates {
    /// One entry a contact that there can be at this host, in an order that the model keeps; none at a client.
    pub all: Vec<ContactState>,
    /// Which groups of corners are near the surface that they may touch.
    near: Vec<bool>,
}

impl Contacts {
    /// For users with so many fingers each; without a world, as at a client, nothing touches.
    pub(crate) fn new(scene: &Scene, has_world: bool, fingers: &[u8], bodies: &Bodies) -> Self {
        let models = bodies.models();
        let surfaces: Vec<usize> =
            (0..models.len()).filter(|&body| has_world && models[body].surface.exists()).collect();
        let walls: Vec<FixedPlane> = if surfaces.is_empty() {
            Vec::new()
        } else {
            scene.walls().iter().map(FixedPlane::new).collect()
        };
        let (contact, coupling, wall) = (&scene.contact, &scene.coupling, &scene.wall);
        let finger = |normal, tangential| ContactModel {
            normal,
            tangential,
            static_friction: contact.static_friction,
            dynamic_friction: contact.dynamic_friction,
            stick_speed_m_per_s: contact.stick_speed_m_per_s,
            period_s: scene.rates.control_hz.period_s(),
            cancellation: None,
        };
        let corner = |normal, tangential| ContactModel {
            static_friction: wall.static_friction,
            dynamic_friction: wall.dynamic_friction,
            ..finger(normal, tangential)
        };
        let spring =
            |stiffness_n_per_m, damping_n_s_per_m| SpringDamper { stiffness_n_per_m, damping_n_s_per_m };
        let cancellation = contact.moment_cancellation.then_some(Cancellation {
            max_force_n: scene.governor.max_force_n,
            mass_kg: scene.hand_impedance().mass_kg,
        });
        Self {
            table: ContactTable::new(fingers, models, surfaces, walls.len()),
            finger_radius_m: scene.hand.finger_radius_m,
            walls,
            own: ContactModel {
                cancellation,
                ..finger(coupling.hand_object, coupling.hand_object_tangential)
            },
            held: finger(coupling.remote_hand_object, coupling.remote_hand_object_tangential),
            wall: corner(
                spring(wall.stiffness_n_per_m, wall.damping_n_s_per_m),
                spring(wall.tangential_stiffness_n_per_m, wall.tangential_damping_n_s_per_m),
            ),
            body: corner(contact.body_body, contact.body_body_tangential),
        }
    }

    /// Nothing touches.
    pub(crate) fn start(&self) -> ContactStates {
        ContactStates {
            all: vec![ContactState::default(); self.table.len()],
            near: vec![false; self.table.groups().len()],
        }
    }

    /// The contacts of a finger with bodies begin anew. No allocation.
    pub(crate) fn begin_anew(&self, states: &mut ContactStates, host: HostIndex, finger: usize) {
        for nth in 0..self.table.surfaces().len() {
            if let Some(contact) = states.all.get_mut(self.table.finger(host, finger, nth)) {
                *contact = ContactState::begun_anew(&self.own);
            }
        }
    }

    /// Places for the states of contacts.
    pub(crate) fn len(&self) -> usize {
        self.table.len()
    }

    /// Whether these are states of these contacts.
    pub(crate) fn fit(&self, states: &ContactStates) -> bool {
        states.all.len() == self.table.len() && states.near.len() == self.table.groups().len()
    }

    /// The contact between a finger and a body; `None` where that has no surface.
    pub(crate) fn finger<'a>(
        &self,
        states: &'a ContactStates,
        host: HostIndex,
        finger: usize,
        body: usize,
    ) -> Option<&'a ContactState> {
        let nth = self.table.surfaces().iter().position(|&surface| surface == body)?;
        states.all.get(self.table.finger(host, finger, nth))
    }

    fn model(&self, finger: &Touching<'_>) -> &ContactModel {
        if finger.is_held { &self.held } else { &self.own }
    }

    /// A finger, as a sphere at a body.
    fn sphere(&self, finger: &Touching<'_>, index: usize, body: &BodyState) -> Option<Sphere> {
        let (centre, velocity) = finger.place_at(index, body)?;
        Some(Sphere { centre, velocity, radius_m: self.finger_radius_m })
    }

    /// The contacts of one finger with all bodies, one tick on: wrenches on bodies into `output`. The force on the
    /// finger, N.
    pub(crate) fn touch_bodies(
        &self,
        contacts: &mut ContactStates,
        (bodies, states): (&Bodies, &[BodyState]),
        output: &mut TickOutput,
        finger: &Touching<'_>,
    ) -> DVec3 {
        let mut on_finger = DVec3::ZERO;
        for (nth, &index) in self.table.surfaces().iter().enumerate() {
            let contact = &mut contacts.all[self.table.finger(finger.host, finger.finger, nth)];
            let body = &states[index];
            let Some(sphere) = self.sphere(finger, index, body) else {
                *contact = ContactState::default();
                continue;
            };
            let Some(found) = bodies.models()[index].touch(self.model(finger), contact, body, &sphere) else {
                continue;
            };
            let force = finger.fade * found.force;
            on_finger += force;
            output.push(index, body.pose.position, -force, found.point);
            output.list_contact(ContactRecord {
                point: ContactPoint::Finger { host: finger.host, finger: finger.finger as u8 },
                surface: ContactSurface::Body(index as u8),
                phase: found.phase,
                force,
                depth_m: found.depth_m,
            });
        }
        on_finger
    }

    /// The force (N) that [`touch_bodies`](Self::touch_bodies) would find for this finger at this instant; nothing
    /// moves on.
    pub(crate) fn force(
        &self,
        contacts: &ContactStates,
        (bodies, states): (&Bodies, &[BodyState]),
        finger: &Touching<'_>,
    ) -> DVec3 {
        let mut on_finger = DVec3::ZERO;
        for (nth, &index) in self.table.surfaces().iter().enumerate() {
            let Some(sphere) = self.sphere(finger, index, &states[index]) else { return on_finger };
            let mut contact = contacts.all[self.table.finger(finger.host, finger.finger, nth)];
            let model = &bodies.models()[index];
            let found = model.touch(self.model(finger), &mut contact, &states[index], &sphere);
            on_finger += found.map_or(DVec3::ZERO, |found| finger.fade * found.force);
        }
        on_finger
    }

    /// All corners against walls and bodies, one tick on.
    pub(crate) fn touch_corners(
        &self,
        contacts: &mut ContactStates,
        world: (&Bodies, &[BodyState]),
        output: &mut TickOutput,
    ) {
        for (nth, group) in self.table.groups().iter().enumerate() {
            let is_near = self.is_near(world, group);
            let corners = &mut contacts.all[group.first..group.first + group.corners];
            if is_near {
                self.touch_group(corners, world, output, group);
            } else if contacts.near[nth] {
                corners.fill(ContactState::default());
            }
            contacts.near[nth] = is_near;
        }
    }

    fn is_near(&self, (bodies, states): (&Bodies, &[BodyState]), group: &Group) -> bool {
        let place =
            |body: usize| (states[body].pose.position, bodies.models()[body].surface.bounding_radius_m());
        let (position, radius_m) = place(group.body);
        match group.against {
            Obstacle::Wall(wall) => self.walls[usize::from(wall)].height(position) <= radius_m,
            Obstacle::Body(other) => {
                let (other, other_radius_m) = place(usize::from(other));
                let reach_m = radius_m + other_radius_m + NEAR_M;
                (other - position).length_squared() <= reach_m * reach_m
            }
        }
    }

    fn touch_group(
        &self,
        contacts: &mut [ContactState],
        (bodies, states): (&Bodies, &[BodyState]),
        output: &mut TickOutput,
        group: &Group,
    ) {
        let body = &states[group.body];
        let corners = bodies.models()[group.body].surface.corners();
        for (index, (corner, contact)) in corners.iter().zip(contacts).enumerate() {
            let sphere = Sphere::from_corner(corner, (&body.pose, &body.twist));
            let found = match group.against {
                Obstacle::Wall(wall) => {
                    touch_plane(&self.wall, contact, &self.walls[usize::from(wall)], &sphere)
                }
                Obstacle::Body(other) => {
                    let other = usize::from(other);
                    bodies.models()[other].touch(&self.body, contact, &states[other], &sphere)
                }
            };
            let Some(found) = found else { continue };
            output.push(group.body, body.pose.position, found.force, found.point);
            match group.against {
                Obstacle::Wall(_) => output.touches_wall = true,
                Obstacle::Body(other) => {
                    let other = usize::from(other);
                    output.push(other, states[other].pose.position, -found.force, found.point);
                }
            }
            output.list_contact(ContactRecord {
                point: ContactPoint::Corner { body: group.body as u8, corner: index as u8 },
                surface: group.against.into(),
                phase: found.phase,
                force: found.force,
                depth_m: found.depth_m,
            });
        }
    }
}
