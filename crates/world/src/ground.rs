//! The ground under bodies that move in a plane: Coulomb friction against sliding and against turning.
//!
//! Implicit in the velocity: the friction of a tick is what would stop the body within that tick, or the sliding friction
//! if that is less. So a body that is pushed less than friction holds is at rest exactly, however long, and a tick's
//! friction never gives it energy.

use cotouch_scene::geometry::Wrench;
use cotouch_scene::scene::Ground;
use glam::DVec3;

use crate::rigid::{BodyState, Freedom, Inertia};

/// Acceleration of gravity onto the plane, m/s².
const GRAVITY_M_PER_S2: f64 = 9.81;

/// The ground's friction on one body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundFriction {
    normal: Option<DVec3>,
    friction_n: f64,
    rotational_friction_coefficient: f64,
    inertia: Inertia,
    period_s: f64,
}

impl GroundFriction {
    /// Under a body that is stepped by `period_s`. Without friction unless the body moves in a plane.
    #[must_use]
    pub fn new(ground: &Ground, inertia: Inertia, period_s: f64, freedom: Freedom) -> Self {
        let normal = match freedom {
            Freedom::Plane(normal) if inertia.inverse_mass_per_kg > 0.0 => Some(normal),
            _ => None,
        };
        let friction_n = ground.friction_coefficient * inertia.mass_kg * GRAVITY_M_PER_S2;
        let rotational_friction_coefficient = ground.rotational_friction_coefficient;
        Self { normal, friction_n, rotational_friction_coefficient, inertia, period_s }
    }

    /// Whether it ever resists.
    #[must_use]
    pub fn exists(&self) -> bool {
        self.normal.is_some() && (self.friction_n > 0.0 || self.rotational_friction_coefficient > 0.0)
    }

    /// What the ground adds to `wrench` (about the centre of mass, world), which holds everything else that acts on the
    /// body in this tick.
    #[must_use]
    pub fn resist(&self, body: &BodyState, wrench: &Wrench) -> Wrench {
        let Some(normal) = self.normal.filter(|_| self.exists()) else { return Wrench::default() };
        let momentum_per_s = self.inertia.mass_kg * body.twist.linear / self.period_s;
        let force = wrench.force + momentum_per_s;
        let force = force - normal * force.dot(normal);
        Wrench { force: limited(-force, self.friction_n), torque: self.resist_turning(normal, body, wrench) }
    }

    fn resist_turning(&self, normal: DVec3, body: &BodyState, wrench: &Wrench) -> DVec3 {
        if !self.inertia.turns() {
            return DVec3::ZERO;
        }
        let inertia = self.inertia.about(normal, body.pose.orientation);
        let radius_of_gyration_m = (inertia / self.inertia.mass_kg).sqrt();
        let weight_n = self.inertia.mass_kg * GRAVITY_M_PER_S2;
        let friction_n_m = self.rotational_friction_coefficient * weight_n * radius_of_gyration_m;
        let torque = (wrench.torque + inertia * body.twist.angular / self.period_s).dot(normal);
        limited(-torque * normal, friction_n_m)
    }
}

/// `vector`, shortened to `length` if it is longer.
fn limited(vector: DVec3, length: f64) -> DVec3 {
    vector.clamp_length_max(length)
}

#[cfg(test)]
mod tests {
    use cotouch_scene::scene::Integrator;
    use glam::DMat3;

    use super::*;
    use crate::rigid::Stepper;

    const T: f64 = 1.0 / 1024.0;
    const PLANE: Freedom = Freedom::Plane(DVec3::Z);

    fn inertia() -> Inertia {
        Inertia::new(0.4, DMat3::from_diagonal(DVec3::splat(2.5e-4)))
    }

    fn friction() -> GroundFriction {
        let ground = Ground { friction_coefficient: 0.3, rotational_friction_coefficient: 0.2 };
        GroundFriction::new(&ground, inertia(), T, PLANE)
    }

    fn step(body: &mut BodyState, pull: Wrench) {
        let friction = friction().resist(body, &pull);
        let wrench = Wrench { force: pull.force + friction.force, torque: pull.torque + friction.torque };
        Stepper::rigid(inertia(), T, Integrator::ExactHold, PLANE).step(body, &wrench);
    }

