//! Eigenvectors of eigenvalues that are known.

use faer::linalg::solvers::Solve;
use faer::{Mat, c64};
use nalgebra::{Complex, DMatrix};

/// Orthonormal vectors (columns) of the space that belongs to an eigenvalue which is there `count` times, by inverse iteration
/// next to it. Nothing where the numbers overflow.
#[must_use]
pub fn eigenvectors(
    matrix: &DMatrix<f64>,
    eigenvalue: Complex<f64>,
    count: usize,
) -> Option<DMatrix<Complex<f64>>> {
    const BESIDE: f64 = 1e-9;
    let size = matrix.nrows();
    let shift = eigenvalue * (1.0 + BESIDE) + BESIDE * BESIDE;
    let shifted = Mat::from_fn(size, size, |row, column| {
        let shift = if row == column { c64::new(shift.re, shift.im) } else { c64::new(0.0, 0.0) };
        c64::new(matrix[(row, column)], 0.0) - shift
    });
    let decomposition = shifted.partial_piv_lu();
    // Aligned with nothing.
    let start = |row: usize, column: usize| {
        let place = (row + 1) as f64 * (column + 1) as f64;
        c64::new(1.0 + (place * 0.754_877_666_2).fract(), 0.3 + (place * 0.569_840_290_9).fract())
    };
    let mut vectors = Mat::from_fn(size, count, start);
    for _ in 0..3 {
        decomposition.solve_in_place(&mut vectors);
        if !vectors.norm_l2().is_finite() {
            return None;
        }
        vectors = vectors.qr().compute_thin_Q();
    }
    Some(DMatrix::from_fn(size, count, |row, column| {
        let c64 { re, im } = vectors[(row, column)];
        Complex::new(re, im)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_span_the_space_of_an_eigenvalue() {
        // Rotated by reflections: eigenvalues 0.9 twice, ±0.5i.
        let mut matrix = DMatrix::zeros(4, 4);
        (matrix[(0, 0)], matrix[(1, 1)], matrix[(2, 3)], matrix[(3, 2)]) = (0.9, 0.9, 0.5, -0.5);
        let normal = nalgebra::DVector::from_row_slice(&[1.0, 2.0, -1.0, 0.5]).normalize();
        let reflect = DMatrix::identity(4, 4) - &normal * normal.transpose() * 2.0;
        let matrix = &reflect * matrix * &reflect;
        let complex = matrix.map(|value| Complex::new(value, 0.0));
        for (eigenvalue, count) in [(Complex::new(0.9, 0.0), 2), (Complex::new(0.0, 0.5), 1)] {
            let vectors = eigenvectors(&matrix, eigenvalue, count).unwrap();
            let rest = &complex * &vectors - &vectors * eigenvalue;
            assert!(rest.norm() < 1e-7, "{rest}");
            let products = vectors.adjoint() * &vectors;
            assert!((products - DMatrix::<Complex<f64>>::identity(count, count)).norm() < 1e-12);
        }
    }
}
