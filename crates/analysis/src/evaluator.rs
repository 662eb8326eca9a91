//! Verdicts on many variants of one scene.
//!
//! Where swept keys are gains or masses of a loop without preload, every number of the compiled loops is a product of
//! polynomials of first degree in each key or its reciprocal. That is checked once, on points apart from those that
//! the polynomials were made from; then points need no compiling (`template`). Everywhere else, and wherever a number
//! vanishes (and with it a force, a wall, a contact mode), a point is a scene that is compiled and analysed like any.

mod forms;
mod template;

use cotouch_scene::{Scene, with_override};

use crate::sweep::SweepError;
use crate::variants::Variants;
use crate::verdict::PointVerdict;
use template::Template;

/// A scene of which some keys take other values, point after point. Can be shared by threads.
#[derive(Debug)]
pub struct Evaluator {
    scene: Scene,
    keys: Vec<String>,
    template: Option<Template>,
    variants: Variants,
}

impl Evaluator {
    /// Prepares for points that differ from `scene` in the numbers of `keys`.
    ///
    /// # Errors
    /// When a key is unknown or not a number, or is there twice.
    pub fn new(scene: &Scene, keys: &[&str]) -> Result<Self, SweepError> {
        for (index, &key) in keys.iter().enumerate() {
            if scene.number(key).is_none() {
                // Says what the key is, or which one was meant.
                with_override(scene, key, 1.0)?;
            }
            if keys[..index].contains(&key) {
                return Err(SweepError::Twice(key.to_owned()));
            }
        }
        let template = Template::new(scene, keys);
        Ok(Self {
            scene: scene.clone(),
            keys: keys.iter().map(|&key| key.to_owned()).collect(),
            template,
            variants: Variants::default(),
        })
    }

    /// The verdict with `values`, one for each key.
    ///
    /// # Errors
    /// When the scene does not allow a value, or the loop cannot be analysed.
    ///
    /// # Panics
    /// When there are more or fewer values than keys.
    pub fn at(&self, values: &[f64]) -> Result<PointVerdict, SweepError> {
        assert_eq!(values.len(), self.keys.len(), "one value for each key");
        match self.template.as_ref().and_then(|template| template.at(values)) {
            Some(verdict) => Ok(verdict),
            None => self.compiled(values),
        }
    }

    /// Whether points need no compiling.
    pub(crate) const fn is_quick(&self) -> bool {
        self.template.is_some()
    }

    /// Whether each mode is stable with `values`, one for each key: quicker than [`Self::at`] where one is not.
    ///
    /// # Errors
    /// As [`Self::at`].
    pub(crate) fn is_stable_at(&self, values: &[f64]) -> Result<bool, SweepError> {
        match self.template.as_ref().and_then(|template| template.at(values)) {
            Some(verdict) => Ok(verdict.stable),
            None => Ok(self.variants.is_stable(&self.scene_at(values)?)?),
        }
    }

    fn scene_at(&self, values: &[f64]) -> Result<Scene, SweepError> {
        let mut scene = self.scene.clone();
        for (key, &value) in self.keys.iter().zip(values) {
            scene = with_override(&scene, key, value)?;
        }
        Ok(scene)
    }

    fn compiled(&self, values: &[f64]) -> Result<PointVerdict, SweepError> {
        let scene = self.scene_at(values)?;
        Ok(self.variants.verdict(&scene)?.verdict)
    }
}

#[cfg(test)]
mod tests;
