//! With which settings a host has run, and what it was like with each.

use std::sync::Arc;

use cotouch_scene::Scene;

use crate::observer::{Observer, SettingsVerdict};

/// Settings that are kept; later ones are counted.
const MAX_SETTINGS: usize = 64;

/// What happened with one set of settings.
#[derive(Clone, Debug)]
pub(crate) struct SettingsRun {
    pub(crate) scene: Arc<Scene>,
    pub(crate) seen: SettingsVerdict,
}

/// The settings of a host, in the order in which they were in force. Those that were changed again before anything could be
/// said of them, as when somebody drags a slider, are not kept; the first and the present ones always are.
#[derive(Clone, Debug)]
pub(crate) struct SettingsLog {
    present: Arc<Scene>,
    ended: Vec<SettingsRun>,
    left_out: u32,
}

impl SettingsLog {
    pub(crate) fn new(scene: &Scene) -> Self {
        // Room for all, so that a change allocates nothing.
        Self { present: Arc::new(scene.clone()), ended: Vec::with_capacity(MAX_SETTINGS), left_out: 0 }
    }

    /// Puts `next` into force before `tick`. What was in force is in its place afterwards, to be dropped elsewhere. No
    /// allocation.
    pub(crate) fn change(&mut self, next: &mut Arc<Scene>, observer: &mut Observer, tick: u64) {
        let seen = observer.change_settings(tick);
        std::mem::swap(&mut self.present, next);
        let is_kept = seen.to > seen.from && (seen.from == 0 || seen.verdict.is_some());
        match (is_kept, self.ended.len() < MAX_SETTINGS) {
            (true, true) => self.ended.push(SettingsRun { scene: Arc::clone(next), seen }),
            (true, false) => self.left_out += 1,
            (false, _) => {}
        }
    }

    /// All that are kept, the present ones last.
    pub(crate) fn runs(&self, observer: &Observer) -> Vec<SettingsRun> {
        let present =
            SettingsRun { scene: Arc::clone(&self.present), seen: observer.with_present_settings() };
        self.ended.iter().cloned().chain([present]).collect()
    }

    /// How many were in force for long enough and are not kept.
    pub(crate) fn left_out(&self) -> u32 {
        self.left_out
    }
}
