//! What is expected of every transport.

use std::io;
use std::time::Duration;

use cotouch_net::Route;
use cotouch_scene::time::LocalTime;

/// The longest that [`Transport::receive`] waits in real time.
pub const MAX_WAIT: Duration = Duration::from_millis(20);

/// A transport that threads share.
pub type DynTransport = dyn Transport + Send + Sync;

/// A datagram that has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// When it did.
    pub at: LocalTime,
    /// Where it came from, and where an answer goes.
    pub from: Route,
    /// How many bytes of the buffer it takes up.
    pub length: usize,
}

/// One end of a way for datagrams; the [module](super) says how to write one.
pub trait Transport {
    /// Where others reach this end.
    ///
    /// # Errors
    /// When the system does not say.
    fn route(&self) -> io::Result<Route>;

    /// Sends a datagram of at most [`MAX_SEALED`](cotouch_net::MAX_SEALED) bytes. In virtual time `now` does not go
    /// back from call to call.
    ///
    /// # Errors
    /// When it is certain that the datagram is lost. That nobody is at `to` is none in itself.
    fn send(&self, now: LocalTime, to: Route, bytes: &[u8]) -> io::Result<()>;

    /// Puts the next datagram that has arrived at the start of `buffer`; what does not fit is cut off. Waits for one for at
    /// most [`MAX_WAIT`] in real time, and does not in virtual time, where only what arrives by `now` has arrived.
    ///
    /// # Errors
    /// When nothing can be received any more. That a peer is gone is none.
    fn receive(&self, now: LocalTime, buffer: &mut [u8]) -> io::Result<Option<Arrival>>;

    /// How many bytes of datagrams the system keeps for [`receive`](Self::receive), where it says so.
    fn receive_buffer_bytes(&self) -> Option<usize> {
        None
    }

    /// Says at which local time the session's time is 0, for a transport that does something at times of the session.
    fn set_session_origin(&self, _origin: LocalTime) {}

    /// Sends what was held back until `now`, and says when it wants to be called again at the latest.
    fn send_due(&self, _now: LocalTime) -> Option<LocalTime> {
        None
    }
}

/// A transport that can be asked for by the way in which an address is written.
#[derive(Clone, Copy, Debug)]
pub struct TransportKind {
    /// What stands in front of the first colon of its routes; `None` for sockets, whose routes are their addresses.
    pub scheme: Option<&'static str>,
    /// What an end is called in errors, such as "UDP socket".
    pub end: &'static str,
    /// Opens an end that others reach at a route.
    pub listen: fn(Route) -> io::Result<Box<DynTransport>>,
    /// Opens an end, with a route of its own, from which another can be reached.
    pub connect: fn(Route) -> io::Result<Box<DynTransport>>,
    /// Whether datagrams to a route do not leave this computer.
    pub is_local: fn(Route) -> bool,
}
