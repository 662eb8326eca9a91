//! What a session is, as typed values: the result of reading and checking a scene file.
//!
//! A [`Scene`] that exists is valid: reading makes it ([`crate::load`]), and every number in it lies in its stated range.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::names::HostIndex;
use crate::time::{Rate, Schedule};

/// A checked session description. Units are in the field names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scene {
    /// The scene's name: the built-in's name, or the file's stem.
    pub name: String,
    /// One sentence about the scene.
    pub description: String,
    /// Who takes part and how hosts share the world.
    pub session: Session,
    /// The rates of the loops.
    pub rates: Rates,
    /// The network between hosts.
    pub link: Link,
    /// Every user's hand together with the moving part of the device.
    pub hand: Hand,
    /// The shared object.
    pub object: Object,
    /// The virtual couplers.
    pub coupling: Coupling,
    /// The wall that the object meets.
    pub wall: Wall,
    /// Limits on every force that reaches a device.
    pub governor: GovernorLimits,
    /// What each user is called and does when simulated; exactly `session.users` entries.
    pub users: Vec<User>,
}

impl Scene {
    /// Which tick does which network step.
    #[must_use]
    pub fn schedule(&self) -> Schedule {
        Schedule::new(self.rates.control_hz, self.rates.network_hz).expect("checked when the scene was read")
    }

    /// The scene's hosts.
    pub fn hosts(&self) -> impl Iterator<Item = HostIndex> + Clone + use<> {
        HostIndex::all(self.session.users)
    }

    /// The impairment of the way from one host to another.
    #[must_use]
    pub fn impairment(&self, from: HostIndex, to: HostIndex) -> &Impairment {
        let of_way = self.link.ways.iter().rev().find(|way| way.from == from && way.to == to);
        of_way.map_or(&self.link.impairment, |way| &way.impairment)
    }

    /// Whole network periods that a packet from `from` is kept before use in the receiver, by `scheduled` play-out.
    ///
    /// Distributed: `link.delay_periods` each way. Centralized: the round trip is `link.delay_periods`, of which
    /// `link.return_delay_periods` lie on the force's way back and the rest on the position's way to the server.
    #[must_use]
    pub fn play_out_periods(&self, from: HostIndex) -> u32 {
        match self.session.architecture {
            Architecture::Distributed => self.link.delay_periods,
            Architecture::Centralized if from == HostIndex::FIRST => self.link.return_delay_periods,
            Architecture::Centralized => self.link.delay_periods - self.link.return_delay_periods,
        }
    }
}

/// `[session]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Session {
    /// Who computes the world.
    pub architecture: Architecture,
    /// 2 to 16.
    pub users: u8,
    /// How copies of the object are kept together (distributed).
    pub coordination: Coordination,
    /// How bodies are stepped.
    pub integrator: Integrator,
    /// Seed of everything random.
    pub seed: u64,
    /// A peer that is silent for so long has left; its coupling is released smoothly.
    pub peer_timeout_s: f64,
    /// Time in which the coupling to a peer fades in when it comes and out when it goes.
    pub peer_fade_s: f64,
}

/// Who computes the world (thesis §4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Architecture {
    /// Host 1 is the server: it keeps the one object and sends forces back.
    Centralized,
    /// Every host keeps a copy of the object; copies are coupled.
    Distributed,
}

/// How copies of the object are kept together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Coordination {
    /// Every copy is coupled to every other with k_o, b_o.
    Pairwise,
    /// Every copy is coupled with k_o, b_o to the average of all copies (its own undelayed).
    Average,
}

/// How a body of mass m is advanced by T under a held force f.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// x += T·v + T²·f/(2m), v += T·f/m: exact for a force that is held over the period.
    ExactHold,
    /// v += T·f/m, x += T·v with the new v.
    SemiImplicitEuler,
}

/// `[rates]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rates {
    /// Haptic rate, 1/T_c.
    pub control_hz: Rate,
    /// Network rate, 1/T_t; not above the haptic rate.
    pub network_hz: Rate,
}

/// `[link]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Link {
    /// n: network periods between sampling and use; one way when distributed, round trip when centralized. 0 to 64.
    pub delay_periods: u32,
    /// The part of `delay_periods` that lies on the force's way back from the server (centralized). Default 0.
    pub return_delay_periods: u32,
    /// When a received sample is used.
    pub play_out: PlayOut,
    /// What a simulated link does to packets, in every direction that `ways` does not name.
    pub impairment: Impairment,
    /// Directions with an impairment of their own.
    pub ways: Vec<Way>,
}

/// When a received sample is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlayOut {
    /// At sample time + n·T_t; a late one at the next network step.
    Scheduled,
    /// At the first haptic tick at or after its arrival.
    OnArrival,
}

/// `[[link.way]]`: one direction with an impairment of its own.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Way {
    /// Sender.
    pub from: HostIndex,
    /// Receiver.
    pub to: HostIndex,
    /// What happens on the way.
    pub impairment: Impairment,
}

/// What a simulated link does to packets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Impairment {
    /// Transit time of every packet, one way.
    pub latency_s: f64,
    /// Extra transit time: the mean of an exponential distribution. Without `reorder_rate`, order is kept.
    pub jitter_s: f64,
    /// Share of packets lost in the long run, 0 to 0.99.
    pub loss_rate: f64,
    /// Mean length of a run of lost packets, in packets, 1 or more (Gilbert–Elliott; 1/(1 − loss_rate) is independent loss).
    pub loss_burst_packets: f64,
    /// Share of packets that overtake: they skip the jitter and the queue's order.
    pub reorder_rate: f64,
    /// Share of packets that arrive twice.
    pub duplicate_rate: f64,
    /// Bytes a second that pass; 0 means no limit.
    pub rate_limit_bytes_per_s: f64,
}

