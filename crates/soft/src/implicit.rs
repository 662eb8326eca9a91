//! The step that springs and balloons share: backward Euler or equilibrium, by Newton's method, with energy under control.
//!
//! A period looks for the nodes `x` that make the incremental potential least (its gradient is h⁻¹ times the residual of the
//! backward Euler step), subject to the kept volume if there is one:
//!
//! ```text
//! Φ(x) = E(x) − f·x + ½·dᵀ·(((1 + h·α)/h²)·M + (β/h)·K₀)·d − (1/h)·vᵀ·M·d,   d = x − x₀
//! ```
//!
//! with `K₀` the stiffness at the start of the period. Every Newton step is shortened until Φ falls. In the end the whole
//! displacement is shortened until the body has no more energy than it had plus the work of the forces: energy never grows
//! without input, however the Newton steps went.

mod constants;
mod parts;
mod potential;
mod rest;

use std::sync::Arc;

use cotouch_scene::scene::Scene;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use self::constants::{ImplicitConstants, RestCompliance, VolumeGradient};
use self::potential::{MAX_HALVINGS, Potential, ROUNDING};
use crate::body::{SoftBody, SoftEnergy, SoftError, SoftState};
use crate::elastic::Elastic;
use crate::factor::{BlockMatrix, Factor, Symbolic};
use crate::forces::unit_forces;
use crate::linear::LinearBody;
use crate::point::{MaterialPoint, PointForce};

pub(crate) use parts::Parts;

/// A shape whose volume is further than this from what it should be, relative, was not the result of a step.
const MAX_VOLUME_ERROR: f64 = 1e-3;
/// Newton steps after which a static equilibrium counts as not found.
const MAX_SETTLING_STEPS: usize = 300;
/// Newton steps of a period that is to end in equilibrium.
const MAX_QUASI_STATIC_STEPS: usize = 30;
/// A Newton step shorter than this part of the body's size ends the search for an equilibrium.
const SETTLED: f64 = 1e-12;
/// One that rounding keeps from going further downhill may be this long.
const NEARLY_SETTLED: f64 = 1e-7;
/// A body that [`Elastic`] holds together.
#[derive(Clone)]
pub(crate) struct ImplicitBody<E> {
    constants: Arc<ImplicitConstants<E>>,
    state: SoftState,
    matrix: BlockMatrix,
    factor: Factor,
}

impl<E: Elastic> ImplicitBody<E> {
    /// A body at rest where the parts say, with the scene's period, damping and gravity.
    pub(crate) fn new(scene: &Scene, parts: Parts<E>) -> Self {
        let soft = &scene.soft;
        let symbolic = Arc::new(Symbolic::new(&parts.rest_m, &parts.fixed, &parts.pairs));
        let matrix = BlockMatrix::new(symbolic.clone());
        let factor = Factor::new(symbolic.clone());
        let state = SoftState {
            positions_m: parts.rest_m.clone(),
            velocities_m_per_s: vec![DVec3::ZERO; parts.rest_m.len()],
        };
        let mut constants = ImplicitConstants {
            size_m: extent(&parts.rest_m),
            period_s: scene.rates.simulation_hz.period_s(),
            mass_damping_per_s: soft.mass_damping_per_s,
            stiffness_damping_s: soft.stiffness_damping_s,
            newton_steps: soft.newton_steps as usize,
            quasi_static: soft.quasi_static,
            gravity_m_per_s2: scene.gravity_m_per_s2,
            rest_energy_j: parts.elastic.energy_j(&parts.rest_m),
            at_rest: None,
            symbolic,
            parts,
        };
        constants.at_rest = constants.rest_compliance(factor.clone());
        Self { constants: Arc::new(constants), state, matrix, factor }
    }

