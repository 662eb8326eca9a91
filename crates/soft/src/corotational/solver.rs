//! Solves the step's system with a factor that may be some periods old.
//!
//! The factor of an earlier matrix, in numbers of seven digits and turned node by node as the body has turned since, is a very
//! good preconditioner (Hecht et al. 2012): a few conjugate gradient steps, each with one solution, cost far less than a
//! factorisation. Small bodies are factorised in every period: their results depend on their state alone.

use glam::{DMat3, DVec3, Vec3};

use crate::factor::{BlockMatrix, Factor, FactorOf, NotPositive};
use crate::vector::{add_multiple, dot};

/// The error that remains, as a part of the solution, both measured by the matrix itself.
const TOLERANCE: f64 = 1e-6;

/// After so many steps with an old factor a new one is made.
const MAX_STEPS_WITH_OLD: u64 = 8;

/// A factor with which this many steps were needed is made anew, if it has served for so many solutions.
const WORN_STEPS: u64 = 6;
const MIN_SERVICE: u64 = 10;

/// After so many steps with a factor of the same matrix seven digits are too few.
const MAX_STEPS: u64 = 20;

/// Bodies with at most so many coordinates are small.
const SMALL: usize = 400;

/// A matrix, its factor or that of one before it, and room for vectors.
#[derive(Clone, Debug)]
pub(super) struct Solver {
    pub(super) matrix: BlockMatrix,
    rough: FactorOf<f32>,
    rough_is_usable: bool,
    /// How the body is turned at each free node, and how it was when the rough factor was made.
    pub(super) rotations: Vec<DMat3>,
    rotations_then: Vec<DMat3>,
    /// How often the rough factor has been used, and how many steps the last time took.
    service: u64,
    last_steps: u64,
    exact: Option<Factor>,
    factorisations: u64,
    solutions: u64,
    residual: Vec<f64>,
    last_residual: Vec<f64>,
    direction: Vec<f64>,
    applied: Vec<f64>,
    preconditioned: Vec<f64>,
    short: Vec<f32>,
}

impl Solver {
    pub(super) fn new(rough: FactorOf<f32>) -> Self {
        let symbolic = rough.symbolic().clone();
        let vector = vec![0.0; symbolic.coordinates()];
        Self {
            matrix: BlockMatrix::new(symbolic),
            short: vec![0.0; vector.len()],
            preconditioned: vector.clone(),
            rough,
            rough_is_usable: false,
            rotations: Vec::new(),
            rotations_then: Vec::new(),
            service: 0,
            last_steps: 0,
            exact: None,
            factorisations: 0,
            solutions: 0,
            residual: vector.clone(),
            last_residual: vector.clone(),
            direction: vector.clone(),
            applied: vector,
        }
    }

    /// Forgets the factor: what follows depends on the matrix only.
    pub(super) fn forget(&mut self) {
        self.rough_is_usable = false;
        (self.service, self.last_steps) = (0, 0);
    }

    pub(super) fn counts(&self) -> (u64, u64) {
        (self.factorisations, self.solutions)
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let exact = self.exact.as_ref().map_or(0, Factor::memory_bytes);
        let rough = self.rough.memory_bytes() + self.rough.shared_bytes();
        self.matrix.memory_bytes() + exact + rough + 44 * self.residual.len()
    }

    /// Whether the next solution looks at `rotations`.
    pub(super) fn uses_rotations(&self) -> bool {
        self.residual.len() > SMALL
    }

    /// `matrix · solution = right`, to six digits or more.
    pub(super) fn solve(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), NotPositive> {
        if !self.uses_rotations() {
            return self.solve_exactly(right, solution);
        }
        let worn = self.last_steps >= WORN_STEPS && self.service >= MIN_SERVICE;
        if self.rough_is_usable && !worn && self.iterate(right, solution, MAX_STEPS_WITH_OLD) {
            return Ok(());
        }
        self.factorisations += 1;
        self.rough_is_usable = self.rough.refactor(&self.matrix).is_ok();
        self.rotations_then.clone_from(&self.rotations);
        self.service = 0;
        if self.rough_is_usable && self.iterate(right, solution, MAX_STEPS) {
            return Ok(());
        }
        self.rough_is_usable = false;
        self.solve_exactly(right, solution)
    }

