//! Gains whose slowest transient dies out fastest, over all stiffnesses that the object may have.

use super::clip::clip;
use super::contacts::{Compliances, worst_spectral_radius};
use super::region::half_planes;
use super::{LocalModel, LocalModelError, SlowLoop, SurfaceHold};

/// Gains for an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The gains, on the object's nominal K_o.
    pub model: LocalModel,
    /// On the nominal K_o, one contact alone.
    pub spectral_radius: f64,
    /// The largest over all compliances that were asked for. Below 1 for any range that numbers can tell from infinite.
    pub worst_spectral_radius: f64,
}

/// The gains K_h ≥ 0, INT > 0 with the least worst spectral radius over all objects of K_o/λ, λ in `range`.
///
/// Under a zero-order hold this is the global optimum: for a given radius Jury's conditions are straight lines in
/// (K_h, INT), so that the gains which keep it on both ends of the range (which are the worst,
/// [`worst_spectral_radius`]) form a convex polygon; the radius at which it becomes empty is found by bisection. Under a
/// first-order hold the same objective is searched on a grid that closes in on its eight best points.
///
/// For a single known stiffness under a zero-order hold the answer is deadbeat (INT = K_o, K_h = (1−m)·K_o): the surface
/// arrives after two periods.
///
/// # Errors
/// When K_o or the range is not positive.
pub fn choose(slow_loop: &SlowLoop, ko_n_per_m: f64, range: Compliances) -> Result<Choice, LocalModelError> {
    LocalModel::new(0.0, 0.0, ko_n_per_m)?;
    if !(range.least > 0.0 && range.least <= range.largest && range.largest.is_finite()) {
        let (what, allowed) = ("the least compliance of a range", "above 0 and at most the largest");
        return Err(LocalModelError::Number { what, allowed, found: range.least });
    }
    // In units in which the softest object has K_o = 1.
    let spread = Compliances { least: range.least / range.largest, largest: 1.0 };
    let [h, i] = match slow_loop.hold() {
        SurfaceHold::Zero if spread.least == 1.0 && slow_loop.first_moment() <= 1.0 => {
            [1.0 - slow_loop.first_moment(), 1.0]
        }
        SurfaceHold::Zero => by_bisection(slow_loop, spread),
        SurfaceHold::First => by_search(slow_loop, spread),
    };
    let scale = ko_n_per_m / range.largest;
    let model = LocalModel::new(h * scale, i * scale, ko_n_per_m)?;
    Ok(Choice {
        model,
        spectral_radius: slow_loop.spectral_radius(&model),
        worst_spectral_radius: worst_spectral_radius(slow_loop, &model, range),
    })
}

/// The middle of what is left of the polygon of gains when the radius can fall no more.
fn by_bisection(slow_loop: &SlowLoop, spread: Compliances) -> [f64; 2] {
    const LARGEST: f64 = 8.0;
    let feasible = |radius: f64| {
        let square = vec![[0.0, 0.0], [LARGEST, 0.0], [LARGEST, LARGEST], [0.0, LARGEST]];
        [spread.least, spread.largest]
            .into_iter()
            .flat_map(|compliance| half_planes(slow_loop, compliance, radius))
            .fold(square, |polygon, half_plane| clip(&polygon, half_plane))
    };
    let (mut empty, mut enough) = (0.0, 1.0);
    let mut polygon = feasible(enough);
    for _ in 0..60 {
        let middle = 0.5 * (empty + enough);
        match feasible(middle) {
            left if left.is_empty() => empty = middle,
            left => (enough, polygon) = (middle, left),
        }
    }
    let corners = polygon.len().max(1) as f64;
    polygon.iter().fold([0.0; 2], |sum, corner| [sum[0] + corner[0] / corners, sum[1] + corner[1] / corners])
}

/// A coarse grid, then grids that close in on its best points.
fn by_search(slow_loop: &SlowLoop, spread: Compliances) -> [f64; 2] {
    const COARSE: usize = 48;
    const EXTENT: [f64; 2] = [2.4, 4.8];
    const STARTS: usize = 8;
    let objective = |[h, i]: [f64; 2]| {
        let model = LocalModel { kh_n_per_m: h, int_n_per_m: i, ko_n_per_m: 1.0 };
        worst_spectral_radius(slow_loop, &model, spread)
    };
    let mut grid: Vec<[f64; 2]> = (0..COARSE * COARSE)
        .map(|index| [index % COARSE, index / COARSE + 1])
        .map(|place| [0, 1].map(|axis| EXTENT[axis] * place[axis] as f64 / COARSE as f64))
        .collect();
    grid.sort_by(|&one, &other| objective(one).total_cmp(&objective(other)));
    let step = EXTENT.map(|extent| extent / COARSE as f64);
    let refined = grid.iter().take(STARTS).map(|&start| close_in(&objective, start, step));
    refined.min_by(|&one, &other| objective(one).total_cmp(&objective(other))).unwrap_or([0.0, EXTENT[1]])
}

/// Moves to the best of 7×7 points around, then looks closer.
fn close_in(objective: &impl Fn([f64; 2]) -> f64, start: [f64; 2], step: [f64; 2]) -> [f64; 2] {
    const REACH: i32 = 3;
    let (mut best, mut least, mut step) = (start, objective(start), step);
    for _ in 0..70 {
        let centre = best;
        for place in (-REACH..=REACH).flat_map(|x| (-REACH..=REACH).map(move |y| [x, y])) {
            let point = [0, 1].map(|axis| centre[axis] + f64::from(place[axis]) * step[axis]);
            // INT = 0 would be another loop, without an integral.
            if point[0] >= 0.0 && point[1] > 0.0 && objective(point) < least {
                (best, least) = (point, objective(point));
            }
        }
        if best == centre {
            step = step.map(|step| 0.5 * step);
        }
    }
    best
}
