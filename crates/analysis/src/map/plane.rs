//! The points of a map, and what is known of them.

use rayon::prelude::*;

use super::axis::SweptAxis;
use crate::evaluator::Evaluator;
use crate::sweep::SweepError;
use crate::verdict::PointVerdict;

/// Logarithms of spectral radii are cut off here: what lies beyond is far from 1.
const FARTHEST: f64 = 40.0;

/// Where the two keys are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Point {
    pub(super) x: usize,
    pub(super) y: usize,
}

/// All points.
pub(super) struct Plane<'a> {
    pub(super) x: SweptAxis,
    pub(super) y: SweptAxis,
    evaluator: &'a Evaluator,
    /// Whether there is a second key.
    has_y: bool,
    known: Vec<Option<PointVerdict>>,
    pub(super) evaluated: usize,
}

impl<'a> Plane<'a> {
    /// Of which nothing is known.
    pub(super) fn new(evaluator: &'a Evaluator, x: SweptAxis, y: Option<SweptAxis>) -> Self {
        let has_y = y.is_some();
        let y = y.unwrap_or_else(SweptAxis::single);
        let known = vec![None; x.len() * y.len()];
        Self { x, y, evaluator, has_y, known, evaluated: 0 }
    }

    /// The verdict anywhere.
    pub(super) fn at(&self, x: f64, y: f64) -> Result<PointVerdict, SweepError> {
        if self.has_y { self.evaluator.at(&[x, y]) } else { self.evaluator.at(&[x]) }
    }

    /// The verdict at a point that was evaluated.
    pub(super) fn known(&self, point: Point) -> Option<PointVerdict> {
        self.known[point.y * self.x.len() + point.x]
    }

    /// Evaluates those of `points` that are not known, on all cores; `done` is called after each.
    pub(super) fn evaluate(
        &mut self,
        mut points: Vec<Point>,
        done: &(dyn Fn() + Sync),
    ) -> Result<(), SweepError> {
        points.retain(|&point| self.known(point).is_none());
        points.sort_unstable_by_key(|point| (point.y, point.x));
        points.dedup();
        let plane = &*self;
        let evaluate = |point: &Point| {
            let verdict = plane.at(plane.x.values[point.x], plane.y.values[point.y]);
            done();
            verdict
        };
        let verdicts: Vec<_> = points.par_iter().with_min_len(4).map(evaluate).collect();
        self.evaluated += points.len();
        // The first error in the order of the points, whichever core was faster.
        for (point, verdict) in points.into_iter().zip(verdicts) {
            let index = point.y * self.x.len() + point.x;
            self.known[index] = Some(verdict?);
        }
        Ok(())
    }

    /// Every point, row after row.
    pub(super) fn points(&self) -> impl Iterator<Item = Point> + use<> {
        let (columns, rows) = (self.x.len(), self.y.len());
        (0..rows).flat_map(move |y| (0..columns).map(move |x| Point { x, y }))
    }
}

/// ln ρ, cut off far from 0.
pub(super) fn height(verdict: PointVerdict) -> f64 {
    verdict.spectral_radius.ln().clamp(-FARTHEST, FARTHEST)
}
