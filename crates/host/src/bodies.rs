//! The bodies of a host's world, and what acts on each by itself: gravity, damping, ground, and, on a body without a
//! surface, the wall.

use arrayvec::ArrayVec;
use cotouch_scene::geometry::Wrench;
use cotouch_scene::limits::{MAX_BODIES, WORLD_BOUND_M};
use cotouch_scene::scene::{Body, BodyImpedance, Scene, Space, Wall};
use cotouch_world::wall::FixedPlane;
use cotouch_world::{
    BodyState, ContactForce, ContactModel, ContactState, Freedom, GroundFriction, Inertia, Sphere, Stepper,
    Surface, touch,
};
use glam::DVec3;

use crate::output::TickOutput;

/// All bodies of the world, in the scene's order.
#[derive(Clone, Debug)]
pub(crate) struct Bodies {
    models: Vec<BodyModel>,
    /// Bodies that are not fixed, by their index.
    moving: Vec<usize>,
}

impl Bodies {
    pub(crate) fn new(scene: &Scene) -> Self {
        let models: Vec<BodyModel> =
            scene.world_bodies().iter().take(MAX_BODIES).map(|body| BodyModel::new(scene, body)).collect();
        let moving = (0..models.len()).filter(|&body| !models[body].fixed).collect();
        Self { models, moving }
    }

    pub(crate) fn models(&self) -> &[BodyModel] {
        &self.models
    }

    /// Bodies that are not fixed, by their index.
    pub(crate) fn moving(&self) -> &[usize] {
        &self.moving
    }

    /// Whether any has a surface.
    pub(crate) fn have_surfaces(&self) -> bool {
        self.models.iter().any(|body| body.surface.exists())
    }

    /// All at rest where the scene puts them.
    pub(crate) fn start(&self) -> Vec<BodyState> {
        self.models.iter().map(|body| body.start).collect()
    }

    /// What acts on each body that moves by itself, into `output`.
    pub(crate) fn act(&self, states: &[BodyState], output: &mut TickOutput) {
        for &index in &self.moving {
            let (model, body) = (&self.models[index], &states[index]);
            let own = model.own_wrench(body);
            output.wrenches[index].force += own.force;
            output.wrenches[index].torque += own.torque;
            output.touches_wall |= model.touches_wall(body);
        }
    }

    /// One period under the wrenches, held. Whether all bodies are still in the world; if not, none has moved.
    pub(crate) fn step(&self, states: &mut [BodyState], wrenches: &[Wrench]) -> bool {
        let mut before = ArrayVec::<BodyState, MAX_BODIES>::new();
        before.extend(states.iter().copied());
        for &index in &self.moving {
            self.models[index].step(&mut states[index], &wrenches[index]);
        }
        let is_sound = self.moving.iter().all(|&index| states[index].is_within(WORLD_BOUND_M));
        if !is_sound {
            states.copy_from_slice(&before);
        }
        is_sound
    }
}

/// The constants of one body.
#[derive(Clone, Debug)]
pub(crate) struct BodyModel {
    pub(crate) start: BodyState,
    fixed: bool,
    pub(crate) surface: Surface,
    inverse_mass_per_kg: f64,
    stepper: Stepper,
    ground: GroundFriction,
    weight_n: DVec3,
    to_ground: BodyImpedance,
    /// Walls of a body without a surface; each across its axis, at its `position_m`.
    walls: Vec<(Wall, DVec3)>,
}

impl BodyModel {
    fn new(scene: &Scene, body: &Body) -> Self {
        let surface = if scene.space == Space::Plane {
            Surface::planar(&body.shape)
        } else {
            Surface::new(&body.shape)
        };
        let (inertia, freedom) = (Inertia::from_body(body), Freedom::from_space(scene.space));
        let period_s = scene.rates.control_hz.period_s();
        Self {
            start: BodyState::start(body),
            fixed: body.fixed,
            inverse_mass_per_kg: inertia.inverse_mass_per_kg,
            stepper: Stepper::rigid(inertia, period_s, scene.session.integrator, freedom),
            ground: GroundFriction::new(&scene.ground, inertia, period_s, freedom),
            weight_n: scene.gravity_m_per_s2 * body.mass_kg,
            to_ground: scene.object.to_ground(),
            walls: if surface.exists() { Vec::new() } else { point_walls(scene) },
            surface,
        }
    }

    pub(crate) fn is_fixed(&self) -> bool {
        self.fixed
    }

    /// The contact of a sphere with this body's surface, one tick on.
    pub(crate) fn touch(
        &self,
        contact: &ContactModel,
        state: &mut ContactState,
        body: &BodyState,
        sphere: &Sphere,
    ) -> Option<ContactForce> {
        touch(contact, state, &self.surface, (&body.pose, &body.twist), sphere, self.inverse_mass_per_kg)
    }

    /// What concerns the body alone: its impedance to the ground, gravity, and the wall of a body without a surface.
    fn own_wrench(&self, body: &BodyState) -> Wrench {
        let (position, velocity) = body.point();
        let BodyImpedance { stiffness_n_per_m, damping_n_s_per_m, rotational_damping_n_m_s_per_rad } =
            self.to_ground;
        let mut force = -damping_n_s_per_m * velocity;
        if stiffness_n_per_m != DVec3::ZERO {
            force += stiffness_n_per_m * (self.start.pose.position - position);
        }
        for (wall, axis) in &self.walls {
            force += cotouch_world::wall::force(wall, *axis, position, velocity);
        }
        Wrench {
            force: force + self.weight_n,
            torque: -rotational_damping_n_m_s_per_rad * body.twist.angular,
        }
    }

    /// Whether a body without a surface touches a wall.
    fn touches_wall(&self, body: &BodyState) -> bool {
        let touches =
            |(wall, axis): &(Wall, DVec3)| cotouch_world::wall::touches(wall, *axis, body.pose.position);
        self.walls.iter().any(touches)
    }

    /// One period under `wrench`, held, and the friction of the ground.
    fn step(&self, body: &mut BodyState, wrench: &Wrench) {
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
        let FixedPlane { point, normal } = FixedPlane::new(&plane);
        (Wall { position_m: point.dot(-normal), ..scene.wall.clone() }, -normal)
    };
    scene.walls().into_iter().map(wall).collect()
}
