//! Transports: how datagrams get from one host to another.
//!
//! The protocol ([`Endpoint`](cotouch_net::Endpoint)) makes datagrams and takes them in; it has no socket, reads no
//! clock, and knows a peer by its identity. A [`Transport`] carries the datagrams: it may lose, double or reorder them, which
//! the protocol is made for, but not change or join them. Where a peer is reached is a [`Route`](cotouch_net::Route),
//! which only transports look into.
//!
//! | transport | carries datagrams | used by |
//! |---|---|---|
//! | [`Udp`] | between processes and computers | [`Secured`] |
//! | [`VirtualEnd`] | over the simulated links of a [`VirtualNetwork`], in virtual time | sessions in virtual time |
//! | [`Impaired`] | over any other transport, with a simulated impairment on every way out | [`Secured`] |
//! | [`Secured`] | over an impaired one, authenticated and encrypted; its routes are public keys | sessions in real time, `probe` |
//!
//! Sessions in real time and in virtual time drive the same endpoint through this trait. In real time two threads a host do so
//! ([`NetworkThreads`](crate::NetworkThreads)): one waits in [`Transport::receive`], the other sends, and is
//! woken when there is something to send. In virtual time one loop does all of it for all hosts
//! ([`VirtualSession`](crate::VirtualSession)).
//!
//! # How to write one
//!
//! 1. Write `transport/NAME.rs` after `transport/udp.rs`: a type with the methods of [`Transport`], and a [`TransportKind`] that says
//!    how an end is opened. Routes are names that begin with the kind's scheme: `Route::Named` of `unix:/run/a.sock`, say.
//!    Every end has a route of its own, since that is how a receiver knows where to answer, and all spell it alike: a join compares
//!    routes. A named route has at most 64 bytes. `SCHEME:` alone stands for any free route, as port 0 does.
//! 2. Name the file below, and the kind in [`KINDS`] (`transport/kinds.rs`). That is all: `cotouch serve SCENE --listen NAME:…` listens with it, and
//!    `cotouch join NAME:…` joins.
//! 3. Say in `LISTENING` of the conformance suite (`tests/it/transports.rs`) where two ends can listen; it fails until then. A whole
//!    session over it stands well in `tests/it/real_time_runs.rs`.
//!
//! What the trait's methods promise:
//!
//! - Both [`send`](Transport::send) and [`receive`](Transport::receive) are called from several threads at once in real time.
//!   `send` does not wait for the network nor for a receiver whose queue is full (`SendFlags::DONTWAIT` where the system would):
//!   a datagram that cannot go out now is lost, and the error says so.
//! - `receive` waits for at most [`MAX_WAIT`], so that a thread in it sees a request to stop; in virtual time not at all.
//! - Routes may have come from another host, so they may be wrong or hostile: a route that is not this transport's is an error
//!   of `send`, never a panic. What came from where nothing can be answered is dropped by `receive`.
//! - A transport that holds datagrams back sends them in [`send_due`](Transport::send_due), which is called at the instant that
//!   it last returned, or earlier.
//!
//! Transports wrap transports: [`Impaired`] has another inside and passes on to it what it does not do itself. [`Secured`] has one
//! inside whose routes are addresses, and is one whose routes are public keys, so that a route proves who sent a datagram. What a
//! transport carries is sealed there, so no transport need encrypt; an end has room for [`MAX_SEALED`](cotouch_net::MAX_SEALED) bytes.
//!
//! ```
//! use cotouch_runtime::transport::{Transport, VirtualNetwork};
//! use cotouch_scene::{load, names::HostIndex, time::LocalTime};
//!
//! let network = VirtualNetwork::new(&load("single-axis", &["link.impairment.latency_s=0.003".parse()?])?);
//! let [near, far] = [0, 1].map(|host| network.end(HostIndex(host)));
//! near.send(LocalTime(0), far.route()?, b"hello")?;
//! let mut buffer = [0; 16];
//! assert_eq!(far.receive(LocalTime(2_999_999), &mut buffer)?, None);
//! let arrival = far.receive(LocalTime(5_000_000), &mut buffer)?.unwrap();
//! assert_eq!((arrival.at, arrival.from), (LocalTime(3_000_000), near.route()?));
//! assert_eq!(&buffer[..arrival.length], b"hello");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod impaired;
mod interface;
mod kinds;
mod secured;
mod udp;
mod virtual_network;

pub use impaired::Impaired;
pub use interface::{Arrival, DynTransport, MAX_WAIT, Transport, TransportKind};
pub use kinds::{KINDS, OpenError, RouteError, connect, is_local, listen, parse};
pub use secured::{Secured, Unreached};
pub use udp::Udp;
pub use virtual_network::{VirtualEnd, VirtualNetwork};
