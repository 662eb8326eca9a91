//! The keys of what a scene has several of: impairments, ways, users and what their hands do.

use super::Fallback::{Derived, Is, Kept, Required};
use super::{Access, Fallback, Key, Kind, at, shape};
use crate::limits::MAX_USERS;
use crate::scene::{Action, Body, Finger, FixedRegion, Impairment, User, WallPlane, Way};
use crate::value::{Field as _, Value};

const SHARE: Kind = Kind::Number { min: 0.0, max: 1.0 };
const TRANSIT: Kind = Kind::Number { min: 0.0, max: 10.0 };
const OUTAGE: Kind = Kind::Number { min: 0.0, max: 1e6 };
const HOST: Kind = Kind::Count { min: 1, max: MAX_USERS as u64 };

const INDEPENDENT_LOSS: Fallback<Impairment> = Derived {
    says: "1/(1 - loss_rate): every packet is lost or not, whatever happened to the one before",
    of: |impairment| Value::Number(1.0 / (1.0 - impairment.loss_rate)),
};

/// `[link.impairment]`, every `[[link.way]]`, and `[impairment]` of a link file.
#[rustfmt::skip]
pub(crate) static IMPAIRMENT: &[Key<Impairment>] = &[
    Key::new("latency_s", TRANSIT, Is("0"), "s", "Transit time of every packet, one way.", at!(latency_s)),
    Key::new("jitter_s", TRANSIT, Is("0"), "s", "Extra transit time: the mean of an exponential distribution; packets keep their order.", at!(jitter_s)),
    Key::new("loss_rate", Kind::Number { min: 0.0, max: 0.99 }, Is("0"), "", "Share of packets lost in the long run.", at!(loss_rate)),
    Key::new("loss_burst_packets", Kind::Number { min: 1.0, max: 1e5 }, INDEPENDENT_LOSS, "packets", "Mean length of a run of lost packets (Gilbert-Elliott); at least loss_rate/(1 - loss_rate).", at!(loss_burst_packets)),
    Key::new("reorder_rate", SHARE, Is("0"), "", "Share of packets that overtake: they skip the jitter and the queue's order.", at!(reorder_rate)),
    Key::new("duplicate_rate", SHARE, Is("0"), "", "Share of packets that arrive twice.", at!(duplicate_rate)),
    Key::new("rate_limit_bytes_per_s", Kind::Number { min: 0.0, max: 1e12 }, Is("0"), "bytes/s", "What passes at most; 0 means no limit.", at!(rate_limit_bytes_per_s)),
    Key::new("outage_from_s", OUTAGE, Is("0"), "s", "Session time from which on, for outage_duration_s, no packet that is sent arrives.", at!(outage_from_s)),
    Key::new("outage_duration_s", OUTAGE, Is("0"), "s", "How long that lasts; 0 means no outage.", at!(outage_duration_s)),
];

/// `[[link.way]]`, next to [`IMPAIRMENT`].
#[rustfmt::skip]
pub(crate) static WAY: &[Key<Way>] = &[
    Key::new("from", HOST, Required, "", "The sending host.", at!(from)),
    Key::new("to", HOST, Required, "", "The receiving host.", at!(to)),
];

const NAME: Kind = Kind::Text { min: 1, max: 32 };
const BODY_NAME: Fallback<Body> = Kept { says: "bodyN" };
const PLANE_NAME: Fallback<WallPlane> = Kept { says: "wallN" };

/// `[[body]]`.
#[rustfmt::skip]
pub(crate) static BODY: &[Key<Body>] = &[
    Key::new("name", NAME, BODY_NAME, "", "The body's name, unique among bodies and walls.", at!(name)),
    Key::new("mass_kg", Kind::Number { min: 1e-4, max: 1e3 }, Is("0.4"), "kg", "Mass of every copy of the body; without effect when it is fixed.", at!(mass_kg)),
    shape::kind!("shape", shape.kind),
    shape::size!("size_m", shape.size_m),
    shape::radius!("radius_m", shape.radius_m),
    shape::length!("length_m", shape.length_m),
    shape::mesh!("mesh", shape.mesh),
    shape::mesh_scale!("mesh_scale", shape.mesh_scale),
    shape::position!("position_m", position_m),
    shape::rotation!("rotation_rad", rotation_rad),
    Key::new("fixed", Kind::Flag, Is("false"), "", "Whether it never moves: a wall of any shape.", at!(fixed)),
];

