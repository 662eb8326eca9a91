//! Stability maps: where in the plane of two keys a scene is stable.
//!
//! The verdict at every point of the map is that of the analysis at this point. Without the radii, most points get
//! theirs from their surroundings where these leave no room for another one (`adaptive`); tests hold such maps to
//! those in which every point was analysed. Where neighbours differ, the crossing between them is computed, and the
//! crossings are joined to curves.

mod adaptive;
mod axis;
mod contours;
mod empty;
mod plane;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use cotouch_scene::Scene;
use rayon::prelude::*;
use serde::Serialize;

use crate::crossing::crossing;
use crate::evaluator::Evaluator;
use crate::sweep::{Sweep, SweepError};
use axis::SweptAxis;
use contours::{Edge, Verdicts};
use plane::{Plane, Point};

/// Serialises to the document of `cotouch analyze stability --sweep …`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StabilityMap {
    /// Along a row.
    pub x: Sweep,
    /// From row to row; `None` for a single row.
    pub y: Option<Sweep>,
    /// A row for each value of y.
    pub stable: Vec<Vec<bool>>,
    /// Likewise, where asked for; infinite where it is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spectral_radius: Option<Vec<Vec<f64>>>,
    /// Where the verdict changes: polylines of (x, y), closed ones ending where they began; y is NaN for a single row,
    /// of which each crossing is a polyline of one point. Crossings of grid lines lie within 1e-6 of the key's
    /// range (of its logarithm's, where values have equal ratios); half-way between neighbours where a key has whole
    /// numbers or rates only.
    pub boundary: Vec<Vec<[f64; 2]>>,
    /// Why no point is stable, where none is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub empty: Option<String>,
    /// How many points of the grid were analysed one by one.
    pub evaluated: usize,
    /// Closed curves around what is stable, the map's own edge included, the stable side to the left (where values
    /// rise); holes run the other way. None for a single row.
    #[serde(skip)]
    pub outlines: Vec<Vec<[f64; 2]>>,
}

/// How near to the crossing a point of [`StabilityMap::boundary`] is, as a share of the key's range.
const ACCURACY: f64 = 1e-6;

/// The map of one or two keys, on all cores. With radii every point is analysed, without them as many as it takes.
///
/// # Errors
/// When a key is unknown, a value is not allowed, or a point cannot be analysed.
pub fn stability_map(
    scene: &Scene,
    x: &Sweep,
    y: Option<&Sweep>,
    with_radius: bool,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<StabilityMap, SweepError> {
    let keys: Vec<&str> = std::iter::once(x).chain(y).map(|sweep| sweep.key.as_str()).collect();
    if let [one, other] = keys[..]
        && one == other
    {
        return Err(SweepError::Twice(one.to_owned()));
    }
    let evaluator = Evaluator::new(scene, &keys)?;
    let mut plane =
        Plane::new(&evaluator, SweptAxis::new(scene, x), y.map(|sweep| SweptAxis::new(scene, sweep)));
    let stable = if with_radius {
        all_verdicts(&mut plane, progress)?
    } else {
        adaptive::verdicts(&mut plane, progress)?
    };
    let Curves { boundary, outlines } = curves(&plane, &stable)?;
    let is_empty = !stable.iter().flatten().any(|&stable| stable);
    let empty =
        if is_empty { Some(empty::reason(scene, x, y, &|share| progress(0.8 + 0.2 * share))?) } else { None };
    progress(1.0);
    let radius = |y: usize, x: usize| plane.known(Point { x, y }).map_or(f64::NAN, |v| v.spectral_radius);
    let radii = || (0..plane.y.len()).map(|y| (0..plane.x.len()).map(|x| radius(y, x)).collect()).collect();
    Ok(StabilityMap {
        x: x.clone(),
        y: y.cloned(),
        spectral_radius: with_radius.then(radii),
        boundary,
        outlines: if y.is_some() { outlines } else { Vec::new() },
        empty,
        evaluated: plane.evaluated,
        stable,
    })
}

fn all_verdicts(
    plane: &mut Plane<'_>,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<Vec<bool>>, SweepError> {
    let points: Vec<Point> = plane.points().collect();
    let (count, done) = (points.len(), AtomicUsize::new(0));
    let step = || {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if done.is_multiple_of(64) {
            progress(0.8 * done as f64 / count as f64);
        }
    };
    plane.evaluate(points, &step)?;
    let stable = |x, y| plane.known(Point { x, y }).is_some_and(|verdict| verdict.stable);
    Ok((0..plane.y.len()).map(|y| (0..plane.x.len()).map(|x| stable(x, y)).collect()).collect())
}

struct Curves {
    boundary: Vec<Vec<[f64; 2]>>,
    outlines: Vec<Vec<[f64; 2]>>,
}

fn curves(plane: &Plane<'_>, stable: &[Vec<bool>]) -> Result<Curves, SweepError> {
    let (within, around) = (Verdicts { stable, rim: false }, Verdicts { stable, rim: true });
    let changes = within.changes();
    let places: Vec<_> = changes.par_iter().map(|&edge| place_of_change(plane, edge)).collect();
    let mut crossings = BTreeMap::new();
    for (edge, place) in changes.into_iter().zip(places) {
        crossings.insert(edge, place?);
    }
    let mut stable_middles = Vec::new();
    for (x, y) in within.saddles() {
        if plane.x.divisible && plane.y.divisible {
            let middle = (plane.x.between(x - 1, 0.5), plane.y.between(y - 1, 0.5));
            if plane.at(middle.0, middle.1)?.stable {
                stable_middles.push((x, y));
            }
        }
    }
    let is_stable = |x: usize, y: usize| stable_middles.contains(&(x, y));
    let place = |edge: &Edge| crossings.get(edge).copied().unwrap_or_else(|| on_the_rim(plane, *edge));
    let placed = |verdicts: &Verdicts<'_>| {
        let curves = verdicts.curves(&is_stable);
        curves.iter().map(|curve| curve.iter().map(place).collect()).collect()
    };
    Ok(Curves { boundary: placed(&within), outlines: placed(&around) })
}

/// Where on the line between two neighbours of different verdicts it changes.
fn place_of_change(plane: &Plane<'_>, edge: Edge) -> Result<[f64; 2], SweepError> {
    let (x, y) = (edge.x - 1, edge.y - 1);
    let axis = if edge.upward { &plane.y } else { &plane.x };
    let place = |share: f64| {
        if edge.upward {
            [plane.x.values[x], plane.y.between(y, share)]
        } else {
            [plane.x.between(x, share), plane.y.values[y]]
        }
    };
    let other = if edge.upward { Point { x, y: y + 1 } } else { Point { x: x + 1, y } };
    let (from, to) = (plane.known(Point { x, y }), plane.known(other));
    let share = match (from, to) {
        (Some(from), Some(to)) if axis.divisible => {
            let accuracy = ACCURACY * (axis.len() - 1) as f64;
            crossing(from, to, accuracy, |share| {
                let [x, y] = place(share);
                plane.at(x, y)
            })?
        }
        _ => 0.5,
    };
    Ok(place(share))
}

/// The point of the map's edge behind which there is nothing.
fn on_the_rim(plane: &Plane<'_>, edge: Edge) -> [f64; 2] {
    let inner = |place: usize, count: usize| place.clamp(1, count) - 1;
    [plane.x.values[inner(edge.x, plane.x.len())], plane.y.values[inner(edge.y, plane.y.len())]]
}
