//! What a session's recording is made of: everything that a host consumed, and everything that came of it.
//!
//! A host's items stand in the order in which the host took them, so that feeding `Received`, `Presence`, `Surface`,
//! `Release`, `ForceOff` and `Changed` items back and ticking at every `Tick` item re-creates the run bit for bit.

use arrayvec::{ArrayString, ArrayVec};
use cotouch_device::DeviceLimits;
use cotouch_host::{ContactPoint, ContactRecord, SlowFrame};
use cotouch_net::StatePacket;
use cotouch_scene::geometry::{Readings, Wrench, Wrenches};
use cotouch_scene::limits::{MAX_BODIES, MAX_CONTACTS, MAX_FINGERS, MAX_USERS};
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::SessionTime;
use cotouch_world::BodyState;
use serde::{Deserialize, Serialize};

use crate::faults::FaultText;

/// One thing worth recording, at one host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordItem {
    /// The host that it happened at.
    pub host: HostIndex,
    /// The tick at, or before, which it happened.
    pub tick: u64,
    /// What happened there and then.
    pub kind: RecordKind,
}

/// What happened at a host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(clippy::large_enum_variant, reason = "the haptic thread makes items and must not allocate")]
pub enum RecordKind {
    /// A packet was handed to the host, before it played out for this tick.
    Received {
        /// The host that sent it.
        from: HostIndex,
        /// The packet that crossed the network.
        packet: StatePacket,
    },
    /// The host sent a packet at this tick.
    Sent {
        /// The receiver; `None` means every peer.
        to: Option<HostIndex>,
        /// The packet that crossed the network.
        packet: StatePacket,
    },
    /// A peer came or went.
    Presence {
        /// The peer that came or went.
        peer: HostIndex,
        /// Whether it is there now.
        present: bool,
    },
    /// The host was told to take the world's present state from the first peer that it hears.
    Adopt,
    /// From here on the governor lets go.
    Release,
    /// The device's force was switched off from outside, because the loop stood still; from here on forces begin again from
    /// nothing, and contacts where fingers are.
    ForceOff,
    /// From here on the session runs with other settings: the whole changed scene, as TOML.
    Changed(String),
    /// The soft body's surface of a slow period came into use at this tick. Consumed: which period's; the rest is for
    /// displays.
    Surface(SurfaceRecord),
    /// Something to read: an event in words. Not consumed by the host.
    Note(Note),
    /// One tick: what it consumed and what came of it.
    Tick(TickRecord),
    /// Which device the host has, before everything else. Consumed: what the device can render.
    Device(DeviceRecord),
    /// The whole state before this tick, once a second: where a replay can begin. Serialised by postcard.
    State(Vec<u8>),
}

/// A host's device, as far as a replay has to know it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceRecord {
    /// What the device is called.
    pub name: ArrayString<64>,
    /// The largest force that it renders at a finger, N.
    pub max_force_n: f64,
    /// The largest torque that it renders at a finger, N·m.
    pub max_torque_n_m: f64,
}

impl DeviceRecord {
    /// Of a device called `name`, of which the first 64 bytes are kept. No allocation.
    pub(crate) fn new(name: &str, limits: DeviceLimits) -> Self {
        let DeviceLimits { max_force_n, max_torque_n_m } = limits;
        let mut kept = ArrayString::new();
        let _all_that_fits: Result<(), _> = name.chars().try_for_each(|letter| kept.try_push(letter));
        Self { name: kept, max_force_n, max_torque_n_m }
    }

    /// What the device could render.
    pub(crate) fn limits(&self) -> DeviceLimits {
        DeviceLimits { max_force_n: self.max_force_n, max_torque_n_m: self.max_torque_n_m }
    }
}

