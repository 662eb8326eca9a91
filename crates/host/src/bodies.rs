//! What acts on a body by itself: gravity, damping, ground, and, on a body without a surface, the wall.

use cotouch_scene::geometry::Wrench;
use cotouch_scene::scene::{Body, Scene, Space, Wall};
use cotouch_world::wall::Plane;
use cotouch_world::{BodyState, Freedom, GroundFriction, Inertia, Stepper, Surface};
use glam::DVec3;

/// The constants of one body.
#[derive(Clone, Debug)]
pub(crate) struct BodyModel {
    pub(crate) start: BodyState,
    pub(crate) fixed: bool,
    pub(crate) surface: Surface,
    pub(crate) inverse_mass_per_kg: f64,
    stepper: Stepper,
    ground: GroundFriction,
    weight_n: DVec3,
    damping_n_s_per_m: DVec3,
    rotational_damping_n_m_s_per_rad: f64,
    /// Walls of a body without a surface; each across its axis, at its `position_m`.
    walls: Vec<(Wall, DVec3)>,
}

impl BodyModel {
    pub(crate) fn new(scene: &Scene, body: &Body) -> Self {
        let surface = if scene.space == Space::Plane {
            Surface::planar(&body.shape)
        } else {
            Surface::new(&body.shape)
        };
        let (inertia, freedom) = (Inertia::of(body), Freedom::of(scene.space));
        let period_s = scene.rates.control_hz.period_s();
        let damping = &scene.object;
        Self {
            start: BodyState::start(body),
            fixed: body.fixed,
            inverse_mass_per_kg: inertia.inverse_mass_per_kg,
            stepper: Stepper::of(inertia, period_s, scene.session.integrator, freedom),
            ground: GroundFriction::new(&scene.ground, inertia, period_s, freedom),
            weight_n: scene.gravity_m_per_s2 * body.mass_kg,
            damping_n_s_per_m: DVec3::splat(damping.damping_n_s_per_m) + damping.axis_damping_n_s_per_m,
            rotational_damping_n_m_s_per_rad: damping.rotational_damping_n_m_s_per_rad,
            walls: if surface.exists() { Vec::new() } else { point_walls(scene) },
            surface,
        }
    }

    /// What concerns the body alone: compensation, gravity, and the wall of a body without a surface.
    pub(crate) fn own_wrench(&self, body: &BodyState) -> Wrench {
        let (position, velocity) = body.point();
        let mut force = -self.damping_n_s_per_m * velocity;
        for (wall, axis) in &self.walls {
            force += cotouch_world::wall::force(wall, *axis, position, velocity);
        }
        Wrench {
            force: force + self.weight_n,
            torque: -self.rotational_damping_n_m_s_per_rad * body.twist.angular,
        }
    }

    /// Whether a body without a surface touches a wall.
    pub(crate) fn touches_wall(&self, body: &BodyState) -> bool {
        let touches =
            |(wall, axis): &(Wall, DVec3)| cotouch_world::wall::touches(wall, *axis, body.pose.position);
        self.walls.iter().any(touches)
    }

    /// One period under `wrench`, held, and the friction of the ground.
    pub(crate) fn step(&self, body: &mut BodyState, wrench: &Wrench) {
        if !self.ground.exists() {
            return self.stepper.step(body, wrench);
        }
        let friction = self.ground.resist(body, wrench);
        let (force, torque) = (wrench.force + friction.force, wrench.torque + friction.torque);
        self.stepper.step(body, &Wrench { force, torque });
    }
}

/// The one wall across the x axis, or `[[wall.plane]]`, in the words of a wall across an axis.
fn point_walls(scene: &Scene) -> Vec<(Wall, DVec3)> {
    let wall = |plane| {
        let Plane { point, normal } = Plane::new(&plane);
        (Wall { position_m: point.dot(-normal), ..scene.wall.clone() }, -normal)
    };
    scene.walls().into_iter().map(wall).collect()
}