    /// The same, at rest where its parts are in equilibrium without gravity.
    ///
    /// # Errors
    /// When there is no equilibrium.
    pub(crate) fn new_settled(scene: &Scene, mut parts: Parts<E>) -> Result<Self, SoftError> {
        let mut body = Self::new(scene, parts.clone());
        let start = body.state.clone();
        let potential = Potential::equilibrium(&start, vec![DVec3::ZERO; start.positions_m.len()]);
        body.factorise(&potential);
        if !body.search(&potential, MAX_SETTLING_STEPS) {
            return Err(SoftError::NoEquilibrium("the mesh at rest does not come to rest".into()));
        }
        parts.rest_m = body.state.positions_m;
        Ok(Self::new(scene, parts))
    }

    /// The period of a body without inertia.
    fn step_in_equilibrium(&mut self, forces_n: Vec<DVec3>) {
        let max_steps = MAX_QUASI_STATIC_STEPS.max(self.constants.newton_steps);
        self.recover_volume();
        let start = self.state.clone();
        let potential = Potential::equilibrium(&start, forces_n);
        self.factorise(&potential);
        self.search(&potential, max_steps);
        self.state.velocities_m_per_s.fill(DVec3::ZERO);
    }

    /// The period of a body with inertia.
    fn step_in_time(&mut self, forces_n: Vec<DVec3>) {
        let newton_steps = self.constants.newton_steps;
        self.recover_volume();
        let start = self.state.clone();
        let potential = self.potential_in_time(&start, forces_n);
        let base = self.keep_volume();
        self.search(&potential, newton_steps);
        self.arrive(&start, &base, &potential.forces_n);
    }

    /// A shape that cannot be of this volume by far comes nearer to the one at rest until it can, and stops.
    fn recover_volume(&mut self) {
        let constants = self.constants.clone();
        let Parts { enclosed: Some(enclosed), rest_m, .. } = &constants.parts else { return };
        if enclosed.error(&self.state.positions_m).abs() <= MAX_VOLUME_ERROR {
            return;
        }
        self.state.velocities_m_per_s.fill(DVec3::ZERO);
        for part in (0..=10).map(|tenths| f64::from(tenths) / 10.0) {
            let nearer = self.state.positions_m.iter().zip(rest_m).map(|(at, rest)| at.lerp(*rest, part));
            let mut nearer: Vec<DVec3> = nearer.collect();
            let swelling = constants.free_part(enclosed.gradient(&nearer));
            if enclosed.error(&nearer) > -0.5 && enclosed.restore(&mut nearer, &swelling) {
                self.state.positions_m = nearer;
                return;
            }
        }
        self.state.positions_m.clone_from(rest_m);
    }

    /// Brings the volume back to what it should be, with the factor of where the nodes are; returns where they are then.
    fn keep_volume(&mut self) -> Vec<DVec3> {
        let constants = self.constants.clone();
        if let Some(enclosed) = &constants.parts.enclosed {
            let volume = constants.volume_gradient(enclosed, &self.state.positions_m, &self.factor);
            enclosed.restore(&mut self.state.positions_m, &constants.scattered(&volume.solved));
        }
        self.state.positions_m.clone()
    }