/// `[[wall.plane]]`.
#[rustfmt::skip]
pub(crate) static PLANE: &[Key<WallPlane>] = &[
    Key::new("name", NAME, PLANE_NAME, "", "The wall's name, unique among bodies and walls.", at!(name)),
    Key::new("point_m", Kind::Vector { max: 10.0 }, Required, "m", "A point of the plane.", at!(point_m)),
    Key::new("normal", Kind::Vector { max: 1e3 }, Required, "", "Where the wall pushes to: across the plane, of any length but 0.", at!(normal)),
];

/// `[[soft.fixed]]`.
#[rustfmt::skip]
pub(crate) static FIXED: &[Key<FixedRegion>] = &[
    Key::new("from_m", Kind::Vector { max: 100.0 }, Required, "m", "Its least corner.", at!(from_m)),
    Key::new("to_m", Kind::Vector { max: 100.0 }, Required, "m", "Its largest corner.", at!(to_m)),
];

const USER_NAME: Fallback<User> = Kept { says: "userN" };

/// `[[user]]`, next to the lists [`SCRIPT`] and [`FINGER_LIST`].
#[rustfmt::skip]
pub(crate) static USER: &[Key<User>] = &[
    Key::new("name", NAME, USER_NAME, "", "The user's name, unique in the session.", at!(name)),
    Key::new("tracking.stiffness_n_per_m", Kind::Number { min: 0.0, max: 1e6 }, Is("0"), "N/m", "How firmly fingers follow a path in actions that have one (hold, reach, grasp, carry and others); part of the loop that is analysed.", at!(tracking.stiffness_n_per_m)),
    Key::new("tracking.damping_n_s_per_m", Kind::Number { min: 0.0, max: 1e4 }, Is("0"), "N·s/m", "The damping of that.", at!(tracking.damping_n_s_per_m)),
    Key::new("repeat", Kind::Flag, Is("false"), "", "Whether the script starts again at its end; otherwise the hand relaxes.", at!(repeat)),
];

/// `[[user.finger]]`, next to the list [`FINGER_SCRIPT`].
#[rustfmt::skip]
pub(crate) static FINGER: &[Key<Finger>] = &[
    Key::new("position_m", Kind::Vector { max: 10.0 }, Is("0"), "m", "Where the finger rests, and is at the start.", at!(position_m)),
];

/// The list of a user's fingers: [`FINGER`].
pub(crate) const FINGER_LIST: (&str, &str) =
    ("finger", "A finger of the user, 1 to 4; where there is none, the user has one at the origin.");
/// The list of actions of one finger.
pub(crate) const FINGER_SCRIPT: (&str, &str) =
    ("script", "What this finger does in place of the user's script; left out or empty: the user's script.");
/// The list of a user's actions.
pub(crate) const SCRIPT: (&str, &str) =
    ("script", "What the simulated hand does, in order; vectors are 3 numbers, or one along x.");
/// The key that says which action it is.
pub(crate) const DO: &str = "do";

/// One kind of action.
pub(crate) struct ActionKind {
    /// The value of `do`.
    pub(crate) word: &'static str,
    pub(crate) doc: &'static str,
    /// An action of this kind before its keys are read.
    pub(crate) blank: fn() -> Action,
    pub(crate) keys: &'static [Key<Action>],
    /// Whether an action is of this kind.
    pub(crate) is: fn(&Action) -> bool,
}

