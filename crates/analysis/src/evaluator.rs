//! Verdicts on many variants of one scene.

use cotouch_scene::Scene;
use cotouch_scene::access::with_override;

use crate::stability::analyze;
use crate::sweep::SweepError;

/// A scene of which some keys take other values, point after point. Can be shared by threads.
#[derive(Debug)]
pub struct Evaluator {
    scene: Scene,
    keys: Vec<String>,
}

/// The verdict at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointVerdict {
    /// As in [`crate::stability::Stability`].
    pub spectral_radius: f64,
    /// As in [`crate::stability::Stability`].
    pub stable: bool,
}

impl Evaluator {
    /// Prepares for points that differ from `scene` in the numbers of `keys`.
    ///
    /// # Errors
    /// When a key is unknown or not a number, or is there twice.
    pub fn new(scene: &Scene, keys: &[&str]) -> Result<Self, SweepError> {
        Ok(Self { scene: scene.clone(), keys: keys.iter().map(|&key| key.to_owned()).collect() })
    }

    /// The verdict with `values`, one for each key.
    ///
    /// # Errors
    /// When the scene does not allow a value, or the loop cannot be analysed.
    pub fn at(&self, values: &[f64]) -> Result<PointVerdict, SweepError> {
        let mut scene = self.scene.clone();
        for (key, &value) in self.keys.iter().zip(values) {
            scene = with_override(&scene, key, value)?;
        }
        let verdict = analyze(&scene)?;
        Ok(PointVerdict { spectral_radius: verdict.spectral_radius, stable: verdict.stable })
    }
}