    fn potential_in_time<'a>(&mut self, start: &'a SoftState, forces_n: Vec<DVec3>) -> Potential<'a> {
        let mut potential = Potential::equilibrium(start, forces_n);
        potential.add_time(&self.constants);
        let positive = !self.factorise(&potential);
        if potential.damping > 0.0 {
            let mut damper = BlockMatrix::new(self.constants.symbolic.clone());
            self.constants.add_stiffness(&mut damper, &potential, &start.positions_m, positive, 1.0);
            (potential.positive_damper, potential.damper) = (positive, Some(damper));
        }
        potential
    }

    /// Newton's method downhill from the present positions, with the factor of about there for the first step. Returns
    /// whether it ended in a minimum.
    fn search(&mut self, potential: &Potential<'_>, max_steps: usize) -> bool {
        let constants = self.constants.clone();
        let mut value = constants.potential(potential, &self.state.positions_m);
        for step in 0..max_steps {
            if step > 0 {
                self.factorise(potential);
            }
            let newton = constants.newton_step(potential, &self.state.positions_m, &self.factor);
            let longest = newton.step.iter().fold(0.0_f64, |most, part| most.max(part.abs()));
            let found = constants.downhill(potential, &self.state.positions_m, value, &newton);
            let Some((positions, less)) = found else { return longest <= NEARLY_SETTLED * constants.size_m };
            (self.state.positions_m, value) = (positions, less);
            if longest <= SETTLED * constants.size_m {
                return true;
            }
        }
        false
    }

    /// The factor of Φ's second derivative where the nodes are: with the exact stiffness if that is positive definite, else
    /// without the parts of it that are not positive. Returns whether it is exact.
    fn factorise(&mut self, potential: &Potential<'_>) -> bool {
        let constants = self.constants.clone();
        for positive in [false, true] {
            constants.fill(&mut self.matrix, potential, &self.state.positions_m, positive);
            if self.factor.refactor(&self.matrix).is_ok() {
                return !positive;
            }
        }
        // Something is loose in this very shape: a little of the body's stiffness everywhere holds it.
        let mut extra = 1e-9 * constants.stiffness_n_per_m();
        while self.factor.refactor(&self.matrix).is_err() && extra.is_finite() {
            (0..constants.symbolic.free_nodes()).for_each(|place| self.matrix.add_to_diagonal(place, extra));
            extra *= 10.0;
        }
        false
    }

    /// Shortens the displacement from `base_m` until energy allows it; and the velocities of a period that began at `start`.
    /// `base_m` is where it began, with the volume put right.
    fn arrive(&mut self, start: &SoftState, base_m: &[DVec3], forces_n: &[DVec3]) {
        let constants = self.constants.clone();
        let speeds = |to: &[DVec3], from: &[DVec3]| -> Vec<DVec3> {
            to.iter().zip(from).map(|(to, from)| (*to - *from) / constants.period_s).collect()
        };
        let put_right = speeds(base_m, &start.positions_m);
        let speed_before: Vec<DVec3> =
            start.velocities_m_per_s.iter().zip(&put_right).map(|(speed, right)| *speed - *right).collect();
        let before = constants.elastic_j(base_m) + constants.kinetic_j(&speed_before);
        for _ in 0..MAX_HALVINGS {
            let to = &mut self.state.positions_m;
            let moves = speeds(to, base_m);
            let work: f64 = moves.iter().zip(forces_n).map(|(speed, force)| speed.dot(*force)).sum();
            let work = work * constants.period_s;
            let after = constants.elastic_j(to) + constants.kinetic_j(&moves);
            let rounding =
                ROUNDING * (after.abs() + before.abs() + work.abs() + constants.rest_energy_j.abs());
            if after <= before + work + rounding {
                self.state.velocities_m_per_s = speeds(to, &start.positions_m);
                return;
            }
            to.iter_mut().zip(base_m).for_each(|(to, &base)| *to = base.midpoint(*to));
            if let Some(enclosed) = &constants.parts.enclosed {
                let swelling = constants.free_part(enclosed.gradient(to));
                enclosed.restore(to, &swelling);
            }
        }
        self.state.positions_m.copy_from_slice(base_m);
        self.state.velocities_m_per_s.fill(DVec3::ZERO);
    }
}

impl<E: Elastic> SoftBody for ImplicitBody<E> {
    fn rest_m(&self) -> &[DVec3] {
        &self.constants.parts.rest_m
    }

    fn triangles(&self) -> &[[u32; 3]] {
        &self.constants.parts.triangles
    }

    fn state(&self) -> &SoftState {
        &self.state
    }

    fn set_state(&mut self, state: &SoftState) {
        let constants = self.constants.clone();
        let Parts { rest_m, fixed, .. } = &constants.parts;
        assert_eq!(state.positions_m.len(), rest_m.len(), "a state of another body");
        assert_eq!(state.velocities_m_per_s.len(), rest_m.len(), "a state of another body");
        let mut numbers = state.positions_m.iter().chain(&state.velocities_m_per_s);
        if !numbers.all(|vector| vector.is_finite()) {
            self.state.velocities_m_per_s.fill(DVec3::ZERO);
            return;
        }
        self.state.clone_from(state);
        for node in (0..rest_m.len()).filter(|&node| fixed[node]) {
            self.state.positions_m[node] = rest_m[node];
            self.state.velocities_m_per_s[node] = DVec3::ZERO;
        }
    }

