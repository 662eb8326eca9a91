//! What one host tells another about the world at one network step.

use arrayvec::ArrayVec;
use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::limits::{MAX_CHANNEL_VECTORS, MAX_ENTRIES};
use cotouch_scene::names::HostIndex;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// What a host sampled at network step `step`; it fits one datagram.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StatePacket {
    /// The network step of the sample, and so the packet's sequence number: its sample time is `step·T_t`.
    pub step: u64,
    /// What the sender sampled at that step.
    pub entries: ArrayVec<Entry, MAX_ENTRIES>,
}

/// What a coordination scheme says of one body: its vectors for translation, then those for rotation.
pub type ChannelVectors = [DVec3; 2 * MAX_CHANNEL_VECTORS];

/// One thing that a host sampled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Entry {
    /// A haptic interface point of the sender's user (a hand has one or more).
    Hand {
        /// Which of the user's points, from 0.
        point: u8,
        /// Its pose, m.
        pose: Pose,
        /// Its twist, m/s and rad/s.
        twist: Twist,
    },
    /// The sender's copy of an object.
    Object {
        /// Which object, from 0.
        object: u8,
        /// Its pose, m.
        pose: Pose,
        /// Its twist, m/s and rad/s.
        twist: Twist,
    },
    /// The wrench for one haptic interface point of the receiver's user (centralized).
    Force {
        /// Which of the user's points, from 0.
        point: u8,
        /// The wrench to render.
        wrench: Wrench,
    },
    /// What the sender's coordination scheme says to one peer about the two copies of an object (distributed).
    Channel {
        /// The peer that it is for.
        to: HostIndex,
        /// Which object, from 0.
        object: u8,
        /// What only the scheme has a meaning for; zeros where it needs fewer.
        vectors: ChannelVectors,
    },
}
