//! The way of a pointer's targets to the haptic thread: the newest only, without locks.

use cotouch_device::guided::{Guide, Targets};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::SpringDamper;

/// Who moves a user's hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeldBy {
    /// The scene's script, in this process.
    Script,
    /// A pointer, in this process.
    Pointer,
    /// Somebody in another process.
    Elsewhere,
    /// Nobody: a place that is still free.
    Nobody,
}

/// A user's place in a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seat {
    /// Whose.
    pub user: HostIndex,
    /// The user's name.
    pub name: String,
    /// Who moves the hand.
    pub by: HeldBy,
}

/// Why a hand cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TakeError {
    /// There is no such user.
    #[error("this session has users 1 to {users}; there is no user {}", .user + 1)]
    NoSuchUser {
        /// From 0.
        user: u8,
        /// How many there are.
        users: u8,
    },
    /// Somebody else moves it.
    #[error("somebody else moves {name}'s hand")]
    Taken {
        /// Whose hand.
        name: String,
    },
    /// The session is over.
    #[error("the session is over")]
    Ended,
    /// A free place could not be had.
    #[error("{name}'s place cannot be had: {why}")]
    NotLetIn {
        /// Whose place.
        name: String,
        /// Why.
        why: String,
    },
}

/// A hand that a pointer moves. Dropping it lets go, smoothly.
#[derive(Debug)]
pub struct Hand {
    /// Whose.
    pub user: HostIndex,
    /// From the pointer to each finger.
    pub spring: SpringDamper,
    // The writing end of the exchange, and what lets go on drop.
}

impl Hand {
    /// Draws the fingers to `targets` (m, world). Never waits. Targets that are not finite are refused by returning false.
    pub fn point(&mut self, targets: &Targets) -> bool {
        let _ = targets;
        todo!()
    }
}

/// The haptic thread's end.
#[derive(Debug, Default)]
pub(crate) struct GuideSlot {}

impl Guide for GuideSlot {
    fn targets(&mut self) -> Option<Targets> {
        None
    }
}
