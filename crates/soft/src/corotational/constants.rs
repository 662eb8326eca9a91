//! What does not change in a body of tetrahedra.

use std::sync::Arc;

use cotouch_scene::scene::Soft;
use cotouch_scene::soft_mesh::SoftMesh;
use glam::DVec3;

use super::element::{Material, Tangent, Tetrahedron};
use super::evaluation::{Elements, Evaluation};
use crate::body::SoftError;
use crate::factor::{BlockMatrix, Factor, FactorOf, Symbolic};
use crate::forces::external_forces;
use crate::mesh::{edges, node_volumes};
use crate::point::PointForce;

/// What does not change.
#[derive(Debug)]
pub(super) struct TetrahedraConstants {
    pub(super) rest_m: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) elements: Elements,
    /// Of every node, kg.
    pub(super) mass_kg: Vec<f64>,
    pub(super) gravity_m_per_s2: DVec3,
    pub(super) period_s: f64,
    pub(super) mass_damping_per_s: f64,
    pub(super) stiffness_damping_s: f64,
    pub(super) newton_steps: u32,
    pub(super) quasi_static: bool,
    pub(super) symbolic: Arc<Symbolic>,
    /// Of every free coordinate, kg.
    pub(super) free_mass_kg: Vec<f64>,
    /// The largest extent at rest, m.
    pub(super) size_m: f64,
    /// μ times the volume, J.
    pub(super) energy_scale_j: f64,
    /// Of the stiffness at rest; none where a part can move without being deformed.
    pub(super) at_rest: Option<Factor>,
}

impl TetrahedraConstants {
    pub(super) fn new(
        mesh: &SoftMesh,
        soft: &Soft,
        gravity_m_per_s2: DVec3,
        period_s: f64,
    ) -> Result<Self, SoftError> {
        let rest_m = mesh.nodes_m.clone();
        let fixed = mesh.fixed_nodes(&soft.fixed);
        let joined: Vec<[u32; 2]> = mesh.tetrahedra.iter().flat_map(edges).collect();
        let symbolic = Arc::new(Symbolic::new(&rest_m, &fixed, &joined));
        let list = elements(mesh, &symbolic)?;
        let volumes = node_volumes(&rest_m, &mesh.tetrahedra);
        let mass_kg: Vec<f64> = volumes.iter().map(|volume| soft.density_kg_per_m3 * volume).collect();
        let free_mass_kg =
            symbolic.gather(&mass_kg.iter().map(|&mass| DVec3::splat(mass)).collect::<Vec<_>>());
        if free_mass_kg.iter().any(|&mass| !(mass > 0.0 && mass.is_finite())) {
            return Err(SoftError::Unsuitable("every node must be a corner of a tetrahedron".into()));
        }
        let material = Material::new(soft.young_pa, soft.poisson_ratio);
        let mut constants = Self {
            triangles: mesh.triangles.clone(),
            elements: Elements { list, material },
            mass_kg,
            gravity_m_per_s2,
            period_s,
            mass_damping_per_s: soft.mass_damping_per_s,
            stiffness_damping_s: soft.stiffness_damping_s,
            newton_steps: soft.newton_steps.max(1),
            quasi_static: soft.quasi_static,
            free_mass_kg,
            size_m: extent(&rest_m),
            energy_scale_j: material.mu_pa * volumes.iter().sum::<f64>(),
            at_rest: Some(Factor::new(symbolic.clone())),
            symbolic,
            rest_m,
        };
        constants.factorise_at_rest();
        Ok(constants)
    }

    /// Room for a factor of few digits, which shares what it can with the one at rest.
    pub(super) fn rough_factor(&self) -> FactorOf<f32> {
        match &self.at_rest {
            Some(factor) => FactorOf::like(factor),
            None => FactorOf::new(self.symbolic.clone()),
        }
    }

    fn factorise_at_rest(&mut self) {
        let mut stiffness = BlockMatrix::new(self.symbolic.clone());
        self.assemble(&Evaluation::new(&self.elements, &self.rest_m), Tangent::Exact, &mut stiffness);
        self.at_rest.take_if(|factor| factor.refactor(&stiffness).is_err());
    }

    pub(super) fn assemble(&self, evaluation: &Evaluation, kind: Tangent, matrix: &mut BlockMatrix) {
        matrix.clear();
        for (element, deformed) in self.elements.list.iter().zip(&evaluation.deformed) {
            element.add_tangent(self.elements.material, deformed, kind, matrix);
        }
    }

    /// Gravity and the points' forces on the free coordinates, N.
    pub(super) fn external_forces(&self, points: &[PointForce]) -> Vec<f64> {
        self.symbolic.gather(&external_forces(&self.mass_kg, self.gravity_m_per_s2, points))
    }

    pub(super) fn kinetic_j(&self, velocities: &[f64]) -> f64 {
        self.free_mass_kg
            .iter()
            .zip(velocities)
            .map(|(mass, velocity)| 0.5 * mass * velocity * velocity)
            .sum()
    }

    /// By how much two sums of energies of about `size_j` may differ and still count as equal.
    pub(super) fn rounding_j(&self, size_j: f64) -> f64 {
        1e-12 * size_j + 1e-14 * (size_j * self.energy_scale_j).sqrt() + 1e-28 * self.energy_scale_j
    }
}

fn elements(mesh: &SoftMesh, symbolic: &Symbolic) -> Result<Vec<Tetrahedron>, SoftError> {
    if mesh.tetrahedra.is_empty() {
        return Err(SoftError::Unsuitable(
            "the technique \"corotational\" needs a mesh of tetrahedra".into(),
        ));
    }
    let element = |(index, &nodes): (usize, &[u32; 4])| {
        let bad = || SoftError::Unsuitable(format!("tetrahedron {} has no positive volume", index + 1));
        Tetrahedron::new(nodes, &mesh.nodes_m, symbolic).ok_or_else(bad)
    };
    mesh.tetrahedra.iter().enumerate().map(element).collect()
}

fn extent(nodes_m: &[DVec3]) -> f64 {
    let least = nodes_m.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let most = nodes_m.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    (most - least).max_element()
}
