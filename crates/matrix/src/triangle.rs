//! Triangular factors.

use faer::Mat;
use nalgebra::DMatrix;

/// R of `matrix = Q·R` with orthonormal columns in Q: upper triangular, with as many rows as the matrix has rows or columns, the
/// fewer of the two.
#[must_use]
pub fn upper_triangle(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let qr = Mat::from_fn(matrix.nrows(), matrix.ncols(), |row, column| matrix[(row, column)]).qr();
    let triangle = qr.thin_R();
    DMatrix::from_fn(triangle.nrows(), triangle.ncols(), |row, column| {
        if column < row { 0.0 } else { triangle[(row, column)] }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_the_products_of_the_columns() {
        for (rows, columns) in [(5, 3), (3, 3), (2, 4)] {
            let matrix = DMatrix::from_fn(rows, columns, |i, j| ((i * 5 + j * 3) % 7) as f64 - 2.5);
            let triangle = upper_triangle(&matrix);
            assert_eq!(triangle.shape(), (rows.min(columns), columns));
            assert!((triangle.tr_mul(&triangle) - matrix.tr_mul(&matrix)).amax() < 1e-12);
        }
    }
}
