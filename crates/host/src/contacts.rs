//! Which spheres meet which surfaces at a host: a fixed table, made once, so that a contact's state has its place.
//!
//! Fingers meet bodies; spheres in the corners of bodies meet walls and other bodies. Before corners are looked at
//! closely, the spheres around whole bodies are: what is far costs next to nothing.

use cotouch_scene::geometry::Pose;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Scene, SpringDamper};
use cotouch_world::wall::Plane;
use cotouch_world::{BodyState, Cancellation, ContactModel, ContactState, Sphere, touch, touch_plane};
use glam::DVec3;

use crate::bodies::BodyModel;
use crate::model::{HostModel, Role};
use crate::output::{ContactPoint, ContactRecord, ContactSurface, CouplerOutput, TickOutput};
use crate::state::HostState;

/// Bodies so far (m) from touching are near all the same: what comes fast is known from outside before it is inside.
const NEAR_M: f64 = 0.05;

/// The table of contacts, and their constants.
#[derive(Clone, Debug)]
pub(crate) struct Contacts {
    /// Own fingers.
    own: ContactModel,
    /// Held fingers of others.
    held: ContactModel,
    /// Corners and walls.
    wall: ContactModel,
    /// Corners and bodies.
    body: ContactModel,
    /// Bodies with a surface, by their index.
    surfaces: Vec<usize>,
    /// Where each host's fingers begin; each finger has a slot a surface.
    first_finger: Vec<usize>,
    walls: Vec<Plane>,
    groups: Vec<Group>,
    slots: usize,
}

/// What corners may meet.
#[derive(Clone, Copy, Debug)]
enum Obstacle {
    Body(u8),
    Wall(u8),
}

impl From<Obstacle> for ContactSurface {
    fn from(obstacle: Obstacle) -> Self {
        match obstacle {
            Obstacle::Body(index) => Self::Body(index),
            Obstacle::Wall(index) => Self::Wall(index),
        }
    }
}

/// All corners of one body against one surface.
#[derive(Clone, Copy, Debug)]
struct Group {
    body: usize,
    against: Obstacle,
    first: usize,
    corners: usize,
}

impl Contacts {
    pub(crate) fn new(scene: &Scene, role: Role, fingers: &[u8], bodies: &[BodyModel]) -> Self {
        let period_s = scene.rates.control_hz.period_s();
        let (contact, coupling, wall) = (&scene.contact, &scene.coupling, &scene.wall);
        let finger = |normal, tangential| ContactModel {
            normal,
            tangential,
            static_friction: contact.static_friction,
            dynamic_friction: contact.dynamic_friction,
            stick_speed_m_per_s: contact.stick_speed_m_per_s,
            period_s,
            cancellation: None,
        };
        let corner = |normal, tangential| ContactModel {
            static_friction: wall.static_friction,
            dynamic_friction: wall.dynamic_friction,
            ..finger(normal, tangential)
        };
        let cancellation = contact
            .moment_cancellation
            .then_some(Cancellation { max_force_n: scene.governor.max_force_n, mass_kg: scene.hand.mass_kg });
        let has_world = role != Role::Client;
        let surfaces: Vec<usize> =
            (0..bodies.len()).filter(|&body| has_world && bodies[body].surface.exists()).collect();
        let walls: Vec<Plane> =
            if surfaces.is_empty() { Vec::new() } else { scene.walls().iter().map(Plane::new).collect() };
        let mut slots = 0;
        let mut take = |count: usize| {
            slots += count;
            slots - count
        };
        let first_finger =
            fingers.iter().map(|&fingers| take(usize::from(fingers) * surfaces.len())).collect();
        let groups = groups(bodies, &surfaces, walls.len(), &mut take);
        Self {
            own: ContactModel {
                cancellation,
                ..finger(coupling.hand_object, coupling.hand_object_tangential)
            },
            held: finger(coupling.remote_hand_object, coupling.remote_hand_object_tangential),
            wall: corner(
                of_wall(scene),
                SpringDamper {
                    stiffness_n_per_m: wall.tangential_stiffness_n_per_m,
                    damping_n_s_per_m: wall.tangential_damping_n_s_per_m,
                },
            ),
            body: corner(contact.body_body, contact.body_body_tangential),
            surfaces,
            first_finger,
            walls,
            groups,
            slots,
        }
    }

    /// Places for the states of contacts.
    pub(crate) fn slots(&self) -> usize {
        self.slots
    }

    /// Groups of corners, each of which is near its surface or is not.
    pub(crate) fn groups(&self) -> usize {
        self.groups.len()
    }

