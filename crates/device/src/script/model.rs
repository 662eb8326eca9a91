//! What a script consists of, how far it is, and what it asks for.

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::scene::{Action, Space, SpringDamper};
use cotouch_scene::time::{Rate, SessionTime};
use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::side::Side;
use crate::target::{Target, Transition};
use crate::tremor::Tremor;

/// Seconds in which a target moves over to a new path, a finger gains its closing speed and a push fades in or out
/// (about a person's reaction time).
pub const TRANSITION_S: f64 = 0.2;

/// The shortest time in which a closing finger that presses comes to rest, s.
pub(super) const SHORTEST_STOP_S: f64 = 0.05;

/// Time constant with which a user judges a load, s.
pub(super) const LOAD_TIME_S: f64 = 0.05;

/// A script, ready to run: constants only.
#[derive(Clone, Debug, PartialEq)]
pub struct Script {
    pub(super) steps: Vec<Step>,
    pub(super) repeat: bool,
    pub(super) tracking: SpringDamper,
    /// Of all springs to where a finger rests, which a pressing one must overcome.
    pub(super) hand_stiffness_n_per_m: f64,
    pub(super) space: Space,
    /// The direction of gravity, if there is any.
    pub(super) down: Option<DVec3>,
    /// From which side fingers go at each body.
    pub(super) sides: Vec<Side>,
    pub(super) control: Rate,
    pub(super) period_s: f64,
    /// The share of a new load that is taken in at a tick, 1 − e^{−T/[`LOAD_TIME_S`]}.
    pub(super) load_share: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Step {
    pub(super) action: Action,
    pub(super) tremor: Option<Tremor>,
    /// The body that a `grasp` names.
    pub(super) body: Option<usize>,
}

/// How far a script is. A plain value: with the script, the tick, and what is felt and seen it decides what comes next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScriptState {
    /// Index of the present action; the number of actions when the script is over.
    pub action: usize,
    /// When it began, before rounding up to a tick.
    pub began: SessionTime,
    /// The first tick that does not belong to it (unless an event ends it before).
    pub until_tick: u64,
    /// The first tick at which a `push-and-let-go` no longer pushes.
    pub let_go_tick: u64,
    /// One a finger that follows the script.
    pub fingers: ArrayVec<FingerPath, MAX_FINGERS>,
    /// The body that was grasped last.
    pub body: Option<usize>,
    /// What a `turn` turns about, m.
    pub centre: DVec3,
    /// The sum of the forces that the fingers feel, along gravity, smoothed, N.
    pub load_n: f64,
    /// The same when the present action began.
    pub load_at_begin_n: f64,
}

/// Where a script is, for who follows it from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlaceInScript {
    /// Index of the present action; the number of actions when the script is over.
    pub action: usize,
    /// When that action began, session time.
    pub began: SessionTime,
    /// Whether the script begins again at its end.
    pub repeats: bool,
    /// Whether no action comes after the present one.
    pub is_last: bool,
}

/// The path that one finger's target follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FingerPath {
    /// The fixed point of the present path, m.
    pub anchor: DVec3,
    /// By how much a `carry`, `carry-to`, `lift` or `let-go` moves it in all, m.
    pub shift: DVec3,
    /// From the last path to the present one.
    pub transition: Transition,
    /// When the transition began, s after the action; negative for one that an action before left unfinished.
    pub transition_began_s: f64,
    /// Whether the finger is on its way to a body that it is to grasp.
    pub closing: bool,
    /// Where a `grasp` presses to, a unit vector; zero before the first one.
    pub approach: DVec3,
    /// The same in the body's frame.
    pub grip: DVec3,
}

/// What a finger is and feels at a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Touch {
    /// Where the finger is, m.
    pub position: DVec3,
    /// Where the arm draws it, m.
    pub rest: DVec3,
    /// The device's force on it, without that of the spring to where it started, N.
    pub felt: DVec3,
}

/// What a script asks of a finger during one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drive {
    /// The force that the muscles add, N.
    pub force: DVec3,
    /// Where tracking draws the finger.
    pub target: Target,
}

/// One drive a finger.
pub type Drives = ArrayVec<Drive, MAX_FINGERS>;

impl Script {
    /// The action of that number; `None` when the script is over.
    pub(super) fn action(&self, index: usize) -> Option<&Action> {
        self.steps.get(index).map(|step| &step.action)
    }

    /// For how long the present action has gone on at `tick`, s.
    pub(super) fn elapsed_s(&self, state: &ScriptState, tick: u64) -> f64 {
        (tick as f64 * self.period_s - state.began.as_secs_f64()).max(0.0)
    }
}
