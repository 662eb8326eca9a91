//! Gains whose slowest transient dies out fastest, over all stiffnesses that the object may have.

use cotouch_scene::scene::SurfaceHold;

use super::clip::clip;
use super::contacts::{Compliances, worst_spectral_radius};
use super::error::LocalModelError;
use super::gains::PiLocalModel;
use super::region::{half_planes, where_all_positive};
use super::simulation_loop::SimulationLoop;

/// Gains for an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChosenGains {
    /// The gains, on the object's nominal K_o.
    pub model: PiLocalModel,
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
/// first-order hold the K_h that keep a radius at a given INT are intervals in closed form, the least radius at that INT
/// is found by bisection, and INT by a grid and golden sections.
///
/// For a single known stiffness under a zero-order hold the answer is deadbeat (INT = K_o, K_h = (1−m)·K_o): the surface
/// arrives after two periods.
///
/// # Errors
/// When K_o or the range is not positive.
pub fn choose(
    slow_loop: &SimulationLoop,
    ko_n_per_m: f64,
    range: Compliances,
) -> Result<ChosenGains, LocalModelError> {
    PiLocalModel::new(0.0, 0.0, ko_n_per_m)?;
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
    // What rounding leaves of a gain that is not wanted.
    let [h, i] = [h, i].map(|gain| if gain < 1e-12 { 0.0 } else { gain });
    let scale = ko_n_per_m / range.largest;
    let model = PiLocalModel::new(h * scale, i * scale, ko_n_per_m)?;
    Ok(ChosenGains {
        model,
        spectral_radius: slow_loop.spectral_radius(&model),
        worst_spectral_radius: worst_spectral_radius(slow_loop, &model, range),
    })
}

/// The middle of what is left of the polygon of gains when the radius can fall no more.
fn by_bisection(slow_loop: &SimulationLoop, spread: Compliances) -> [f64; 2] {
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

/// INT by search; for each the least radius that some K_h keeps, by bisection, the K_h that keep one in closed form.
fn by_search(slow_loop: &SimulationLoop, spread: Compliances) -> [f64; 2] {
    const COARSE: u32 = 80;
    const LARGEST: f64 = 5.0;
    let radius = |i: f64| least_radius(slow_loop, spread, i).0;
    let place = |index: f64| LARGEST * index / f64::from(COARSE);
    let mut grid: Vec<(f64, f64)> =
        (1..=COARSE).map(|index| (radius(place(f64::from(index))), f64::from(index))).collect();
    grid.sort_by(|one, other| one.0.total_cmp(&other.0));
    let refined = grid.iter().take(3).map(|&(_, index)| {
        // INT = 0 would be another loop, without an integral.
        golden_section(&radius, place((index - 1.0).max(1e-3)), place(index + 1.0))
    });
    let best = refined.min_by(|&one, &other| radius(one).total_cmp(&radius(other))).unwrap_or(LARGEST);
    [least_radius(slow_loop, spread, best).1, best]
}

/// The least radius with this INT (in units of the softest object's stiffness), and the K_h that reaches it. Where not
/// even the unit circle can be kept, 1 and 0.
fn least_radius(slow_loop: &SimulationLoop, spread: Compliances, i: f64) -> (f64, f64) {
    let feasible = |radius: f64| {
        let conditions = |h: f64| {
            let on = |compliance| {
                slow_loop.characteristic(&PiLocalModel::normalised(h * compliance, i * compliance))
            };
            let mut conditions = on(spread.least).jury(radius);
            conditions.extend(on(spread.largest).jury(radius));
            conditions
        };
        let widest = |one: &(f64, f64), other: &(f64, f64)| (one.1 - one.0).total_cmp(&(other.1 - other.0));
        where_all_positive(conditions).into_iter().max_by(widest).map(|(from, to)| 0.5 * (from + to))
    };
    let Some(mut kh) = feasible(1.0) else { return (1.0, 0.0) };
    let (mut none, mut some) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = 0.5 * (none + some);
        match feasible(middle) {
            None => none = middle,
            Some(found) => (some, kh) = (middle, found),
        }
    }
    (some, kh)
}

/// The minimum of a function that falls and then rises.
fn golden_section(function: &impl Fn(f64) -> f64, mut from: f64, mut to: f64) -> f64 {
    const SHARE: f64 = 0.618_033_988_749_894_9;
    let inner = |from: f64, to: f64| [to - SHARE * (to - from), from + SHARE * (to - from)];
    for _ in 0..45 {
        let [one, other] = inner(from, to);
        if function(one) < function(other) {
            to = other;
        } else {
            from = one;
        }
    }
    0.5 * (from + to)
}
