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
pub const GRAVITY_M_PER_S2: f64 = 9.81;

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
