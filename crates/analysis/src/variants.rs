//! Verdicts on variants of one scene, each compiled and judged as a whole.

use cotouch_scene::Scene;
use rayon::prelude::*;

use crate::loop_spec::LoopSpec;
use crate::modes::contact_modes;
use crate::poles::judge;
use crate::soft::Bodies;
use crate::verdict::{AnalysisError, LoopStability, PointVerdict};

/// Judges variants of one scene; what they have in common is prepared once. Can be shared by threads.
#[derive(Debug, Default)]
pub(crate) struct Variants {
    bodies: Bodies,
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

impl Variants {
    /// The worst of all contact modes, on all cores.
    ///
    /// # Errors
    /// When a loop is too large or a soft body cannot be linearised.
    pub(crate) fn verdict(&self, scene: &Scene) -> Result<VariantVerdict, AnalysisError> {
        let (modes, _) = contact_modes(scene, &self.bodies)?;
        let verdicts: Vec<_> = modes.par_iter().map(|mode| of_mode(&mode.spec)).collect();
        let none = VariantVerdict { verdict: PointVerdict::NONE, growth_per_s: f64::NEG_INFINITY };
        // The first error in the order of the modes, whichever core was faster.
        verdicts.into_iter().try_fold(none, |worst, verdict| Ok(worst.and(verdict?)))
    }
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
