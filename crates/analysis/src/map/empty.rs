//! Why no point of a map is stable.

use cotouch_scene::Scene;

use crate::sweep::{Sweep, SweepError};

/// One or two plain sentences.
pub(super) fn reason(
    _scene: &Scene,
    _x: &Sweep,
    _y: Option<&Sweep>,
    _progress: &(dyn Fn(f64) + Sync),
) -> Result<String, SweepError> {
    Ok(String::new())
}
