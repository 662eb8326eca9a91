//! Stability maps: where in the plane of two keys a scene is stable.

use cotouch_scene::Scene;
use serde::Serialize;

use crate::sweep::{Sweep, SweepError};

/// Serialises to the document of `cotouch analyze stability --sweep …`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StabilityMap {
    /// Along a row.
    pub x: Sweep,
    /// From row to row; `None` for a single row.
    pub y: Option<Sweep>,
    /// A row for each value of y.
    pub stable: Vec<Vec<bool>>,
    /// Likewise, where asked for; infinite where it is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spectral_radius: Option<Vec<Vec<f64>>>,
    /// Where the verdict changes, refined to the accuracy of the keys: polylines of (x, y); y is NaN for a single row.
    pub boundary: Vec<Vec<[f64; 2]>>,
    /// Why no point is stable, where none is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub empty: Option<String>,
    /// How many points were analysed one by one.
    pub evaluated: usize,
}

/// The map of one or two keys, on all cores.
///
/// # Errors
/// When a key is unknown, a value is not allowed, or a point cannot be analysed.
pub fn stability_map(
    _scene: &Scene,
    _x: &Sweep,
    _y: Option<&Sweep>,
    _with_radius: bool,
    _progress: &(dyn Fn(f64) + Sync),
) -> Result<StabilityMap, SweepError> {
    todo!("helper 4")
}
