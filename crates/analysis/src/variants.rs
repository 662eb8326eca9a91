//! Verdicts on variants of one scene, each compiled and judged as a whole.

use std::sync::Mutex;

use cotouch_scene::Scene;
use rayon::prelude::*;

use crate::compile::ContactMode;
use crate::loop_spec::LoopSpec;
use crate::modes::contact_modes;
use crate::poles::{check_size, judge};
use crate::soft::Bodies;
use crate::verdict::{AnalysisError, LoopStability, PointVerdict};

/// Judges variants of one scene; what they have in common is prepared once. Can be shared by threads.
#[derive(Debug, Default)]
pub(crate) struct Variants {
    bodies: Bodies,
    /// Contact modes that were unstable in some variant.
    culprits: Mutex<Vec<Contacts>>,
}

/// The verdict on a variant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VariantVerdict {
    /// Of the worst contact mode.
    pub(crate) verdict: PointVerdict,
    /// ln of what the fastest growing motion is multiplied by in a second, negative where all die out: comparable
    /// between variants whose patterns take different times.
    pub(crate) growth_per_s: f64,
}

/// The contacts that are closed in a mode, by name.
pub(crate) type Contacts = Vec<String>;

/// So many modes are judged before it is looked whether one of them settles the matter.
const AT_ONCE: usize = 8;

impl Variants {
    /// Every contact mode, if none of them is too large: a large one is not found after all others were judged.
    fn modes(&self, scene: &Scene) -> Result<Vec<ContactMode>, AnalysisError> {
        let (modes, _) = contact_modes(scene, &self.bodies)?;
        modes.iter().try_for_each(|mode| check_size(&mode.spec))?;
        Ok(modes)
    }

    /// The worst of all contact modes, on all cores.
    ///
    /// # Errors
    /// When a loop is too large or a soft body cannot be linearised.
    pub(crate) fn verdict(&self, scene: &Scene) -> Result<VariantVerdict, AnalysisError> {
        let modes = self.modes(scene)?;
        worst(&modes.iter().collect::<Vec<_>>())
    }

    /// The worst of some contact modes; those that the variant does not have count as stable.
    ///
    /// # Errors
    /// As [`Self::verdict`].
    pub(crate) fn verdict_among(
        &self,
        scene: &Scene,
        contacts: &[Contacts],
    ) -> Result<VariantVerdict, AnalysisError> {
        let modes = self.modes(scene)?;
        worst(&modes.iter().filter(|mode| contacts.contains(&mode.contacts)).collect::<Vec<_>>())
    }

    /// The contact modes that are unstable.
    ///
    /// # Errors
    /// As [`Self::verdict`].
    pub(crate) fn unstable(&self, scene: &Scene) -> Result<Vec<Contacts>, AnalysisError> {
        let modes = self.modes(scene)?;
        let verdicts: Vec<_> = modes.par_iter().map(|mode| of_mode(&mode.spec)).collect();
        let mut unstable = Vec::new();
        for (mode, verdict) in modes.into_iter().zip(verdicts) {
            if !verdict?.verdict.stable {
                unstable.push(mode.contacts);
            }
        }
        Ok(unstable)
    }

    /// Whether every contact mode is stable, judging no more of them than it takes: what was unstable in another variant
    /// is judged first.
    ///
    /// # Errors
    /// As [`Self::verdict`].
    pub(crate) fn is_stable(&self, scene: &Scene) -> Result<bool, AnalysisError> {
        let modes = self.modes(scene)?;
        let lock = || self.culprits.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let culprits = lock().clone();
        let (first, rest): (Vec<_>, Vec<_>) =
            modes.iter().partition(|mode| culprits.contains(&mode.contacts));
        for modes in first.chunks(1).chain(rest.chunks(AT_ONCE)) {
            let verdicts: Vec<_> = modes.par_iter().map(|mode| of_mode(&mode.spec)).collect();
            for (mode, verdict) in modes.iter().zip(verdicts) {
                if !verdict?.verdict.stable {
                    let mut culprits = lock();
                    if !culprits.contains(&mode.contacts) {
                        culprits.push(mode.contacts.clone());
                    }
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }
}

/// Of none where there are none.
fn worst(modes: &[&ContactMode]) -> Result<VariantVerdict, AnalysisError> {
    let verdicts: Vec<_> = modes.par_iter().map(|mode| of_mode(&mode.spec)).collect();
    let none = VariantVerdict { verdict: PointVerdict::NONE, growth_per_s: f64::NEG_INFINITY };
    // The first error in the order of the modes, whichever core was faster.
    verdicts.into_iter().try_fold(none, |worst, verdict| Ok(worst.and(verdict?)))
}

impl VariantVerdict {
    /// The worse of two modes.
    fn and(self, other: Self) -> Self {
        Self {
            verdict: self.verdict.and(other.verdict),
            growth_per_s: self.growth_per_s.max(other.growth_per_s),
        }
    }
}

fn of_mode(spec: &LoopSpec) -> Result<VariantVerdict, AnalysisError> {
    let LoopStability { spectral_radius, stable, .. } = judge(spec, false)?;
    Ok(VariantVerdict {
        verdict: PointVerdict { spectral_radius, stable },
        growth_per_s: spectral_radius.ln() / spec.pattern_s(),
    })
}
