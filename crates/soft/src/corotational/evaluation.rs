//! How the elements of a body are deformed when its nodes are somewhere.

use glam::{DMat3, DVec3};

use super::element::{DeformedTetrahedron, Material, Tetrahedron};
use super::rotation::{nearest_rotation, norm_squared};
use crate::factor::Symbolic;

/// The elements of a body, all of one material.
#[derive(Debug)]
pub(super) struct Elements {
    pub(super) list: Vec<Tetrahedron>,
    pub(super) material: Material,
}

/// Rotation and stretch of every element, and what they store.
#[derive(Clone, Debug)]
pub(super) struct Evaluation {
    pub(super) deformed: Vec<DeformedTetrahedron>,
    pub(super) energy_j: f64,
}

impl Evaluation {
    pub(super) fn new(elements: &Elements, positions_m: &[DVec3]) -> Self {
        let mut evaluation = Self { deformed: Vec::new(), energy_j: 0.0 };
        evaluation.update(elements, positions_m);
        evaluation
    }

    pub(super) fn update(&mut self, elements: &Elements, positions_m: &[DVec3]) {
        self.deformed.clear();
        self.energy_j = 0.0;
        for element in &elements.list {
            let deformed = element.deformed(positions_m);
            self.energy_j += element.energy_j(elements.material, &deformed);
            self.deformed.push(deformed);
        }
    }

    /// Adds the elastic forces times `factor` to a vector of the free coordinates.
    pub(super) fn add_forces(
        &self,
        elements: &Elements,
        symbolic: &Symbolic,
        factor: f64,
        vector: &mut [f64],
    ) {
        for (element, deformed) in elements.list.iter().zip(&self.deformed) {
            let forces = element.forces_n(elements.material, deformed);
            for (&node, force) in element.nodes.iter().zip(forces) {
                let Some(position) = symbolic.position(node) else { continue };
                for (sum, part) in vector[3 * position..].iter_mut().zip(force.to_array()) {
                    *sum += factor * part;
                }
            }
        }
    }

    /// How the elements around each free node are turned in the mean, in the order of elimination.
    pub(super) fn node_rotations(
        &self,
        elements: &Elements,
        symbolic: &Symbolic,
        rotations: &mut Vec<DMat3>,
    ) {
        rotations.clear();
        rotations.resize(symbolic.free_nodes(), DMat3::ZERO);
        for (element, deformed) in elements.list.iter().zip(&self.deformed) {
            let part = deformed.rotation * element.volume_m3;
            for position in element.nodes.iter().filter_map(|&node| symbolic.position(node)) {
                rotations[position] += part;
            }
        }
        for rotation in rotations {
            // Of about unit size, as the search for the rotation likes it.
            *rotation =
                nearest_rotation(*rotation * norm_squared(*rotation).max(f64::MIN_POSITIVE).sqrt().recip());
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.deformed.capacity() * size_of::<DeformedTetrahedron>()
    }
}
