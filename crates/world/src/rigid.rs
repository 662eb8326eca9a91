//! Bodies under a force that is held over one period.

use cotouch_scene::geometry::{Pose, Twist};
use cotouch_scene::scene::Integrator;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Where a body is and how it moves: a plain value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyState {
    /// Pose of the centre of mass.
    pub pose: Pose,
    /// Its twist.
    pub twist: Twist,
}

impl BodyState {
    /// At `position` (m), at rest.
    #[must_use]
    pub fn at_rest(position: DVec3) -> Self {
        Self { pose: Pose::at(position), twist: Twist::default() }
    }

    /// Position (m) and velocity (m/s) of the centre of mass.
    #[must_use]
    pub fn point(&self) -> (DVec3, DVec3) {
        (self.pose.position, self.twist.linear)
    }

    /// Whether position and velocity are numbers within `bound` (m, m/s) of the origin.
    #[must_use]
    pub fn is_within(&self, bound: f64) -> bool {
        let bounded = |vector: DVec3| vector.abs().cmple(DVec3::splat(bound)).all();
        bounded(self.pose.position) && bounded(self.twist.linear)
    }
}

/// The directions in which a body may move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Freedom {
    /// Along a unit vector.
    Line(DVec3),
    /// Across a unit normal.
    Plane(DVec3),
    /// Everywhere.
    Space,
}

impl Freedom {
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

/// Advances the translation of a body of constant mass by one period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepper {
    period_s: f64,
    velocity_per_force: f64,
    position_per_force: f64,
    integrator: Integrator,
    freedom: Freedom,
}

impl Stepper {
    /// For a body of `mass_kg`, stepped by `period_s`.
    #[must_use]
    pub fn new(mass_kg: f64, period_s: f64, integrator: Integrator, freedom: Freedom) -> Self {
        let velocity_per_force = period_s / mass_kg;
        let position_per_force = match integrator {
            Integrator::ExactHold => 0.5 * period_s * velocity_per_force,
            Integrator::SemiImplicitEuler => period_s * velocity_per_force,
        };
        Self { period_s, velocity_per_force, position_per_force, integrator, freedom }
    }

    /// The scheme that this stepper uses.
    #[must_use]
    pub fn integrator(&self) -> Integrator {
        self.integrator
    }

    /// One period under `force` (N), held.
    pub fn step(&self, body: &mut BodyState, force: DVec3) {
        let force = self.freedom.project(force);
        body.pose.position += self.period_s * body.twist.linear + self.position_per_force * force;
        body.twist.linear += self.velocity_per_force * force;
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
            stepper.step(&mut body, force);
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
                stepper.step(&mut body, DVec3::X);
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
        stepper.step(&mut body, DVec3::new(5.0, 0.0, 9.0));
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
            step(light).step(&mut bodies[0], force);
            step(heavy).step(&mut bodies[1], -force);
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
