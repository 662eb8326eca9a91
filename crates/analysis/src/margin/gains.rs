//! By which factors single gains may be multiplied.

use cotouch_scene::Scene;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::found::{GainMargin, go_on};
use crate::crossing::crossing;
use crate::evaluator::Evaluator;
use crate::gains::{Gain, acting_gains};
use crate::sweep::SweepError;
use crate::verdict::PointVerdict;

/// ln of the largest factor.
const FARTHEST: f64 = 9.210_340_371_976_184;
/// Factors that are looked at first, each way.
const LOOKS: usize = 32;
/// Looks closer than this (in ln of the factor) are not divided further.
const FINEST: f64 = 1e-3;
/// At most so many looks, each way: between these two, the fewer the more states there are.
const MAX_LOOKS: usize = 300;
const MIN_LOOKS: usize = 48;
const LOOKS_AT_STATES: usize = 20_000;
/// How many times the doubt must fit between ln ρ and 0, as in maps.
const SAFETY: f64 = 2.0;
/// ln ρ that is 0 but for rounding.
const HAIR: f64 = 1e-9;
/// Of a factor, relative.
const ACCURACY: f64 = 1e-9;

/// `states`: of all contact modes together.
pub(super) fn margins(
    scene: &Scene,
    states: usize,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Vec<GainMargin>, SweepError> {
    let gains = acting_gains(scene);
    let most_looks = (LOOKS_AT_STATES / states.max(1)).clamp(MIN_LOOKS, MAX_LOOKS);
    let (count, done) = (2 * gains.len(), AtomicUsize::new(0));
    let ways: Vec<(Gain, f64)> = gains.iter().flat_map(|&gain| [(gain, 1.0), (gain, -1.0)]).collect();
    let factors: Vec<Option<f64>> = ways
        .par_iter()
        .with_max_len(1)
        .map(|&(gain, sign)| {
            let wanted = || progress(done.load(Ordering::Relaxed) as f64 / count as f64);
            let factor = Way::new(scene, gain, sign).and_then(|way| way.factor(most_looks, &wanted));
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
}

/// What is known at a factor.
#[derive(Clone, Copy)]
struct Look {
    /// Of the logarithm of the factor, the amount.
    place: f64,
    verdict: PointVerdict,
}

impl Look {
    fn height(&self) -> f64 {
        self.verdict.spectral_radius.ln().clamp(-40.0, 40.0)
    }
}

impl Way {
    fn new(scene: &Scene, gain: Gain, sign: f64) -> Result<Self, SweepError> {
        Ok(Self { evaluator: Evaluator::new(scene, &[gain.key])?, value: gain.value, sign })
    }

    fn at(&self, place: f64) -> Result<PointVerdict, SweepError> {
        self.evaluator.at(&[self.value * (self.sign * place).exp()])
    }

    /// The factor nearest to 1 at which the verdict changes.
    fn factor(&self, most_looks: usize, wanted: &dyn Fn() -> bool) -> Result<Option<f64>, SweepError> {
        let mut looks = self.first_looks(wanted)?;
        let mut index = 0;
        while index + 1 < looks.len() {
            go_on(wanted())?;
            let (from, to) = (looks[index], looks[index + 1]);
            if from.verdict.stable && !to.verdict.stable {
                let width = to.place - from.place;
                let share = crossing(from.verdict, to.verdict, ACCURACY / width, |share| {
                    self.at(from.place + share * width)
                })?;
                return Ok(Some((self.sign * (from.place + share * width)).exp()));
            }
            if is_clear(&looks, index) || to.place - from.place < FINEST || looks.len() > most_looks {
                index += 1;
            } else {
                let place = 0.5 * (from.place + to.place);
                looks.insert(index + 1, Look { place, verdict: self.at(place)? });
                // The new look may cast doubt on what was clear before.
                index = index.saturating_sub(1);
            }
        }
        let without = self.sign < 0.0 && !self.evaluator.at(&[0.0])?.stable;
        Ok(without.then_some(0.0))
    }

    /// Up to the first unstable one; fewer where a larger value is not allowed.
    fn first_looks(&self, wanted: &dyn Fn() -> bool) -> Result<Vec<Look>, SweepError> {
        let mut looks = Vec::new();
        for index in 0..=LOOKS {
            go_on(wanted())?;
            let place = FARTHEST * index as f64 / LOOKS as f64;
            let verdict = match self.at(place) {
                Ok(verdict) => verdict,
                Err(SweepError::Scene(_)) if index > 0 => break,
                Err(error) => return Err(error),
            };
            looks.push(Look { place, verdict });
            if !verdict.stable {
                break;
            }
        }
        Ok(looks)
    }
}

/// Whether there is no room for a crossing between a look and the next, both stable.
fn is_clear(looks: &[Look], index: usize) -> bool {
    let bend = |middle: usize| {
        let [before, here, after] = [middle - 1, middle, middle + 1].map(|at| looks[at]);
        let share = (here.place - before.place) / (after.place - before.place);
        (here.height() - (1.0 - share) * before.height() - share * after.height()).abs()
    };
    let middles = index.max(1)..(index + 2).min(looks.len() - 1);
    let doubt = middles.map(bend).fold(0.0, f64::max);
    let nearest = looks[index].height().abs().min(looks[index + 1].height().abs());
    // Neutral all along: rounding is no reason to look closer.
    nearest > SAFETY * doubt || doubt < HAIR
}