    fn step(&mut self, forces: &[PointForce]) {
        let forces_n = self.constants.external_forces(forces);
        if self.constants.quasi_static {
            self.step_in_equilibrium(forces_n)
        } else {
            self.step_in_time(forces_n)
        }
    }

    fn settle(&mut self, forces: &[PointForce]) -> Result<(), SoftError> {
        let start = self.state.clone();
        self.recover_volume();
        let begin = self.state.clone();
        let potential = Potential::equilibrium(&begin, self.constants.external_forces(forces));
        self.factorise(&potential);
        if !self.search(&potential, MAX_SETTLING_STEPS) {
            self.state = start;
            let steps = format!("{MAX_SETTLING_STEPS} Newton steps did not end in one");
            return Err(SoftError::NoEquilibrium(steps));
        }
        self.state.velocities_m_per_s.fill(DVec3::ZERO);
        Ok(())
    }

    fn compliance(&self, points: &[MaterialPoint]) -> Option<DMatrix<f64>> {
        let RestCompliance { factor, volume } = self.constants.at_rest.as_ref()?;
        let forces = unit_forces(&self.constants.symbolic, points);
        let mut displacements = forces.clone();
        factor.solve_columns_in_place(&mut displacements);
        let mut compliance = forces.tr_mul(&displacements);
        if let Some(VolumeGradient { solved, product, .. }) = volume {
            let swelling = forces.tr_mul(&DVector::from_column_slice(solved));
            compliance -= &swelling * swelling.transpose() / *product;
        }
        Some((&compliance + compliance.transpose()) * 0.5)
    }

    fn linear(&self) -> Option<LinearBody> {
        let mut body = self.clone();
        let constants = self.constants.clone();
        let start = self.state.clone();
        let pressure = |enclosed| constants.median_pressure_pa(enclosed, &start.positions_m);
        let mut potential = Potential::equilibrium(&start, constants.external_forces(&[]));
        potential.known_pressure_pa = constants.parts.enclosed.as_ref().map(pressure);
        if !constants.quasi_static {
            potential.add_time(&constants);
        }
        let exact = body.factorise(&potential);
        let several = constants.quasi_static || constants.newton_steps > 1;
        (exact || !several).then(|| constants.linear(&potential, exact))
    }

    fn energy(&self) -> SoftEnergy {
        let ImplicitConstants { parts, gravity_m_per_s2, .. } = &*self.constants;
        let SoftState { positions_m, velocities_m_per_s } = &self.state;
        let lifted =
            positions_m.iter().zip(&parts.rest_m).map(|(at, rest)| (*at - *rest).dot(*gravity_m_per_s2));
        SoftEnergy {
            elastic_j: self.constants.elastic_j(positions_m),
            kinetic_j: self.constants.kinetic_j(velocities_m_per_s),
            potential_j: -lifted.zip(&parts.mass_kg).map(|(lifted, mass)| lifted * mass).sum::<f64>(),
        }
    }

    fn stress_pa(&self, stress: &mut Vec<f32>) {
        self.constants.parts.elastic.stress_pa(&self.state.positions_m, stress);
    }

    fn period_s(&self) -> f64 {
        self.constants.period_s
    }

    fn boxed_clone(&self) -> Box<dyn SoftBody> {
        Box::new(self.clone())
    }
}

/// The diagonal of the box around some points, m.
fn extent(points: &[DVec3]) -> f64 {
    let first = points.first().copied().unwrap_or_default();
    let (low, high) = points.iter().fold((first, first), |(low, high), &at| (low.min(at), high.max(at)));
    low.distance(high)
}
