//! Tetrahedra of corotational linear elasticity, stepped by backward Euler.
//!
//! The energy is `Σ V·(μ·|F − R|² + λ/2·tr(RᵀF − 1)²)`, with R the rotation that is nearest to each element's deformation F:
//! linear in strain, whatever the rotation. Inverted and flattened elements have an energy too, and forces that right them.

mod element;
mod evaluation;
mod period;
mod rotation;
mod settle;
mod solver;

use std::sync::Arc;

use cotouch_scene::scene::{Scene, Soft};
use cotouch_scene::soft_mesh::SoftMesh;
use glam::DVec3;
use nalgebra::DMatrix;

use self::element::{Element, Material, Tangent};
use self::evaluation::Evaluation;
use self::rotation::norm_squared;
use self::solver::Solver;
use crate::body::{MaterialPoint, PointForce, SoftBody, SoftEnergy, SoftError, SoftState};
use crate::factor::{BlockMatrix, Factor, FactorOf, Symbolic};
use crate::linear::LinearBody;
use crate::mesh::{edges, fixed_nodes, node_volumes, not_held};

/// What does not change.
#[derive(Debug)]
struct Constants {
    rest_m: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    elements: Vec<Element>,
    material: Material,
    /// Of every node, kg.
    mass_kg: Vec<f64>,
    gravity_m_per_s2: DVec3,
    period_s: f64,
    mass_damping_per_s: f64,
    stiffness_damping_s: f64,
    newton_steps: u32,
    quasi_static: bool,
    symbolic: Arc<Symbolic>,
    /// Of every free coordinate, kg.
    free_mass_kg: Vec<f64>,
    /// The largest extent at rest, m.
    size_m: f64,
    /// μ times the volume, J.
    energy_scale_j: f64,
    /// Of the stiffness at rest; or why there is none.
    at_rest: Result<Factor, String>,
}

/// A body of corotational linear tetrahedra.
#[derive(Clone, Debug)]
pub struct Corotational {
    constants: Arc<Constants>,
    state: SoftState,
    /// Of the state's positions.
    present: Evaluation,
    /// Of positions that are tried.
    trial: Evaluation,
    /// The tangent stiffness of the present positions.
    stiffness: BlockMatrix,
    /// That of the positions at the start of the period.
    damper: BlockMatrix,
    solver: Solver,
}

impl Corotational {
    /// The scene's tetrahedra at rest.
    ///
    /// # Errors
    /// When the mesh has none or bad ones, or when a quasi-static body is not held.
    pub fn of_scene(scene: &Scene) -> Result<Self, SoftError> {
        let period_s = scene.rates.simulation_hz.period_s();
        Self::new(scene.soft.mesh(), &scene.soft, scene.gravity_m_per_s2, period_s)
    }

    /// The body of a mesh, at rest; mesh and fixed regions of `soft` as far as they go.
    ///
    /// # Errors
    /// When the mesh has no tetrahedra or bad ones, or when a quasi-static body is not held.
    pub fn new(
        mesh: &SoftMesh,
        soft: &Soft,
        gravity_m_per_s2: DVec3,
        period_s: f64,
    ) -> Result<Self, SoftError> {
        let constants = Arc::new(Constants::new(mesh, soft, gravity_m_per_s2, period_s)?);
        if let (true, Err(why)) = (soft.quasi_static, &constants.at_rest) {
            return Err(SoftError::NotHeld(format!("{why}; without inertia nothing else holds it")));
        }
        let positions_m = constants.rest_m.clone();
        let velocities_m_per_s = vec![DVec3::ZERO; positions_m.len()];
        let present = Evaluation::new(&constants, &positions_m);
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
        let mesh = size_of_val(&*constants.elements) + size_of_val(&*constants.triangles);
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
    fn assemble(&mut self, kind: Tangent) {
        self.constants.assemble(&self.present, kind, &mut self.stiffness);
    }
}

impl Constants {
    fn new(mesh: &SoftMesh, soft: &Soft, gravity_m_per_s2: DVec3, period_s: f64) -> Result<Self, SoftError> {
        let rest_m = mesh.nodes_m.clone();
        let fixed = fixed_nodes(mesh, &soft.fixed);
        let joined: Vec<[u32; 2]> = mesh.tetrahedra.iter().flat_map(edges).collect();
        let symbolic = Arc::new(Symbolic::new(&rest_m, &fixed, &joined));
        let elements = elements(mesh, &symbolic)?;
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
            elements,
            material,
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
            at_rest: not_held(&rest_m, &fixed).map_or(Ok(Factor::new(symbolic.clone())), Err),
            symbolic,
            rest_m,
        };
        constants.factorise_at_rest();
        Ok(constants)
    }