    /// The same to all digits, with a factor of this very matrix.
    pub(super) fn solve_exactly(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), NotPositive> {
        let factor = self.exact.get_or_insert_with(|| Factor::like(&self.rough));
        self.factorisations += 1;
        factor.refactor(&self.matrix)?;
        solution.copy_from_slice(right);
        factor.solve_in_place(solution);
        self.solutions += 1;
        Ok(())
    }

    /// Conjugate gradients, in the form that bears a preconditioner of few digits. Returns whether they converged: every step
    /// brings the solution nearer by `contribution` (in the matrix's own measure, squared); what later ones would bring is
    /// judged by how fast contributions fall.
    fn iterate(&mut self, right: &[f64], solution: &mut [f64], max_steps: u64) -> bool {
        solution.fill(0.0);
        self.residual.copy_from_slice(right);
        self.direction.fill(0.0);
        self.service += 1;
        let (mut keep, mut size, mut total) = (0.0, 0.0, 0.0);
        let mut last_contribution = None;
        for step in 1..=max_steps {
            self.last_steps = step;
            self.precondition();
            let before = std::mem::replace(&mut size, dot(&self.residual, &self.preconditioned));
            if size == 0.0 {
                return true;
            }
            if last_contribution.is_some() {
                keep = (size - dot(&self.last_residual, &self.preconditioned)) / before;
            }
            let Some(contribution) = self.advance(keep, solution) else { return false };
            total += contribution;
            let fall = last_contribution.map_or(1.0, |last| contribution / last);
            if contribution * fall <= TOLERANCE * TOLERANCE * total {
                return true;
            }
            last_contribution = Some(contribution);
        }
        false
    }

    /// One step: along the preconditioned residual and `keep` times the last direction. Returns its contribution; `None` where
    /// the matrix is not positive.
    fn advance(&mut self, keep: f64, solution: &mut [f64]) -> Option<f64> {
        for (direction, new) in self.direction.iter_mut().zip(&self.preconditioned) {
            *direction = keep * *direction + new;
        }
        self.matrix.multiply(&self.direction, &mut self.applied);
        let (along, curvature) = (dot(&self.direction, &self.residual), dot(&self.direction, &self.applied));
        if curvature <= 0.0 || !curvature.is_finite() {
            return None;
        }
        let length = along / curvature;
        self.last_residual.copy_from_slice(&self.residual);
        add_multiple(solution, length, &self.direction);
        add_multiple(&mut self.residual, -length, &self.applied);
        Some(length * along)
    }

    /// The residual, solved with the rough factor. Scaled, because small numbers have too few digits of the short kind.
    fn precondition(&mut self) {
        let scale = self.residual.iter().fold(0.0_f64, |most, part| most.max(part.abs()));
        let down = if scale > 0.0 { 1.0 / scale } else { 0.0 };
        let turns = self.rotations.iter().zip(&self.rotations_then);
        let residual = self.residual.as_chunks::<3>().0;
        for ((short, residual), (now, then)) in
            self.short.as_chunks_mut::<3>().0.iter_mut().zip(residual).zip(turns.clone())
        {
            let back = *then * (now.transpose() * (DVec3::from_array(*residual) * down));
            *short = back.as_vec3().to_array();
        }
        self.rough.solve_in_place(&mut self.short);
        let preconditioned = self.preconditioned.as_chunks_mut::<3>().0;
        for ((part, short), (now, then)) in
            preconditioned.iter_mut().zip(self.short.as_chunks::<3>().0).zip(turns)
        {
            let forth = *now * (then.transpose() * (Vec3::from_array(*short).as_dvec3() * scale));
            *part = forth.to_array();
        }
        self.solutions += 1;
    }
}
