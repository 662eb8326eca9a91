//! One host's end of a session: who is there, what time it is, and the way of every datagram.
//!
//! [`Endpoint`] has no socket and reads no clock. The caller hands in datagrams with the route by which they came, and the time, sends what
//! [`Endpoint::poll_transmit`] returns, calls [`Endpoint::handle_timeout`] when [`Endpoint::poll_timeout`] says so, and takes
//! [`Event`]s. After every call that takes `now`, poll again.
//!
//! ```text
//! newcomer            host 0 (server)                  another host
//!    │ Join ──────────────▶ │                                │
//!    │ ◀───────── Challenge │  (nothing is remembered yet)   │
//!    │ Join with cookie ──▶ │                                │
//!    │ ◀─────────── Welcome │                                │
//!    │ Ping, Pong ◀───────▶ │  four time stamps: the clock   │
//!    │ ◀──────────── Roster │  Roster ─────────────────────▶ │
//!    │ Ping, Pong ◀─────────────────────────────────────────▶│  (distributed only)
//!    │ ◀──── Roster (origin of tick 0) ─────────────────────▶│
//!    │ State ◀──────────────┼───────────────────────────────▶│
//!    │ Leave ─────────────▶ │ ───────── (acknowledged) ─────▶│
//! ```
//!
//! Everything that must arrive is repeated with growing pauses until it is answered. A join proves by a cookie that its sender's
//! address is real before anything is remembered or more than one small reply is sent to it.
//!
//! A peer is known by its route, and each of its lives by a [`PeerId`](crate::PeerId), which it draws when it starts and which the server
//! tells all others. What comes by another route is not its. Over a network, routes are public keys, and
//! [`SecureNode`](crate::SecureNode) proves who sent what, encrypts it, and finds a peer whose address changes; over the simulated links inside one
//! process, routes are what the simulation says.

mod admission;
mod config;
mod endpoint;
mod event;
mod follower;
mod member;
mod outbox;
mod peer;
mod server;
mod timekeeping;
mod trust;

pub use config::{Config, ConfigError, StartWhen};
pub use endpoint::{Endpoint, PeerInfo};
pub use event::{Event, SendError};
pub use member::Expelled;
pub use outbox::Counters;
pub use peer::Presence;