/// The kind of an action.
pub(crate) fn kind_of(action: &Action) -> &'static ActionKind {
    ACTIONS.iter().find(|kind| (kind.is)(action)).unwrap_or(&ACTIONS[0])
}

/// Access to a field of one variant. The keys of a kind only ever meet actions of that kind.
macro_rules! of {
    ($variant:ident . $field:ident) => {
        Access {
            get: |action| match action {
                Action::$variant { $field, .. } => $field.value(),
                _ => Value::Flag(false),
            },
            set: |action, value| {
                if let Action::$variant { $field, .. } = action {
                    $field.assign(value);
                }
            },
        }
    };
}

const DURATION: Kind = Kind::Number { min: 1e-3, max: 86_400.0 };
const TAKES: &str = "How long it takes.";
const AT_MOST: &str = "How long it takes at most.";

macro_rules! duration {
    ($variant:ident) => {
        Key::new("duration_s", DURATION, Required, "s", TAKES, of!($variant.duration_s))
    };
}
macro_rules! at_most {
    ($variant:ident) => {
        Key::new("duration_s", DURATION, Required, "s", AT_MOST, of!($variant.duration_s))
    };
}
macro_rules! vector {
    ($variant:ident.$field:ident, $max:literal, $unit:literal, $doc:literal) => {
        Key::new(stringify!($field), Kind::Vector { max: $max }, Required, $unit, $doc, of!($variant.$field))
    };
}
macro_rules! frequency {
    ($variant:ident) => {
        Key::new(
            "frequency_hz",
            Kind::Number { min: 1e-3, max: 500.0 },
            Required,
            "Hz",
            "Oscillations a second.",
            of!($variant.frequency_hz),
        )
    };
}
macro_rules! phase {
    ($variant:ident) => {
        Key::new(
            "phase_rad",
            Kind::Number { min: -1e3, max: 1e3 },
            Is("0"),
            "rad",
            "Phase of the sine when the action begins.",
            of!($variant.phase_rad),
        )
    };
}
macro_rules! kind {
    ($word:literal, $doc:literal, $variant:ident { $($field:ident),+ }, [$($key:expr),+ $(,)?]) => {
        ActionKind {
            word: $word,
            doc: $doc,
            blank: || Action::$variant { $($field: Default::default()),+ },
            keys: const { &[$($key),+] },
            is: |action| matches!(action, Action::$variant { .. }),
        }
    };
}

