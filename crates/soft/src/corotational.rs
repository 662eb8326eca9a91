//! Tetrahedra of corotational linear elasticity, stepped by backward Euler.
//!
//! The energy is `Σ V·(μ·|F − R|² + λ/2·tr(RᵀF − 1)²)`, with R the rotation that is nearest to each element's deformation F:
//! linear in strain, whatever the rotation. Inverted and flattened elements have an energy too, and forces that right them.

mod body;
mod constants;
mod element;
mod evaluation;
mod period;
mod rotation;
mod settle;
mod solver;

use glam::DVec3;
use nalgebra::DMatrix;

use self::rotation::norm_squared;
use crate::body::{SoftBody, SoftEnergy, SoftError, SoftState};
use crate::forces::unit_forces;
use crate::linear::LinearBody;
use crate::point::{MaterialPoint, PointForce};

pub use self::body::Corotational;

impl SoftBody for Corotational {
    fn rest_m(&self) -> &[DVec3] {
        &self.constants.rest_m
    }

    fn triangles(&self) -> &[[u32; 3]] {
        &self.constants.triangles
    }

    fn state(&self) -> &SoftState {
        &self.state
    }

    fn set_state(&mut self, state: &SoftState) {
        self.place(state);
    }

    fn step(&mut self, forces: &[PointForce]) {
        if self.constants.quasi_static {
            self.quasi_static_period(forces);
        } else {
            self.period(forces);
        }
    }

    fn settle(&mut self, forces: &[PointForce]) -> Result<(), SoftError> {
        self.find_equilibrium(forces)
    }

    fn compliance(&self, points: &[MaterialPoint]) -> Option<DMatrix<f64>> {
        let constants = &*self.constants;
        let factor = constants.at_rest.as_ref()?;
        let weights = unit_forces(&constants.symbolic, points);
        let mut moved = weights.clone();
        factor.solve_columns_in_place(&mut moved);
        let compliance = weights.tr_mul(&moved);
        Some(0.5 * (&compliance + compliance.transpose()))
    }

    fn linear(&self) -> Option<LinearBody> {
        Some(self.linearised())
    }

    fn energy(&self) -> SoftEnergy {
        let constants = &*self.constants;
        let fall = |node: usize| self.state.positions_m[node] - constants.rest_m[node];
        let weight = |(node, mass): (usize, &f64)| -mass * constants.gravity_m_per_s2.dot(fall(node));
        let speed = |(mass, velocity): (&f64, &DVec3)| 0.5 * mass * velocity.length_squared();
        SoftEnergy {
            elastic_j: self.present.energy_j,
            kinetic_j: constants.mass_kg.iter().zip(&self.state.velocities_m_per_s).map(speed).sum(),
            potential_j: constants.mass_kg.iter().enumerate().map(weight).sum(),
        }
    }

    fn stress_pa(&self, stress: &mut Vec<f32>) {
        let constants = &*self.constants;
        let mut sums = vec![(0.0, 0.0); constants.rest_m.len()];
        for (element, deformed) in constants.elements.list.iter().zip(&self.present.deformed) {
            let tensor = deformed.stress(constants.elements.material);
            let mean = (tensor.x_axis.x + tensor.y_axis.y + tensor.z_axis.z) / 3.0;
            let shape = tensor - glam::DMat3::from_diagonal(DVec3::splat(mean));
            let von_mises = (1.5 * norm_squared(shape)).sqrt();
            for &node in &element.nodes {
                let (sum, volume) = &mut sums[node as usize];
                *sum += element.volume_m3 * von_mises;
                *volume += element.volume_m3;
            }
        }
        stress.clear();
        stress.extend(sums.iter().map(|(sum, volume)| (sum / volume) as f32));
    }

    fn period_s(&self) -> f64 {
        self.constants.period_s
    }

    fn boxed_clone(&self) -> Box<dyn SoftBody> {
        Box::new(self.clone())
    }
}