    #[test]
    fn it_stops_a_sliding_and_turning_body_by_the_closed_form() {
        let mut body = BodyState::at_rest(DVec3::ZERO);
        body.twist.linear = DVec3::new(0.3, -0.4, 0.0);
        body.twist.angular = DVec3::Z * 2.0;
        for _ in 0..2048 {
            step(&mut body, Wrench::default());
        }
        let path = 0.5 * 0.5 / (2.0 * 0.3 * GRAVITY_M_PER_S2);
        assert!((body.pose.position.length() - path).abs() < 1e-6);
        assert!((body.pose.position.normalize() - DVec3::new(0.6, -0.8, 0.0)).length() < 1e-12);
        // τ/I = μ_r·g/ρ with the radius of gyration ρ = √(I/m) = 25 mm.
        let angle = 2.0 * 2.0 / (2.0 * 0.2 * GRAVITY_M_PER_S2 / 0.025);
        let turned = crate::coupler::rotation_vector(body.pose.orientation).z;
        assert!((turned - angle).abs() < 1e-4 * angle + 1e-4, "{turned}, {angle}");
        assert!(body.twist.linear.length() < 1e-15 && body.twist.angular.length() < 1e-14);
    }

    #[test]
    fn a_body_that_would_stop_within_a_tick_stops_in_it() {
        let mut body = BodyState::at_rest(DVec3::ZERO);
        // Friction takes 2.9 mm/s in a tick, and 77 mrad/s.
        body.twist.linear = DVec3::new(0.0015, -0.002, 0.0);
        body.twist.angular = DVec3::Z * 0.07;
        step(&mut body, Wrench::default());
        assert!(body.twist.linear.length() < 1e-17 && body.twist.angular.length() < 1e-16);
    }

    #[test]
    fn a_body_that_is_pushed_less_than_friction_holds_does_not_creep() {
        let weight = 0.4 * GRAVITY_M_PER_S2;
        let held =
            Wrench { force: DVec3::new(0.2, 0.22, 0.0) * weight, torque: DVec3::Z * 0.19 * weight * 0.025 };
        let mut body = BodyState::at_rest(DVec3::X);
        for _ in 0..1_000_000 {
            step(&mut body, held);
        }
        assert_eq!(body, BodyState::at_rest(DVec3::X));
        step(&mut body, Wrench { force: held.force * 1.02, torque: held.torque * 1.06 });
        assert!(body.twist.linear.length() > 0.0 && body.twist.angular.z > 0.0);
    }

    #[test]
    fn it_takes_energy_and_never_gives() {
        let mut body = BodyState::at_rest(DVec3::ZERO);
        body.twist.linear = DVec3::new(0.2, 0.1, 0.0);
        body.twist.angular = DVec3::Z * -3.0;
        let stepper = Stepper::rigid(inertia(), T, Integrator::ExactHold, PLANE);
        for tick in 0..5000 {
            let phase = 0.37 * f64::from(tick);
            let force = DVec3::new(2.0 * phase.sin(), 3.0 * (1.7 * phase).cos(), 0.0);
            let pull = Wrench { force, torque: DVec3::Z * 0.02 * (0.9 * phase).sin() };
            let mut without = body;
            stepper.step(&mut without, &pull);
            step(&mut body, pull);
            let (with, without) = (inertia().kinetic_energy_j(&body), inertia().kinetic_energy_j(&without));
            assert!(with <= without * (1.0 + 1e-12), "tick {tick}");
        }
    }

    #[test]
    fn there_is_no_ground_on_a_line_or_in_space() {
        let ground = Ground { friction_coefficient: 0.3, rotational_friction_coefficient: 0.2 };
        let mut body = BodyState::at_rest(DVec3::ZERO);
        body.twist.linear = DVec3::X;
        for freedom in [Freedom::Line(DVec3::X), Freedom::Space] {
            let friction = GroundFriction::new(&ground, inertia(), T, freedom);
            assert!(!friction.exists());
            assert_eq!(friction.resist(&body, &Wrench::force(DVec3::X)), Wrench::default());
        }
    }
}
