//! The rotation that is nearest to a deformation.

use glam::{DMat3, DQuat, DVec3};

/// Deformations with less volume than this part of what their length would allow are not inverted to find their rotation.
const FLAT: f64 = 1e-3;

/// The proper rotation `R` for which `|F − R|` is least. Of inverted and flattened deformations too: then `RᵀF` has a
/// negative or vanishing eigenvalue, and forces push the element back (as in invertible finite elements, Irving, Teran &
/// Fedkiw 2004). Of no deformation at all (`F = 0`) any rotation is nearest.
pub(super) fn nearest_rotation(deformation: DMat3) -> DMat3 {
    let length = (norm_squared(deformation) / 3.0).sqrt();
    if deformation.determinant() > FLAT * length.powi(3) {
        polar_rotation(deformation)
    } else {
        rotation_by_quaternions(deformation)
    }
}

/// Sum of the squares of all entries.
pub(super) fn norm_squared(matrix: DMat3) -> f64 {
    matrix.x_axis.length_squared() + matrix.y_axis.length_squared() + matrix.z_axis.length_squared()
}

/// Newton's iteration `R ← (R + R⁻ᵀ)/2` (Higham 1986). It converges quadratically where the determinant is positive.
fn polar_rotation(deformation: DMat3) -> DMat3 {
    let mut rotation = deformation;
    for _ in 0..30 {
        let [a, b, c] = [rotation.x_axis, rotation.y_axis, rotation.z_axis];
        let cofactors = DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b));
        let next = 0.5 * (rotation + cofactors * (1.0 / a.dot(cofactors.x_axis)));
        let change = norm_squared(next - rotation);
        rotation = next;
        if change < 1e-16 {
            break;
        }
    }
    rotation
}

/// The quaternion that is the eigenvector of the largest eigenvalue of Horn's matrix (1987): it makes `tr(RᵀF)` largest,
/// whatever `F`.
fn rotation_by_quaternions(f: DMat3) -> DMat3 {
    let [a, b, c] = f.transpose().to_cols_array_2d();
    let (xx, xy, xz, yx, yy, yz, zx, zy, zz) = (a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]);
    #[rustfmt::skip]
    let horn = nalgebra::Matrix4::new(
        xx + yy + zz, zy - yz, xz - zx, yx - xy,
        zy - yz, xx - yy - zz, xy + yx, xz + zx,
        xz - zx, xy + yx, yy - xx - zz, yz + zy,
        yx - xy, xz + zx, yz + zy, zz - xx - yy,
    );
    let eigen = horn.symmetric_eigen();
    let q = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    DMat3::from_quat(DQuat::from_xyzw(q[1], q[2], q[3], q[0]).normalize())
}

/// Eigenvalues and eigenvectors of a symmetric matrix, by Jacobi's rotations.
pub(super) fn symmetric_eigen(matrix: DMat3) -> (DVec3, DMat3) {
    let mut rows = matrix.to_cols_array_2d();
    let mut vectors = DMat3::IDENTITY.to_cols_array_2d();
    let size = norm_squared(matrix);
    for _ in 0..12 {
        let beside = rows[0][1].powi(2) + rows[0][2].powi(2) + rows[1][2].powi(2);
        if beside <= 1e-32 * size {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut rows, &mut vectors, p, q);
        }
    }
    (DVec3::new(rows[0][0], rows[1][1], rows[2][2]), DMat3::from_cols_array_2d(&vectors))
}

/// One of Jacobi's rotations: entry (p, q) vanishes. The eigenvectors are the columns, which are kept one after the other.
fn rotate(rows: &mut [[f64; 3]; 3], vectors: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if rows[p][q] == 0.0 {
        return;
    }
    let half = 0.5 * (rows[q][q] - rows[p][p]) / rows[p][q];
    let tangent = half.signum() / (half.abs() + half.hypot(1.0));
    let cosine = 1.0 / tangent.hypot(1.0);
    let sine = tangent * cosine;
    for row in rows.iter_mut() {
        let (at_p, at_q) = (row[p], row[q]);
        (row[p], row[q]) = (cosine * at_p - sine * at_q, sine * at_p + cosine * at_q);
    }
    for k in 0..3 {
        let (at_p, at_q) = (rows[p][k], rows[q][k]);
        (rows[p][k], rows[q][k]) = (cosine * at_p - sine * at_q, sine * at_p + cosine * at_q);
        let (of_p, of_q) = (vectors[p][k], vectors[q][k]);
        (vectors[p][k], vectors[q][k]) = (cosine * of_p - sine * of_q, sine * of_p + cosine * of_q);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn matrix() -> impl Strategy<Value = DMat3> {
        prop::array::uniform9(-2.0..2.0_f64).prop_map(|entries| DMat3::from_cols_array(&entries))
    }

    proptest! {
        #[test]
        fn no_rotation_is_nearer(f in matrix(), axis in prop::array::uniform3(-1.0..1.0_f64), angle in 1e-3..3.0_f64) {
            let r = nearest_rotation(f);
            prop_assert!(norm_squared(r.transpose() * r - DMat3::IDENTITY) < 1e-24);
            prop_assert!((r.determinant() - 1.0).abs() < 1e-12);
            let stretch = r.transpose() * f;
            prop_assert!(norm_squared(stretch - stretch.transpose()) < 1e-20);
            let axis = DVec3::from_array(axis).try_normalize().unwrap_or(DVec3::X);
            let other = r * DMat3::from_axis_angle(axis, angle);
            prop_assert!(norm_squared(f - r) <= norm_squared(f - other) + 1e-12);
        }

        #[test]
        fn eigenvectors_are_those_of_the_matrix(a in matrix()) {
            let symmetric = a + a.transpose();
            let (values, vectors) = symmetric_eigen(symmetric);
            let rebuilt = vectors * DMat3::from_diagonal(values) * vectors.transpose();
            prop_assert!(norm_squared(rebuilt - symmetric) < 1e-24);
            prop_assert!(norm_squared(vectors.transpose() * vectors - DMat3::IDENTITY) < 1e-24);
        }
    }

    #[test]
    fn flat_and_vanishing_deformations_have_a_rotation() {
        let flat = DMat3::from_diagonal(DVec3::new(1.0, 2.0, 0.0));
        let of_vanishing = nearest_rotation(DMat3::ZERO);
        assert!(norm_squared(nearest_rotation(flat) - DMat3::IDENTITY) < 1e-24);
        assert!((of_vanishing.determinant() - 1.0).abs() < 1e-12);
    }
}
