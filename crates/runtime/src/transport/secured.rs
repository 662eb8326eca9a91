//! Datagrams that are authenticated and encrypted, over another transport.

use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use cotouch_net::{
    Entropy, MAX_DATAGRAM, MAX_SEALED, Rejections, Route, SecureNode, SessionKey, Ticket, Unwelcome,
    may_be_secured,
};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Impairment;
use cotouch_scene::time::LocalTime;

use super::impaired::Impaired;
use super::interface::{Arrival, DynTransport, Transport};
use crate::clock;

/// A server that may be unwelcoming only by the word of somebody on the way has so long to answer, ns.
const SECOND_THOUGHT_NS: i64 = 1_000_000_000;

/// Why a server was not reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Unreached {
    /// It does not take this host's calls.
    #[error(transparent)]
    Unwelcome(Unwelcome),
    /// Nothing was heard in time.
    #[error("nothing was heard")]
    Silent,
    /// It was no longer wanted.
    #[error("it was no longer wanted")]
    Unwanted,
}

/// A transport whose routes are public keys, and whose datagrams are sealed: one [`SecureNode`] over an impaired transport, whose
/// routes are addresses.
pub struct Secured {
    node: Mutex<SecureNode>,
    own: Route,
    key: SessionKey,
    inner: Impaired<DynTransport>,
    /// Datagrams that were rejected by their first bytes.
    foreign: AtomicU64,
}

impl Secured {
    /// The end of a server, with a key pair and a ticket's secret that are new.
    ///
    /// # Panics
    /// When the operating system has no random numbers.
    #[must_use]
    pub fn serve(end: Box<DynTransport>) -> Self {
        Self::new(SecureNode::serve(entropy()), end)
    }

    /// The end of a host that joins with a ticket, with a key pair that is new.
    ///
    /// # Panics
    /// When the operating system has no random numbers.
    #[must_use]
    pub fn join(end: Box<DynTransport>, ticket: Ticket, now: LocalTime) -> Self {
        Self::new(SecureNode::join(ticket.key, ticket.address, entropy(), now), end)
    }

    fn new(node: SecureNode, end: Box<DynTransport>) -> Self {
        let (own, key) = (node.route(), node.session_key());
        Self { node: Mutex::new(node), own, key, inner: Impaired::new(end), foreign: AtomicU64::new(0) }
    }

    /// The key to the session that this end serves or joins.
    #[must_use]
    pub const fn session_key(&self) -> SessionKey {
        self.key
    }

    /// The ticket to the session that this end serves.
    ///
    /// # Errors
    /// When the system does not say where this end is reached.
    pub fn ticket(&self) -> io::Result<Ticket> {
        Ok(Ticket { address: self.inner.route()?, key: self.key })
    }

    /// Calls the server until it is reached; blocks for at most `patience`, and not for long after it is no longer `wanted`.
    ///
    /// # Errors
    /// When nobody answers, the ticket or the version is another, or it is no longer wanted.
    pub fn reach_server(&self, patience: Duration, wanted: &dyn Fn() -> bool) -> Result<(), Unreached> {
        let give_up = clock::now().plus_ns(patience.as_nanos() as i64);
        while !self.call(clock::now(), self.key.server()) {
            let is_settled = |since: &LocalTime| clock::now().since(*since) >= SECOND_THOUGHT_NS;
            let unwelcome = self.node().unwelcome();
            if let Some((reason, _)) = unwelcome.filter(|(_, since)| is_settled(since)) {
                return Err(Unreached::Unwelcome(reason));
            }
            if !wanted() {
                return Err(Unreached::Unwanted);
            }
            if clock::now() >= give_up {
                return Err(Unreached::Silent);
            }
            // Nothing is expected yet but the answer, which stays below; what cannot be received is lost.
            let _: io::Result<Option<Arrival>> = self.receive(clock::now(), &mut [0; MAX_DATAGRAM]);
            self.send_due(clock::now());
        }
        Ok(())
    }

    /// Calls the host with the key `to`; whether it is reached already.
    fn call(&self, now: LocalTime, to: Route) -> bool {
        let mut node = self.node();
        node.call(now, to);
        let is_reached = node.is_reached(now, to);
        self.send_own(now, node);
        is_reached
    }

    /// What was rejected so far.
    pub fn rejections(&self) -> Rejections {
        let rejections = self.node().rejections();
        Rejections { foreign: rejections.foreign + self.foreign.load(Ordering::Relaxed), ..rejections }
    }

    /// As [`Impaired::impair`].
    pub fn impair(&self, impairment: &Impairment, seed: u64, from: HostIndex) {
        self.inner.impair(impairment, seed, from);
    }

    fn node(&self) -> MutexGuard<'_, SecureNode> {
        self.node.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends what the node itself has to say.
    fn send_own(&self, now: LocalTime, mut node: MutexGuard<'_, SecureNode>) {
        while let Some(transmit) = node.poll_transmit() {
            // What cannot be sent is lost, and said again.
            let _: io::Result<()> = self.inner.send(now, transmit.to, &transmit.bytes);
        }
    }
}

impl Transport for Secured {
    fn route(&self) -> io::Result<Route> {
        Ok(self.own)
    }

    fn receive_buffer_bytes(&self) -> Option<usize> {
        self.inner.receive_buffer_bytes()
    }

    fn send(&self, now: LocalTime, to: Route, bytes: &[u8]) -> io::Result<()> {
        let mut sealed = [0; MAX_SEALED];
        let mut node = self.node();
        let way = node.seal(now, to, bytes, &mut sealed);
        self.send_own(now, node);
        let (address, length) = way.ok_or(io::ErrorKind::NotConnected)?;
        self.inner.send(now, address, &sealed[..length])
    }

    fn set_session_origin(&self, origin: LocalTime) {
        self.inner.set_session_origin(origin);
    }

    fn receive(&self, now: LocalTime, buffer: &mut [u8]) -> io::Result<Option<Arrival>> {
        // One more byte than a sealed datagram has, so that what is longer is told apart.
        let mut sealed = [0; MAX_SEALED + 1];
        let Some(Arrival { at, from, length }) = self.inner.receive(now, &mut sealed)? else {
            return Ok(None);
        };
        // Before anything is locked: what strangers send must not hold up those who send and receive.
        if !may_be_secured(&sealed[..length]) {
            self.foreign.fetch_add(1, Ordering::Relaxed);
            return Ok(None);
        }
        let mut opened = [0; MAX_SEALED];
        let mut node = self.node();
        let said = node.open(at, from, &sealed[..length], &mut opened);
        self.send_own(at, node);
        Ok(said.map(|(from, length)| {
            let length = length.min(buffer.len());
            buffer[..length].copy_from_slice(&opened[..length]);
            Arrival { at, from, length }
        }))
    }

    fn send_due(&self, now: LocalTime) -> Option<LocalTime> {
        let mut node = self.node();
        node.handle_timeout(now);
        let next_call = node.poll_timeout();
        self.send_own(now, node);
        self.inner.send_due(now).into_iter().chain(next_call).min()
    }
}

fn entropy() -> Entropy {
    Box::new(|bytes| getrandom::fill(bytes).expect("the operating system has random numbers"))
}