    /// Room for a factor of few digits, which shares what it can with the one at rest.
    fn rough_factor(&self) -> FactorOf<f32> {
        match &self.at_rest {
            Ok(factor) => FactorOf::like(factor),
            Err(_) => FactorOf::new(self.symbolic.clone()),
        }
    }

    fn factorise_at_rest(&mut self) {
        let mut stiffness = BlockMatrix::new(self.symbolic.clone());
        self.assemble(&Evaluation::new(self, &self.rest_m), Tangent::Exact, &mut stiffness);
        if let Ok(factor) = &mut self.at_rest
            && factor.refactor(&stiffness).is_err()
        {
            self.at_rest = Err("a part of it can move without being deformed".into());
        }
    }

    fn assemble(&self, evaluation: &Evaluation, kind: Tangent, matrix: &mut BlockMatrix) {
        matrix.clear();
        for (element, deformed) in self.elements.iter().zip(&evaluation.deformed) {
            element.add_tangent(self.material, deformed, kind, matrix);
        }
    }

    /// Gravity and the points' forces on the free coordinates, N. Forces that are not finite count as none.
    fn external_forces(&self, points: &[PointForce]) -> Vec<f64> {
        let mut forces: Vec<DVec3> = self.mass_kg.iter().map(|mass| *mass * self.gravity_m_per_s2).collect();
        for point in points.iter().filter(|point| point.force_n.is_finite()) {
            for (&node, weight) in point.at.nodes.iter().zip(point.at.weights) {
                if let Some(force) = forces.get_mut(node as usize) {
                    *force += weight * point.force_n;
                }
            }
        }
        self.symbolic.gather(&forces)
    }

    fn kinetic_j(&self, velocities: &[f64]) -> f64 {
        self.free_mass_kg
            .iter()
            .zip(velocities)
            .map(|(mass, velocity)| 0.5 * mass * velocity * velocity)
            .sum()
    }

    /// By how much two sums of energies of about `size_j` may differ and still count as equal.
    fn rounding_j(&self, size_j: f64) -> f64 {
        1e-12 * size_j + 1e-14 * (size_j * self.energy_scale_j).sqrt() + 1e-28 * self.energy_scale_j
    }
}

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
        let factor = constants.at_rest.as_ref().ok()?;
        let mut weights = DMatrix::zeros(constants.symbolic.coordinates(), 3 * points.len());
        for (index, point) in points.iter().enumerate() {
            for (&node, &weight) in point.nodes.iter().zip(&point.weights) {
                let Some(position) = constants.symbolic.position(node) else { continue };
                (0..3).for_each(|axis| weights[(3 * position + axis, 3 * index + axis)] += weight);
            }
        }
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
        for (element, deformed) in constants.elements.iter().zip(&self.present.deformed) {
            let tensor = deformed.stress(constants.material);
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

fn elements(mesh: &SoftMesh, symbolic: &Symbolic) -> Result<Vec<Element>, SoftError> {
    if mesh.tetrahedra.is_empty() {
        return Err(SoftError::Unsuitable(
            "the technique \"corotational\" needs a mesh of tetrahedra".into(),
        ));
    }
    let element = |(index, &nodes): (usize, &[u32; 4])| {
        let bad = || SoftError::Unsuitable(format!("tetrahedron {} has no positive volume", index + 1));
        Element::new(nodes, &mesh.nodes_m, symbolic).ok_or_else(bad)
    };
    mesh.tetrahedra.iter().enumerate().map(element).collect()
}

fn extent(nodes_m: &[DVec3]) -> f64 {
    let least = nodes_m.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let most = nodes_m.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    (most - least).max_element()
}
