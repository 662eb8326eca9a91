//! What a simulated user does: actions in order, as forces and as paths that the fingers track.
//!
//! Two things come from a script at each tick and for each finger that follows it: a force that the muscles add, and a
//! [`Target`] that the finger is drawn to by `user.tracking`. That impedance belongs to the loop, so it must not change
//! within a run: it is there during the whole run when any action of the script tracks, and absent when none does
//! ([`Script::tracking`]). During actions that do not track, the target stays at its last value, and what the action
//! pushes comes on top.
//!
//! The target never jumps, nor does its velocity or acceleration. Each action is a path of its own plus a
//! [`Transition`] from where the target was:
//! - `reach`: the minimum-jerk path from the target's present motion to `to_m`, over the whole duration; of several
//!   fingers the first goes there, and the others move alike;
//! - `hold`: a fixed point; `sinusoid`: a sinusoid about a fixed point. After an action that tracked, that point is
//!   the one that was tracked last, so that a hand that lags under a load stays where it is instead of sagging
//!   further; otherwise (and at the beginning) it is where the finger was. A sinusoid after a sinusoid keeps its
//!   centre. The transition takes [`TRANSITION_S`], or the action's duration if that is shorter;
//! - `grasp`: a straight path towards the body's side, whose speed rises within [`TRANSITION_S`]; once the finger feels
//!   enough of the body, a transition to the point at which it keeps pressing so;
//! - `carry`, `carry-to`, `lift`: minimum-jerk paths, the same for all fingers; `turn`: all targets turn about one
//!   centre by a minimum-jerk angle; the distances from target to finger, which are the grip, stay. Such actions leave
//!   the transition of a finger that is still coming to rest as it is;
//! - `let-go`: a minimum-jerk path back from where the finger is;
//! - all others: the last point; a target in motion comes to rest there in the same way.
//!
//! What fingers feel and what the user sees has an effect at events only: it ends an action, stops a closing finger,
//! and sets where a path begins. In between a finger is a linear system.
//!
//! Actions begin at the first tick at or after the sum of the durations before them, and time within an action counts
//! from that sum: nothing is lost to rounding to ticks. An action that an event ended was over at that tick's instant.

mod event;
mod grip;
mod model;
mod path;
mod side;

use cotouch_scene::geometry::Pose;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, Scene, SpringDamper};
use cotouch_scene::time::SessionTime;
use glam::DVec3;
use rand::SeedableRng;
use rand_pcg::Pcg64;

pub use model::{Drive, Drives, FingerPath, PlaceInScript, Script, ScriptState, TRANSITION_S, Touch};
pub(crate) use side::free_axes;

use self::model::{LOAD_TIME_S, Step};
use self::side::Side;
use crate::tremor::Tremor;

impl Script {
    /// The script of the user at `host`, or the own one of that user's finger number `finger` (from 0). Tremors are
    /// seeded by the scene; each user's and each finger's differs.
    ///
    /// # Panics
    /// When the scene has no such host or finger.
    #[must_use]
    pub fn new(scene: &Scene, host: HostIndex, finger: Option<usize>) -> Self {
        let user = &scene.users[host.index()];
        let actions = finger.map_or(&user.script, |finger| &user.fingers[finger].script);
        // Weyl's sequence keeps the seeds apart; the generator hashes what it is given.
        let apart = |number: usize, step: u64| (number as u64).wrapping_mul(step);
        let mut random = Pcg64::seed_from_u64(
            scene
                .session
                .seed
                .wrapping_add(apart(host.index(), 0x9E37_79B9_7F4A_7C15))
                .wrapping_add(apart(finger.map_or(0, |finger| finger + 1), 0xD1B5_4A32_D192_ED03)),
        );
        let bodies = scene.world_bodies();
        let mut step = |action: &Action| Step {
            tremor: match *action {
                Action::Tremor { rms_n, .. } => Some(Tremor::new(rms_n, &mut random)),
                _ => None,
            },
            body: match action {
                Action::Grasp { body, .. } => bodies.iter().position(|one| one.name == *body),
                _ => None,
            },
            action: action.clone(),
        };
        let period_s = scene.rates.control_hz.period_s();
        Self {
            steps: actions.iter().map(&mut step).collect(),
            repeat: user.repeat,
            tracking: user.tracking_in(actions),
            hand_stiffness_n_per_m: scene.hand_impedance().to_ground().stiffness_n_per_m,
            space: scene.space,
            down: scene.gravity_m_per_s2.try_normalize(),
            sides: bodies.iter().map(|body| Side::of_shape(&body.shape)).collect(),
            control: scene.rates.control_hz,
            period_s,
            load_share: -(-period_s / LOAD_TIME_S).exp_m1(),
        }
    }

