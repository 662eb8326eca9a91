//! What the analysis says of every set of settings that a session ran with.

use std::collections::BTreeMap;
use std::sync::Arc;

use cotouch_runtime::{Predicted, SettingValue, SettingsSummary, Summary, clock, real_time};
use cotouch_scene::Scene;
use cotouch_scene::time::LocalTime;

use super::prediction;
use crate::output::Output;

/// When this time is over, no further settings are predicted, s: the session is over, and somebody waits for its end.
const LONGEST_S: f64 = 20.0;

/// Says of every stretch of `summary` what differs from the scene `first` that the session began with, and what is predicted
/// of it; `predicted` is what was said of `first`.
pub(super) fn complete(summary: &mut Summary, first: &Scene, predicted: Option<Predicted>, output: &Output) {
    let progress = output.progress("predicting");
    let earlier = summary.earlier.iter_mut().flat_map(|session| &mut session.predictions);
    let mut stretches: Vec<&mut SettingsSummary> = earlier.chain(&mut summary.predictions).collect();
    let mut known = Known { first, predicted, others: Vec::new(), began: clock::now(), left_out: 0 };
    let all = stretches.len() as f64;
    for (index, stretch) in stretches.iter_mut().enumerate() {
        progress.show(index as f64 / all);
        // The link of the first scene is as its text says, not as packets met it.
        let scene = stretch.scene.clone().filter(|_| index > 0);
        stretch.settings = scene.as_ref().map(|scene| known.differences(scene)).unwrap_or_default();
        let predicted = scene.as_ref().map_or(known.predicted, |scene| known.predicted(scene));
        stretch.stable = predicted.and_then(|predicted| predicted.stable);
        stretch.spectral_radius = predicted.map(|predicted| predicted.spectral_radius);
        summary.predicted = predicted;
    }
    drop(progress);
    if known.left_out > 0 {
        let left_out = known.left_out;
        tell!("note: {left_out} more settings were tried than could be predicted in {LONGEST_S} s");
    }
}

/// Predictions that were made already.
struct Known<'a> {
    first: &'a Scene,
    predicted: Option<Predicted>,
    others: Vec<(Arc<Scene>, Option<Predicted>)>,
    began: LocalTime,
    left_out: u32,
}

impl Known<'_> {
    fn predicted(&mut self, scene: &Arc<Scene>) -> Option<Predicted> {
        if **scene == *self.first {
            return self.predicted;
        }
        if let Some((_, predicted)) = self.others.iter().find(|(other, _)| other == scene) {
            return *predicted;
        }
        if clock::now().since(self.began) as f64 * 1e-9 > LONGEST_S {
            self.left_out += 1;
            return None;
        }
        let predicted = prediction::predicted_if_possible(scene);
        self.others.push((Arc::clone(scene), predicted));
        predicted
    }

    /// What differs from the scene of that name: the one that the session began with, or the built-in one.
    fn differences(&self, scene: &Scene) -> BTreeMap<String, SettingValue> {
        if scene.name == self.first.name {
            return SettingsSummary::differences(scene, self.first);
        }
        let plain = cotouch_scene::load(&scene.name, &[]);
        plain.map_or_else(
            |_| Default::default(),
            |plain| SettingsSummary::differences(scene, &real_time::realisable(&plain).0),
        )
    }
}
