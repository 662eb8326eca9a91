//! Users, and what their simulated hands do.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::coupling::SpringDamper;

/// `[[user]]`: a user's name and what the simulated hand of that user does.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct User {
    /// Unique within the session.
    pub name: String,
    /// 1 to [`crate::limits::MAX_FINGERS`]; one at the origin where none is written.
    pub fingers: Vec<Finger>,
    /// How firmly the hand follows `reach`, `sinusoid` and `hold`; part of the loop, so the analysis compiles it.
    pub tracking: SpringDamper,
    /// What the hand does, in order.
    pub script: Vec<Action>,
    /// Whether the script starts again at its end (otherwise the hand relaxes).
    pub repeat: bool,
}

/// The spring from a pointer to the fingers of users whose scene gives them none for tracking: soft enough for a mouse's
/// stretch to be seen.
const USUAL_POINTER_SPRING: SpringDamper = SpringDamper { stiffness_n_per_m: 150.0, damping_n_s_per_m: 6.0 };

impl User {
    /// What finger number `finger` (from 0) does: its own script, or where it has none the user's.
    #[must_use]
    pub fn script_of(&self, finger: usize) -> &[Action] {
        let own = &self.fingers[finger].script;
        if own.is_empty() { &self.script } else { own }
    }

    /// The spring and damper by which finger number `finger` (from 0) follows its script. They stay between actions that track,
    /// so that one linear loop describes the whole run; a script in which none does has none.
    #[must_use]
    pub fn tracking_of(&self, finger: usize) -> SpringDamper {
        self.tracking_in(self.script_of(finger))
    }

    /// The same of the fingers that follow a script of this user's.
    #[must_use]
    pub fn tracking_in(&self, script: &[Action]) -> SpringDamper {
        if script.iter().any(Action::tracks) { self.tracking } else { SpringDamper::default() }
    }

    /// The spring from a pointer that moves the user's hand to each of its fingers: `tracking`, or a usual one where the
    /// scene has none. It is a part of the loop.
    #[must_use]
    pub fn pointer_spring(&self) -> SpringDamper {
        if self.tracking.stiffness_n_per_m > 0.0 { self.tracking } else { USUAL_POINTER_SPRING }
    }
}

/// `[[user.finger]]`: one haptic interface point of a user.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Finger {
    /// Where it rests and is at the start.
    pub position_m: DVec3,
    /// What this finger does instead of the user's script; empty: the user's script.
    pub script: Vec<Action>,
}

/// One thing that a simulated hand does, for `duration_s`. Vectors are in the world frame; a scene on a line uses x.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Action {
    /// The hand pushes with no force of its own.
    Relax {
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Stay, by tracking, where the hand was when the action began.
    Hold {
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Go by tracking to `to_m` along a minimum-jerk path (Flash & Hogan 1985).
    Reach {
        /// Where to, m, world frame.
        to_m: DVec3,
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Follow `centre + amplitude·sin(2π·f·t + phase)` by tracking, centre being where the hand was.
    Sinusoid {
        /// How far to either side, m.
        amplitude_m: DVec3,
        /// Oscillations a second, Hz.
        frequency_hz: f64,
        /// Phase of the sine when the action begins, rad.
        phase_rad: f64,
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Push with a constant force.
    Force {
        /// How hard, N.
        force_n: DVec3,
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Push with `amplitude·sin(2π·f·t + phase)`.
    SinusoidalForce {
        /// How hard to either side, N.
        amplitude_n: DVec3,
        /// Oscillations a second, Hz.
        frequency_hz: f64,
        /// Phase of the sine when the action begins, rad.
        phase_rad: f64,
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Physiological tremor: seeded band-limited force, 8 to 12 Hz.
    Tremor {
        /// Root mean square, N.
        rms_n: DVec3,
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Close the fingers on a body until each presses with `force_n`: each goes straight to the side of the body that it is
    /// at. Ends when all press, or after `duration_s`; from then on the fingers hold what they hold.
    Grasp {
        /// The name of the body that they close on.
        body: String,
        /// N, of each finger.
        force_n: f64,
        /// At what speed fingers close, m/s.
        speed_m_per_s: f64,
        /// How long it takes at most, s.
        duration_s: f64,
    },
    /// Move what is held by `by_m` along a minimum-jerk path; all fingers move alike.
    Carry {
        /// How far, m, world frame.
        by_m: DVec3,
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Move what is held until its centre is at `to_m`, as seen when the action begins.
    CarryTo {
        /// Where to, m, world frame.
        to_m: DVec3,
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Lift what is held by `height_m`, against gravity.
    Lift {
        /// How high, m; below 0 lowers it.
        height_m: f64,
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Turn what is held about its centre, about the z axis.
    Turn {
        /// How far, counter-clockwise, rad.
        angle_rad: f64,
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Push what is held with a constant force on top of the grip, shared by the fingers; it fades in and out.
    Push {
        /// N, of all fingers together.
        force_n: DVec3,
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Hold what is held until another hand takes its weight: until the load that the fingers feel has fallen to half of
    /// what it was when the action began, or `duration_s` is over.
    HandOver {
        /// How long it takes at most, s.
        duration_s: f64,
    },
    /// Open the fingers: back along the surface's normal by `distance_m`.
    LetGo {
        /// How far back, m.
        distance_m: f64,
        /// How long it takes, s.
        duration_s: f64,
    },
    /// Hold until the session's clock shows `until_s`: people who work together agree on times. Takes no time when it
    /// is later already.
    WaitUntil {
        /// s of session time.
        until_s: f64,
    },
    /// Push with a constant force for `push_s`, then let go for the rest of `duration_s`.
    PushAndLetGo {
        /// How hard, N.
        force_n: DVec3,
        /// How long the push lasts, s.
        push_s: f64,
        /// How long it takes, s.
        duration_s: f64,
    },
}

impl Action {
    /// How long it takes at most, s (from the session's start for [`Action::WaitUntil`]).
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match *self {
            Self::Relax { duration_s }
            | Self::Hold { duration_s }
            | Self::Reach { duration_s, .. }
            | Self::Sinusoid { duration_s, .. }
            | Self::Force { duration_s, .. }
            | Self::SinusoidalForce { duration_s, .. }
            | Self::Tremor { duration_s, .. }
            | Self::Grasp { duration_s, .. }
            | Self::Carry { duration_s, .. }
            | Self::CarryTo { duration_s, .. }
            | Self::Lift { duration_s, .. }
            | Self::Turn { duration_s, .. }
            | Self::Push { duration_s, .. }
            | Self::HandOver { duration_s }
            | Self::LetGo { duration_s, .. }
            | Self::PushAndLetGo { duration_s, .. } => duration_s,
            Self::WaitUntil { until_s } => until_s,
        }
    }

    /// Whether the hand tracks a path during it.
    #[must_use]
    pub fn tracks(&self) -> bool {
        !matches!(
            self,
            Self::Relax { .. }
                | Self::Force { .. }
                | Self::SinusoidalForce { .. }
                | Self::Tremor { .. }
                | Self::PushAndLetGo { .. }
        )
    }
}
