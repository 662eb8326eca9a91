//! What an endpoint tells its caller.

use cotouch_scene::names::HostIndex;
use cotouch_scene::time::{LocalTime, SessionTime};

use crate::message::Refusal;
use crate::packet::StatePacket;
use crate::plausibility::Implausible;

/// Something that happened in a session.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[expect(
    clippy::large_enum_variant,
    reason = "states are most of all events, and a box would allocate for each"
)]
pub enum Event {
    /// This host takes part.
    Welcome {
        /// This host's index from now on.
        host: HostIndex,
        /// The name of the user at that host.
        name: String,
    },
    /// This host may not take part, or no longer; the endpoint is closed.
    Refused(Refusal),
    /// Another host exchanges data with this one.
    PeerJoined {
        /// The index of the other host.
        host: HostIndex,
        /// The name of the user at that host.
        name: String,
    },
    /// A state packet came. Each comes once; the order is that of arrival.
    State {
        /// The index of the sender.
        from: HostIndex,
        /// What the sender sampled.
        packet: StatePacket,
        /// When it came, on this host's clock.
        received: LocalTime,
    },
    /// A host said good-bye.
    PeerLeft {
        /// The index of the other host.
        host: HostIndex,
        /// Why, in its words.
        reason: String,
    },
    /// A host has been silent for longer than the scene's peer time-out, or a new instance took its place.
    PeerLost {
        /// The index of the other host.
        host: HostIndex,
    },
    /// A host has begun to send what cannot be; it is not used, and the last that could stays in use.
    Implausible {
        /// The index of the other host.
        host: HostIndex,
        /// What cannot be.
        why: Implausible,
    },
    /// This host has let go of another for the rest of the session, because of what that sent.
    Expelled {
        /// The index of the other host.
        host: HostIndex,
        /// Why.
        reason: String,
    },
    /// A lost host is back: after an outage (`restarted` false), or as a new instance under the same name.
    PeerReturned {
        /// The index of the other host.
        host: HostIndex,
        /// Whether it starts anew, so that nothing held of it is worth keeping.
        restarted: bool,
    },
    /// The clock is agreed upon.
    ClockReady,
    /// The server's clock has begun to contradict what it said before, which is not followed.
    ClockContradicted {
        /// By how much, ns.
        by_ns: i64,
    },
    /// Tick 0 is set: ticks begin at session time `at` (0, or later for one who comes later), by [`Endpoint::clock`](super::Endpoint::clock).
    Started {
        /// First instant at which this host takes part.
        at: SessionTime,
    },
    /// All was said after [`Endpoint::leave`](super::Endpoint::leave); nothing more will be sent.
    Closed,
}

/// Why a state was not sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// This host does not take part (yet, or any more).
    #[error("this host does not take part in the session")]
    NotJoined,
    /// The other does not.
    #[error("{0} is not present")]
    NotPresent(HostIndex),
}
