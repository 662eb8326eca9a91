//! Shapes, gains and a small world for tests.

use cotouch_scene::geometry::Wrench;
use cotouch_scene::mesh::TriangleMesh;
use cotouch_scene::scene::{Body, Integrator, Shape, ShapeKind, SpringDamper};
use cotouch_world::wall::FixedPlane;
use cotouch_world::{
    BodyState, ContactForce, ContactModel, ContactState, Freedom, Inertia, Sphere, Stepper, Surface, touch,
    touch_plane,
};
use glam::{DMat3, DVec3};

/// One tick, s.
pub(crate) const T: f64 = 1.0 / 1024.0;
/// Gravity, m/s².
pub(crate) const G: f64 = 9.81;

pub(crate) fn spring(stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> SpringDamper {
    SpringDamper { stiffness_n_per_m, damping_n_s_per_m }
}

pub(crate) fn model() -> ContactModel {
    ContactModel {
        normal: spring(2000.0, 8.0),
        tangential: spring(1500.0, 5.0),
        static_friction: 0.5,
        dynamic_friction: 0.4,
        stick_speed_m_per_s: 0.002,
        period_s: T,
        cancellation: None,
    }
}

pub(crate) fn shape(kind: ShapeKind) -> Shape {
    Shape {
        kind,
        size_m: DVec3::splat(0.06),
        radius_m: 0.03,
        length_m: 0.05,
        mesh: String::new(),
        mesh_scale: 1.0,
        surface: None,
    }
}

pub(crate) fn cuboid(size_m: DVec3) -> Shape {
    Shape { size_m, ..shape(ShapeKind::Box) }
}

pub(crate) fn hull(vertices: Vec<DVec3>) -> Shape {
    let mesh = TriangleMesh {
        vertices,
        triangles: Vec::new(),
        volume_m3: 1.0,
        inertia_per_mass_m2: DMat3::IDENTITY,
    };
    Shape { surface: Some(std::sync::Arc::new(mesh)), ..shape(ShapeKind::Hull) }
}

pub(crate) fn vertices_of_cuboid(half: DVec3) -> Vec<DVec3> {
    let sign = |bit: u32| if bit == 0 { -1.0 } else { 1.0 };
    (0..8).map(|i| half * DVec3::new(sign(i & 1), sign(i & 2), sign(i & 4))).collect()
}

pub(crate) fn body(shape: Shape, mass_kg: f64, position_m: DVec3) -> Body {
    Body { name: "body".into(), shape, mass_kg, position_m, rotation_rad: DVec3::ZERO, fixed: false }
}

/// A floor at height 0.
pub(crate) fn floor() -> FixedPlane {
    FixedPlane { point: DVec3::ZERO, normal: DVec3::Y }
}

/// A body that meets a floor and the others.
pub(crate) struct Thing {
    pub(crate) surface: Surface,
    pub(crate) stepper: Stepper,
    pub(crate) state: BodyState,
    on_floor: Vec<ContactState>,
    on_others: Vec<Vec<ContactState>>,
}

/// Bodies on a floor, under gravity.
pub(crate) struct World {
    pub(crate) things: Vec<Thing>,
    pub(crate) model: ContactModel,
    pub(crate) gravity: DVec3,
    /// Of the last tick.
    pub(crate) forces: Vec<ContactForce>,
}

impl World {
    pub(crate) fn new(bodies: &[Body], model: ContactModel) -> Self {
        let thing = |body: &Body| {
            let surface = Surface::new(&body.shape);
            let stepper = Stepper::rigid(Inertia::from_body(body), T, Integrator::ExactHold, Freedom::Space);
            let contacts = vec![ContactState::default(); surface.corners().len()];
            let on_others = vec![contacts.clone(); bodies.len()];
            Thing { surface, stepper, state: BodyState::start(body), on_floor: contacts, on_others }
        };
        let things = bodies.iter().map(thing).collect();
        Self { things, model, gravity: -G * DVec3::Y, forces: Vec::new() }
    }

    pub(crate) fn step(&mut self) {
        self.forces.clear();
        let gravity = |thing: &Thing| Wrench::force(thing.stepper.inertia().mass_kg * self.gravity);
        let mut wrenches: Vec<Wrench> = self.things.iter().map(gravity).collect();
        for a in 0..self.things.len() {
            let state = self.things[a].state;
            for c in 0..self.things[a].surface.corners().len() {
                let corner = self.things[a].surface.corners()[c];
                let sphere = Sphere::from_corner(&corner, (&state.pose, &state.twist));
                let contact = &mut self.things[a].on_floor[c];
                if let Some(force) = touch_plane(&self.model, contact, &floor(), &sphere) {
                    add(&mut wrenches[a], force.on_sphere(state.pose.position));
                    self.forces.push(force);
                }
                for b in (0..self.things.len()).filter(|&b| b != a) {
                    let mut contact = self.things[a].on_others[b][c];
                    let other = &self.things[b];
                    let frame = (&other.state.pose, &other.state.twist);
                    if let Some(force) = touch(&self.model, &mut contact, &other.surface, frame, &sphere, 0.0)
                    {
                        add(&mut wrenches[a], force.on_sphere(state.pose.position));
                        add(&mut wrenches[b], force.on_surface(other.state.pose.position));
                        self.forces.push(force);
                    }
                    self.things[a].on_others[b][c] = contact;
                }
            }
        }
        for (thing, wrench) in self.things.iter_mut().zip(&wrenches) {
            thing.stepper.step(&mut thing.state, wrench);
        }
    }

    /// Kinetic and potential, without that of springs, J.
    pub(crate) fn energy(&self) -> f64 {
        let of = |thing: &Thing| {
            let inertia = thing.stepper.inertia();
            inertia.kinetic_energy_j(&thing.state)
                - inertia.mass_kg * self.gravity.dot(thing.state.pose.position)
        };
        self.things.iter().map(of).sum()
    }
}

pub(crate) fn add(sum: &mut Wrench, wrench: Wrench) {
    sum.force += wrench.force;
    sum.torque += wrench.torque;
}
