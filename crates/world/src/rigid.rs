//! Bodies under a wrench that is held over one period.
//!
//! Translation: `x += T·v + T²·f/(2m)`, `v += T·f/m` (exact hold), or semi-implicit Euler. Turning in a plane is the same
//! for the angle. Turning in space keeps the angular momentum `L = I·ω` in the world: with `ω_m = I(q_m)⁻¹·L_m` half-way,
//! at `q_m = exp(T·ω_m/2)·q`, the orientation becomes `exp(T·ω_m)·q` (midpoint rule: second order, symmetric, so that the
//! energy of a free body does not drift). `L_m` is `L + T·τ/2` with exact hold, `L + T·τ` with semi-implicit Euler.

use cotouch_scene::MassProperties;
use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::scene::{Body, Integrator, Space};
use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Most iterations for the angular velocity half-way through a tick.
const MAX_ITERATIONS: usize = 8;

/// Where a body is and how it moves: a plain value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyState {
    /// Pose of the centre of mass.
    pub pose: Pose,
    /// Velocity of the centre of mass and angular velocity, world frame.
    pub twist: Twist,
}

impl BodyState {
    /// At `position` (m), at rest.
    #[must_use]
    pub fn at_rest(position: DVec3) -> Self {
        Self { pose: Pose::at(position), twist: Twist::default() }
    }

    /// Where a scene's body is at the start, at rest.
    #[must_use]
    pub fn start(body: &Body) -> Self {
        let orientation = DQuat::from_scaled_axis(body.rotation_rad);
        Self { pose: Pose { position: body.position_m, orientation }, twist: Twist::default() }
    }

    /// Position (m) and velocity (m/s) of the centre of mass.
    #[must_use]
    pub fn point(&self) -> (DVec3, DVec3) {
        (self.pose.position, self.twist.linear)
    }

    /// Whether position and velocity are numbers within `bound` (m, m/s) of the origin, and the rest are numbers.
    #[must_use]
    pub fn is_within(&self, bound: f64) -> bool {
        let bounded = |vector: DVec3| vector.abs().cmple(DVec3::splat(bound)).all();
        let turning = self.pose.orientation.is_finite() && self.twist.angular.is_finite();
        bounded(self.pose.position) && bounded(self.twist.linear) && turning
    }
}

/// How a body resists being moved and turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// kg; also of a fixed body, which nothing moves.
    pub mass_kg: f64,
    /// About the centre of mass, in the body's frame, kg·m²; zero for a body that does not turn.
    pub inertia_kg_m2: DMat3,
    /// 1/m; zero for a fixed body.
    pub inverse_mass_per_kg: f64,
    /// I⁻¹; zero for a body that does not turn.
    pub inverse_inertia_per_kg_m2: DMat3,
}

impl Inertia {
    /// A mass that does not turn.
    #[must_use]
    pub fn point(mass_kg: f64) -> Self {
        Self {
            mass_kg,
            inertia_kg_m2: DMat3::ZERO,
            inverse_mass_per_kg: mass_kg.recip(),
            inverse_inertia_per_kg_m2: DMat3::ZERO,
        }
    }

    /// A mass with an inertia about its centre of mass (body frame, kg·m²).
    #[must_use]
    pub fn new(mass_kg: f64, inertia_kg_m2: DMat3) -> Self {
        let inverse_inertia_per_kg_m2 = inertia_kg_m2.inverse();
        Self { inertia_kg_m2, inverse_inertia_per_kg_m2, ..Self::point(mass_kg) }
    }

    /// Of a scene's body: solid and of uniform density. A body without a surface does not turn, a fixed one does not
    /// move.
    #[must_use]
    pub fn from_body(body: &Body) -> Self {
        let MassProperties { mass_kg, inertia_kg_m2 } = body.shape.mass_properties(body.mass_kg);
        let inertia = if inertia_kg_m2 == DMat3::ZERO {
            Self::point(mass_kg)
        } else {
            Self::new(mass_kg, inertia_kg_m2)
        };
        if body.fixed {
            let inverse_inertia_per_kg_m2 = DMat3::ZERO;
            return Self { inverse_mass_per_kg: 0.0, inverse_inertia_per_kg_m2, ..inertia };
        }
        inertia
    }

    /// Whether torques turn the body.
    #[must_use]
    pub fn turns(&self) -> bool {
        self.inverse_inertia_per_kg_m2 != DMat3::ZERO
    }

    /// About an axis (world, unit) of a body with this orientation, kg·m².
    #[must_use]
    pub fn about(&self, axis: DVec3, orientation: DQuat) -> f64 {
        let axis = orientation.conjugate() * axis;
        axis.dot(self.inertia_kg_m2 * axis)
    }

