//! What a simulated hand does: a user's actions in order, as a force and a path to track.
//!
//! Two things come from a script at each tick: a force that the muscles add, and a [`Target`] that the hand is drawn
//! to by `user.tracking`. That impedance belongs to the loop, so it must not change within a run: it is there during
//! the whole run when any action of the script tracks, and absent when none does ([`Script::tracking`]).
//! During actions that do not track, the target stays at its last value, and what the action pushes comes on top.
//!
//! The target never jumps, nor does its velocity or acceleration. Each action is a path of its own plus a
//! [`Transition`] from where the target was:
//! - `reach`: the minimum-jerk path from the target's present motion to `to_m`, over the whole duration;
//! - `hold`: a fixed point; `sinusoid`: a sinusoid about a fixed point. After an action that tracked, that point is
//!   the one that was tracked last, so that a hand that lags under a load stays where it is instead of sagging
//!   further; otherwise (and at the beginning) it is where the hand was. A sinusoid after a sinusoid keeps its
//!   centre. The transition takes [`TRANSITION_S`], or the action's duration if that is shorter;
//! - all others: the last point; a target in motion comes to rest there in the same way.
//!
//! Actions begin at the first tick at or after the sum of the durations before them, and time within an action counts
//! from that sum: nothing is lost to rounding to ticks.

use std::f64::consts::TAU;

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, SpringDamper, User};
use cotouch_scene::time::{Rate, SessionTime};
use glam::DVec3;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use crate::target::{Target, Transition};
use crate::tremor::Tremor;

/// Seconds in which a target moves over to a new path (about a person's reaction time).
pub const TRANSITION_S: f64 = 0.2;

/// A user's script, ready to run: constants only.
#[derive(Clone, Debug, PartialEq)]
pub struct Script {
    actions: Vec<(Action, Option<Tremor>)>,
    repeat: bool,
    tracking: SpringDamper,
    control: Rate,
    period_s: f64,
}

/// How far a script is. A plain value: with the script and the tick it decides what comes next.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScriptState {
    /// Index of the present action; the number of actions when the script is over.
    pub action: usize,
    /// When it began, before rounding up to a tick.
    pub began: SessionTime,
    /// The first tick that does not belong to it.
    pub until_tick: u64,
    /// The first tick at which a `push-and-let-go` no longer pushes.
    pub let_go_tick: u64,
    /// The fixed point of the present path, m.
    pub anchor: DVec3,
    /// From the last path to the present one.
    pub transition: Transition,
}

/// What a script asks of the hand during one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drive {
    /// Muscle force, N.
    pub force: DVec3,
    /// Where tracking draws the hand.
    pub target: Target,
}

impl Script {
    /// The script of the user at `host`. `seed` is the scene's; each user's tremor differs.
    #[must_use]
    pub fn new(user: &User, seed: u64, host: HostIndex, control: Rate) -> Self {
        // Weyl's sequence keeps the seeds of different users apart; the generator hashes what it is given.
        let mut random = Pcg64::seed_from_u64(
            seed.wrapping_add((host.index() as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)),
        );
        let with_tremor = |action: &Action| match *action {
            Action::Tremor { rms_n, .. } => (action.clone(), Some(Tremor::new(rms_n, &mut random))),
            _ => (action.clone(), None),
        };
        let none = SpringDamper { stiffness_n_per_m: 0.0, damping_n_s_per_m: 0.0 };
        Self {
            actions: user.script.iter().map(with_tremor).collect(),
            repeat: user.repeat,
            tracking: if user.script.iter().any(Action::tracks) { user.tracking } else { none },
            control,
            period_s: control.period_s(),
        }
    }

    /// The haptic period T_c, s.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// The impedance by which the hand is drawn to the target: constant over the run, part of the loop.
    #[must_use]
    pub fn tracking(&self) -> SpringDamper {
        self.tracking
    }

    /// The state at `tick` of a hand that rests at `position` (m): the first action begins there.
    #[must_use]
    pub fn begin(&self, tick: u64, position: DVec3) -> ScriptState {
        let began = self.control.instant(tick);
        let nothing = ScriptState {
            action: self.actions.len(),
            began,
            until_tick: tick,
            let_go_tick: 0,
            anchor: position,
            transition: Transition::default(),
        };
        self.enter(&nothing, 0, began, position)
    }

