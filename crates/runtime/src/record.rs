//! What a session's recording is made of: everything that a host consumed, and everything that came of it.
//!
//! A host's items stand in the order in which the host took them, so that feeding `Received`, `Presence` and
//! `Release` items back and ticking at every `Tick` item re-creates the run bit for bit.

use arrayvec::ArrayVec;
use cotouch_host::model::MAX_USERS;
use cotouch_net::packet::StatePacket;
use cotouch_scene::geometry::{Reading, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::SessionTime;
use cotouch_world::rigid::BodyState;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// One thing worth recording, at one host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordItem {
    /// The host that it happened at.
    pub host: HostIndex,
    /// The tick at, or before, which it happened.
    pub tick: u64,
    /// What happened.
    pub kind: RecordKind,
}

/// What happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum RecordKind {
    /// A packet was handed to the host, before it played out for this tick.
    Received {
        /// The sender.
        from: HostIndex,
        /// What it said.
        packet: StatePacket,
    },
    /// The host sent a packet at this tick.
    Sent {
        /// The receiver; `None` means every peer.
        to: Option<HostIndex>,
        /// What it said.
        packet: StatePacket,
    },
    /// A peer came or went.
    Presence {
        /// Which peer.
        peer: HostIndex,
        /// Whether it is there now.
        present: bool,
    },
    /// The host was told to take the world's present state from the first peer that it hears.
    Adopt,
    /// From here on the governor lets go.
    Release,
    /// Something to read: an event in words. Not consumed by the host.
    Note(Note),
    /// One tick.
    Tick(TickRecord),
    /// The whole state before this tick, once a second: where a replay can begin. Serialised by postcard.
    State(Vec<u8>),
}

/// An event that a reader of a recording wants to know of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Note {
    /// The tick came so late that ticks before it were skipped.
    Skipped {
        /// How many.
        ticks: u64,
    },
    /// The device could not be read or written.
    DeviceFault,
    /// The world left all bounds.
    Diverged,
    /// The recorder could not keep up: this many of the host's items are missing here.
    Dropped {
        /// How many.
        items: u64,
    },
    /// The session ended for a reason.
    Ended(String),
}

/// What one tick consumed and what came of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TickRecord {
    /// The tick's nominal instant.
    pub instant: SessionTime,
    /// What the device reported; consumed.
    pub reading: Reading,
    /// Whether the device failed at this tick; consumed.
    pub device_failed: bool,
    /// The network step of the sample in use from each host.
    pub steps_in_use: ArrayVec<Option<u64>, MAX_USERS>,
    /// How far the coupling to each host has faded in, 0 to 1.
    pub fades: ArrayVec<f64, MAX_USERS>,
    /// This host's copy of the object, after the tick.
    pub object: BodyState,
    /// The force on it, N.
    pub object_force: DVec3,
    /// What the host asked the device to render.
    pub requested: Wrench,
    /// What the governor let through.
    pub commanded: Wrench,
    /// Which of the governor's limits acted, as bits; see `cotouch_device::governor`.
    pub governor_acted: u32,
    /// The governor's gain, 0 (released) to 1.
    pub governor_gain: f64,
    /// Energy that the user has put into the session so far, J.
    pub energy_j: f64,
    /// Whether the object touches the wall.
    pub touches_wall: bool,
    /// Whether the world left all bounds.
    pub diverged: bool,
    /// How late the tick began, ns (0 in virtual time).
    pub lateness_ns: i64,
    /// How long it took, ns (0 in virtual time).
    pub compute_ns: i64,
}
