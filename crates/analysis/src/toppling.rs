//! Poles of the mechanics themselves: what topples, buckles or slips away even between perfect devices without a network.
//!
//! A body that is squeezed between fingers, or that stands on one, can be in an equilibrium that is not stable: the forces that
//! press on it stay in the world's directions while it turns beneath them. That is a property of statics, of a stiffness matrix
//! with a direction in which it pushes away (Lagrange–Dirichlet; Howard & Kumar 1996 for grasps), and no choice of rates, delays
//! or dampers changes it. The motion leaves the contact mode, and another mode says what follows. So such poles are told apart
//! from a spectral radius that tells of the loop.
//!
//! With everything held equal to what is current and without dampers, accelerations are `q̈ = S·q`. Each real, positive
//! eigenvalue σ of `S` is an unstable direction of the statics, in which a motion grows at most as e^(√σ·t): dampers slow it.
//! A real pole above 1 of the sampled loop that grows no faster than such a direction belongs to it; what grows faster, and
//! whatever oscillates, is the loop's doing.

use nalgebra::{Complex, DMatrix};

use crate::balance::Balance;
use crate::discretise::per_inertia;
use crate::loop_spec::{Dynamics, LoopBody, LoopSpec, Plant};
use crate::verdict::NEUTRAL;
use cotouch_matrix::eigenvalues;

/// What is left of an eigenvalue of S that is 0 but for rounding, relative to the largest.
const ROUNDING: f64 = 1e-10;
/// Held data change how fast something topples: by so much it may be faster than its statics without dampers.
const FASTER_BY_HELD_DATA: f64 = 1.1;

/// Takes the poles of the mechanics out of a loop's eigenvalues; gives how fast they grow, 1/s, the fastest first.
pub(crate) fn take_out(spec: &LoopSpec, poles: &mut Vec<Complex<f64>>) -> Vec<f64> {
    let grows = |pole: &Complex<f64>| pole.im == 0.0 && pole.re > 1.0 + NEUTRAL;
    if !poles.iter().any(grows) {
        return Vec::new();
    }
    let mut directions = unstable_directions(spec);
    let mut growing: Vec<f64> = poles.iter().filter(|pole| grows(pole)).map(|pole| pole.re).collect();
    growing.sort_by(|one, other| other.total_cmp(one));
    let mut rates = Vec::new();
    for pole in growing {
        let rate = pole.ln() / spec.pattern_s();
        let explains = |direction: &f64| rate <= FASTER_BY_HELD_DATA * direction;
        // The slowest direction that explains it leaves the faster ones to faster poles; those come first here.
        if let Some(direction) = directions.iter().rposition(explains) {
            directions.remove(direction);
            rates.push(rate);
            if let Some(index) = poles.iter().position(|&other| other == Complex::from(pole)) {
                poles.remove(index);
            }
        }
    }
    rates
}

/// √σ of the directions in which a loop's statics push away, 1/s, the fastest first. None where the loop has blocks or plants
/// that are no masses on springs: there is no telling.
fn unstable_directions(spec: &LoopSpec) -> Vec<f64> {
    let Some(accelerations) = accelerations(spec) else { return Vec::new() };
    let Ok(squares) = eigenvalues(&accelerations) else { return Vec::new() };
    let largest = squares.iter().map(|square| square.norm()).fold(0.0, f64::max);
    let pushes_away = |square: &&Complex<f64>| square.im == 0.0 && square.re > ROUNDING * largest;
    let mut rates: Vec<f64> = squares.iter().filter(pushes_away).map(|square| square.re.sqrt()).collect();
    rates.sort_by(|one, other| other.total_cmp(one));
    rates
}

/// S: accelerations (m/s², rad/s²) per displacement (m, rad), of all degrees of freedom.
fn accelerations(spec: &LoopSpec) -> Option<DMatrix<f64>> {
    if !spec.blocks.is_empty() {
        return None;
    }
    let balance = Balance::new(spec);
    let degrees = spec.bodies.iter().map(|body| body.axes.len());
    let places: Vec<usize> =
        balance.first.iter().zip(degrees).flat_map(|(&first, d)| first..first + d).collect();
    let per_displacement = balance.matrix.select_columns(&places);
    let mut accelerations = DMatrix::zeros(places.len(), places.len());
    let mut row = 0;
    for (body, &first) in spec.bodies.iter().zip(&balance.first) {
        let degrees = body.axes.len();
        let of_body = of_body(body, &per_displacement, first)?;
        accelerations.rows_mut(row, degrees).copy_from(&of_body);
        row += degrees;
    }
    Some(accelerations)
}

/// The accelerations of one body, from the laws of rest, of which the body's begin with row `first`.
fn of_body(body: &LoopBody, per_displacement: &DMatrix<f64>, first: usize) -> Option<DMatrix<f64>> {
    let degrees = body.axes.len();
    let rows = |from: usize| per_displacement.rows(from, degrees);
    match &body.dynamics {
        Dynamics::Plant(plant) | Dynamics::Sensed { plant, .. } => {
            is_of_masses(plant, degrees).then(|| rows(first + degrees).into_owned())
        }
        Dynamics::Mass { mass_kg, .. } => Some(rows(first) / *mass_kg),
        Dynamics::Rigid { .. } => Some(per_inertia(body) * rows(first)),
    }
}

/// Whether a plant's states are positions, then the velocities that are their derivatives.
fn is_of_masses(plant: &Plant, degrees: usize) -> bool {
    let size = 2 * degrees;
    plant.a.shape() == (size, size)
        && plant.c == DMatrix::identity(size, size)
        && plant.a.view((0, 0), (degrees, degrees)).iter().all(|&value| value == 0.0)
        && plant.a.view((0, degrees), (degrees, degrees)) == DMatrix::identity(degrees, degrees)
        && plant.b.rows(0, degrees).iter().all(|&value| value == 0.0)
}

#[cfg(test)]
mod tests;
