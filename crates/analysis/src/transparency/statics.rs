//! What a user feels at rest: Hooke's and Newton's laws, with everything held equal to what is current.

use nalgebra::DVector;

use super::alone::{End, Held};
use crate::balance::Balance;
use cotouch_matrix::SingularValues;

/// Force over displacement, N/m; 0 where nothing resists.
pub(super) fn stiffness(held: &Held) -> f64 {
    /// A balance that holds but for rounding.
    const BALANCED: f64 = 1e-9;
    /// Relative to the largest singular value: nothing that resists.
    const NOTHING: f64 = 1e-14;
    let balance = Balance::new(&held.spec);
    let mut force = DVector::zeros(balance.matrix.nrows());
    for End { body, shares } in &held.pushed {
        for (component, &share) in shares.iter().enumerate() {
            balance.add_force(&held.spec, body.0, component, share, |row, value| force[row] -= value);
        }
    }
    // Rows of plants are accelerations: all rows are brought to one size.
    let mut matrix = balance.matrix;
    for row in 0..matrix.nrows() {
        let size = matrix.row(row).amax();
        if size > 0.0 {
            matrix.row_mut(row).unscale_mut(size);
            force[row] /= size;
        }
    }
    let Some(found) = SingularValues::of(&matrix) else { return 0.0 };
    let state = found.solve(&force, found.largest() * NOTHING);
    if (&matrix * &state - &force).norm() > BALANCED * force.norm() {
        return 0.0;
    }
    let answer = held.answer(0).into_iter();
    let displacement: f64 =
        answer.map(|(body, number, factor)| state[balance.first[body.0] + number] * factor).sum();
    if displacement == 0.0 { 0.0 } else { displacement.recip() }
}