    /// The haptic period T_c, s.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// The impedance by which fingers are drawn to their targets: constant over the run, part of the loop.
    #[must_use]
    pub fn tracking(&self) -> SpringDamper {
        self.tracking
    }

    /// The state at `tick` of a user whose fingers rest as `touches` say: the first action begins there.
    #[must_use]
    pub fn begin(&self, tick: u64, touches: &[Touch], bodies: &[Pose]) -> ScriptState {
        let began = self.control.instant(tick);
        let at_rest = |touch: &Touch| FingerPath { anchor: touch.position, ..FingerPath::default() };
        let nothing = ScriptState {
            action: self.steps.len(),
            began,
            until_tick: tick,
            let_go_tick: 0,
            fingers: touches.iter().map(at_rest).collect(),
            body: None,
            centre: DVec3::ZERO,
            load_n: 0.0,
            load_at_begin_n: 0.0,
        };
        self.enter(&nothing, 0, began, touches, bodies)
    }

    /// What is asked of the fingers from `tick` to the next; `touches` are theirs at `tick`, one for each in the state, and
    /// `bodies` where the user sees the scene's bodies. To be called for ticks in order. No allocation; at most one
    /// pass over the script, however short its actions are.
    pub fn drive(&self, state: &mut ScriptState, tick: u64, touches: &[Touch], bodies: &[Pose]) -> Drives {
        if self.is_ended_by_event(state, tick, touches) {
            let next = self.after(state.action);
            *state = self.enter(state, next, self.control.instant(tick), touches, bodies);
        }
        for _ in 0..=self.steps.len() {
            if tick < state.until_tick {
                break;
            }
            let at = self.end(state);
            *state = self.enter(state, self.after(state.action), at, touches, bodies);
        }
        let elapsed_s = self.elapsed_s(state, tick);
        let force = self.force(state, tick, elapsed_s);
        let drive = |finger| Drive { force, target: self.target(state, finger, elapsed_s) };
        (0..state.fingers.len()).map(drive).collect()
    }

    /// Whether nothing is to be done any more; so of a script without actions.
    pub(crate) fn is_over(&self, state: &ScriptState) -> bool {
        state.action >= self.steps.len()
    }

    /// Whether there is anything to do.
    pub(crate) fn has_actions(&self) -> bool {
        !self.steps.is_empty()
    }

    /// Where the script is.
    pub(crate) fn place(&self, state: &ScriptState) -> PlaceInScript {
        let repeats = self.repeat && self.has_actions();
        let is_last = !repeats && state.action + 1 >= self.steps.len();
        PlaceInScript { action: state.action, began: state.began, repeats, is_last }
    }

    /// Which action comes after number `action`.
    fn after(&self, action: usize) -> usize {
        match action + 1 {
            next if next == self.steps.len() && self.repeat => 0,
            next => next.min(self.steps.len()),
        }
    }

    /// When the present action ends, if no event ends it.
    fn end(&self, state: &ScriptState) -> SessionTime {
        self.action(state.action).map_or(SessionTime(i64::MAX), |action| end_of(action, state.began))
    }

    /// The state at the beginning of action `index`, which comes after what `before` describes.
    fn enter(
        &self,
        before: &ScriptState,
        index: usize,
        began: SessionTime,
        touches: &[Touch],
        bodies: &[Pose],
    ) -> ScriptState {
        let action = self.action(index);
        let until = action.map_or(SessionTime(i64::MAX), |action| end_of(action, began));
        let mut state = ScriptState {
            action: index,
            began,
            until_tick: self.tick_at(until),
            let_go_tick: 0,
            load_at_begin_n: before.load_n,
            ..before.clone()
        };
        if let Some(&Action::PushAndLetGo { push_s, .. }) = action {
            state.let_go_tick = self.tick_at(after(began, push_s));
        }
        self.lay_paths(before, &mut state, touches, bodies);
        state
    }

    fn tick_at(&self, time: SessionTime) -> u64 {
        if time.0 == i64::MAX { u64::MAX } else { self.control.first_tick_at(time) }
    }
}

/// When `action` ends that began at `began`, if no event ends it.
fn end_of(action: &Action, began: SessionTime) -> SessionTime {
    match *action {
        Action::WaitUntil { until_s } => began.max(after(SessionTime(0), until_s)),
        _ => after(began, action.duration_s()),
    }
}

/// `duration_s` after `time`; a duration beyond all clocks never ends.
fn after(time: SessionTime, duration_s: f64) -> SessionTime {
    time.plus_ns((duration_s * 1e9).round() as i64)
}
