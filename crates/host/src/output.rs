//! What comes of a tick.

use arrayvec::ArrayVec;
use cotouch_scene::geometry::{Wrench, Wrenches};
use cotouch_scene::limits::{MAX_BODIES, MAX_CONTACTS};
use cotouch_scene::names::HostIndex;
use cotouch_world::Phase;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::soft::SlowInput;

/// What came of one tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TickOutput {
    /// The wrenches that the host asks the device to render until the next tick, one a finger, N and N·m.
    pub device: Wrenches,
    /// The wrench on this host's copy of each body, about its centre of mass, N and N·m; none at a client.
    pub wrenches: ArrayVec<Wrench, MAX_BODIES>,
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
    /// No force on so many fingers and bodies.
    pub(crate) fn reset(&mut self, fingers: usize, bodies: usize) {
        let zeros = |wrenches: usize| std::iter::repeat_n(Wrench::default(), wrenches);
        self.device.clear();
        self.device.extend(zeros(fingers));
        self.wrenches.clear();
        self.wrenches.extend(zeros(bodies));
        self.contacts.clear();
        self.slow = None;
        self.touches_wall = false;
        self.diverged = false;
    }

    /// Lists a contact; what finds no place in the list counts all the same.
    pub(crate) fn list_contact(&mut self, contact: ContactRecord) {
        let _ = self.contacts.try_push(contact);
    }

    /// Adds a force (N) at `point` (m) to what acts on a body about its centre of mass at `position` (m).
    pub(crate) fn push(&mut self, body: usize, position: DVec3, force: DVec3, point: DVec3) {
        let wrench = &mut self.wrenches[body];
        wrench.force += force;
        wrench.torque += (point - position).cross(force);
    }
}

/// One contact that is not free.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactRecord {
    /// What touches.
    pub point: ContactPoint,
    /// What is touched.
    pub surface: ContactSurface,
    /// Whether it is pushed to a stop, sticks or slides.
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
        /// The host of the user that it belongs to.
        host: HostIndex,
        /// Its place among that user's fingers, from 0.
        finger: u8,
    },
    /// A sphere in the corner of a body.
    Corner {
        /// The body's place in the scene's order, from 0.
        body: u8,
        /// The corner's place in the body's list, from 0.
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
