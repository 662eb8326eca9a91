//! Eigenvalues that can be trusted: Osborne's balancing, then Hessenberg form and Francis's double-shift QR, which has a
//! limit on its iterations and says when it meets it.
//!
//! Not by faer (0.24.4): from 75 rows on it deflates early, and sorts diagonal blocks by a size that changes when they are swapped,
//! which for pairs of nearly one absolute value, as delay lines have them, need not end; and an iteration that did not converge is
//! told as success, with zeros.
//!
//! Lifted maps mix metres, metres a second and delay lines; unbalanced, half of the digits are lost. Balancing is the
//! similarity `D⁻¹·A·D` by powers of two (exact in floating point) that makes each row as large as its column
//! (Osborne 1960; Parlett & Reinsch 1969).

mod francis;

use nalgebra::{Complex, DMatrix};

use francis::Beside;

/// Why a matrix has no eigenvalues here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EigenvalueError {
    /// Not square.
    #[error("eigenvalues need a square matrix; found {0}×{1}")]
    NotSquare(usize, usize),
    /// NaN or infinity.
    #[error("eigenvalues need finite numbers; row {0}, column {1} is not")]
    NotFinite(usize, usize),
    /// The iteration ran into its limit, in each of the ways that are tried.
    #[error("the eigenvalues of this {0}×{0} matrix were not found within the limit of iterations")]
    NoConvergence(usize),
}

/// Largest elements with which products of a few elements neither overflow nor vanish.
const PRODUCTS_ARE_SAFE: std::ops::Range<f64> = 1e-60..1e60;

/// All eigenvalues, in no particular order. Real eigenvalues have an imaginary part of exactly zero.
///
/// # Errors
/// When the matrix is not square or not finite, or the iteration does not converge.
pub fn eigenvalues(matrix: &DMatrix<f64>) -> Result<Vec<Complex<f64>>, EigenvalueError> {
    check(matrix)?;
    let mut balanced = matrix.clone();
    balance(&mut balanced);
    of_balanced(&balanced)
}

/// The largest absolute value among eigenvalues; 0 for none.
#[must_use]
pub fn spectral_radius(eigenvalues: &[Complex<f64>]) -> f64 {
    eigenvalues.iter().map(|value| value.norm()).fold(0.0, f64::max)
}

