//! Φ, its derivatives, and a step downhill.

use glam::DVec3;

use super::constants::ImplicitConstants;
use crate::body::SoftState;
use crate::elastic::Elastic;
use crate::factor::{BlockMatrix, Factor};
use crate::vector::dot;

/// How often a step is halved before it is given up.
pub(super) const MAX_HALVINGS: usize = 40;
/// Energies that differ by less than this part of themselves count as equal.
pub(super) const ROUNDING: f64 = 1e-13;

/// Φ has to fall by this part of what its slope promises.
const SUFFICIENT: f64 = 1e-4;

/// The potential that a search makes least.
pub(super) struct Potential<'a> {
    pub(super) start_m: &'a [DVec3],
    pub(super) velocity_m_per_s: &'a [DVec3],
    pub(super) forces_n: Vec<DVec3>,
    /// (1 + h·α)/h², 1/s²; 0 in a search for equilibrium.
    pub(super) inertia: f64,
    /// 1/h, 1/s; 0 in a search for equilibrium.
    pub(super) momentum: f64,
    /// β/h; 0 in a search for equilibrium.
    pub(super) damping: f64,
    /// K₀, where it damps.
    pub(super) damper: Option<BlockMatrix>,
    /// Whether K₀ is without the parts that are not positive.
    pub(super) positive_damper: bool,
    /// The pressure of the enclosed volume, Pa, where forces do not tell it.
    pub(super) known_pressure_pa: Option<f64>,
}

/// A step of Newton's method.
pub(super) struct NewtonStep {
    /// What is subtracted from the free coordinates.
    pub(super) step: Vec<f64>,
    /// How fast Φ falls on it.
    pub(super) fall: f64,
    /// A direction over all nodes that changes the volume, in a body that keeps it.
    pub(super) swelling: Option<Vec<DVec3>>,
}

impl<'a> Potential<'a> {
    pub(super) fn equilibrium(start: &'a SoftState, forces_n: Vec<DVec3>) -> Self {
        Self {
            start_m: &start.positions_m,
            velocity_m_per_s: &start.velocities_m_per_s,
            forces_n,
            inertia: 0.0,
            momentum: 0.0,
            damping: 0.0,
            damper: None,
            positive_damper: false,
            known_pressure_pa: None,
        }
    }

    /// Inertia and damping of a period.
    pub(super) fn add_time<E>(&mut self, constants: &ImplicitConstants<E>) {
        let ImplicitConstants { period_s, mass_damping_per_s, stiffness_damping_s, .. } = *constants;
        self.inertia = (1.0 + period_s * mass_damping_per_s) / (period_s * period_s);
        self.momentum = 1.0 / period_s;
        self.damping = stiffness_damping_s / period_s;
    }
}

impl<E: Elastic> ImplicitConstants<E> {
    /// The value of Φ, J.
    pub(super) fn potential(&self, potential: &Potential<'_>, positions_m: &[DVec3]) -> f64 {
        let Potential { start_m, velocity_m_per_s, forces_n, inertia, momentum, damping, .. } = potential;
        let mut value = self.parts.elastic.energy_j(positions_m);
        for (node, (position, start)) in positions_m.iter().zip(*start_m).enumerate() {
            let (moved, mass) = (*position - *start, self.parts.mass_kg[node]);
            value += mass
                * (0.5 * inertia * moved.length_squared() - momentum * velocity_m_per_s[node].dot(moved));
            value -= forces_n[node].dot(moved);
        }
        match &potential.damper {
            None => value,
            Some(damper) => {
                let moved = self.displacement(start_m, positions_m);
                let mut force = vec![0.0; moved.len()];
                damper.multiply(&moved, &mut force);
                value + 0.5 * damping * dot(&moved, &force)
            }
        }
    }

    /// Φ's gradient over the free coordinates, N.
    pub(super) fn gradient(&self, potential: &Potential<'_>, positions_m: &[DVec3]) -> Vec<f64> {
        let Potential { start_m, velocity_m_per_s, forces_n, inertia, momentum, damping, .. } = potential;
        let mut down = forces_n.clone();
        self.parts.elastic.add_forces(positions_m, &mut down);
        for (node, force) in down.iter_mut().enumerate() {
            let moved = positions_m[node] - start_m[node];
            *force -= self.parts.mass_kg[node] * (*inertia * moved - *momentum * velocity_m_per_s[node]);
        }
        let mut gradient = self.symbolic.gather(&down);
        gradient.iter_mut().for_each(|part| *part = -*part);
        if let Some(damper) = &potential.damper {
            let mut force = vec![0.0; gradient.len()];
            damper.multiply(&self.displacement(start_m, positions_m), &mut force);
            gradient.iter_mut().zip(force).for_each(|(part, force)| *part += damping * force);
        }
        gradient
    }

