//! The ways of samples between hosts.

use cotouch_scene::names::{Coordinate, HostIndex, Part, Quantity};

use super::coupling::{BodyId, ForceGains};
use super::delay::Delay;

/// Samples of one signal on their way from one host to another, taken at network steps and held until the next one
/// plays out.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// The receiver.
    pub host: HostIndex,
    /// The sender.
    pub from: HostIndex,
    /// What the samples are called.
    pub part: Part,
    /// What is sampled.
    pub signal: Signal,
    /// When a sample is used.
    pub delay: Delay,
}

impl Line {
    /// The name of one number of the sample of age `age` (network steps, 1 or more).
    #[must_use]
    pub fn coordinate(&self, quantity: Quantity, age: u32) -> Coordinate {
        Coordinate::Held { host: self.host, from: self.from, part: self.part, quantity, age }
    }
}

/// What a line samples.
#[derive(Clone, Debug, PartialEq)]
pub enum Signal {
    /// Positions and velocities of a body.
    Motion(BodyId),
    /// Positions of a body.
    Position(BodyId),
    /// A force, computed where it is sampled; its components lie along the world's axes x, y, z.
    Force(ForceGains),
}

impl Signal {
    /// The body whose motion is sampled.
    #[must_use]
    pub const fn body(&self) -> Option<BodyId> {
        match self {
            Self::Motion(body) | Self::Position(body) => Some(*body),
            Self::Force(_) => None,
        }
    }

    /// The force that is sampled.
    #[must_use]
    pub const fn force(&self) -> Option<&ForceGains> {
        match self {
            Self::Force(coupling) => Some(coupling),
            Self::Motion(_) | Self::Position(_) => None,
        }
    }
}
