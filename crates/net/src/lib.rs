//! The session protocol without sockets or clocks, its wire format, and simulated links.
//!
//! The caller owns the socket and the clock; this crate is a set of values to which datagrams and instants are handed. The layers,
//! from the wire up:
//!
//! - [`StatePacket`], [`Control`] and [`encode_state`] with its like: what is said and how it looks as bytes; [`Route`]: where a
//!   peer is reached.
//! - [`ClockMap`]: agreement on one clock. Four time stamps give the offset `θ = ((t2 − t1) + (t3 − t4))/2`, off by at most half
//!   the round trip `δ = (t4 − t1) − (t3 − t2)`.
//! - [`Plausibility`]: whether a sample can be what it says, before it is used.
//! - [`PlayOutBuffer`]: when a sample is used. Scheduled: sample `j` from network step `j + n` on, so that with a latency L the
//!   data are `max(n, ⌈L/T_t⌉)` periods old.
//! - [`LinkStatistics`]: losses from sequence gaps; rms jitter `√(Σ(r_i − r̄)²/N)`.
//! - [`Endpoint`]: one host's end of a session: join, start in phase, exchange, leave, time-out, return. [`SceneFetch`] gets the
//!   scene before that.
//! - [`SecureNode`]: between an endpoint and a transport; encrypts and authenticates every datagram, and knows peers by
//!   their keys. [`Ticket`]: what one must hold to join.
//! - [`SimulatedLink`]: Gilbert–Elliott loss `p = q/(q + r)`, mean burst `1/r`, jitter, reordering, rate limit.
//! - [`Prober`]: the measurement of a real link.
//!
//! What carries datagrams between endpoints is a transport: see `cotouch_runtime::transport`.
//!
//! ```
//! use cotouch_net::{MAX_DATAGRAM, PlayOutBuffer, SimulatedLink, StatePacket, decode_state, encode_state};
//! use cotouch_scene::{names::HostIndex, scene::{Impairment, PlayOut}, time::SessionTime};
//!
//! let impairment = Impairment { latency_s: 0.003, ..Impairment::NONE };
//! let mut link = SimulatedLink::new(&impairment, 1, HostIndex(0), HostIndex(1));
//! let mut bytes = [0; MAX_DATAGRAM];
//! let packet = StatePacket { step: 5, ..StatePacket::default() };
//! let length = encode_state(7, HostIndex(0), SessionTime(5_000_000), &packet, &mut bytes)?;
//! link.send(5_000_000, &bytes[..length]);
//! let (arrival, bytes) = link.poll_delivery(8_000_000).unwrap();
//! assert_eq!(arrival, 8_000_000);
//! let mut buffer = PlayOutBuffer::new(PlayOut::Scheduled, 4);
//! buffer.insert(decode_state(bytes)?.2);
//! assert!(buffer.due_at_step(8).is_none());
//! assert_eq!(buffer.due_at_step(9), Some(&packet));
//! # Ok::<(), cotouch_net::WireError>(())
//! ```

mod backoff;
mod clock;
mod link;
mod message;
mod packet;
mod plausibility;
mod play_out;
mod probe;
mod route;
mod scene_fetch;
mod secure;
mod session;
mod statistics;
mod text;
mod wire;

pub use clock::ClockMap;
pub use link::{LinkCounts, SimulatedLink};
pub use message::{Control, Join, PeerId, Refusal, Roster, RosterEntry};
pub use packet::{ChannelVectors, Entry, StatePacket};
pub use plausibility::{Before, Implausible, Plausibility, What};
pub use play_out::{PlayOutBuffer, PlayOutCounts};
pub use probe::{ProbeConfig, ProbeReport, Prober, RateSweep, reflect_probe};
pub use route::Route;
pub use scene_fetch::{SceneFetch, SceneFetchError};
pub use secure::{
    Entropy, MAX_SEALED, PublicKey, Rejections, SealedTransmit, SecureNode, SessionKey, Ticket, TicketError,
    Unwelcome, may_be_secured,
};
pub use session::{
    Config, ConfigError, Counters, Endpoint, Event, Expelled, PeerInfo, Presence, SendError, StartWhen,
};
pub use statistics::{LinkStatistics, RoundTrip, SequenceCounts};
pub use text::{MAX_TEXT_BYTES, Text, printable};
pub use wire::{
    DatagramBytes, DatagramKind, HEADER_BYTES, Header, MAX_DATAGRAM, PROTOCOL_VERSION, Transmit, WireError,
    decode_control, decode_state, encode_control, encode_state, open,
};
