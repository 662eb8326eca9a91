//! Removal of a known eigenvalue.

use nalgebra::{DMatrix, DVector};

/// `matrix` in an orthogonal basis that begins with `eigenvector`, without its first row and column, and the
/// reflection that leads there: the other eigenvalues.
pub(crate) fn deflate(matrix: &DMatrix<f64>, eigenvector: &DVector<f64>) -> (DMatrix<f64>, Reflection) {
    let reflection = Reflection::to_first_axis(eigenvector);
    let mut reduced = matrix.clone();
    reflection.apply_left(&mut reduced);
    reflection.apply_right(&mut reduced);
    (reduced.remove_row(0).remove_column(0), reflection)
}

/// `H = I − 2·n·nᵀ` (Householder).
pub(crate) struct Reflection {
    /// Of length 1, or 0 for the identity.
    normal: DVector<f64>,
}

impl Reflection {
    fn to_first_axis(vector: &DVector<f64>) -> Self {
        let mut normal = vector / vector.norm();
        normal[0] += 1.0f64.copysign(normal[0]);
        let length = normal.norm();
        Self { normal: normal / length }
    }

    fn apply_left(&self, matrix: &mut DMatrix<f64>) {
        let along = matrix.tr_mul(&self.normal);
        matrix.ger(-2.0, &self.normal, &along, 1.0);
    }

    fn apply_right(&self, matrix: &mut DMatrix<f64>) {
        let along = &*matrix * &self.normal;
        matrix.ger(-2.0, &along, &self.normal, 1.0);
    }

    /// A vector in the new basis, without its first element.
    pub(crate) fn deflate_vector(&self, vector: &DVector<f64>) -> DVector<f64> {
        let reflected = vector - &self.normal * (2.0 * self.normal.dot(vector));
        reflected.remove_row(0)
    }
}
