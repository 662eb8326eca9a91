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
//! address is real before anything is remembered or more than one small reply is sent to it. Nothing is encrypted or
//! authenticated: whoever can read the session's datagrams can forge them.
//!
//! A peer is known by its host index and its [`PeerId`](crate::PeerId), which it draws when it starts and which the server
//! tells all others. Where it is reached may change: a ping with its id from another route is followed from then on.

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

pub use config::{Config, ConfigError, StartWhen};
pub use endpoint::{Endpoint, PeerInfo};
pub use event::{Event, SendError};
pub use outbox::Counters;
pub use peer::Presence;