    /// The contact of a finger with the `nth` surface.
    fn finger_slot(&self, host: HostIndex, finger: usize, nth: usize) -> usize {
        self.first_finger[host.index()] + finger * self.surfaces.len() + nth
    }
}

fn of_wall(scene: &Scene) -> SpringDamper {
    SpringDamper {
        stiffness_n_per_m: scene.wall.stiffness_n_per_m,
        damping_n_s_per_m: scene.wall.damping_n_s_per_m,
    }
}

/// Corners of every body that moves against every wall, then of every body against every other; two that are fixed
/// never meet.
fn groups(
    bodies: &[BodyModel],
    surfaces: &[usize],
    walls: usize,
    take: &mut impl FnMut(usize) -> usize,
) -> Vec<Group> {
    let mut groups = Vec::new();
    for &body in surfaces {
        let corners = bodies[body].surface.corners().len();
        let walls = (0..walls).filter(|_| !bodies[body].fixed).map(|wall| Obstacle::Wall(wall as u8));
        let meets = |other: usize| other != body && !(bodies[body].fixed && bodies[other].fixed);
        let others = surfaces.iter().filter(|&&other| meets(other));
        for against in walls.chain(others.map(|&other| Obstacle::Body(other as u8))) {
            groups.push(Group { body, against, first: take(corners), corners });
        }
    }
    groups
}

/// A finger that may touch bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touching {
    pub(crate) host: HostIndex,
    pub(crate) finger: usize,
    /// Where it is (m) and how it moves (m/s); `None` when nothing is known of it.
    pub(crate) place: Option<(DVec3, DVec3)>,
    /// How much of its force counts.
    pub(crate) fade: f64,
}