/// Scales `matrix` to `D⁻¹·A·D` with powers of two; gives the diagonal of `D`.
///
/// A row or a column without off-diagonal elements is left alone: no scale would balance it.
pub fn balance(matrix: &mut DMatrix<f64>) -> Vec<f64> {
    const SWEEPS: usize = 100;
    let mut scales = vec![1.0; matrix.nrows()];
    for _ in 0..SWEEPS {
        let mut changed = false;
        for (index, scale) in scales.iter_mut().enumerate() {
            if let Some(factor) = balancing_factor(matrix, index) {
                matrix.column_mut(index).scale_mut(factor);
                matrix.row_mut(index).scale_mut(factor.recip());
                *scale *= factor;
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    scales
}

/// The power of two that brings column `index` nearest to its row, where that gains 5 % or more.
fn balancing_factor(matrix: &DMatrix<f64>, index: usize) -> Option<f64> {
    const LARGEST: f64 = 1e150;
    let size = matrix.nrows();
    let (mut column, mut row) = (0.0, 0.0);
    let in_column = &matrix.as_slice()[index * size..][..size];
    let columns = matrix.as_slice().chunks_exact(size);
    let mut add = |from: usize, to: usize| {
        for (of_column, of_row) in in_column[from..to].iter().zip(columns.clone().skip(from)) {
            column += of_column.abs();
            row += of_row[index].abs();
        }
    };
    add(0, index);
    add(index + 1, size);
    if column == 0.0 || row == 0.0 || !(column + row).is_finite() {
        return None;
    }
    let factor = power_of_two(row / column).clamp(LARGEST.recip(), LARGEST);
    (column * factor + row / factor < 0.95 * (column + row)).then_some(factor)
}

/// The power of two nearest to the square root of `ratio`, in the logarithm.
fn power_of_two(ratio: f64) -> f64 {
    if (4096f64.recip()..4096.0).contains(&ratio) {
        // The usual case, without logarithms.
        let (mut power, mut rest) = (1.0, ratio);
        while rest >= 2.0 {
            (power, rest) = (power * 2.0, rest / 4.0);
        }
        while rest <= 0.5 {
            (power, rest) = (power / 2.0, rest * 4.0);
        }
        return power;
    }
    ratio.sqrt().log2().round().exp2()
}

/// Eigenvalues of a finite, square matrix that was balanced before ([`balance`]), in no particular order.
///
/// # Errors
/// When the iteration does not converge, in any of the ways that are tried.
pub fn of_balanced(matrix: &DMatrix<f64>) -> Result<Vec<Complex<f64>>, EigenvalueError> {
    let largest = matrix.amax();
    if largest == 0.0 || PRODUCTS_ARE_SAFE.contains(&largest) {
        return of_middling(matrix);
    }
    // By a power of two, which is exact but where numbers are lost beside the largest anyway.
    let (down, up) = scales(largest);
    let values = of_middling(&(matrix * down[0] * down[1]))?;
    Ok(values.into_iter().map(|value| value * up[0] * up[1]).collect())
}

/// Two powers of two that together bring `largest` near to 1, and their reciprocals: one alone may not be a number.
fn scales(largest: f64) -> ([f64; 2], [f64; 2]) {
    let exponent = largest.log2().round();
    let half = (0.5 * exponent).round();
    let parts = [half, exponent - half];
    (parts.map(|part| (-part).exp2()), parts.map(f64::exp2))
}

/// Of a matrix whose largest element is neither huge nor tiny.
fn of_middling(matrix: &DMatrix<f64>) -> Result<Vec<Complex<f64>>, EigenvalueError> {
    francis::eigenvalues(matrix, Beside::Diagonal)
        .or_else(|| francis::eigenvalues(matrix, Beside::Norm))
        // Another basis is another course of the iteration.
        .or_else(|| francis::eigenvalues(&reflected(matrix), Beside::Norm))
        .ok_or(EigenvalueError::NoConvergence(matrix.nrows()))
}

/// `H·A·H` with a reflection in a plane that is aligned with nothing.
fn reflected(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let size = matrix.nrows();
    let normal =
        nalgebra::DVector::from_fn(size, |i, _| 1.0 + (i as f64 * 0.754_877_666_2).fract()).normalize();
    let reflect = DMatrix::identity(size, size) - &normal * normal.transpose() * 2.0;
    &reflect * matrix * &reflect
}

/// Whether a matrix has eigenvalues.
///
/// # Errors
/// When it is not square or not finite.
pub fn check(matrix: &DMatrix<f64>) -> Result<(), EigenvalueError> {
    let (rows, columns) = matrix.shape();
    if rows != columns {
        return Err(EigenvalueError::NotSquare(rows, columns));
    }
    // Without leaving early, many are asked at once.
    if matrix.as_slice().iter().fold(true, |finite, value| finite & value.is_finite()) {
        return Ok(());
    }
    match matrix.iter().position(|value| !value.is_finite()) {
        Some(place) => Err(EigenvalueError::NotFinite(place % rows, place / rows)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted_norms(matrix: &DMatrix<f64>) -> Vec<f64> {
        let mut norms: Vec<f64> = eigenvalues(matrix).unwrap().iter().map(|value| value.norm()).collect();
        norms.sort_by(f64::total_cmp);
        norms
    }

    #[test]
    fn nilpotent_blocks_are_fine() {
        for size in 1..=40 {
            let shift = DMatrix::from_fn(size, size, |i, j| if i == j + 1 { 1.0 } else { 0.0 });
            assert!(sorted_norms(&shift).iter().all(|&norm| norm < 1e-12), "{size}");
        }
    }

    #[test]
    fn cyclic_shifts_are_fine() {
        for size in (1..=20).chain([33, 64]) {
            let cycle = DMatrix::from_fn(size, size, |i, j| if i == (j + 1) % size { 1.0 } else { 0.0 });
            assert!(sorted_norms(&cycle).iter().all(|norm| (norm - 1.0).abs() < 1e-10), "{size}");
        }
    }

    #[test]
    fn badly_scaled_matrices_keep_their_digits() {
        let good = DMatrix::from_row_slice(3, 3, &[0.5, 0.2, 0.1, 0.3, -0.4, 0.2, 0.1, 0.6, 0.25]);
        let scales = [1e-9, 1.0, 1e9];
        let bad = DMatrix::from_fn(3, 3, |i, j| good[(i, j)] * scales[i] / scales[j]);
        for (a, b) in sorted_norms(&good).iter().zip(sorted_norms(&bad)) {
            assert!((a - b).abs() < 1e-14, "{a} {b}");
        }
    }

    /// Loops whose pattern takes seconds have them: what dies out is 1e-200 by then, what grows 1e200.
    #[test]
    fn tiny_and_huge_matrices_are_as_good_as_others() {
        let mut random = cotouch_testkit::Random::new(7);
        for size in [2, 4, 8, 24, 32] {
            let matrix = DMatrix::from_fn(size, size, |_, _| 2.0 * random.unit() - 1.0);
            let expected = sorted_norms(&matrix);
            for exponent in [-1000, -700, -300, -210, 210, 300, 700, 1000] {
                let scale = f64::from(exponent).exp2();
                let found = sorted_norms(&(&matrix * scale));
                for (found, expected) in found.iter().zip(&expected) {
                    assert!(
                        (found / scale - expected).abs() < 1e-12,
                        "{size} 2^{exponent}: {found} {expected}"
                    );
                }
            }
        }
        let subnormal = DMatrix::from_element(3, 3, f64::from_bits(5));
        assert!((sorted_norms(&subnormal)[2] / f64::from_bits(15) - 1.0).abs() < 0.1);
    }

    #[test]
    fn balancing_is_a_similarity_by_powers_of_two() {
        let matrix = DMatrix::from_fn(5, 5, |i, j| ((i * 7 + j * 3) % 5) as f64 * 10f64.powi(i as i32 * 3));
        let mut balanced = matrix.clone();
        let scales = balance(&mut balanced);
        for i in 0..5 {
            for j in 0..5 {
                assert_eq!(balanced[(i, j)], matrix[(i, j)] * scales[j] / scales[i]);
            }
        }
    }

    #[test]
    fn powers_of_two_are_the_nearest() {
        for exponent in -200..=200 {
            let ratio = (f64::from(exponent) * 0.173).exp2();
            assert_eq!(power_of_two(ratio), ratio.sqrt().log2().round().exp2(), "{ratio}");
        }
    }

    #[test]
    fn what_has_no_eigenvalues_is_refused() {
        assert_eq!(eigenvalues(&DMatrix::zeros(2, 3)), Err(EigenvalueError::NotSquare(2, 3)));
        for bad in [f64::NAN, f64::INFINITY] {
            let mut matrix = DMatrix::zeros(3, 3);
            matrix[(1, 2)] = bad;
            assert_eq!(eigenvalues(&matrix), Err(EigenvalueError::NotFinite(1, 2)));
        }
        assert_eq!(eigenvalues(&DMatrix::zeros(0, 0)), Ok(vec![]));
    }
}
