//! What ends an action before its time: what fingers feel.

use cotouch_scene::scene::Action;
use glam::DVec3;

use super::model::{FingerPath, SHORTEST_STOP_S, Script, ScriptState, TRANSITION_S, Touch};
use crate::target::{Target, Transition};

impl Script {
    /// Notes what is felt. Whether that ends the present action: a grasp when all fingers press, a hand-over when
    /// the load is gone.
    pub(super) fn is_ended_by_event(&self, state: &mut ScriptState, tick: u64, touches: &[Touch]) -> bool {
        if let Some(down) = self.down {
            let load: f64 = touches.iter().map(|touch| touch.felt.dot(down)).sum();
            state.load_n += self.load_share * (load - state.load_n);
        }
        if tick >= state.until_tick {
            return false;
        }
        match self.action(state.action) {
            Some(&Action::Grasp { force_n, .. }) => {
                self.stop_pressing_fingers(state, tick, touches, force_n);
                state.fingers.iter().all(|finger| !finger.closing)
            }
            Some(Action::HandOver { .. }) => {
                let begin = state.load_at_begin_n;
                begin > 0.0 && state.load_n <= 0.5 * begin
            }
            _ => false,
        }
    }

    /// A finger that feels `force_n` against its approach keeps its target where it goes on pressing so:
    /// k_track·(target − x) − k_h·(x − rest) = force_n along the approach.
    fn stop_pressing_fingers(&self, state: &mut ScriptState, tick: u64, touches: &[Touch], force_n: f64) {
        let elapsed_s = self.elapsed_s(state, tick);
        for (finger, touch) in touches.iter().enumerate().take(state.fingers.len()) {
            let FingerPath { closing, approach, .. } = state.fingers[finger];
            let presses = approach != DVec3::ZERO && -touch.felt.dot(approach) >= force_n;
            if !(closing && presses) {
                continue;
            }
            let target = self.target(state, finger, elapsed_s);
            let hand_n = self.hand_stiffness_n_per_m * (touch.position - touch.rest).dot(approach);
            let ahead_m = (force_n + hand_n) / self.tracking.stiffness_n_per_m;
            let there_m = (touch.position - target.position).dot(approach);
            let way = if ahead_m.is_finite() { ahead_m + there_m } else { 0.0 };
            // Longer than twice way over speed, and it would overshoot.
            let unhurried_s = 2.0 * way / target.velocity.dot(approach);
            let path = &mut state.fingers[finger];
            path.anchor = target.position + approach * way;
            path.closing = false;
            path.transition = Transition {
                from: target.minus(Target::at(path.anchor)),
                duration_s: if unhurried_s < TRANSITION_S {
                    unhurried_s.max(SHORTEST_STOP_S)
                } else {
                    TRANSITION_S
                },
            };
            path.transition_began_s = elapsed_s;
        }
    }
}