/// An event that a reader of a recording wants to know of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Note {
    /// The tick came so late that ticks before it were skipped.
    Skipped {
        /// How many ticks were skipped.
        ticks: u64,
    },
    /// The device could not be read or written: its name, and why. Once for a stretch of ticks with the same reason.
    DeviceFault(FaultText),
    /// The world left all bounds.
    Diverged,
    /// The recorder could not keep up: this many of the host's items are missing here.
    Dropped {
        /// How many items are missing.
        items: u64,
    },
    /// The session ended for a reason.
    Ended(String),
}

/// A soft body as it is shown, in single precision. One element a node of the mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SurfaceRecord {
    /// The slow period whose forces led here.
    pub period: u64,
    /// K_o of all fingers that touch or are near, N/m.
    pub ko_n_per_m: f64,
    /// Where the nodes are, m.
    pub positions_m: Vec<[f32; 3]>,
    /// Von Mises stress at the nodes, Pa.
    pub stress_pa: Vec<f32>,
}

impl SurfaceRecord {
    /// Fills this with `frame`; allocates only where it has never been so large.
    pub(crate) fn fill(&mut self, frame: &SlowFrame) {
        self.period = frame.period.unwrap_or_default();
        self.ko_n_per_m = frame.ko_n_per_m;
        self.positions_m.clear();
        self.positions_m.extend(frame.positions_m.iter().map(|node| node.as_vec3().to_array()));
        self.stress_pa.clear();
        self.stress_pa.extend_from_slice(&frame.stress_pa);
    }
}

/// What one tick consumed and what came of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TickRecord {
    /// The tick's nominal instant.
    pub instant: SessionTime,
    /// What the device reported, one reading a finger; consumed.
    pub readings: Readings,
    /// Whether the device failed at this tick; consumed.
    pub device_failed: bool,
    /// The network step of the sample in use from each host.
    pub steps_in_use: ArrayVec<Option<u64>, MAX_USERS>,
    /// How far the coupling to each host has faded in, 0 to 1.
    pub fades: ArrayVec<f64, MAX_USERS>,
    /// This host's copy of every body, after the tick; at a client, the server's bodies as last heard of.
    pub bodies: ArrayVec<BodyState, MAX_BODIES>,
    /// The wrench on each of them, about its centre of mass; zero at a client.
    pub wrenches: ArrayVec<Wrench, MAX_BODIES>,
    /// Every contact at this host that is not free, fingers first; none at a client.
    pub contacts: ArrayVec<ContactRecord, MAX_CONTACTS>,
    /// What the host asked the device to render, one wrench a finger.
    pub requested: Wrenches,
    /// What the governors let through.
    pub commanded: Wrenches,
    /// Which of each governor's limits acted, as bits; see `cotouch_device::governor`.
    pub governor_acted: ArrayVec<u32, MAX_FINGERS>,
    /// Each governor's gain, 0 (released) to 1.
    pub governor_gain: ArrayVec<f64, MAX_FINGERS>,
    /// Energy that the user has put into the session so far, J.
    pub energy_j: f64,
    /// The same at each finger: what the passivity observer sees. Below 0 the session has given more than it took.
    pub finger_energy_j: ArrayVec<f64, MAX_FINGERS>,
    /// Whether a body touches a wall.
    pub touches_wall: bool,
    /// Whether the world left all bounds.
    pub diverged: bool,
    /// How late the tick began, ns (0 in virtual time).
    pub lateness_ns: i64,
    /// How long it took, ns (0 in virtual time).
    pub compute_ns: i64,
}

impl TickRecord {
    /// The contact of a finger of `host`: the deepest, where it touches several bodies.
    #[must_use]
    pub fn contact_of(&self, host: HostIndex, finger: usize) -> Option<&ContactRecord> {
        let is_of = |contact: &&ContactRecord| match contact.point {
            ContactPoint::Finger { host: of, finger: nth } => of == host && usize::from(nth) == finger,
            ContactPoint::Corner { .. } => false,
        };
        self.contacts.iter().filter(is_of).max_by(|a, b| a.depth_m.total_cmp(&b.depth_m))
    }
}
