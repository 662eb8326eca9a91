//! Singular value decompositions, by faer: that of nalgebra 0.35 is wrong for some matrices, without a word. One of them is met by
//! the test `stiffness_at_rest_is_that_of_the_slowest_motion`.

use faer::Mat;
use nalgebra::{DMatrix, DVector};

/// `matrix = U·diag(values)·Vᵀ`; with as many columns in U and V as the matrix has rows or columns, the fewer of the two.
pub(crate) struct SingularValues {
    pub(crate) u: DMatrix<f64>,
    /// From the largest on.
    pub(crate) values: Vec<f64>,
    pub(crate) v: DMatrix<f64>,
}

impl SingularValues {
    /// Nothing where the iteration does not converge.
    pub(crate) fn of(matrix: &DMatrix<f64>) -> Option<Self> {
        let dense = Mat::from_fn(matrix.nrows(), matrix.ncols(), |row, column| matrix[(row, column)]);
        let svd = dense.thin_svd().ok()?;
        let own = |of: faer::MatRef<'_, f64>| {
            DMatrix::from_fn(of.nrows(), of.ncols(), |row, column| of[(row, column)])
        };
        let values = (0..matrix.nrows().min(matrix.ncols())).map(|index| svd.S()[index]).collect();
        Some(Self { u: own(svd.U()), values, v: own(svd.V()) })
    }

    /// The largest singular value.
    pub(crate) fn largest(&self) -> f64 {
        self.values.first().copied().unwrap_or(0.0)
    }

    /// The shortest solution of `matrix·x = right`, or what comes nearest to one; singular values up to `negligible` count as 0.
    pub(crate) fn solve(&self, right: &DVector<f64>, negligible: f64) -> DVector<f64> {
        let mut shares = self.u.tr_mul(right);
        for (share, &value) in shares.iter_mut().zip(&self.values) {
            *share = if value > negligible { *share / value } else { 0.0 };
        }
        &self.v * shares
    }
}
