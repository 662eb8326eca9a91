//! The whole verdict on a scene: where the analysis meets the run that shows what scripts ask for.

use cotouch_analysis::{AnalysisError, Stability};
use cotouch_runtime::scripted_demand;
use cotouch_scene::Scene;

/// Everything that can be said of a scene. What its scripts ask for is found by running them, which ends early when `wanted` says no;
/// the answer is then of no use.
pub(crate) fn whole_verdict(scene: &Scene, wanted: &dyn Fn() -> bool) -> Result<Stability, AnalysisError> {
    cotouch_analysis::analyze(scene, |scene| scripted_demand(scene, wanted))
}