impl HostModel {
    /// The contact between a user's finger and a body of this host; `None` where the body has no surface, or the host
    /// no world.
    #[must_use]
    pub fn finger_contact<'a>(
        &self,
        state: &'a HostState,
        user: HostIndex,
        finger: usize,
        body: usize,
    ) -> Option<&'a ContactState> {
        let nth = self.contacts.surfaces.iter().position(|&surface| surface == body)?;
        state.contacts.get(self.contacts.finger_slot(user, finger, nth))
    }

    fn of_finger(&self, host: HostIndex) -> &ContactModel {
        if host == self.host { &self.contacts.own } else { &self.contacts.held }
    }

    /// The contacts of one finger with all bodies, one tick on: wrenches on bodies into `output`. The force on the
    /// finger, N.
    pub(crate) fn touch_bodies(
        &self,
        state: &mut HostState,
        output: &mut TickOutput,
        touching: Touching,
    ) -> DVec3 {
        let mut on_finger = DVec3::ZERO;
        for (nth, &index) in self.contacts.surfaces.iter().enumerate() {
            let slot = self.contacts.finger_slot(touching.host, touching.finger, nth);
            let contact = &mut state.contacts[slot];
            let body = &state.bodies[index];
            let Some(sphere) = self.sphere(touching.place) else {
                *contact = ContactState::default();
                continue;
            };
            let model = self.of_finger(touching.host);
            let BodyModel { surface, inverse_mass_per_kg, .. } = &self.bodies[index];
            let frame = (&body.pose, &body.twist);
            let Some(found) = touch(model, contact, surface, frame, &sphere, *inverse_mass_per_kg) else {
                continue;
            };
            let force = touching.fade * found.force;
            on_finger += force;
            push(output, index, body.pose.position, -force, found.point);
            let finger = touching.finger;
            let point = ContactPoint::Finger { host: touching.host, finger: finger as u8 };
            let surface = ContactSurface::Body(index as u8);
            let record = ContactRecord { point, surface, phase: found.phase, force, depth_m: found.depth_m };
            // What finds no place in the list counts all the same.
            let _ = output.contacts.try_push(record);
            let _ = output.couplers.try_push(CouplerOutput {
                slot: self.finger_slot(touching.host, finger, index),
                held: touching.host != self.host,
                stiffness_n_per_m: touching.fade * model.normal.stiffness_n_per_m,
                stretch: found.normal * found.depth_m
                    + slip(model, contact, &body.pose, &sphere, found.normal),
            });
        }
        on_finger
    }

    /// The force (N) that [`touch_bodies`](Self::touch_bodies) would find for this finger at this instant; nothing
    /// moves on.
    pub(crate) fn force_of_touch(&self, state: &HostState, touching: Touching) -> DVec3 {
        let mut on_finger = DVec3::ZERO;
        for (nth, &index) in self.contacts.surfaces.iter().enumerate() {
            let body = &state.bodies[index];
            let Some(sphere) = self.sphere(touching.place) else { continue };
            let mut contact = state.contacts[self.contacts.finger_slot(touching.host, touching.finger, nth)];
            let BodyModel { surface, inverse_mass_per_kg, .. } = &self.bodies[index];
            let frame = (&body.pose, &body.twist);
            let model = self.of_finger(touching.host);
            let found = touch(model, &mut contact, surface, frame, &sphere, *inverse_mass_per_kg);
            on_finger += found.map_or(DVec3::ZERO, |found| touching.fade * found.force);
        }
        on_finger
    }

    /// A finger, as a sphere.
    fn sphere(&self, place: Option<(DVec3, DVec3)>) -> Option<Sphere> {
        place.map(|(centre, velocity)| Sphere { centre, velocity, radius_m: self.finger_radius_m })
    }

    /// All corners against walls and bodies, one tick on.
    pub(crate) fn touch_corners(&self, state: &mut HostState, output: &mut TickOutput) {
        for (nth, group) in self.contacts.groups.iter().enumerate() {
            let is_near = self.is_near(state, group);
            if is_near {
                self.touch_corners_of(state, output, group);
            } else if state.near[nth] {
                state.contacts[group.first..group.first + group.corners].fill(ContactState::default());
            }
            state.near[nth] = is_near;
        }
    }

    fn is_near(&self, state: &HostState, group: &Group) -> bool {
        let place =
            |body: usize| (state.bodies[body].pose.position, self.bodies[body].surface.bounding_radius_m());
        let (position, radius_m) = place(group.body);
        match group.against {
            Obstacle::Wall(wall) => self.contacts.walls[usize::from(wall)].height(position) <= radius_m,
            Obstacle::Body(other) => {
                let (other, other_radius_m) = place(usize::from(other));
                let reach_m = radius_m + other_radius_m + NEAR_M;
                (other - position).length_squared() <= reach_m * reach_m
            }
        }
    }

    fn touch_corners_of(&self, state: &mut HostState, output: &mut TickOutput, group: &Group) {
        let body = state.bodies[group.body];
        let corners = self.bodies[group.body].surface.corners();
        for (index, corner) in corners.iter().enumerate() {
            let contact = &mut state.contacts[group.first + index];
            let sphere = Sphere::of_corner(corner, (&body.pose, &body.twist));
            let found = match group.against {
                Obstacle::Wall(wall) => touch_plane(
                    &self.contacts.wall,
                    contact,
                    &self.contacts.walls[usize::from(wall)],
                    &sphere,
                ),
                Obstacle::Body(other) => {
                    let other = usize::from(other);
                    let BodyModel { surface, inverse_mass_per_kg, .. } = &self.bodies[other];
                    let BodyState { pose, twist } = &state.bodies[other];
                    touch(&self.contacts.body, contact, surface, (pose, twist), &sphere, *inverse_mass_per_kg)
                }
            };
            let Some(found) = found else { continue };
            push(output, group.body, body.pose.position, found.force, found.point);
            match group.against {
                Obstacle::Wall(_) => output.touches_wall = true,
                Obstacle::Body(other) => {
                    let other = usize::from(other);
                    push(output, other, state.bodies[other].pose.position, -found.force, found.point);
                }
            }
            let point = ContactPoint::Corner { body: group.body as u8, corner: index as u8 };
            let _ = output.contacts.try_push(ContactRecord {
                point,
                surface: group.against.into(),
                phase: found.phase,
                force: found.force,
                depth_m: found.depth_m,
            });
        }
    }
}

/// Adds a force (N) at `point` (m) to what acts on a body about its centre of mass at `position` (m).
fn push(output: &mut TickOutput, index: usize, position: DVec3, force: DVec3, point: DVec3) {
    let wrench = &mut output.wrenches[index];
    wrench.force += force;
    wrench.torque += (point - position).cross(force);
}

/// How far the tangential spring is stretched, in the measure in which the normal spring's stiffness gives its energy, m.
fn slip(model: &ContactModel, contact: &ContactState, pose: &Pose, sphere: &Sphere, normal: DVec3) -> DVec3 {
    let ratio = model.tangential.stiffness_n_per_m / model.normal.stiffness_n_per_m;
    if !ratio.is_normal() {
        return DVec3::ZERO;
    }
    let from_anchor = sphere.centre - pose.to_world(contact.anchor);
    (from_anchor - normal * from_anchor.dot(normal)) * ratio.sqrt()
}
