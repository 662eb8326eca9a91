//! Vectors that a matrix takes to 0.

use nalgebra::{DMatrix, DVector};

use cotouch_matrix::SingularValues;

/// What is as small as this, relative to the largest, is 0 but for rounding.
pub(super) const NEGLIGIBLE: f64 = 1e-10;

/// An orthonormal basis of what a matrix with at least as many rows as columns takes to 0.
pub(super) fn null_space(matrix: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let Some(found) = SingularValues::of(matrix) else { return Vec::new() };
    let small = found.largest() * NEGLIGIBLE;
    let is_small = |&index: &usize| found.values[index] <= small;
    (0..found.values.len()).filter(is_small).map(|index| found.v.column(index).into_owned()).collect()
}
