//! What comes of a tick.

use arrayvec::ArrayVec;
use cotouch_scene::geometry::{Wrench, Wrenches};
use cotouch_scene::limits::{MAX_BODIES, MAX_CONTACTS, MAX_COUPLERS, MAX_FINGERS};
use cotouch_scene::names::HostIndex;
use cotouch_world::Phase;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::model::HostModel;
use crate::soft::SlowInput;

/// What came of one tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TickOutput {
    /// The wrenches that the host asks the device to render until the next tick, one a finger, N and N·m.
    pub device: Wrenches,
    /// The wrench on this host's copy of each body, about its centre of mass, N and N·m; none at a client.
    pub wrenches: ArrayVec<Wrench, MAX_BODIES>,
    /// Every coupler that this host evaluated, those to fingers that touch a body included; the forces of any more than
    /// [`MAX_COUPLERS`] count all the same.
    pub couplers: ArrayVec<CouplerOutput, MAX_COUPLERS>,
    /// Every contact that is not free: fingers first. The forces of any more than [`MAX_CONTACTS`] count all the same.
    pub contacts: ArrayVec<ContactRecord, MAX_CONTACTS>,
    /// What goes to the slow simulation after this tick, at the ticks at which something does.
    pub slow: Option<SlowInput>,
    /// Whether a body touches a wall.
    pub touches_wall: bool,
    /// Whether the world left all bounds, now or before.
    pub diverged: bool,
}

impl TickOutput {
    /// No force on anything.
    pub(crate) fn reset(&mut self, model: &HostModel) {
        let zeros = |wrenches: usize| std::iter::repeat_n(Wrench::default(), wrenches);
        self.device.clear();
        self.device.extend(zeros(model.own_fingers()));
        self.wrenches.clear();
        self.wrenches.extend(zeros(model.body_count()));
        self.couplers.clear();
        self.contacts.clear();
        self.slow = None;
        self.touches_wall = false;
        self.diverged = false;
    }
}

/// One evaluated coupler.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CouplerOutput {
    /// Which coupler, below [`HostModel::coupler_slots`].
    pub slot: u16,
    /// Whether its far end is a held sample.
    pub held: bool,
    /// N/m (N·m/rad of a coupler for turning), faded.
    pub stiffness_n_per_m: f64,
    /// m (rad).
    pub stretch: DVec3,
}

/// One contact that is not free.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactRecord {
    /// What touches.
    pub point: ContactPoint,
    /// What is touched.
    pub surface: ContactSurface,
    /// How.
    pub phase: Phase,
    /// The force on what touches, world frame, N; faded.
    pub force: DVec3,
    /// How far it is inside, m.
    pub depth_m: f64,
}

/// A sphere that touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ContactPoint {
    /// A finger, of the own user or as last heard of.
    Finger {
        /// Whose.
        host: HostIndex,
        /// Which, from 0.
        finger: u8,
    },
    /// A sphere in the corner of a body.
    Corner {
        /// Which body, from 0.
        body: u8,
        /// Which corner, from 0.
        corner: u8,
    },
}

/// What a sphere touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ContactSurface {
    /// The surface of a body, from 0.
    Body(u8),
    /// A wall, from 0, in the scene's order.
    Wall(u8),
    /// The soft body.
    Soft,
}

/// Room for `fingers × bodies`, with a number to each pair.
const PAIRS: u16 = (MAX_FINGERS * MAX_BODIES) as u16;
/// Couplers to one peer: to its fingers, to its copies, and to their turns.
const OF_PEER: u16 = PAIRS + 2 * MAX_BODIES as u16;

impl HostModel {
    /// Couplers are numbered below this.
    #[must_use]
    pub fn coupler_slots(&self) -> usize {
        usize::from(PAIRS) + usize::from(self.users) * usize::from(OF_PEER)
    }

    /// The coupler between a finger and a body.
    pub(crate) fn finger_slot(&self, host: HostIndex, finger: usize, body: usize) -> u16 {
        let pair = (finger * MAX_BODIES + body) as u16;
        if host == self.host { pair } else { peer_slot(host.index()) + pair }
    }
}

/// The coupler to a peer's copy of a body.
pub(crate) fn copy_slot(peer: usize, body: usize) -> u16 {
    peer_slot(peer) + PAIRS + body as u16
}

/// The coupler to how a peer's copy of a body is turned.
pub(crate) fn turn_slot(peer: usize, body: usize) -> u16 {
    copy_slot(peer, body) + MAX_BODIES as u16
}

fn peer_slot(peer: usize) -> u16 {
    PAIRS + peer as u16 * OF_PEER
}
