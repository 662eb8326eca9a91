//! The keys of a scene, except those of its lists.

use super::Fallback::{ByArchitecture, Derived, Is, Kept};
use super::{Fallback, Key, Kind, at};
use crate::scene::{Architecture, Coordination, Integrator, PlayOut, Scene, WallSides};
use crate::value::{Choice, Value};

const fn number(min: f64, max: f64) -> Kind {
    Kind::Number { min, max }
}

/// Table 6.1 of the thesis for the scene's architecture.
macro_rules! table_6_1 {
    ($distributed:literal, $centralized:literal) => {
        ByArchitecture {
            distributed: stringify!($distributed),
            centralized: stringify!($centralized),
            of: |scene: &Scene| {
                Value::Number(match scene.session.architecture {
                    Architecture::Distributed => $distributed as f64,
                    Architecture::Centralized => $centralized as f64,
                })
            },
        }
    };
}

const SLEW: Fallback<Scene> = Derived {
    says: "governor.max_force_n times rates.control_hz",
    of: |scene| Value::Number(scene.governor.max_force_n * scene.rates.control_hz.hz()),
};
const USERS: Fallback<Scene> = Kept { says: "the number of [[user]] tables, at least 2" };
const NAME: Fallback<Scene> = Kept { says: "the file's name without its ending" };

const STIFFNESS: Kind = number(0.0, 1e6);
const DAMPING: Kind = number(0.0, 1e4);
const MASS: Kind = number(1e-4, 1e3);
const FADE: Kind = number(0.0, 10.0);

/// In the order in which a scene is written.
#[rustfmt::skip]
pub(crate) static SCENE: &[Key<Scene>] = &[
    Key::new("name", Kind::Text { min: 1, max: 64 }, NAME, "", "The scene's name; two hosts may call one scene differently.", at!(name)),
    Key::new("description", Kind::Text { min: 0, max: 500 }, Is(""), "", "One sentence about the scene.", at!(description)),

    Key::new("session.architecture", Kind::Choice(Architecture::WORDS), Is("distributed"), "", "Who computes the world: host 1 for all (centralized), or every host its own copy (distributed).", at!(session.architecture)),
    Key::new("session.users", Kind::Count { min: 2, max: 16 }, USERS, "", "How many people take part, each on a host of their own.", at!(session.users)),
    Key::new("session.coordination", Kind::Choice(Coordination::WORDS), Is("pairwise"), "", "What a copy of the object is coupled to: every other copy, or the average of all; without effect when centralized.", at!(session.coordination)),
    Key::new("session.integrator", Kind::Choice(Integrator::WORDS), Is("exact-hold"), "", "How objects are stepped; hands are always exact.", at!(session.integrator)),
    Key::new("session.seed", Kind::Count { min: 0, max: i64::MAX as u64 }, Is("1"), "", "Seed of everything random: the same scene and seed give the same bytes.", at!(session.seed)),
    Key::new("session.peer_timeout_s", number(0.01, 60.0), Is("0.25"), "s", "A peer that is silent for so long has left.", at!(session.peer_timeout_s)),
    Key::new("session.peer_fade_s", FADE, Is("0.25"), "s", "Time in which the coupling to a peer fades in when it comes and out when it goes; 0 is at once.", at!(session.peer_fade_s)),

    Key::new("rates.control_hz", Kind::Rate { min: 1, max: 20_000 }, Is("1024"), "Hz", "Haptic rate, 1/T_c: forces are computed so often.", at!(rates.control_hz)),
    Key::new("rates.network_hz", Kind::Rate { min: 1, max: 20_000 }, Is("128"), "Hz", "Network rate, 1/T_t: states are sent so often; at most the haptic rate.", at!(rates.network_hz)),

    Key::new("link.delay_periods", Kind::Count { min: 0, max: 64 }, Is("1"), "network periods", "n: from sampling to use; one way when distributed, the round trip when centralized.", at!(link.delay_periods)),
    Key::new("link.return_delay_periods", Kind::Count { min: 0, max: 64 }, Is("0"), "network periods", "The part of link.delay_periods on the force's way back from the server; without effect when distributed.", at!(link.return_delay_periods)),
    Key::new("link.play_out", Kind::Choice(PlayOut::WORDS), Is("scheduled"), "", "When a received sample is used: link.delay_periods after it was taken, or on arrival.", at!(link.play_out)),

    Key::new("hand.mass_kg", MASS, Is("0.1"), "kg", "m_h: hand and moving part of the device together.", at!(hand.mass_kg)),
    Key::new("hand.damping_n_s_per_m", DAMPING, Is("0"), "N·s/m", "b_h: damping of the arm.", at!(hand.damping_n_s_per_m)),
    Key::new("hand.stiffness_n_per_m", STIFFNESS, Is("0"), "N/m", "k_h: stiffness of the arm, towards the hand's rest position at the origin.", at!(hand.stiffness_n_per_m)),

    Key::new("object.mass_kg", MASS, Is("0.4"), "kg", "m_o: mass of every copy of the object.", at!(object.mass_kg)),
    Key::new("object.damping_n_s_per_m", number(-1e3, 1e4), Is("0"), "N·s/m", "Damping to the ground; a negative value compensates the drag of the network.", at!(object.damping_n_s_per_m)),

    Key::new("coupling.hand_object.stiffness_n_per_m", STIFFNESS, table_6_1!(3000, 1000), "N/m", "k_11 = k_22: a hand and the copy on its own host; centralized k_1: the server's hand and the object.", at!(coupling.hand_object.stiffness_n_per_m)),
    Key::new("coupling.hand_object.damping_n_s_per_m", DAMPING, table_6_1!(20, 15), "N·s/m", "b_11 = b_22; centralized b_1.", at!(coupling.hand_object.damping_n_s_per_m)),
    Key::new("coupling.remote_hand_object.stiffness_n_per_m", STIFFNESS, table_6_1!(400, 85), "N/m", "k_12 = k_21: a hand and a copy on another host; centralized k_2: a client's hand and the object.", at!(coupling.remote_hand_object.stiffness_n_per_m)),
    Key::new("coupling.remote_hand_object.damping_n_s_per_m", DAMPING, table_6_1!(2, 3), "N·s/m", "b_12 = b_21; centralized b_2.", at!(coupling.remote_hand_object.damping_n_s_per_m)),
    Key::new("coupling.object_object.stiffness_n_per_m", STIFFNESS, Is("300"), "N/m", "k_o: copies of the object; without effect when centralized.", at!(coupling.object_object.stiffness_n_per_m)),
    Key::new("coupling.object_object.damping_n_s_per_m", DAMPING, Is("10"), "N·s/m", "b_o: copies of the object; without effect when centralized.", at!(coupling.object_object.damping_n_s_per_m)),

    Key::new("wall.stiffness_n_per_m", number(0.0, 1e7), Is("0"), "N/m", "k_w: the wall that the object meets; with damping 0 too there is none.", at!(wall.stiffness_n_per_m)),
    Key::new("wall.damping_n_s_per_m", DAMPING, Is("0"), "N·s/m", "b_w.", at!(wall.damping_n_s_per_m)),
    Key::new("wall.position_m", number(-10.0, 10.0), Is("0"), "m", "Where on the axis the wall is.", at!(wall.position_m)),
    Key::new("wall.sides", Kind::Choice(WallSides::WORDS), Is("two"), "", "Two: the object is always coupled to the wall, as in the thesis; one: the wall pushes towards -x and never pulls.", at!(wall.sides)),

    Key::new("governor.max_force_n", number(0.1, 1e3), Is("20"), "N", "Largest force that reaches a device.", at!(governor.max_force_n)),
    Key::new("governor.max_slew_n_per_s", number(0.01, 1e9), SLEW, "N/s", "Largest change of that force; the default admits a jump from 0 to the largest force in one tick.", at!(governor.max_slew_n_per_s)),
    Key::new("governor.watchdog_s", number(0.001, 10.0), Is("0.02"), "s", "A device that was not written for so long lets go.", at!(governor.watchdog_s)),
    Key::new("governor.soft_start_s", FADE, Is("0.25"), "s", "Time in which forces fade in at the start; 0 is at once.", at!(governor.soft_start_s)),
    Key::new("governor.release_s", FADE, Is("0.1"), "s", "Time in which forces fade out on a stop, a lost link or a fault; 0 is at once.", at!(governor.release_s)),
    Key::new("governor.damping_n_s_per_m", DAMPING, Is("0"), "N·s/m", "Damping that the governor adds at the device.", at!(governor.damping_n_s_per_m)),
];

