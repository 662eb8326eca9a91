//! How stiff a body is where it is touched: K_o of every contact, from the joint compliance of all.
//!
//! K_o of contact i is `1/(λ·c_i)`: `c_i` is the largest eigenvalue of its own compliance `W_ii`, and `λ` that of the joint
//! compliance `W` in units of these, `D^−½·W·D^−½` with `D` made of the `c_i·I`. Gains `K_i = r·K_o,i` then have `K·W` with
//! all eigenvalues at most `r`, as one contact of ratio `r` has, and a finger at a stiff place does not grow soft because
//! another is at a soft one.

use nalgebra::DMatrix;

/// K_o of every contact of a joint compliance (m/N, three rows and columns each), N/m; `None` where the compliance is not
/// finite or a contact gives way in no direction.
#[must_use]
pub fn contact_stiffnesses(compliance: &DMatrix<f64>) -> Option<Vec<f64>> {
    let count = compliance.nrows() / 3;
    let gives_way =
        |contact: usize| (0..3).any(|axis| compliance[(3 * contact + axis, 3 * contact + axis)] > 0.0);
    if !(compliance.iter().all(|entry| entry.is_finite()) && (0..count).all(gives_way)) {
        return None;
    }
    if count == 0 {
        return Some(Vec::new());
    }
    let own =
        |contact: usize| largest_eigenvalue(&compliance.view((3 * contact, 3 * contact), (3, 3)).into());
    let own: Vec<f64> = (0..count).map(own).collect();
    let in_own_units = DMatrix::from_fn(compliance.nrows(), compliance.ncols(), |row, column| {
        compliance[(row, column)] / (own[row / 3] * own[column / 3]).sqrt()
    });
    let joint = largest_eigenvalue(&in_own_units);
    Some(own.iter().map(|own| 1.0 / (joint * own)).collect())
}

/// The largest eigenvalue of the symmetric part of a matrix, at least 0.
#[must_use]
pub fn largest_eigenvalue(matrix: &DMatrix<f64>) -> f64 {
    let symmetric = (matrix + matrix.transpose()) * 0.5;
    symmetric.symmetric_eigenvalues().iter().copied().fold(0.0, f64::max)
}
