//! By which factors single gains may be multiplied.

use cotouch_scene::Scene;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::found::GainMargin;
use super::scan::{Look, Scan, Turn};
use crate::crossing::crossing;
use crate::evaluator::Evaluator;
use crate::gains::{Gain, acting_gains};
use crate::sweep::SweepError;
use crate::verdict::PointVerdict;

/// ln of the largest factor.
const FARTHEST: f64 = 9.210_340_371_976_184;
/// Factors that are looked at first, each way, less one: of a rigid scene, and with a soft object, whose loops are large.
const PARTS: usize = 32;
const PARTS_OF_SOFT: usize = 12;
/// Looks closer than this (in ln of the factor) are not divided further.
const FINEST: f64 = 1e-3;
/// At most so many looks, each way: between these two, the fewer the more states there are.
const MAX_LOOKS: usize = 300;
const MIN_LOOKS: usize = 48;
const LOOKS_AT_STATES: usize = 20_000;
/// Of a factor, relative.
const ACCURACY: f64 = 1e-9;

/// `states`: of all contact modes together.
pub(super) fn margins(
    scene: &Scene,
    states: usize,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Vec<GainMargin>, SweepError> {
    let gains = acting_gains(scene);
    let max_looks = (LOOKS_AT_STATES / states.max(1)).clamp(MIN_LOOKS, MAX_LOOKS);
    let (count, done) = (2 * gains.len(), AtomicUsize::new(0));
    let ways: Vec<(Gain, f64)> = gains.iter().flat_map(|&gain| [(gain, 1.0), (gain, -1.0)]).collect();
    let factors: Vec<Option<f64>> = ways
        .par_iter()
        .with_max_len(1)
        .map(|&(gain, sign)| {
            let wanted = || progress(done.load(Ordering::Relaxed) as f64 / count as f64);
            let factor = Way::new(scene, gain, sign).and_then(|way| way.factor(max_looks, &wanted));
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / count as f64);
            factor
        })
        .collect::<Result<_, SweepError>>()?;
    let margin = |(gain, pair): (&Gain, &[Option<f64>])| GainMargin {
        key: gain.key.to_owned(),
        value: gain.value,
        factor: pair[0],
        lower_factor: pair[1],
    };
    Ok(gains.iter().zip(factors.chunks(2)).map(margin).collect())
}

/// One gain, to larger or to smaller factors.
struct Way {
    evaluator: Evaluator,
    value: f64,
    sign: f64,
    parts: usize,
}

impl Way {
    fn new(scene: &Scene, gain: Gain, sign: f64) -> Result<Self, SweepError> {
        let parts = if scene.soft.exists() { PARTS_OF_SOFT } else { PARTS };
        Ok(Self { evaluator: Evaluator::new(scene, &[gain.key])?, value: gain.value, sign, parts })
    }

    fn at(&self, place: f64) -> Result<PointVerdict, SweepError> {
        self.evaluator.at(&[self.value * (self.sign * place).exp()])
    }

    /// The factor nearest to 1 at which the verdict changes.
    fn factor(&self, max_looks: usize, wanted: &dyn Fn() -> bool) -> Result<Option<f64>, SweepError> {
        let scan = Scan { farthest: FARTHEST, parts: self.parts, finest: FINEST, max_looks };
        let mut look_at = |from: f64, to: f64| self.look_at(0.5 * (from + to));
        let first = Look { place: 0.0, verdict: self.at(0.0)? };
        match scan.first_turn(first, &mut look_at, wanted)? {
            Turn::Between(from, to) => {
                let width = to.place - from.place;
                let share = crossing(from.verdict, to.verdict, ACCURACY / width, |share| {
                    self.at(from.place + share * width)
                })?;
                Ok(Some((self.sign * (from.place + share * width)).exp()))
            }
            Turn::Nowhere(_) => {
                let without = self.sign < 0.0 && !self.evaluator.at(&[0.0])?.stable;
                Ok(without.then_some(0.0))
            }
        }
    }

    /// Nothing where the scene does not allow so large a value.
    fn look_at(&self, place: f64) -> Result<Option<Look>, SweepError> {
        match self.at(place) {
            Ok(verdict) => Ok(Some(Look { place, verdict })),
            Err(SweepError::Scene(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }
}
