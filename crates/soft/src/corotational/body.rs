//! A body of tetrahedra: its state, and what all of its steps need.

use std::sync::Arc;

use cotouch_scene::scene::{Scene, Soft};
use cotouch_scene::soft_mesh::SoftMesh;
use glam::DVec3;

use super::constants::TetrahedraConstants;
use super::element::Tangent;
use super::evaluation::Evaluation;
use super::solver::Solver;
use crate::body::{SoftError, SoftState};
use crate::factor::{BlockMatrix, Factor};

/// A body of corotational linear tetrahedra.
#[derive(Clone, Debug)]
pub struct Corotational {
    pub(super) constants: Arc<TetrahedraConstants>,
    pub(super) state: SoftState,
    /// Of the state's positions.
    pub(super) present: Evaluation,
    /// Of positions that are tried.
    pub(super) trial: Evaluation,
    /// The tangent stiffness of the present positions.
    pub(super) stiffness: BlockMatrix,
    /// That of the positions at the start of the period.
    pub(super) damper: BlockMatrix,
    pub(super) solver: Solver,
}

impl Corotational {
    /// The scene's tetrahedra at rest.
    ///
    /// # Errors
    /// When the mesh has none or bad ones.
    pub fn from_scene(scene: &Scene) -> Result<Self, SoftError> {
        let period_s = scene.rates.simulation_hz.period_s();
        Self::new(scene.soft.mesh(), &scene.soft, scene.gravity_m_per_s2, period_s)
    }

    /// The body of a mesh, at rest; mesh and fixed regions of `soft` as far as they go.
    ///
    /// # Errors
    /// When the mesh has no tetrahedra or bad ones.
    pub fn new(
        mesh: &SoftMesh,
        soft: &Soft,
        gravity_m_per_s2: DVec3,
        period_s: f64,
    ) -> Result<Self, SoftError> {
        let constants = Arc::new(TetrahedraConstants::new(mesh, soft, gravity_m_per_s2, period_s)?);
        let positions_m = constants.rest_m.clone();
        let velocities_m_per_s = vec![DVec3::ZERO; positions_m.len()];
        let present = Evaluation::new(&constants.elements, &positions_m);
        let symbolic = &constants.symbolic;
        Ok(Self {
            state: SoftState { positions_m, velocities_m_per_s },
            trial: present.clone(),
            present,
            stiffness: BlockMatrix::new(symbolic.clone()),
            damper: BlockMatrix::new(symbolic.clone()),
            solver: Solver::new(constants.rough_factor()),
            constants,
        })
    }

    /// Bytes on the heap that this body needs, shared constants included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let constants = &*self.constants;
        let nodes = constants.rest_m.len() * (size_of::<f64>() + 3 * size_of::<DVec3>());
        let mesh = size_of_val(&*constants.elements.list) + size_of_val(&*constants.triangles);
        let at_rest = constants.at_rest.as_ref().map_or(0, Factor::memory_bytes);
        let matrices = self.stiffness.memory_bytes() + self.damper.memory_bytes();
        nodes
            + mesh
            + at_rest
            + matrices
            + size_of_val(&*constants.free_mass_kg)
            + self.present.memory_bytes()
            + self.trial.memory_bytes()
            + self.solver.memory_bytes()
    }

    /// How often a matrix has been factorised, and how many solutions with an older factor there were.
    #[must_use]
    pub fn solver_counts(&self) -> (u64, u64) {
        self.solver.counts()
    }

    /// Fills the tangent stiffness of the present positions.
    pub(super) fn assemble(&mut self, kind: Tangent) {
        self.constants.assemble(&self.present, kind, &mut self.stiffness);
    }

    /// `(1 + h·α)·M + h·β·K₀ + h²·K`.
    pub(super) fn fill_system(&mut self) {
        let constants = &*self.constants;
        let h = constants.period_s;
        let inertia = 1.0 + h * constants.mass_damping_per_s;
        let matrix = &mut self.solver.matrix;
        matrix.set_to_sum((h * h, &self.stiffness), (h * constants.stiffness_damping_s, &self.damper));
        for (position, mass) in constants.free_mass_kg.iter().step_by(3).enumerate() {
            matrix.add_to_diagonal(position, inertia * mass);
        }
    }

    /// Takes another state over, as far as it is finite; fixed nodes stay.
    pub(super) fn place(&mut self, state: &SoftState) {
        let constants = self.constants.clone();
        let (positions, velocities) = (&state.positions_m, &state.velocities_m_per_s);
        for &node in constants.symbolic.order() {
            let node = node as usize;
            if let Some(position) = positions.get(node).filter(|position| position.is_finite()) {
                self.state.positions_m[node] = *position;
            }
            let velocity = velocities.get(node).filter(|velocity| velocity.is_finite());
            self.state.velocities_m_per_s[node] = velocity.copied().unwrap_or(DVec3::ZERO);
        }
        self.present.update(&constants.elements, &self.state.positions_m);
        self.solver.forget();
    }
}