    /// Angular momentum about the centre of mass, world, kg·m²/s.
    #[must_use]
    pub fn angular_momentum(&self, body: &BodyState) -> DVec3 {
        let orientation = body.pose.orientation;
        orientation * (self.inertia_kg_m2 * (orientation.conjugate() * body.twist.angular))
    }

    /// Kinetic energy of a body in this state, J.
    #[must_use]
    pub fn kinetic_energy_j(&self, body: &BodyState) -> f64 {
        let turning = body.twist.angular.dot(self.angular_momentum(body));
        0.5 * (self.mass_kg * body.twist.linear.length_squared() + turning)
    }

    /// Angular velocity that goes with an angular momentum at an orientation.
    fn angular_velocity(&self, momentum: DVec3, orientation: DQuat) -> DVec3 {
        orientation * (self.inverse_inertia_per_kg_m2 * (orientation.conjugate() * momentum))
    }
}

/// The directions in which a body may move, and with them how it may turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Freedom {
    /// Along a unit vector; it does not turn.
    Line(DVec3),
    /// Across a unit normal, and turning about it.
    Plane(DVec3),
    /// In every direction, and about every axis.
    Space,
}

impl Freedom {
    /// Of the bodies of a scene: along x, in the x-y plane, or everywhere.
    #[must_use]
    pub fn from_space(space: Space) -> Self {
        match space {
            Space::Line => Self::Line(DVec3::X),
            Space::Plane => Self::Plane(DVec3::Z),
            Space::Space => Self::Space,
        }
    }

    /// The part of `vector` that the body can follow.
    #[must_use]
    pub fn project(self, vector: DVec3) -> DVec3 {
        match self {
            Self::Line(axis) => axis * vector.dot(axis),
            Self::Plane(normal) => vector - normal * vector.dot(normal),
            Self::Space => vector,
        }
    }
}

/// Advances a body of constant mass by one period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepper {
    period_s: f64,
    velocity_per_force: f64,
    position_per_force: f64,
    integrator: Integrator,
    freedom: Freedom,
    inertia: Inertia,
}

impl Stepper {
    /// For a mass that does not turn, stepped by `period_s`.
    #[must_use]
    pub fn new(mass_kg: f64, period_s: f64, integrator: Integrator, freedom: Freedom) -> Self {
        let velocity_per_force = period_s / mass_kg;
        let position_per_force = match integrator {
            Integrator::ExactHold => 0.5 * period_s * velocity_per_force,
            Integrator::SemiImplicitEuler => period_s * velocity_per_force,
        };
        let inertia = Inertia::point(mass_kg);
        Self { period_s, velocity_per_force, position_per_force, integrator, freedom, inertia }
    }

    /// For a body that turns as its freedom lets it; a fixed one stays where it is.
    #[must_use]
    pub fn rigid(inertia: Inertia, period_s: f64, integrator: Integrator, freedom: Freedom) -> Self {
        let point = Self::new(inertia.mass_kg, period_s, integrator, freedom);
        if inertia.inverse_mass_per_kg > 0.0 {
            return Self { inertia, ..point };
        }
        Self { inertia, velocity_per_force: 0.0, position_per_force: 0.0, ..point }
    }

    /// How the body resists.
    #[must_use]
    pub fn inertia(&self) -> &Inertia {
        &self.inertia
    }

    /// One period under `wrench` (about the centre of mass, world), held.
    pub fn step(&self, body: &mut BodyState, wrench: &Wrench) {
        let force = self.freedom.project(wrench.force);
        body.pose.position += self.period_s * body.twist.linear + self.position_per_force * force;
        body.twist.linear += self.velocity_per_force * force;
        if self.inertia.turns() {
            match self.freedom {
                Freedom::Line(_) => {}
                Freedom::Plane(normal) => self.turn_about(normal, body, wrench.torque),
                Freedom::Space => self.turn(body, wrench.torque),
            }
        }
    }

    /// What of the period a held torque has acted for, on average, while the orientation changes.
    fn share(&self) -> f64 {
        match self.integrator {
            Integrator::ExactHold => 0.5,
            Integrator::SemiImplicitEuler => 1.0,
        }
    }

    fn turn_about(&self, normal: DVec3, body: &mut BodyState, torque: DVec3) {
        let inertia = self.inertia.about(normal, body.pose.orientation);
        let gained = self.period_s * torque.dot(normal) / inertia;
        let velocity = body.twist.angular.dot(normal);
        let angle = self.period_s * (velocity + self.share() * gained);
        let turned = DQuat::from_axis_angle(normal, angle) * body.pose.orientation;
        body.pose.orientation = turned.normalize();
        body.twist.angular = (velocity + gained) * normal;
    }

