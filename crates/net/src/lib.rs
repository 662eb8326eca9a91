//! The session protocol without sockets or clocks, its wire format, and simulated links.
//!
//! The caller owns the socket and the clock; this crate is a set of values to which datagrams and instants are handed. The layers,
//! from the wire up:
//!
//! - [`packet`], [`message`], [`wire`]: what is said and how it looks as bytes.
//! - [`clock`]: agreement on one clock. Four time stamps give the offset `θ = ((t2 − t1) + (t3 − t4))/2`, off by at most half the
//!   round trip `δ = (t4 − t1) − (t3 − t2)`.
//! - [`play_out`]: when a sample is used. Scheduled: sample `j` from network step `j + n` on, so that with a latency L the data are
//!   `max(n, ⌈L/T_t⌉)` periods old.
//! - [`statistics`]: losses from sequence gaps; rms jitter `√(Σ(r_i − r̄)²/N)`.
//! - [`session`]: [`Endpoint`](session::Endpoint), one host's end of a session: join, start in phase, exchange, leave, time-out,
//!   return. [`scene_fetch`] gets the scene before that.
//! - [`link`]: a simulated link with Gilbert–Elliott loss `p = q/(q + r)`, mean burst `1/r`, jitter, reordering, rate limit.
//! - [`probe`]: the measurement of a real one.
//!
//! ```
//! use cotouch_net::link::SimulatedLink;
//! use cotouch_net::packet::StatePacket;
//! use cotouch_net::play_out::PlayOutBuffer;
//! use cotouch_net::wire::{MAX_DATAGRAM, decode_state, encode_state};
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
//! # Ok::<(), cotouch_net::wire::WireError>(())
//! ```

pub mod clock;
pub mod link;
pub mod message;
pub mod packet;
pub mod play_out;
pub mod probe;
pub mod route;
pub mod scene_fetch;
pub mod session;
pub mod statistics;
pub mod text;
pub mod wire;