    /// Φ's second derivative, N/m, into `matrix`.
    pub(super) fn fill(
        &self,
        matrix: &mut BlockMatrix,
        potential: &Potential<'_>,
        positions_m: &[DVec3],
        positive: bool,
    ) {
        matrix.clear();
        let damping = potential.damping;
        if positions_m == potential.start_m {
            self.add_stiffness(matrix, potential, positions_m, positive, 1.0 + damping);
        } else {
            self.add_stiffness(matrix, potential, positions_m, positive, 1.0);
            if damping > 0.0 {
                let positive = positive || potential.positive_damper;
                self.add_stiffness(matrix, potential, potential.start_m, positive, damping);
            }
        }
        for (place, &node) in self.symbolic.order().iter().enumerate() {
            matrix.add_to_diagonal(place, potential.inertia * self.parts.mass_kg[node as usize]);
        }
    }

    /// Adds `scale` times the tangent stiffness: of the skin or springs, and of the pressure, whose direction turns with them.
    pub(super) fn add_stiffness(
        &self,
        matrix: &mut BlockMatrix,
        potential: &Potential<'_>,
        positions_m: &[DVec3],
        positive: bool,
        scale: f64,
    ) {
        self.parts.elastic.add_tangent(positions_m, positive, scale, matrix);
        if let (Some(enclosed), false) = (&self.parts.enclosed, positive) {
            let known = potential.known_pressure_pa;
            let pressure_pa =
                known.unwrap_or_else(|| self.pressure_pa(enclosed, positions_m, &potential.forces_n));
            enclosed.add_second(positions_m, -scale * pressure_pa, matrix);
        }
    }

    /// Newton's step from some positions, with the factor of Φ's second derivative there.
    pub(super) fn newton_step(
        &self,
        potential: &Potential<'_>,
        positions_m: &[DVec3],
        factor: &Factor,
    ) -> NewtonStep {
        let gradient = self.gradient(potential, positions_m);
        let mut step = gradient.clone();
        factor.solve_in_place(&mut step);
        let volume =
            self.parts.enclosed.as_ref().map(|enclosed| self.volume_gradient(enclosed, positions_m, factor));
        if let Some(volume) = &volume {
            let share = dot(&volume.gradient, &step) / volume.product;
            step.iter_mut().zip(&volume.solved).for_each(|(step, solved)| *step -= share * solved);
        }
        let fall = dot(&step, &gradient);
        NewtonStep { step, fall, swelling: volume.map(|volume| self.scattered(&volume.solved)) }
    }

    /// The first of the steps 1, 1/2, 1/4 … on which Φ falls, and Φ there.
    pub(super) fn downhill(
        &self,
        potential: &Potential<'_>,
        from_m: &[DVec3],
        value: f64,
        newton: &NewtonStep,
    ) -> Option<(Vec<DVec3>, f64)> {
        let full = self.scattered(&newton.step);
        let rounding = ROUNDING * (value.abs() + self.parts.elastic.energy_j(from_m).abs());
        let mut part = 1.0;
        for _ in 0..MAX_HALVINGS {
            let mut to_m: Vec<DVec3> =
                from_m.iter().zip(&full).map(|(from, step)| *from - part * *step).collect();
            let kept = match (&self.parts.enclosed, &newton.swelling) {
                (Some(enclosed), Some(swelling)) => enclosed.restore(&mut to_m, swelling),
                _ => true,
            };
            let there = self.potential(potential, &to_m);
            if kept && there <= value - SUFFICIENT * part * newton.fall + rounding {
                return Some((to_m, there));
            }
            part *= 0.5;
        }
        None
    }

    pub(super) fn displacement(&self, from_m: &[DVec3], to_m: &[DVec3]) -> Vec<f64> {
        let moved: Vec<DVec3> = to_m.iter().zip(from_m).map(|(to, from)| *to - *from).collect();
        self.symbolic.gather(&moved)
    }
}
