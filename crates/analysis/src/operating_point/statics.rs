//! The forces that hold a body still.

use glam::DVec3;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// A force on a body at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Push {
    /// From the body's centre of mass, world, m.
    pub(super) arm: DVec3,
    /// The line along which it presses, of length 1.
    pub(super) normal: DVec3,
    /// What it is when nothing needs to be balanced, N; changed by [`balance`].
    pub(super) force: DVec3,
    /// How readily its normal part changes, against 1 for a contact whose force nobody sets.
    pub(super) readiness: f64,
}

/// How readily contacts change their force along the surface.
const TANGENTIAL_READINESS: f64 = 0.1;

/// Changes forces so that they and `load` (N, at the centre) are in balance in the directions that are `free` (three
/// forces, three torques), by the least weighted sum of squares; what cannot be balanced stays.
pub(super) fn balance(pushes: &mut [Push], load: DVec3, free: [bool; 6]) {
    const NEGLIGIBLE: f64 = 1e-10;
    let reach = pushes.iter().map(|push| push.arm.length()).fold(0.0, f64::max);
    if pushes.is_empty() {
        return;
    }
    let length = if reach > 0.0 { reach } else { 1.0 };
    let wrench = |arm: DVec3, force: DVec3| {
        let torque = arm.cross(force) / length;
        let all = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
        DVector::from_fn(6, |row, _| if free[row] { all[row] } else { 0.0 })
    };
    let mut missing = wrench(DVec3::ZERO, -load);
    let mut directions = DMatrix::zeros(6, 3 * pushes.len());
    let mut weighted = directions.clone();
    for (index, push) in pushes.iter().enumerate() {
        missing -= wrench(push.arm, push.force);
        for axis in 0..3 {
            let unit = DVec3::AXES[axis];
            let across = push.normal * push.normal[axis];
            let ready = across * push.readiness + (unit - across) * TANGENTIAL_READINESS;
            directions.set_column(3 * index + axis, &wrench(push.arm, unit));
            weighted.set_column(3 * index + axis, &wrench(push.arm, ready));
        }
    }
    // W is symmetric, so G·W is `weighted`.
    let SymmetricEigen { eigenvectors, eigenvalues } =
        SymmetricEigen::new(&weighted * directions.transpose());
    let smallest = eigenvalues.amax() * NEGLIGIBLE;
    let mut shares = eigenvectors.tr_mul(&missing);
    for (share, &eigenvalue) in shares.iter_mut().zip(eigenvalues.iter()) {
        *share = if eigenvalue > smallest { *share / eigenvalue } else { 0.0 };
    }
    let change = weighted.tr_mul(&(eigenvectors * shares));
    for (index, push) in pushes.iter_mut().enumerate() {
        push.force += DVec3::new(change[3 * index], change[3 * index + 1], change[3 * index + 2]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANE: [bool; 6] = [true, true, false, false, false, true];

    fn push(x: f64, y: f64, force_n: f64, readiness: f64) -> Push {
        let normal = DVec3::Y * 1.0f64.copysign(-y);
        Push { arm: DVec3::new(x, y, 0.0), normal, force: normal * force_n, readiness }
    }

    #[test]
    fn what_is_in_balance_stays() {
        let mut pushes = [push(0.02, -0.04, 2.0, 1e-3), push(0.02, 0.04, 2.0, 1e-3)];
        let before = pushes.map(|push| push.force);
        balance(&mut pushes, DVec3::ZERO, PLANE);
        assert!(pushes.iter().zip(before).all(|(push, before)| (push.force - before).length() < 1e-9));
    }

    #[test]
    fn a_lone_finger_touches_without_force() {
        let mut pushes = [push(0.02, -0.04, 2.0, 1e-3)];
        balance(&mut pushes, DVec3::ZERO, PLANE);
        assert!(pushes[0].force.length() < 1e-9);
    }

    #[test]
    fn a_finger_that_stands_its_ground_takes_what_the_other_pushes() {
        let mut pushes = [push(0.0, -0.04, 0.0, 1.0), push(0.0, 0.04, 2.0, 1e-6)];
        balance(&mut pushes, DVec3::ZERO, PLANE);
        assert!((pushes[0].force.y - 2.0).abs() < 1e-5, "{}", pushes[0].force);
    }

    #[test]
    fn friction_carries_a_weight() {
        let mut pushes = [push(0.0, -0.04, 9.0, 1e-3), push(0.0, 0.04, 9.0, 1e-3)];
        balance(&mut pushes, DVec3::new(0.0, 0.0, -4.0), [true; 6]);
        for push in pushes {
            assert!((push.force.z - 2.0).abs() < 1e-9 && (push.force.y.abs() - 9.0).abs() < 1e-9);
        }
    }
}
