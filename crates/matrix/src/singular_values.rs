//! Singular value decompositions, by faer: that of nalgebra 0.35 is wrong for some matrices, without a word. One of them is met by
//! the test `stiffness_at_rest_is_that_of_the_slowest_motion` of the analysis.

use faer::{Mat, c64};
use nalgebra::{Complex, DMatrix, DVector};

/// `matrix = U·diag(values)·Vᵀ`; with as many columns in U and V as the matrix has rows or columns, the fewer of the two.
#[derive(Clone, Debug)]
pub struct SingularValues {
    /// Left singular vectors, in columns.
    pub u: DMatrix<f64>,
    /// From the largest on.
    pub values: Vec<f64>,
    /// Right singular vectors, in columns.
    pub v: DMatrix<f64>,
}

impl SingularValues {
    /// Nothing where the iteration does not converge.
    #[must_use]
    pub fn of(matrix: &DMatrix<f64>) -> Option<Self> {
        let dense = Mat::from_fn(matrix.nrows(), matrix.ncols(), |row, column| matrix[(row, column)]);
        let svd = dense.thin_svd().ok()?;
        let own = |of: faer::MatRef<'_, f64>| {
            DMatrix::from_fn(of.nrows(), of.ncols(), |row, column| of[(row, column)])
        };
        let values = (0..matrix.nrows().min(matrix.ncols())).map(|index| svd.S()[index]).collect();
        Some(Self { u: own(svd.U()), values, v: own(svd.V()) })
    }

    /// The largest singular value.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.values.first().copied().unwrap_or(0.0)
    }

    /// The shortest solution of `matrix·x = right`, or what comes nearest to one; singular values up to `negligible` count as 0.
    #[must_use]
    pub fn solve(&self, right: &DVector<f64>, negligible: f64) -> DVector<f64> {
        let mut shares = self.u.tr_mul(right);
        for (share, &value) in shares.iter_mut().zip(&self.values) {
            *share = if value > negligible { *share / value } else { 0.0 };
        }
        &self.v * shares
    }
}

/// The left singular vectors (columns) of a complex matrix, and their singular values from the largest on. Nothing where the
/// iteration does not converge.
#[must_use]
pub fn principal_directions(matrix: &DMatrix<Complex<f64>>) -> Option<(DMatrix<Complex<f64>>, Vec<f64>)> {
    let element = |row, column| {
        let Complex { re, im } = matrix[(row, column)];
        c64::new(re, im)
    };
    let svd = Mat::from_fn(matrix.nrows(), matrix.ncols(), element).thin_svd().ok()?;
    let directions = DMatrix::from_fn(svd.U().nrows(), svd.U().ncols(), |row, column| {
        let c64 { re, im } = svd.U()[(row, column)];
        Complex::new(re, im)
    });
    let values = (0..matrix.nrows().min(matrix.ncols())).map(|index| svd.S()[index].re).collect();
    Some((directions, values))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_solution_is_found() {
        let matrix = DMatrix::from_row_slice(2, 3, &[1.0, 0.0, 1.0, 0.0, 2.0, 0.0]);
        let found = SingularValues::of(&matrix).unwrap();
        let x = found.solve(&DVector::from_row_slice(&[2.0, 4.0]), 1e-12);
        assert!((x - DVector::from_row_slice(&[1.0, 2.0, 1.0])).norm() < 1e-12);
        assert!((found.largest() - 2.0).abs() < 1e-12);
        assert_eq!(SingularValues::of(&DMatrix::zeros(0, 0)).unwrap().largest(), 0.0);
    }

    #[test]
    fn directions_give_the_matrix_times_its_adjoint() {
        let matrix = DMatrix::from_fn(3, 2, |i, j| Complex::new((i + 2 * j) as f64, (i * j) as f64 - 1.0));
        let (directions, values) = principal_directions(&matrix).unwrap();
        let squares = DMatrix::from_diagonal(&DVector::from_iterator(
            2,
            values.iter().map(|value| Complex::new(value * value, 0.0)),
        ));
        let again = &directions * squares * directions.adjoint();
        assert!((again - &matrix * matrix.adjoint()).norm() < 1e-12);
    }
}