/// What the tables of a scene are about.
pub(crate) static TABLES: &[(&str, &str)] = &[
    ("session", "Who takes part, and how hosts share the world."),
    (
        "rates",
        "The rates of the loops: a number, taken exactly as written, or a fraction such as \"1024/10\".",
    ),
    ("link", "The network between hosts."),
    ("link.impairment", "What a simulated link does to packets, in every direction without a [[link.way]]."),
    ("hand", "Every user's hand together with the moving part of the device."),
    ("object", "The shared object."),
    ("coupling", "The virtual couplers: springs with dampers."),
    ("coupling.hand_object", "Between a hand and the object on the same host."),
    ("coupling.remote_hand_object", "Between a hand and the object on another host."),
    ("coupling.object_object", "Between copies of the object (distributed)."),
    ("wall", "A plane across the axis; without stiffness and damping there is none."),
    ("governor", "Limits on every force that reaches a device."),
];

/// The list of users: [`super::parts::USER`].
pub(crate) const USER_LIST: (&str, &str) = (
    "user",
    "A user's name and what the simulated hand does; users beyond the last table are called userN and repeat the tables' scripts in turn.",
);
/// The list of ways: [`super::parts::WAY`] and [`super::parts::IMPAIRMENT`].
pub(crate) const WAY_LIST: (&str, &str) = (
    "link.way",
    "One direction with an impairment of its own; what is left out is as on a perfect link, not as in [link.impairment].",
);
/// The link file.
pub(crate) const INCLUDE: (&str, &str) = (
    "link.include",
    "A link file as `cotouch probe` writes it, relative to the scene file; keys of [link.impairment] win over it.",
);
/// Where the scene's own impairment is.
pub(crate) const LINK_IMPAIRMENT: &str = "link.impairment.";
