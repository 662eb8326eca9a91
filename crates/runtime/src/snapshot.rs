//! What a session looks like right now: the few numbers that a display needs, the newest only.
//!
//! A haptic thread fills a [`HostSnapshot`] without allocating and passes it on through a latest-value exchange; readers
//! look whenever they like and never hold a writer up.

use std::sync::Arc;

use arrayvec::ArrayVec;
use cotouch_device::ScriptProgress;
use cotouch_host::SlowFrame;
use cotouch_scene::geometry::{Pose, Reading, Wrench};
use cotouch_scene::limits::{MAX_BODIES, MAX_FINGERS, MAX_USERS};
use cotouch_scene::names::HostIndex;
use cotouch_world::Phase;
use glam::DVec3;
use serde::Serialize;

use crate::faults::FaultText;
use crate::observer::{LiveVerdict, RunVerdict};

/// A session right now.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Snapshot {
    /// Session time of the newest tick, s.
    pub time_s: f64,
    /// What the run has been so far; `None` while it is too early to say.
    pub verdict: Option<RunVerdict>,
    /// What goes on now.
    pub now: LiveVerdict,
    /// Whether the session is over; the numbers are the last ones.
    pub ended: bool,
    /// Every host that this process knows of.
    pub hosts: Vec<HostSnapshot>,
}

/// One host right now. Vectors are in the world frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HostSnapshot {
    /// The host that this is about.
    pub host: HostIndex,
    /// Session time of the last tick, s.
    pub time_s: f64,
    /// The fingers of the host's user.
    pub fingers: ArrayVec<FingerSnapshot, MAX_FINGERS>,
    /// This host's copy of every body, in the scene's order; at a client, the server's bodies as last heard of.
    pub bodies: ArrayVec<Pose, MAX_BODIES>,
    /// The soft body as this host's fingers meet it; `None` where the host simulates none.
    #[serde(skip)]
    pub soft: Option<SurfaceShown>,
    /// How far the user is with what a script says.
    pub script: ScriptProgress,
    /// Whether a body touches a wall.
    pub touches_wall: bool,
    /// Whether the world left all bounds at this host.
    pub diverged: bool,
    /// Ticks done so far.
    pub ticks: u64,
    /// Ticks skipped so far.
    pub missed: u64,
    /// How late the latest tick since the last snapshot began, µs (0 in virtual time).
    pub lateness_us: f64,
    /// Energy that the user has put into the session so far, J.
    pub energy_j: f64,
    /// Stretches of ticks so far at which the device failed.
    pub device_fault_stretches: u64,
    /// The device's name and its reason in the last one; empty when there was none.
    pub device_fault: FaultText,
    /// What this host knows of the ways to its peers.
    pub links: ArrayVec<LinkSnapshot, MAX_USERS>,
}

impl Default for HostSnapshot {
    fn default() -> Self {
        Self {
            host: HostIndex::FIRST,
            time_s: 0.0,
            fingers: ArrayVec::new(),
            bodies: ArrayVec::new(),
            soft: None,
            script: ScriptProgress::None,
            touches_wall: false,
            diverged: false,
            ticks: 0,
            missed: 0,
            lateness_us: 0.0,
            energy_j: 0.0,
            device_fault_stretches: 0,
            device_fault: FaultText::new(),
            links: ArrayVec::new(),
        }
    }
}

/// The frame of the soft body that is in use.
#[derive(Clone, Debug)]
pub struct SurfaceShown(pub Arc<SlowFrame>);

/// Frames never change once made: the same one is equal, any other is not.
impl PartialEq for SurfaceShown {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// One finger right now.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FingerSnapshot {
    /// Where it is and how it moves.
    pub reading: Reading,
    /// What the governor let through to the device.
    pub commanded: Wrench,
    /// What it does at the body that it touches; a client, whose server knows, says free.
    pub contact: Phase,
    /// Where its centre is held as if it could not get into what it touches, m; `None` when it touches nothing.
    pub proxy: Option<DVec3>,
    /// Where a pointer draws it, m; `None` when none does.
    pub target: Option<DVec3>,
    /// Which of the governor's limits acted, as bits.
    pub governor_acted: u32,
    /// The governor's gain, 0 (released) to 1.
    pub governor_gain: f64,
    /// Energy that the user has put in at this finger so far, J.
    pub energy_j: f64,
}

/// One host's view of the way to a peer and back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LinkSnapshot {
    /// The host at the other end.
    pub peer: HostIndex,
    /// Whether it takes part.
    pub present: bool,
    /// Mean round trip, ms; not a number (`null`) before the first.
    pub round_trip_ms: f64,
    /// Standard deviation of the round trip, ms.
    pub rms_jitter_ms: f64,
    /// Packets received from the peer.
    pub received: u64,
    /// Packets that the peer sent and that never came.
    pub lost: u64,
}