/// What a simulated hand can do.
pub(crate) static ACTIONS: &[ActionKind] = &[
    kind!("relax", "No force.", Relax { duration_s }, [duration!(Relax)]),
    kind!("hold", "Stay, by tracking, where the hand was.", Hold { duration_s }, [duration!(Hold)]),
    kind!(
        "reach",
        "Go by tracking along a minimum-jerk path.",
        Reach { to_m, duration_s },
        [vector!(Reach.to_m, 10.0, "m", "Where to."), duration!(Reach),]
    ),
    kind!(
        "sinusoid",
        "Swing by tracking about where the hand was.",
        Sinusoid { amplitude_m, frequency_hz, phase_rad, duration_s },
        [
            vector!(Sinusoid.amplitude_m, 10.0, "m", "How far to either side."),
            frequency!(Sinusoid),
            phase!(Sinusoid),
            duration!(Sinusoid),
        ]
    ),
    kind!(
        "force",
        "Push with a constant force.",
        Force { force_n, duration_s },
        [vector!(Force.force_n, 1000.0, "N", "How hard."), duration!(Force),]
    ),
    kind!(
        "sinusoidal-force",
        "Push to and fro.",
        SinusoidalForce { amplitude_n, frequency_hz, phase_rad, duration_s },
        [
            vector!(SinusoidalForce.amplitude_n, 1000.0, "N", "How hard to either side."),
            frequency!(SinusoidalForce),
            phase!(SinusoidalForce),
            duration!(SinusoidalForce),
        ]
    ),
    kind!(
        "tremor",
        "Physiological tremor: 8 to 12 Hz.",
        Tremor { rms_n, duration_s },
        [vector!(Tremor.rms_n, 1000.0, "N", "Root mean square of the force."), duration!(Tremor),]
    ),
    kind!(
        "grasp",
        "Close the fingers on a body, each on the side that it is at; ends when all press, and they hold it from then on.",
        Grasp { body, force_n, speed_m_per_s, duration_s },
        [
            Key::new(
                "body",
                NAME,
                Required,
                "",
                "The body's name; \"object\" where there is no [[body]].",
                of!(Grasp.body)
            ),
            Key::new(
                "force_n",
                Kind::Number { min: 1e-3, max: 1e3 },
                Required,
                "N",
                "How hard each finger presses.",
                of!(Grasp.force_n)
            ),
            Key::new(
                "speed_m_per_s",
                Kind::Number { min: 1e-3, max: 10.0 },
                Is("0.05"),
                "m/s",
                "How fast fingers close.",
                of!(Grasp.speed_m_per_s)
            ),
            at_most!(Grasp),
        ]
    ),
    kind!(
        "carry",
        "Move what is held along a minimum-jerk path.",
        Carry { by_m, duration_s },
        [vector!(Carry.by_m, 10.0, "m", "How far."), duration!(Carry),]
    ),
    kind!(
        "carry-to",
        "Move what is held until its centre is there, as seen when the action begins.",
        CarryTo { to_m, duration_s },
        [vector!(CarryTo.to_m, 10.0, "m", "Where to."), duration!(CarryTo),]
    ),
    kind!(
        "lift",
        "Lift what is held, against gravity.",
        Lift { height_m, duration_s },
        [
            Key::new(
                "height_m",
                Kind::Number { min: -10.0, max: 10.0 },
                Required,
                "m",
                "How high; below 0 lowers it.",
                of!(Lift.height_m)
            ),
            duration!(Lift),
        ]
    ),
    kind!(
        "turn",
        "Turn what is held about its centre, about the z axis.",
        Turn { angle_rad, duration_s },
        [
            Key::new(
                "angle_rad",
                Kind::Number { min: -100.0, max: 100.0 },
                Required,
                "rad",
                "How far, counter-clockwise.",
                of!(Turn.angle_rad)
            ),
            duration!(Turn),
        ]
    ),
    kind!(
        "push",
        "Push what is held with a constant force on top of the grip, shared by the fingers; it fades in and out.",
        Push { force_n, duration_s },
        [vector!(Push.force_n, 1000.0, "N", "How hard, all fingers together."), duration!(Push),]
    ),
    kind!(
        "hand-over",
        "Hold what is held until another hand takes its weight: until the load has fallen to half of what it was.",
        HandOver { duration_s },
        [at_most!(HandOver)]
    ),
    kind!(
        "let-go",
        "Open the fingers: back from the surface.",
        LetGo { distance_m, duration_s },
        [
            Key::new(
                "distance_m",
                Kind::Number { min: 1e-3, max: 10.0 },
                Is("0.02"),
                "m",
                "How far back.",
                of!(LetGo.distance_m)
            ),
            duration!(LetGo),
        ]
    ),
    kind!(
        "wait-until",
        "Hold until the session's clock shows a time, so that people act together; takes no time when it is later already.",
        WaitUntil { until_s },
        [Key::new(
            "until_s",
            Kind::Number { min: 0.0, max: 86_400.0 },
            Required,
            "s",
            "Session time.",
            of!(WaitUntil.until_s)
        )]
    ),
    kind!(
        "push-and-let-go",
        "Push with a constant force, then let go for the rest.",
        PushAndLetGo { force_n, push_s, duration_s },
        [
            vector!(PushAndLetGo.force_n, 1000.0, "N", "How hard."),
            Key::new("push_s", DURATION, Required, "s", "How long the push lasts.", of!(PushAndLetGo.push_s)),
            duration!(PushAndLetGo),
        ]
    ),
];
