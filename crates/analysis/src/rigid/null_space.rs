//! Vectors that a matrix takes to 0.

use nalgebra::{DMatrix, DVector};

/// What is as small as this, relative to the largest, is 0 but for rounding.
pub(super) const NEGLIGIBLE: f64 = 1e-10;

/// An orthonormal basis of what a matrix with at least as many rows as columns takes to 0.
pub(super) fn null_space(matrix: DMatrix<f64>) -> Vec<DVector<f64>> {
    let decomposition = matrix.svd(false, true);
    let small = decomposition.singular_values.amax() * NEGLIGIBLE;
    let Some(right) = decomposition.v_t else { return Vec::new() };
    let is_small = |&index: &usize| decomposition.singular_values[index] <= small;
    (0..right.nrows()).filter(is_small).map(|index| right.row(index).transpose()).collect()
}
