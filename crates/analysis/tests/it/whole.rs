//! The whole verdict on a scene, with what its scripts ask for when they are run.

use cotouch_analysis::{AnalysisError, Stability};
use cotouch_runtime::scripted_demand;
use cotouch_scene::Scene;

pub(crate) fn analyze(scene: &Scene) -> Result<Stability, AnalysisError> {
    cotouch_analysis::analyze(scene, |scene| scripted_demand(scene, &|| true))
}
