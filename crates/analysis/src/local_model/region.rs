//! The stability area in (K_h, INT), and the volume over K_o (Figs 10 and 11).

use cotouch_scene::scene::SurfaceHold;

use super::clip::{HalfPlane, area, clip};
use super::gains::PiLocalModel;
use super::polynomial::Polynomial;
use super::simulation_loop::SimulationLoop;

/// The gains for which the slow loop is stable, K_h ≥ 0 and INT ≥ 0, on one object. On the side INT = 0, where the loop
/// has no integral, it is P's range.
#[derive(Clone, Debug, PartialEq)]
pub struct StableGains {
    /// Corners `[K_h, INT]` in N/m, in order, closed by itself. Straight sides under a zero-order hold; under a
    /// first-order hold points on the curved boundary.
    pub boundary: Vec<[f64; 2]>,
}

/// Gains are looked for up to this many times K_o.
const LARGEST: f64 = 64.0;
/// Values of INT at which a curved boundary is computed.
const ROWS: usize = 400;

impl StableGains {
    /// On an object of K_o N/m (above 0).
    #[must_use]
    pub fn new(slow_loop: &SimulationLoop, ko_n_per_m: f64) -> Self {
        let normalised = match slow_loop.hold() {
            SurfaceHold::Zero => polygon(slow_loop),
            SurfaceHold::First => row_by_row(slow_loop),
        };
        Self { boundary: normalised.into_iter().map(|corner| corner.map(|gain| gain * ko_n_per_m)).collect() }
    }

    /// (N/m)².
    #[must_use]
    pub fn area(&self) -> f64 {
        area(&self.boundary)
    }

    /// Of the volume of Fig 11 from K_o = 0 up to the `ko_n_per_m` that the area belongs to, (N/m)³: the area grows with
    /// K_o squared.
    #[must_use]
    pub fn volume_below(&self, ko_n_per_m: f64) -> f64 {
        self.area() * ko_n_per_m / 3.0
    }
}

/// The intervals of K_h ≥ 0 for which the slow loop is stable at this INT, N/m, in closed form: Jury's conditions are
/// polynomials of K_h of degree 1 or 2. Gains are looked for up to 64·K_o.
#[must_use]
pub fn stable_kh(slow_loop: &SimulationLoop, int_n_per_m: f64, ko_n_per_m: f64) -> Vec<(f64, f64)> {
    let i = int_n_per_m / ko_n_per_m;
    in_newtons_per_metre(intervals(slow_loop, |h| PiLocalModel::normalised(h, i)), ko_n_per_m)
}

/// The intervals of INT > 0 for which the slow loop is stable at this K_h, N/m, likewise.
#[must_use]
pub fn stable_int(slow_loop: &SimulationLoop, kh_n_per_m: f64, ko_n_per_m: f64) -> Vec<(f64, f64)> {
    let h = kh_n_per_m / ko_n_per_m;
    in_newtons_per_metre(intervals(slow_loop, |i| PiLocalModel::normalised(h, i)), ko_n_per_m)
}

fn in_newtons_per_metre(relative: Vec<(f64, f64)>, ko_n_per_m: f64) -> Vec<(f64, f64)> {
    relative.into_iter().map(|(from, to)| (from * ko_n_per_m, to * ko_n_per_m)).collect()
}

/// Where the loop is stable as one gain grows from 0, in units of K_o.
fn intervals(slow_loop: &SimulationLoop, model: impl Fn(f64) -> PiLocalModel) -> Vec<(f64, f64)> {
    where_all_positive(|gain| slow_loop.characteristic(&model(gain)).jury(1.0))
}

