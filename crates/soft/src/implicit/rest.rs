//! What a body answers about rest: how compliant it is, and its linearised step.

use glam::DVec3;

use super::constants::{ImplicitConstants, RestCompliance};
use super::parts::Parts;
use super::potential::Potential;
use crate::body::SoftState;
use crate::elastic::Elastic;
use crate::enclosed::Enclosed;
use crate::factor::{BlockMatrix, Factor};
use crate::linear::LinearBody;

impl<E: Elastic> ImplicitConstants<E> {
    /// `None` if the body can move without deforming.
    pub(super) fn rest_compliance(&self, mut factor: Factor) -> Option<RestCompliance> {
        let Parts { rest_m, enclosed, .. } = &self.parts;
        let start =
            SoftState { positions_m: rest_m.clone(), velocities_m_per_s: vec![DVec3::ZERO; rest_m.len()] };
        let potential = Potential::equilibrium(&start, vec![DVec3::ZERO; rest_m.len()]);
        let mut matrix = BlockMatrix::new(self.symbolic.clone());
        self.fill(&mut matrix, &potential, rest_m, false);
        factor.refactor(&matrix).ok()?;
        let volume = enclosed.as_ref().map(|enclosed| self.volume_gradient(enclosed, rest_m, &factor));
        Some(RestCompliance { factor, volume })
    }

    /// The linearised step about the start of `potential`, whose matrix was exact or not.
    pub(super) fn linear(&self, potential: &Potential<'_>, exact: bool) -> LinearBody {
        let stiffness = |positive| {
            let mut matrix = BlockMatrix::new(self.symbolic.clone());
            self.add_stiffness(&mut matrix, potential, potential.start_m, positive, 1.0);
            matrix.entries()
        };
        let order = self.symbolic.order();
        let gradient = |enclosed: &Enclosed| self.symbolic.gather(&enclosed.gradient(potential.start_m));
        LinearBody {
            period_s: self.period_s,
            quasi_static: self.quasi_static,
            coordinates: order.iter().flat_map(|&node| [0, 1, 2].map(|axis| (node, axis))).collect(),
            mass_kg: order.iter().flat_map(|&node| [self.parts.mass_kg[node as usize]; 3]).collect(),
            mass_damping_per_s: self.mass_damping_per_s,
            stiffness_damping_s: self.stiffness_damping_s,
            stiffness: stiffness(false),
            step_stiffness: (!exact).then(|| stiffness(true)),
            volume_gradient: self.parts.enclosed.as_ref().map(gradient),
        }
    }
}
