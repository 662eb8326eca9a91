//! Solves the step's system with a factor that may be some periods old.
//!
//! While elements turn little, the factor of an earlier matrix is a very good preconditioner: a few conjugate gradient steps,
//! each with one solution, cost far less than a factorisation.

use std::sync::Arc;

use crate::factor::{BlockMatrix, Factor, NotPositive, Symbolic};

/// The residual that remains, of the one at the beginning, both measured by the factor.
const TOLERANCE: f64 = 1e-10;

/// After so many steps a new factor is made.
const MOST_STEPS: usize = 7;

/// A matrix, its factor or that of one before it, and room for vectors.
#[derive(Clone, Debug)]
pub(super) struct Solver {
    pub(super) matrix: BlockMatrix,
    factor: Factor,
    usable: bool,
    factorisations: u64,
    solutions: u64,
    residual: Vec<f64>,
    direction: Vec<f64>,
    applied: Vec<f64>,
    preconditioned: Vec<f64>,
}

impl Solver {
    pub(super) fn new(symbolic: Arc<Symbolic>) -> Self {
        let vector = vec![0.0; symbolic.coordinates()];
        Self {
            matrix: BlockMatrix::new(symbolic.clone()),
            factor: Factor::new(symbolic),
            usable: false,
            factorisations: 0,
            solutions: 0,
            residual: vector.clone(),
            direction: vector.clone(),
            applied: vector.clone(),
            preconditioned: vector,
        }
    }

    /// Forgets the factor: what follows depends on the matrix only.
    pub(super) fn forget(&mut self) {
        self.usable = false;
    }

    pub(super) fn counts(&self) -> (u64, u64) {
        (self.factorisations, self.solutions)
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.matrix.memory_bytes() + self.factor.memory_bytes() + 4 * size_of_val(&*self.residual)
    }

    /// `matrix · solution = right`, to ten digits.
    pub(super) fn solve(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), NotPositive> {
        if self.usable && self.iterate(right, solution) {
            return Ok(());
        }
        self.solve_exactly(right, solution)
    }

    /// The same with a factor of this very matrix.
    pub(super) fn solve_exactly(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), NotPositive> {
        self.factorisations += 1;
        self.usable = self.factor.refactor(&self.matrix).is_ok();
        if !self.usable {
            return Err(NotPositive);
        }
        solution.copy_from_slice(right);
        self.factor.solve_in_place(solution);
        self.solutions += 1;
        Ok(())
    }

    /// Conjugate gradients. Returns whether they converged.
    fn iterate(&mut self, right: &[f64], solution: &mut [f64]) -> bool {
        solution.fill(0.0);
        self.residual.copy_from_slice(right);
        let mut size = self.precondition();
        let enough = TOLERANCE * TOLERANCE * size;
        self.direction.copy_from_slice(&self.preconditioned);
        for _ in 0..MOST_STEPS {
            if size <= enough {
                return true;
            }
            self.matrix.multiply(&self.direction, &mut self.applied);
            let curvature = dot(&self.direction, &self.applied);
            if curvature <= 0.0 || !curvature.is_finite() {
                return false;
            }
            let length = size / curvature;
            add_multiple(solution, length, &self.direction);
            add_multiple(&mut self.residual, -length, &self.applied);
            let before = std::mem::replace(&mut size, 0.0);
            size = self.precondition();
            let keep = size / before;
            for (direction, new) in self.direction.iter_mut().zip(&self.preconditioned) {
                *direction = keep * *direction + new;
            }
        }
        size <= enough
    }

    /// Returns the square of the residual's size.
    fn precondition(&mut self) -> f64 {
        self.preconditioned.copy_from_slice(&self.residual);
        self.factor.solve_in_place(&mut self.preconditioned);
        self.solutions += 1;
        dot(&self.residual, &self.preconditioned)
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn add_multiple(sum: &mut [f64], factor: f64, vector: &[f64]) {
    for (sum, part) in sum.iter_mut().zip(vector) {
        *sum += factor * part;
    }
}