impl Impairment {
    /// A perfect link.
    pub const NONE: Self = Self {
        latency_s: 0.0,
        jitter_s: 0.0,
        loss_rate: 0.0,
        loss_burst_packets: 1.0,
        reorder_rate: 0.0,
        duplicate_rate: 0.0,
        rate_limit_bytes_per_s: 0.0,
    };
}

/// `[hand]`: mass of hand and device together, and the arm's damping and stiffness to where the hand rests.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Hand {
    /// m_h.
    pub mass_kg: f64,
    /// b_h.
    pub damping_n_s_per_m: f64,
    /// k_h, towards the rest position (the origin).
    pub stiffness_n_per_m: f64,
}

/// `[object]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Object {
    /// m_o of every copy.
    pub mass_kg: f64,
    /// Damping to the ground; negative values compensate the drag of the network (thesis §6.1).
    pub damping_n_s_per_m: f64,
}

/// `[coupling]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Coupling {
    /// k_11 = k_22, b_11 = b_22; centralized: k_1, b_1.
    pub hand_object: SpringDamper,
    /// k_12 = k_21, b_12 = b_21; centralized: k_2, b_2.
    pub remote_hand_object: SpringDamper,
    /// k_o, b_o (distributed).
    pub object_object: SpringDamper,
}

/// A virtual coupler's spring and damper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpringDamper {
    /// N/m.
    pub stiffness_n_per_m: f64,
    /// N·s/m.
    pub damping_n_s_per_m: f64,
}

/// `[wall]`: a plane across the axis. Stiffness and damping 0 mean free motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Wall {
    /// k_w.
    pub stiffness_n_per_m: f64,
    /// b_w.
    pub damping_n_s_per_m: f64,
    /// Where on the axis.
    pub position_m: f64,
    /// Whether it also pulls.
    pub sides: WallSides,
}

impl Wall {
    /// Whether there is a wall at all.
    #[must_use]
    pub fn exists(&self) -> bool {
        self.stiffness_n_per_m > 0.0 || self.damping_n_s_per_m > 0.0
    }
}

/// Whether a wall also pulls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WallSides {
    /// The object is always coupled to the wall, as in the thesis's analysis: linear.
    Two,
    /// The wall pushes towards −x where the object is beyond it, and never pulls.
    One,
}

/// `[governor]`: limits on every force that reaches a device.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GovernorLimits {
    /// Largest force.
    pub max_force_n: f64,
    /// Largest change of force; the default `max_force_n · control_hz` admits 0 → F_max in one tick.
    pub max_slew_n_per_s: f64,
    /// A device that was not written for so long releases.
    pub watchdog_s: f64,
    /// Time in which forces fade in at the start.
    pub soft_start_s: f64,
    /// Time in which forces fade out on a stop, a lost link or a fault.
    pub release_s: f64,
    /// Damping that the governor adds at the device.
    pub damping_n_s_per_m: f64,
}

/// `[[user]]`: a user's name and what the simulated hand of that user does.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct User {
    /// Unique within the session.
    pub name: String,
    /// How firmly the hand follows `reach`, `sinusoid` and `hold`; part of the loop, so the analysis compiles it.
    pub tracking: SpringDamper,
    /// What the hand does, in order.
    pub script: Vec<Action>,
    /// Whether the script starts again at its end (otherwise the hand relaxes).
    pub repeat: bool,
}

/// One thing that a simulated hand does, for `duration_s`. Vectors are in the world frame; a scene on a line uses x.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Action {
    /// No force.
    Relax {
        /// s.
        duration_s: f64,
    },
    /// Stay, by tracking, where the hand was when the action began.
    Hold {
        /// s.
        duration_s: f64,
    },
    /// Go by tracking to `to_m` along a minimum-jerk path (Flash & Hogan 1985).
    Reach {
        /// m.
        to_m: DVec3,
        /// s.
        duration_s: f64,
    },
    /// Follow `centre + amplitude·sin(2π·f·t + phase)` by tracking, centre being where the hand was.
    Sinusoid {
        /// m.
        amplitude_m: DVec3,
        /// Hz.
        frequency_hz: f64,
        /// rad.
        phase_rad: f64,
        /// s.
        duration_s: f64,
    },
    /// Push with a constant force.
    Force {
        /// N.
        force_n: DVec3,
        /// s.
        duration_s: f64,
    },
    /// Push with `amplitude·sin(2π·f·t + phase)`.
    SinusoidalForce {
        /// N.
        amplitude_n: DVec3,
        /// Hz.
        frequency_hz: f64,
        /// rad.
        phase_rad: f64,
        /// s.
        duration_s: f64,
    },
    /// Physiological tremor: seeded band-limited force, 8 to 12 Hz.
    Tremor {
        /// Root mean square, N.
        rms_n: DVec3,
        /// s.
        duration_s: f64,
    },
    /// Push with a constant force for `push_s`, then let go for the rest of `duration_s`.
    PushAndLetGo {
        /// N.
        force_n: DVec3,
        /// s.
        push_s: f64,
        /// s.
        duration_s: f64,
    },
}

impl Action {
    /// How long it takes, s.
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
            | Self::PushAndLetGo { duration_s, .. } => duration_s,
        }
    }

    /// Whether the hand tracks a path during it.
    #[must_use]
    pub fn tracks(&self) -> bool {
        matches!(self, Self::Hold { .. } | Self::Reach { .. } | Self::Sinusoid { .. })
    }
}
