//! The paths and forces of each action.

use std::f64::consts::TAU;

use cotouch_scene::geometry::Pose;
use cotouch_scene::scene::Action;
use glam::DVec3;

use super::model::{FingerPath, Script, ScriptState, TRANSITION_S, Touch};
use crate::target::{Progress, Target, Transition};

impl Script {
    /// The paths of the action that `state` has just begun, after what `before` describes.
    pub(super) fn lay_paths(
        &self,
        before: &ScriptState,
        state: &mut ScriptState,
        touches: &[Touch],
        bodies: &[Pose],
    ) {
        let elapsed_s = state.began.since(before.began) as f64 * 1e-9;
        let action = self.action(state.action);
        if let Some(Action::Grasp { .. }) = action {
            state.body = self.steps[state.action].body;
        }
        let duration_s = match action {
            Some(&Action::WaitUntil { until_s }) => (until_s - state.began.as_secs_f64()).max(0.0),
            Some(action) => action.duration_s(),
            None => f64::INFINITY,
        };
        state.centre = self.centre(state, touches, bodies);
        let together = self.displacement(before, state, touches, elapsed_s);
        for (finger, touch) in touches.iter().enumerate().take(before.fingers.len()) {
            let from = self.begin_at(before, state, finger, elapsed_s, touch);
            let mut path =
                FingerPath { anchor: from, shift: DVec3::ZERO, closing: false, ..before.fingers[finger] };
            let mut transition_s = TRANSITION_S;
            match action {
                Some(&Action::Reach { to_m, .. }) => {
                    path.anchor = if finger == 0 { to_m } else { from + together };
                    transition_s = duration_s;
                }
                Some(Action::Carry { .. } | Action::CarryTo { .. } | Action::Lift { .. }) => {
                    path.shift = together;
                }
                Some(&Action::LetGo { distance_m, .. }) => {
                    path.shift = self.opening(state, &path, touch, bodies, distance_m);
                }
                Some(Action::Grasp { .. }) => self.close(state.body, &mut path, touch, bodies),
                _ => {}
            }
            state.fingers[finger] = path;
            let (last, begin) = (self.path(before, finger, elapsed_s), self.path(state, finger, 0.0));
            let path = &mut state.fingers[finger];
            if self.action(before.action).is_some_and(grips) && last == begin {
                // What is held stays held as it was going to be.
                path.transition_began_s -= elapsed_s;
            } else {
                let from = self.target(before, finger, elapsed_s).minus(begin);
                path.transition = Transition { from, duration_s: transition_s.min(duration_s) };
                path.transition_began_s = 0.0;
            }
        }
    }

    /// Where finger number `finger` has its fixed point as the action of `state` begins, m.
    fn begin_at(
        &self,
        before: &ScriptState,
        state: &ScriptState,
        finger: usize,
        elapsed_s: f64,
        touch: &Touch,
    ) -> DVec3 {
        let (last, next) = (self.action(before.action), self.action(state.action));
        match (last, next) {
            (Some(Action::Sinusoid { .. }), Some(Action::Sinusoid { .. })) => before.fingers[finger].anchor,
            (Some(last), _) if grips(last) => self.path(before, finger, elapsed_s).position,
            (Some(last), _) if last.tracks() => self.target(before, finger, elapsed_s).position,
            (_, Some(Action::Hold { .. } | Action::Sinusoid { .. })) => touch.position,
            (_, Some(next)) if grips(next) => touch.position,
            _ => before.fingers[finger].anchor,
        }
    }

    /// By how much all targets move in the action of `state`, m.
    fn displacement(
        &self,
        before: &ScriptState,
        state: &ScriptState,
        touches: &[Touch],
        elapsed_s: f64,
    ) -> DVec3 {
        match self.action(state.action) {
            Some(&Action::Carry { by_m, .. }) => by_m,
            Some(&Action::CarryTo { to_m, .. }) => to_m - state.centre,
            Some(&Action::Lift { height_m, .. }) => self.down.map_or(DVec3::Z, |down| -down) * height_m,
            Some(&Action::Reach { to_m, .. }) => touches
                .first()
                .map_or(DVec3::ZERO, |touch| to_m - self.begin_at(before, state, 0, elapsed_s, touch)),
            _ => DVec3::ZERO,
        }
    }

    /// Where the target of finger number `finger` is.
    pub(super) fn target(&self, state: &ScriptState, finger: usize, elapsed_s: f64) -> Target {
        let path = self.path(state, finger, elapsed_s);
        let FingerPath { transition, transition_began_s, .. } = &state.fingers[finger];
        let in_transition_s = elapsed_s - transition_began_s;
        if in_transition_s < transition.duration_s {
            path.plus(transition.offset(in_transition_s))
        } else {
            path
        }
    }

    /// The same without the transition.
    fn path(&self, state: &ScriptState, finger: usize, elapsed_s: f64) -> Target {
        let FingerPath { anchor, shift, closing, approach, .. } = state.fingers[finger];
        match self.action(state.action) {
            Some(&Action::Sinusoid { amplitude_m, frequency_hz, phase_rad, .. }) => {
                let rate = TAU * frequency_hz;
                Target::on_sinusoid(anchor, amplitude_m, rate, rate * elapsed_s + phase_rad)
            }
            Some(&Action::Grasp { speed_m_per_s, .. }) if closing => {
                Target::setting_off(anchor, approach * speed_m_per_s, elapsed_s, TRANSITION_S)
            }
            Some(
                &(Action::Carry { duration_s, .. }
                | Action::CarryTo { duration_s, .. }
                | Action::Lift { duration_s, .. }
                | Action::LetGo { duration_s, .. }),
            ) => Target::shifted(anchor, shift, Progress::minimum_jerk(elapsed_s, duration_s)),
            Some(&Action::Turn { angle_rad, duration_s }) => {
                let progress = Progress::minimum_jerk(elapsed_s, duration_s);
                Target::turned(anchor, state.centre, angle_rad, progress)
            }
            _ => Target::at(anchor),
        }
    }

    /// What the muscles of every finger add, N.
    pub(super) fn force(&self, state: &ScriptState, tick: u64, elapsed_s: f64) -> DVec3 {
        let Some(step) = self.steps.get(state.action) else { return DVec3::ZERO };
        match step.action {
            Action::Force { force_n, .. } => force_n,
            Action::PushAndLetGo { force_n, .. } if tick < state.let_go_tick => force_n,
            Action::SinusoidalForce { amplitude_n, frequency_hz, phase_rad, .. } => {
                amplitude_n * (TAU * frequency_hz * elapsed_s + phase_rad).sin()
            }
            Action::Push { force_n, duration_s } => {
                let fade_s = TRANSITION_S.min(0.5 * duration_s);
                let faded = |s: f64| Progress::minimum_jerk(s, fade_s).way;
                let share = faded(elapsed_s).min(faded(duration_s - elapsed_s));
                force_n * (share / state.fingers.len() as f64)
            }
            _ => step.tremor.as_ref().map_or(DVec3::ZERO, |tremor| tremor.force(elapsed_s)),
        }
    }
}

/// Whether an action speaks of what fingers hold together: its paths may be broken off by events, and the next one
/// goes on from where its target was heading.
fn grips(action: &Action) -> bool {
    matches!(
        action,
        Action::Grasp { .. }
            | Action::Carry { .. }
            | Action::CarryTo { .. }
            | Action::Lift { .. }
            | Action::Turn { .. }
            | Action::Push { .. }
            | Action::HandOver { .. }
            | Action::LetGo { .. }
            | Action::WaitUntil { .. }
    )
}