    fn turn(&self, body: &mut BodyState, torque: DVec3) {
        let orientation = body.pose.orientation;
        let momentum = self.inertia.angular_momentum(body);
        let midway = momentum + self.share() * self.period_s * torque;
        let mut velocity = self.inertia.angular_velocity(midway, orientation);
        for _ in 0..MAX_ITERATIONS {
            let half_turned = DQuat::from_scaled_axis(0.5 * self.period_s * velocity) * orientation;
            let next = self.inertia.angular_velocity(midway, half_turned);
            let change = (next - velocity).length_squared();
            velocity = next;
            if change <= 1e-30 * velocity.length_squared() {
                break;
            }
        }
        let turned = DQuat::from_scaled_axis(self.period_s * velocity) * orientation;
        body.pose.orientation = turned.normalize();
        let after = momentum + self.period_s * torque;
        body.twist.angular = self.inertia.angular_velocity(after, body.pose.orientation);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 1.0 / 1024.0;

    #[test]
    fn exact_hold_follows_the_closed_form() {
        let stepper = Stepper::new(0.4, T, Integrator::ExactHold, Freedom::Space);
        let mut body = BodyState::at_rest(DVec3::new(1.0, -2.0, 0.5));
        let force = DVec3::new(0.3, -0.7, 2.0);
        for _ in 0..1024 {
            stepper.step(&mut body, &Wrench::force(force));
        }
        let expected = DVec3::new(1.0, -2.0, 0.5) + force * (0.5 / 0.4);
        assert!((body.pose.position - expected).length() < 1e-12);
        assert!((body.twist.linear - force / 0.4).length() < 1e-12);
    }

    #[test]
    fn semi_implicit_euler_is_first_order_and_conserves_momentum() {
        let error = |steps: u32| {
            let period = 1.0 / f64::from(steps);
            let stepper = Stepper::new(2.0, period, Integrator::SemiImplicitEuler, Freedom::Space);
            let mut body = BodyState::at_rest(DVec3::ZERO);
            for _ in 0..steps {
                stepper.step(&mut body, &Wrench::force(DVec3::X));
            }
            assert!((body.twist.linear.x - 0.5).abs() < 1e-12);
            (body.pose.position.x - 0.25).abs()
        };
        assert!((error(100) / error(200) - 2.0).abs() < 1e-6);
    }

    #[test]
    fn a_body_on_a_line_stays_on_it() {
        let axis = DVec3::new(3.0, 4.0, 0.0) / 5.0;
        let stepper = Stepper::new(1.0, T, Integrator::ExactHold, Freedom::Line(axis));
        let mut body = BodyState::at_rest(DVec3::ZERO);
        stepper.step(&mut body, &Wrench::force(DVec3::new(5.0, 0.0, 9.0)));
        assert!(body.twist.linear.cross(axis).length() < 1e-18);
        assert!((body.twist.linear.length() - 3.0 * T).abs() < 1e-15);
        let plane = Freedom::Plane(DVec3::Z);
        assert_eq!(plane.project(DVec3::new(1.0, 2.0, 3.0)), DVec3::new(1.0, 2.0, 0.0));
    }

    #[test]
    fn opposite_forces_leave_the_momentum_unchanged() {
        let (light, heavy) = (0.1, 0.7);
        let step = |mass| Stepper::new(mass, T, Integrator::ExactHold, Freedom::Space);
        let mut bodies = [BodyState::at_rest(DVec3::ZERO), BodyState::at_rest(DVec3::X * 0.01)];
        bodies[0].twist.linear = DVec3::Y * 0.2;
        for _ in 0..5000 {
            let spring =
                cotouch_scene::scene::SpringDamper { stiffness_n_per_m: 3000.0, damping_n_s_per_m: 20.0 };
            let stretch = crate::coupler::Stretch::between(bodies[0].point(), bodies[1].point());
            let force = crate::coupler::force(spring, stretch);
            step(light).step(&mut bodies[0], &Wrench::force(force));
            step(heavy).step(&mut bodies[1], &Wrench::force(-force));
        }
        let momentum = light * bodies[0].twist.linear + heavy * bodies[1].twist.linear;
        assert!((momentum - light * DVec3::Y * 0.2).length() < 1e-13);
    }

    #[test]
    fn what_is_not_a_number_is_not_within_bounds() {
        let mut body = BodyState::at_rest(DVec3::ZERO);
        assert!(body.is_within(10.0));
        body.twist.linear.y = f64::NAN;
        assert!(!body.is_within(10.0));
        body.twist.linear.y = 11.0;
        assert!(!body.is_within(10.0));
    }
}
