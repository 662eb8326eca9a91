//! What was rejected.

use std::iter::Sum;

use serde::{Deserialize, Serialize};

/// Datagrams that were rejected, by reason. Nothing else came of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rejections {
    /// Not of this protocol, or of none of the secured kinds, as whoever sends without a key does.
    pub foreign: u64,
    /// Of another protocol version.
    pub other_version: u64,
    /// First messages from somebody without this session's ticket.
    pub without_ticket: u64,
    /// For no channel and no call of this host: left over from another life, or made up.
    pub unknown: u64,
    /// Not made with the keys that they pretend to be made with: forged, or damaged on the way.
    pub forged: u64,
    /// Came before, or too late to be of use: doubled or delayed by the network, or recorded and sent again.
    pub repeated: u64,
    /// First messages beyond the rate at which they are answered.
    pub throttled: u64,
}

impl Rejections {
    /// All together.
    #[must_use]
    pub const fn total(&self) -> u64 {
        self.foreign
            + self.other_version
            + self.without_ticket
            + self.unknown
            + self.forged
            + self.repeated
            + self.throttled
    }
}

impl Sum for Rejections {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |sum, one| Self {
            foreign: sum.foreign + one.foreign,
            other_version: sum.other_version + one.other_version,
            without_ticket: sum.without_ticket + one.without_ticket,
            unknown: sum.unknown + one.unknown,
            forged: sum.forged + one.forged,
            repeated: sum.repeated + one.repeated,
            throttled: sum.throttled + one.throttled,
        })
    }
}