/// The intervals of 0..64 on which all conditions, each a polynomial of degree 1 or 2, are above 0.
pub(super) fn where_all_positive(conditions: impl Fn(f64) -> Vec<f64>) -> Vec<(f64, f64)> {
    let mut ends = vec![0.0, LARGEST];
    // Not at 0, where there may be no integral.
    for ((f1, f2), f3) in conditions(1.0).into_iter().zip(conditions(2.0)).zip(conditions(3.0)) {
        let a = 0.5 * (f1 - 2.0 * f2 + f3);
        let b = f2 - f1 - 3.0 * a;
        ends.extend(roots(a, b, f1 - a - b).into_iter().filter(|root| (0.0..LARGEST).contains(root)));
    }
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    let mut found: Vec<(f64, f64)> = Vec::new();
    for (from, to) in ends.iter().zip(&ends[1..]).map(|(&from, &to)| (from, to)) {
        if conditions(0.5 * (from + to)).into_iter().all(|margin| margin > 0.0) {
            match found.last_mut() {
                // A condition that is only touched does not cut an interval in two.
                Some(last) if last.1 == from => last.1 = to,
                _ => found.push((from, to)),
            }
        }
    }
    found
}

/// Real roots of `a·x² + b·x + c`, coefficients of the size of 1.
fn roots(a: f64, b: f64, c: f64) -> Vec<f64> {
    const ROUNDING: f64 = 1e-13;
    if a.abs() < ROUNDING * (b.abs() + c.abs()).max(1.0) {
        return if b == 0.0 { Vec::new() } else { vec![-c / b] };
    }
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return Vec::new();
    }
    let far = -0.5 * (b + discriminant.sqrt().copysign(b));
    if far == 0.0 { vec![0.0] } else { vec![far / a, c / far] }
}

/// Under a zero-order hold Jury's conditions are straight lines.
fn polygon(slow_loop: &SimulationLoop) -> Vec<[f64; 2]> {
    let square = vec![[0.0, 0.0], [LARGEST, 0.0], [LARGEST, LARGEST], [0.0, LARGEST]];
    half_planes(slow_loop, 1.0, 1.0)
        .into_iter()
        .fold(square, |polygon, half_plane| clip(&polygon, half_plane))
}

/// Jury's conditions on `[K_h, INT]` (in units of K_o) under a zero-order hold, for all eigenvalues to lie inside
/// `radius` on an object that gives way `compliance` times as much.
pub(super) fn half_planes(slow_loop: &SimulationLoop, compliance: f64, radius: f64) -> Vec<HalfPlane> {
    let m = slow_loop.first_moment();
    let conditions = |h: f64, i: f64| {
        let (h, i) = (h * compliance, i * compliance);
        let g = h + m * i;
        Polynomial::monic(&[i - g, g - 1.0]).jury(radius)
    };
    (0..conditions(0.0, 0.0).len())
        .map(|index| HalfPlane::where_not_negative(|h, i| conditions(h, i)[index]))
        .collect()
}

/// Under a first-order hold the boundary is curved; its points are exact, in closed form.
fn row_by_row(slow_loop: &SimulationLoop) -> Vec<[f64; 2]> {
    let widest = |i: f64| {
        intervals(slow_loop, |h| PiLocalModel::normalised(h, i))
            .into_iter()
            .max_by(|one, other| (one.1 - one.0).total_cmp(&(other.1 - other.0)))
    };
    let top = top(&widest);
    let rows: Vec<_> = (0..=ROWS)
        // Closer together towards the top, where the boundary may turn.
        .map(|row| top * (0.5 * std::f64::consts::PI * row as f64 / ROWS as f64).sin())
        .filter_map(|i| widest(i).map(|(from, to)| (i, from, to)))
        .collect();
    let right = rows.iter().map(|&(i, _, to)| [to, i]);
    let left = rows.iter().rev().map(|&(i, from, _)| [from, i]);
    let mut boundary: Vec<_> = right.chain(left).collect();
    boundary.dedup();
    boundary
}

/// The largest INT at which some K_h is stable, from below.
fn top(widest: &impl Fn(f64) -> Option<(f64, f64)>) -> f64 {
    const STEPS: usize = 1024;
    let value = |step: usize| LARGEST * step as f64 / STEPS as f64;
    let last = (0..=STEPS).rev().find(|&step| widest(value(step)).is_some()).unwrap_or(0);
    let (mut some, mut none) = (value(last), value(last + 1));
    for _ in 0..60 {
        let middle = 0.5 * (some + none);
        if widest(middle).is_some() {
            some = middle;
        } else {
            none = middle;
        }
    }
    some
}
