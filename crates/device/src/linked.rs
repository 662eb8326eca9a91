//! A finger that also moves the links of a mechanism.

use cotouch_scene::mechanism::Placed;
use cotouch_scene::scene::SpringDamper;
use glam::{BVec3, DMat3, DVec3};

/// Largest product of a step with the system's fastest rate.
const MAX_RATE_STEP: f64 = 0.05;
const MAX_STEPS: f64 = 256.0;

/// `(m_h·I + Λ(x))·a + b(x, v) = u − k·x − b·v` on the free axes, Λ and b being the mechanism's
/// ([`Mechanism::dynamics`](cotouch_scene::mechanism::Mechanism::dynamics)), by the classical Runge–Kutta method of
/// fourth order, in so many equal steps a period that each is short against the fastest rate of hand and tracking.
///
/// Where the mechanism has no answer (out of reach, beyond its stops) the hand moves alone.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Linked {
    placed: Placed,
    /// The rest position in the mechanism's frame, m.
    rest: DVec3,
    mass_kg: f64,
    impedance: SpringDamper,
    free: BVec3,
    steps: u32,
    step_s: f64,
}

impl Linked {
    pub(crate) fn new(
        placed: Placed,
        mass_kg: f64,
        impedance: SpringDamper,
        free: BVec3,
        period_s: f64,
    ) -> Self {
        let SpringDamper { stiffness_n_per_m, damping_n_s_per_m } = impedance;
        let fastest = (stiffness_n_per_m / mass_kg).abs().sqrt().max((damping_n_s_per_m / mass_kg).abs());
        let steps = (fastest * period_s / MAX_RATE_STEP).ceil().clamp(1.0, MAX_STEPS);
        let rest = placed.mechanism.workspace().centre;
        Self { placed, rest, mass_kg, impedance, free, steps: steps as u32, step_s: period_s / steps }
    }

    /// Place from rest (m) and velocity (m/s) one period later, under the held force `u` (N). No allocation, bounded work.
    pub(crate) fn step(&self, x: DVec3, v: DVec3, u: DVec3) -> (DVec3, DVec3) {
        let (mut x, mut v, h) = (x, v, self.step_s);
        for _ in 0..self.steps {
            let a1 = self.acceleration(x, v, u);
            let (x2, v2) = (x + v * (0.5 * h), v + a1 * (0.5 * h));
            let a2 = self.acceleration(x2, v2, u);
            let (x3, v3) = (x + v2 * (0.5 * h), v + a2 * (0.5 * h));
            let a3 = self.acceleration(x3, v3, u);
            let (x4, v4) = (x + v3 * h, v + a3 * h);
            let a4 = self.acceleration(x4, v4, u);
            x += (v + 2.0 * (v2 + v3) + v4) * (h / 6.0);
            v += (a1 + 2.0 * (a2 + a3) + a4) * (h / 6.0);
        }
        (x, v)
    }

    fn acceleration(&self, x: DVec3, v: DVec3, u: DVec3) -> DVec3 {
        let force = u - x * self.impedance.stiffness_n_per_m - v * self.impedance.damping_n_s_per_m;
        let Some((links, bias)) = self.placed.mechanism.dynamics(self.rest + x, v) else {
            return DVec3::select(self.free, force / self.mass_kg, DVec3::ZERO);
        };
        let inertia = self.guided(links + DMat3::from_diagonal(DVec3::splat(self.mass_kg)));
        inertia.inverse() * DVec3::select(self.free, force - bias, DVec3::ZERO)
    }

    /// The inertia of a finger that a line or a plane guides.
    fn guided(&self, inertia: DMat3) -> DMat3 {
        let column = |axis: usize| {
            if self.free.test(axis) {
                DVec3::select(self.free, inertia.col(axis), DVec3::ZERO)
            } else {
                DVec3::AXES[axis]
            }
        };
        DMat3::from_cols(column(0), column(1), column(2))
    }
}
