//! What one host tells another about the world at one network step.

use arrayvec::ArrayVec;
use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::limits::MAX_ENTRIES;
use serde::{Deserialize, Serialize};

/// What a host sampled at network step `step`; it fits one datagram.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StatePacket {
    /// The network step of the sample, and so the packet's sequence number: its sample time is `step·T_t`.
    pub step: u64,
    /// What was sampled.
    pub entries: ArrayVec<Entry, MAX_ENTRIES>,
}

/// One sampled thing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Entry {
    /// A haptic interface point of the sender's user (a hand has one or more).
    Hand {
        /// Which of the user's points, from 0.
        point: u8,
        /// Its pose.
        pose: Pose,
        /// Its twist.
        twist: Twist,
    },
    /// The sender's copy of an object.
    Object {
        /// Which object, from 0.
        object: u8,
        /// Its pose.
        pose: Pose,
        /// Its twist.
        twist: Twist,
    },
    /// The wrench for one haptic interface point of the receiver's user (centralized).
    Force {
        /// Which of the user's points, from 0.
        point: u8,
        /// The wrench to render.
        wrench: Wrench,
    },
}
