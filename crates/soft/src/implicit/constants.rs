//! What does not change in a body, and what follows from it and from where the nodes are.

use std::sync::Arc;

use glam::DVec3;

use super::parts::Parts;
use crate::elastic::Elastic;
use crate::enclosed::Enclosed;
use crate::factor::{BlockMatrix, Factor, Symbolic};
use crate::forces::external_forces;
use crate::point::PointForce;
use crate::vector::dot;

/// What does not change.
pub(super) struct ImplicitConstants<E> {
    pub(super) parts: Parts<E>,
    pub(super) size_m: f64,
    pub(super) symbolic: Arc<Symbolic>,
    pub(super) period_s: f64,
    pub(super) mass_damping_per_s: f64,
    pub(super) stiffness_damping_s: f64,
    pub(super) newton_steps: usize,
    pub(super) quasi_static: bool,
    pub(super) gravity_m_per_s2: DVec3,
    pub(super) rest_energy_j: f64,
    pub(super) at_rest: Option<RestCompliance>,
}

/// What answers how compliant the body is about rest.
pub(super) struct RestCompliance {
    pub(super) factor: Factor,
    /// Of a body that keeps its volume: the volume's gradient, and what the factor makes of it.
    pub(super) volume: Option<VolumeGradient>,
}

/// A volume's gradient `g` over the free coordinates.
pub(super) struct VolumeGradient {
    pub(super) gradient: Vec<f64>,
    /// `A⁻¹·g`, with A the matrix that is solved with.
    pub(super) solved: Vec<f64>,
    /// The product `gᵀ·A⁻¹·g`.
    pub(super) product: f64,
}

impl<E: Elastic> ImplicitConstants<E> {
    pub(super) fn external_forces(&self, points: &[PointForce]) -> Vec<DVec3> {
        external_forces(&self.parts.mass_kg, self.gravity_m_per_s2, points)
    }

    /// Elastic energy, counted from rest, J.
    pub(super) fn elastic_j(&self, positions_m: &[DVec3]) -> f64 {
        self.parts.elastic.energy_j(positions_m) - self.rest_energy_j
    }

    pub(super) fn kinetic_j(&self, velocities: &[DVec3]) -> f64 {
        let each = self.parts.mass_kg.iter().zip(velocities);
        each.map(|(mass, velocity)| 0.5 * mass * velocity.length_squared()).sum()
    }

    /// The pressure that comes nearest to balancing all forces.
    pub(super) fn pressure_pa(&self, enclosed: &Enclosed, positions_m: &[DVec3], forces_n: &[DVec3]) -> f64 {
        let mut forces = forces_n.to_vec();
        self.parts.elastic.add_forces(positions_m, &mut forces);
        let gradient = self.symbolic.gather(&enclosed.gradient(positions_m));
        -dot(&gradient, &self.symbolic.gather(&forces)) / dot(&gradient, &gradient).max(f64::MIN_POSITIVE)
    }

    /// The pressure that balances the forces of most nodes: what it is in equilibrium, whatever is pressed on a few of them.
    pub(super) fn median_pressure_pa(&self, enclosed: &Enclosed, positions_m: &[DVec3]) -> f64 {
        let mut forces = self.external_forces(&[]);
        self.parts.elastic.add_forces(positions_m, &mut forces);
        let gradient = enclosed.gradient(positions_m);
        let free = self.symbolic.order().iter().map(|&node| (forces[node as usize], gradient[node as usize]));
        let mut pressures: Vec<f64> =
            free.map(|(force, area)| -force.dot(area) / area.length_squared()).collect();
        pressures.sort_unstable_by(f64::total_cmp);
        pressures.get(pressures.len() / 2).copied().unwrap_or(0.0)
    }

    pub(super) fn volume_gradient(
        &self,
        enclosed: &Enclosed,
        positions_m: &[DVec3],
        factor: &Factor,
    ) -> VolumeGradient {
        let gradient = self.symbolic.gather(&enclosed.gradient(positions_m));
        let mut solved = gradient.clone();
        factor.solve_in_place(&mut solved);
        let product = dot(&gradient, &solved);
        VolumeGradient { gradient, solved, product }
    }

    /// A field over all nodes without its part on fixed ones.
    pub(super) fn free_part(&self, mut field: Vec<DVec3>) -> Vec<DVec3> {
        field
            .iter_mut()
            .zip(&self.parts.fixed)
            .filter(|(_, fixed)| **fixed)
            .for_each(|(part, _)| *part = DVec3::ZERO);
        field
    }

    /// A vector over the free coordinates as a field over the nodes, zero where they are fixed.
    pub(super) fn scattered(&self, vector: &[f64]) -> Vec<DVec3> {
        let mut field = vec![DVec3::ZERO; self.parts.rest_m.len()];
        self.symbolic.scatter(vector, &mut field);
        field
    }

    /// The largest stiffness of a node about rest, N/m.
    pub(super) fn stiffness_n_per_m(&self) -> f64 {
        let mut matrix = BlockMatrix::new(self.symbolic.clone());
        self.parts.elastic.add_tangent(&self.parts.rest_m, true, 1.0, &mut matrix);
        let diagonal = matrix.entries().into_iter().filter(|(row, column, _)| row == column);
        diagonal.map(|(_, _, value)| value).fold(f64::MIN_POSITIVE, f64::max)
    }
}
