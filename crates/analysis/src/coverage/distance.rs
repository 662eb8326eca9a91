//! Up to which factor on contacts every judged set of them stays stable.

use cotouch_scene::scene::SceneValues;
use rayon::prelude::*;

use super::loops::{Candidate, Judged, judge_candidate};
use super::search::Search;
use super::{MAX_SEARCHED, SEARCH_BUDGET};
use crate::operating_point::Reach;
use crate::verdict::AnalysisError;

/// Of a factor, relative.
const ACCURACY: f64 = 1e-3;

/// A smaller factor is none.
const NO_DISTANCE: f64 = 1.0 + ACCURACY;

/// All sets of contacts that were judged, hands as scripts hold them, and those from which other hands were searched.
pub(crate) struct JudgedSets {
    pub(super) reach: Reach,
    pub(super) sets: Vec<Candidate>,
    /// Candidates that a search for other hands may judge from each of the worst sets.
    pub(super) searches: usize,
}

/// A scene whose contacts are stiffer by a factor.
pub(crate) type Stiffer<'a> = &'a (dyn Fn(f64) -> SceneValues + Sync);

impl JudgedSets {
    pub(super) fn new(reach: Reach, sets: Vec<Candidate>, largest_states: usize) -> Self {
        let states = largest_states.max(1) as f64;
        Self { reach, sets, searches: (SEARCH_BUDGET / MAX_SEARCHED as f64 / states.powi(3)) as usize }
    }

    /// The largest factor, at most `upper`, at which every set is stable, and so are the worst with hands that are held otherwise:
    /// to 1e-3, on the stable side; 1 where one is unstable already. All are judged at that factor and half-way to it, those that are unstable there are
    /// bisected, and all are judged again.
    ///
    /// # Errors
    /// When a loop cannot be analysed.
    pub(crate) fn stable_up_to(&self, stiffer: Stiffer, upper: f64) -> Result<f64, AnalysisError> {
        let mut upper = upper;
        loop {
            let half_way = upper.sqrt();
            let found = [half_way, upper]
                .into_iter()
                .map(|factor| Ok((factor, self.unstable(&stiffer(factor))?)))
                .find(|found: &Result<_, AnalysisError>| {
                    found.as_ref().map_or(true, |(_, sets)| !sets.is_empty())
                });
            let Some((mut factor, mut unstable)) = found.transpose()? else { return Ok(upper) };
            while !unstable.is_empty() {
                factor = self.crossing(stiffer, &unstable[0], factor)?;
                if factor <= NO_DISTANCE {
                    // With hands held as the search held them at a larger factor, it may grow as the scene is.
                    return Ok(factor);
                }
                unstable = self.worst_first(&stiffer(factor), unstable)?;
            }
            upper = factor;
        }
    }

    /// All that are unstable in a scene, the worst first.
    fn unstable(&self, scene: &SceneValues) -> Result<Vec<Candidate>, AnalysisError> {
        let mut judged = self.judge(scene, self.sets.clone())?;
        let with_hands = judged
            .iter()
            .take(MAX_SEARCHED)
            .map(|worst| Search { scene, reach: &self.reach, left: self.searches }.by_hands(worst.clone()));
        let with_hands = with_hands.collect::<Result<Vec<_>, _>>()?;
        judged.splice(0..0, with_hands);
        judged.retain(|(_, judged)| !judged.stable);
        Ok(judged.into_iter().map(|(candidate, _)| candidate).collect())
    }

    /// Of these, the ones that are unstable in a scene, the worst first.
    fn worst_first(
        &self,
        scene: &SceneValues,
        candidates: Vec<Candidate>,
    ) -> Result<Vec<Candidate>, AnalysisError> {
        let judged = self.judge(scene, candidates)?;
        let unstable = judged.into_iter().filter(|(_, judged)| !judged.stable);
        Ok(unstable.map(|(candidate, _)| candidate).collect())
    }

    /// What a scene makes of each, the one that is nearest to growing first.
    fn judge(
        &self,
        scene: &SceneValues,
        candidates: Vec<Candidate>,
    ) -> Result<Vec<(Candidate, Judged)>, AnalysisError> {
        let judge = |candidate: Candidate| {
            let judged = judge_candidate(scene, &self.reach, &candidate, false)?;
            Ok((candidate, judged))
        };
        let mut judged = candidates.into_par_iter().map(judge).collect::<Result<Vec<_>, AnalysisError>>()?;
        judged.sort_by(|(_, one), (_, other)| other.nearness.total_cmp(&one.nearness));
        Ok(judged)
    }

    /// The factor up to which a set is stable that is not at `unstable`: on the stable side.
    fn crossing(
        &self,
        stiffer: Stiffer,
        candidate: &Candidate,
        mut unstable: f64,
    ) -> Result<f64, AnalysisError> {
        let mut stable = 1.0;
        while unstable > stable * (1.0 + ACCURACY) {
            let middle = (stable * unstable).sqrt();
            if judge_candidate(&stiffer(middle), &self.reach, candidate, false)?.stable {
                stable = middle;
            } else {
                unstable = middle;
            }
        }
        Ok(stable)
    }
}
