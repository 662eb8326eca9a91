//! How far gains, delay, rates and loss are from instability.

use cotouch_scene::Scene;
use serde::Serialize;

use crate::sweep::SweepError;

/// Serialises to the document of `cotouch analyze margin`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Margins {
    /// Of the scene as it is. Margins of an unstable scene are `None`.
    pub stable: bool,
}

/// All margins of a scene.
///
/// # Errors
/// When the scene cannot be analysed.
pub fn margins(_scene: &Scene, _progress: &(dyn Fn(f64) + Sync)) -> Result<Margins, SweepError> {
    todo!("helper 4")
}