    /// What is asked of the hand from `tick` to the next; `position` is the hand's at `tick`. To be called for ticks
    /// in order. No allocation; at most one pass over the script, however short its actions are.
    pub fn drive(&self, state: &mut ScriptState, tick: u64, position: DVec3) -> Drive {
        for _ in 0..=self.actions.len() {
            if tick < state.until_tick {
                break;
            }
            let (next, at) = self.next(state);
            *state = self.enter(state, next, at, position);
        }
        let elapsed_s = (tick as f64 * self.period_s - state.began.as_secs_f64()).max(0.0);
        Drive { force: self.force(state, tick, elapsed_s), target: self.target(state, elapsed_s) }
    }

    fn next(&self, state: &ScriptState) -> (usize, SessionTime) {
        let Some((action, _)) = self.actions.get(state.action) else {
            return (state.action, SessionTime(i64::MAX));
        };
        let last = state.action + 1 == self.actions.len();
        (if last && self.repeat { 0 } else { state.action + 1 }, after(state.began, action.duration_s()))
    }

    /// The state at the beginning of action `index`, which comes after what `before` describes.
    fn enter(&self, before: &ScriptState, index: usize, began: SessionTime, position: DVec3) -> ScriptState {
        let target = self.target(before, began.since(before.began) as f64 * 1e-9);
        let tracked = self.action(before.action).is_some_and(Action::tracks);
        let last_point = if tracked { target.position } else { before.anchor };
        let action = self.action(index);
        let duration_s = action.map_or(f64::INFINITY, Action::duration_s);
        let (anchor, transition_s) = match (action, self.action(before.action)) {
            (Some(&Action::Reach { to_m, .. }), _) => (to_m, duration_s),
            (Some(Action::Sinusoid { .. }), Some(Action::Sinusoid { .. })) => (before.anchor, TRANSITION_S),
            (Some(Action::Hold { .. } | Action::Sinusoid { .. }), _) if !tracked => (position, TRANSITION_S),
            _ => (last_point, TRANSITION_S),
        };
        let mut state = ScriptState {
            action: index,
            began,
            until_tick: self.first_tick_at(after(began, duration_s)),
            let_go_tick: 0,
            anchor,
            transition: Transition::default(),
        };
        if let Some(&Action::PushAndLetGo { push_s, .. }) = action {
            state.let_go_tick = self.first_tick_at(after(began, push_s));
        }
        let offset = target.minus(self.target(&state, 0.0));
        state.transition = Transition { from: offset, duration_s: transition_s.min(duration_s) };
        state
    }

    fn action(&self, index: usize) -> Option<&Action> {
        self.actions.get(index).map(|(action, _)| action)
    }

    fn target(&self, state: &ScriptState, elapsed_s: f64) -> Target {
        let path = match self.action(state.action) {
            Some(&Action::Sinusoid { amplitude_m, frequency_hz, phase_rad, .. }) => {
                let rate = TAU * frequency_hz;
                Target::on_sinusoid(state.anchor, amplitude_m, rate, rate * elapsed_s + phase_rad)
            }
            _ => Target::at(state.anchor),
        };
        if elapsed_s < state.transition.duration_s {
            path.plus(state.transition.offset(elapsed_s))
        } else {
            path
        }
    }

    fn force(&self, state: &ScriptState, tick: u64, elapsed_s: f64) -> DVec3 {
        match self.actions.get(state.action) {
            Some(&(Action::Force { force_n, .. }, _)) => force_n,
            Some(&(Action::PushAndLetGo { force_n, .. }, _)) if tick < state.let_go_tick => force_n,
            Some(&(Action::SinusoidalForce { amplitude_n, frequency_hz, phase_rad, .. }, _)) => {
                amplitude_n * (TAU * frequency_hz * elapsed_s + phase_rad).sin()
            }
            Some((Action::Tremor { .. }, Some(tremor))) => tremor.force(elapsed_s),
            _ => DVec3::ZERO,
        }
    }

    fn first_tick_at(&self, time: SessionTime) -> u64 {
        if time.0 == i64::MAX {
            return u64::MAX;
        }
        let tick = self.control.last_tick_at(time);
        if self.control.instant(tick) < time { tick + 1 } else { tick }
    }
}

/// `duration_s` after `time`; a duration beyond all clocks never ends.
fn after(time: SessionTime, duration_s: f64) -> SessionTime {
    time.plus_ns((duration_s * 1e9).round() as i64)
}
