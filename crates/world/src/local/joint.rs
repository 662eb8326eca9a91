//! Forces of contacts that share a joint compliance: what the simulation will answer to forces, a period before it does.
//!
//! The frame in use was made with forces `f_frame`. Under other forces `f` the surface would be at `x_a + W·(f − f_frame)`,
//! and every finger is held there by a spring `K_h`:
//!
//! ```text
//! (1/K_h + W)·f = x_h − o − x_a + W·f_frame = −e + W·f_frame
//! ```
//!
//! Contacts that would pull are left out, one after the other, and the rest is solved again.

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_SOFT_CONTACTS;
use glam::DVec3;

const MAX_ROWS: usize = 3 * MAX_SOFT_CONTACTS;

/// One of the contacts that are solved together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointContact {
    /// Its place in W: rows 3·place to 3·place + 2.
    pub place: usize,
    /// Stiffness K_h of the contact's spring, N/m.
    pub stiffness_n_per_m: f64,
    /// Error e, from the finger to where it is held, m.
    pub stretch: DVec3,
    /// Outward unit normal of the surface.
    pub normal: DVec3,
    /// Whether it may pull.
    pub two_sided: bool,
}

/// The forces on the fingers, N, one a contact, in the order given; zero where a contact would pull. `compliance` is W,
/// m/N, row-major, three rows and columns a place; `frame_forces` are those on the body at all of its places, N. `None`
/// where W is not one: of another size, not finite, or not positive.
///
/// No allocation; the work is bounded by [`MAX_SOFT_CONTACTS`] solutions.
#[must_use]
pub fn joint_forces(
    compliance: &[f64],
    frame_forces: &[DVec3],
    contacts: &[JointContact],
) -> Option<ArrayVec<DVec3, MAX_SOFT_CONTACTS>> {
    let width = 3 * frame_forces.len();
    let fits = contacts.len() <= MAX_SOFT_CONTACTS
        && contacts.iter().all(|contact| contact.place < frame_forces.len());
    if !fits || compliance.len() != width * width {
        return None;
    }
    let mut acts: ArrayVec<bool, MAX_SOFT_CONTACTS> = contacts.iter().map(|_| true).collect();
    loop {
        let forces = solve(compliance, frame_forces, contacts, &acts)?;
        let push = |at: usize| forces[at].dot(contacts[at].normal);
        let pulls = (0..contacts.len()).filter(|&at| acts[at] && !contacts[at].two_sided && push(at) < 0.0);
        match pulls.min_by(|&a, &b| push(a).total_cmp(&push(b))) {
            Some(worst) => acts[worst] = false,
            None => return Some(forces),
        }
    }
}

/// The same for the contacts that act.
fn solve(
    compliance: &[f64],
    frame_forces: &[DVec3],
    contacts: &[JointContact],
    acts: &[bool],
) -> Option<ArrayVec<DVec3, MAX_SOFT_CONTACTS>> {
    let width = 3 * frame_forces.len();
    let entry = |row: usize, column: usize| compliance[row * width + column];
    let mut rows = ArrayVec::<(usize, usize), MAX_ROWS>::new();
    for (at, contact) in contacts.iter().enumerate().filter(|(at, _)| acts[*at]) {
        rows.extend((0..3).map(|axis| (at, 3 * contact.place + axis)));
    }
    let count = rows.len();
    let mut matrix = [[0.0; MAX_ROWS]; MAX_ROWS];
    let mut right = [0.0; MAX_ROWS];
    for (i, &(at, row)) in rows.iter().enumerate() {
        for (j, &(_, column)) in rows.iter().enumerate().take(i + 1) {
            matrix[i][j] = 0.5 * (entry(row, column) + entry(column, row));
        }
        matrix[i][i] += 1.0 / contacts[at].stiffness_n_per_m;
        let answered: f64 =
            (0..width).map(|column| entry(row, column) * frame_forces[column / 3][column % 3]).sum();
        right[i] = contacts[at].stretch[row % 3] - answered;
    }
    solve_positive(&mut matrix, &mut right, count)?;
    let mut forces: ArrayVec<DVec3, MAX_SOFT_CONTACTS> = contacts.iter().map(|_| DVec3::ZERO).collect();
    for (i, &(at, row)) in rows.iter().enumerate() {
        forces[at][row % 3] = right[i];
    }
    Some(forces)
}

/// Solves the first `count` rows by Cholesky's decomposition, of which the lower half of `matrix` is read; the answer is in
/// `right`. Not nalgebra's: on stack matrices its sizes are types, and a choice between them for 1 to 16 contacts is no
/// quicker (release build, 1, 4, 8 and 16 contacts, assembly included: 0.22, 0.87, 3.5 and 23 µs here, 0.23, 1.0, 5.4 and 24 µs
/// there); padded to the next of five sizes it takes up to 2.8 times as long.
fn solve_positive(
    matrix: &mut [[f64; MAX_ROWS]; MAX_ROWS],
    right: &mut [f64; MAX_ROWS],
    count: usize,
) -> Option<()> {
    for i in 0..count {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| matrix[i][k] * matrix[j][k]).sum();
            let rest = matrix[i][j] - known;
            if i > j {
                matrix[i][j] = rest / matrix[j][j];
            } else if rest > 0.0 && rest.is_finite() {
                matrix[i][i] = rest.sqrt();
            } else {
                return None;
            }
        }
        let known: f64 = (0..i).map(|k| matrix[i][k] * right[k]).sum();
        right[i] = (right[i] - known) / matrix[i][i];
    }
    for i in (0..count).rev() {
        let known: f64 = (i + 1..count).map(|k| matrix[k][i] * right[k]).sum();
        right[i] = (right[i] - known) / matrix[i][i];
    }
    Some(())
}
