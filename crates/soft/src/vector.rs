//! Vectors over the free coordinates.

/// The scalar product of two vectors of equal length.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `sum += factor · vector`.
pub(crate) fn add_multiple(sum: &mut [f64], factor: f64, vector: &[f64]) {
    for (sum, part) in sum.iter_mut().zip(vector) {
        *sum += factor * part;
    }
}
