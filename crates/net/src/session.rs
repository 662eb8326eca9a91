//! One host's end of a session: who is there, what time it is, and the way of every datagram.
//!
//! [`Endpoint`] has no socket and reads no clock. The caller hands in datagrams and the time, sends what
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

mod config;
mod follower;
mod handle;
mod peer;
mod server;

use std::collections::VecDeque;

use cotouch_scene::names::HostIndex;
use cotouch_scene::time::{LocalTime, SessionTime};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::clock::{ClockFilter, ClockMap};
use crate::message::{Control, Refusal};
use crate::packet::StatePacket;
use crate::route::Route;
use crate::statistics::LinkStatistics;
use crate::text::{self, Text};
use crate::wire::{
    DatagramBytes, Kind, MAX_DATAGRAM, Transmit, WireError, decode_control_body, encode_control,
    encode_state, open,
};

pub use config::{Config, ConfigError, StartWhen};
pub use peer::Presence;

use follower::Follower;
use peer::{Backoff, Peer};
use server::Server;

const MILLISECOND: i64 = 1_000_000;
/// A leave is repeated so often before the peer is given up.
const LEAVE_ATTEMPTS: u32 = 6;
/// Most datagrams that wait to be sent; more are dropped, as a socket would.
const MOST_TRANSMITS: usize = 512;
/// Most events that wait to be taken. States are dropped at half of it, so that they never displace the others.
const MOST_EVENTS: usize = 2048;
/// A sample from further in the future than this is not believed.
const FARTHEST_FUTURE_NS: i64 = 1_000_000_000;

/// What happened.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(
    clippy::large_enum_variant,
    reason = "states are most of all events, and a box would allocate for each"
)]
pub enum Event {
    /// This host takes part.
    Welcome {
        /// Its index.
        host: HostIndex,
        /// Its user's name.
        name: String,
    },
    /// This host may not take part, or no longer; the endpoint is closed.
    Refused(Refusal),
    /// Another host exchanges data with this one.
    PeerJoined {
        /// Which.
        host: HostIndex,
        /// Its user's name.
        name: String,
    },
    /// A state packet came. Each comes once; the order is that of arrival.
    State {
        /// From whom.
        from: HostIndex,
        /// What was sampled.
        packet: StatePacket,
        /// When it came.
        received: LocalTime,
    },
    /// A host said good-bye.
    PeerLeft {
        /// Which.
        host: HostIndex,
        /// Why, in its words.
        reason: String,
    },
    /// A host has been silent for longer than the scene's peer time-out, or a new instance took its place.
    PeerLost {
        /// Which.
        host: HostIndex,
    },
    /// A lost host is back: after an outage (`restarted` false), or as a new instance under the same name.
    PeerReturned {
        /// Which.
        host: HostIndex,
        /// Whether it starts anew, so that nothing held of it is worth keeping.
        restarted: bool,
    },
    /// The clock is agreed upon.
    ClockReady,
    /// Tick 0 is set: ticks begin at session time `at` (0, or later for one who comes later), by [`Endpoint::clock`].
    Started {
        /// First instant at which this host takes part.
        at: SessionTime,
    },
    /// All was said after [`Endpoint::leave`]; nothing more will be sent.
    Closed,
}

/// Datagrams and events that led to nothing, and why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Not readable: see [`WireError`].
    pub malformed: u64,
    /// Of another protocol version.
    pub other_version: u64,
    /// Not from an address and instance that takes part.
    pub unknown_sender: u64,
    /// Of another session.
    pub wrong_session: u64,
    /// Readable, but not what was to be expected: stale answers, samples of impossible times.
    pub unexpected: u64,
    /// States that came twice.
    pub duplicates: u64,
    /// Joins that were turned away.
    pub refused: u64,
    /// Datagrams to send or events that nobody took in time.
    pub overflowed: u64,
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

/// A peer, for display.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PeerInfo {
    /// Its index.
    pub host: HostIndex,
    /// Its user's name.
    pub name: String,
    /// Where it is reached.
    pub route: Route,
    /// Whether it is there.
    pub presence: Presence,
}

/// One host's end of a session. Deterministic: the same calls give the same answers.
#[derive(Clone, Debug)]
pub struct Endpoint {
    config: Config,
    /// Tells this life of this host from earlier ones.
    instance: u64,
    /// 0 while unknown.
    session: u64,
    /// `None` while joining.
    me: Option<HostIndex>,
    role: Role,
    phase: Phase,
    /// Those with whom this host exchanges data; at most one a host.
    peers: Vec<Peer>,
    clock: ClockFilter,
    /// Instant of tick 0 on the server's clock.
    origin_ns: Option<i64>,
    announced: Announced,
    transmits: VecDeque<Transmit>,
    events: VecDeque<Event>,
    counters: Counters,
}

#[derive(Clone, Debug)]
enum Role {
    Server(Server),
    Follower(Follower),
}

#[derive(Clone, Debug, PartialEq)]
enum Phase {
    Joining,
    Active,
    Leaving { reason: Text, repeat: Backoff, attempts: u32 },
    Closed,
}

#[derive(Clone, Copy, Debug, Default)]
struct Announced {
    clock: bool,
    start: bool,
}

impl Endpoint {
    /// Host 0, whom the others join. Its user is the scene's first.
    #[must_use]
    pub fn serve(config: Config, now: LocalTime) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(config.seed);
        let server = Server::new(random.random());
        let session = random.random();
        let mut endpoint = Self::new(config, random.random(), Role::Server(server));
        endpoint.session = session;
        endpoint.me = Some(HostIndex::FIRST);
        endpoint.phase = Phase::Active;
        let name = endpoint.config.name_of(HostIndex::FIRST);
        endpoint.push_event(Event::Welcome { host: HostIndex::FIRST, name });
        endpoint.announced.clock = true;
        endpoint.push_event(Event::ClockReady);
        endpoint.start_if_all_are_there(now);
        endpoint
    }

    /// A newcomer to the session at `server`.
    #[must_use]
    pub fn join(config: Config, server: Route, now: LocalTime) -> Self {
        let instance = Pcg64Mcg::seed_from_u64(config.seed).random();
        let follower = Follower::new(server, now, config.join_timeout_ns);
        Self::new(config, instance, Role::Follower(follower))
    }

    fn new(config: Config, instance: u64, role: Role) -> Self {
        Self {
            peers: Vec::with_capacity(config.names.len()),
            config,
            instance,
            session: 0,
            me: None,
            role,
            phase: Phase::Joining,
            clock: ClockFilter::default(),
            origin_ns: None,
            announced: Announced::default(),
            transmits: VecDeque::with_capacity(64),
            events: VecDeque::with_capacity(64),
            counters: Counters::default(),
        }
    }

    /// Takes a datagram that came from `from`. A state from a peer that is present allocates nothing. Whatever the bytes are, this does not fail; what is of no use is counted.
    pub fn handle_datagram(&mut self, now: LocalTime, from: Route, bytes: &[u8]) {
        if self.phase == Phase::Closed {
            return;
        }
        match open(bytes) {
            Ok((header, body)) => match header.kind {
                Kind::State => self.handle_state(now, from, header, body),
                Kind::Control => match decode_control_body(body) {
                    Ok(control) => self.handle_control(now, from, header, control),
                    Err(_) => self.counters.malformed += 1,
                },
                Kind::Probe | Kind::Echo => self.counters.unexpected += 1,
            },
            Err(WireError::Version { found, session, from_newcomer }) => {
                self.handle_other_version(from, found, session, from_newcomer);
            }
            Err(_) => self.counters.malformed += 1,
        }
    }

    /// The next datagram to send. The time stamps in it were taken when it was made, so poll without delay.
    pub fn poll_transmit(&mut self, _now: LocalTime) -> Option<Transmit> {
        self.transmits.pop_front()
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// When to call [`Self::handle_timeout`] at the latest; `None` while nothing is due.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<LocalTime> {
        match &self.phase {
            Phase::Closed => None,
            Phase::Leaving { repeat, .. } => Some(repeat.due()),
            Phase::Joining => self.follower().map(Follower::due),
            Phase::Active => {
                let is_server = matches!(self.role, Role::Server(_));
                let due = |peer: &Peer| peer.due(self.config.peer_timeout_ns, is_server);
                self.peers.iter().filter_map(due).min()
            }
        }
    }

    /// Does what is due: repeats, pings, time-outs. Calling it early or twice does no harm.
    pub fn handle_timeout(&mut self, now: LocalTime) {
        match self.phase {
            Phase::Closed => {}
            Phase::Leaving { .. } => self.repeat_leave(now),
            Phase::Joining => self.drive_join(now),
            Phase::Active => {
                self.lose_silent_peers(now);
                self.send_due_pings(now);
                self.send_due_rosters(now);
                self.start_if_all_are_there(now);
            }
        }
    }

    /// Sends a state to one host. Does not allocate while sending keeps up.
    ///
    /// # Errors
    /// When this host or the other does not take part.
    pub fn send_state(
        &mut self,
        _now: LocalTime,
        packet: &StatePacket,
        to: HostIndex,
    ) -> Result<(), SendError> {
        let bytes = self.state_datagram(packet)?;
        let peer = self.peers.iter_mut().find(|peer| peer.host == to && peer.presence == Presence::Present);
        let peer = peer.ok_or(SendError::NotPresent(to))?;
        peer.sent += 1;
        let to = peer.route;
        self.push_transmit(Transmit { to, bytes });
        Ok(())
    }

    /// Sends a state to every peer that is present and returns to how many. Does not allocate while sending keeps up.
    ///
    /// # Errors
    /// When this host does not take part.
    pub fn send_state_to_all(&mut self, _now: LocalTime, packet: &StatePacket) -> Result<usize, SendError> {
        let bytes = self.state_datagram(packet)?;
        let mut count = 0;
        for index in 0..self.peers.len() {
            let peer = &mut self.peers[index];
            if peer.presence == Presence::Present {
                peer.sent += 1;
                count += 1;
                let to = peer.route;
                self.push_transmit(Transmit { to, bytes: bytes.clone() });
            }
        }
        Ok(count)
    }

    fn state_datagram(&self, packet: &StatePacket) -> Result<DatagramBytes, SendError> {
        let me = self.me.filter(|_| self.phase == Phase::Active).ok_or(SendError::NotJoined)?;
        let mut bytes = DatagramBytes::from([0; MAX_DATAGRAM]);
        let sample_time = self.config.network_hz.instant(packet.step);
        let length = encode_state(self.session, me, sample_time, packet, &mut bytes);
        bytes.truncate(length.expect("a state packet fits a datagram, as wire.rs asserts"));
        Ok(bytes)
    }

    /// Says good-bye to all, in words; [`Event::Closed`] follows when all know or do not answer (within 2 s).
    pub fn leave(&mut self, now: LocalTime, reason: &str) {
        match self.phase {
            Phase::Joining => self.close(),
            Phase::Active => {
                let reason = text::shortened(reason);
                self.phase = Phase::Leaving { reason, repeat: Backoff::from(now), attempts: 0 };
                self.repeat_leave(now);
            }
            Phase::Leaving { .. } | Phase::Closed => {}
        }
    }

    /// The map from this host's clock to the session's, once tick 0 is set and the clock agreed upon.
    #[must_use]
    pub fn clock(&self) -> Option<ClockMap> {
        let origin_ns = self.origin_ns.filter(|_| self.announced.start)?;
        match self.role {
            Role::Server(_) => Some(ClockMap::exact(LocalTime(origin_ns))),
            Role::Follower(_) => Some(self.clock.map()?.with_origin(origin_ns)),
        }
    }

    /// This host's index, once it was welcomed.
    #[must_use]
    pub const fn host(&self) -> Option<HostIndex> {
        self.me
    }

    /// Whether nothing more will happen.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.phase == Phase::Closed
    }

    /// What the link to a peer did so far.
    #[must_use]
    pub fn statistics(&self, host: HostIndex) -> Option<LinkStatistics> {
        self.peers.iter().find(|peer| peer.host == host).map(Peer::statistics)
    }

    /// Those with whom this host exchanges or exchanged data.
    pub fn peers(&self) -> impl Iterator<Item = PeerInfo> {
        self.peers.iter().map(|peer| PeerInfo {
            host: peer.host,
            name: self.config.name_of(peer.host),
            route: peer.route,
            presence: peer.presence,
        })
    }

    /// What led to nothing so far.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    fn repeat_leave(&mut self, now: LocalTime) {
        let Phase::Leaving { reason, repeat, attempts } = &mut self.phase else { return };
        if now < repeat.due() {
            return;
        }
        let leave = Control::Leave { instance: self.instance, reason: *reason };
        *attempts += 1;
        repeat.again(now);
        let given_up = *attempts > LEAVE_ATTEMPTS;
        if given_up || self.peers.iter().all(|peer| peer.presence == Presence::Left) {
            return self.close();
        }
        for index in 0..self.peers.len() {
            if self.peers[index].presence != Presence::Left {
                self.send(self.peers[index].route, &leave);
            }
        }
    }

    fn close(&mut self) {
        if self.phase != Phase::Closed {
            self.phase = Phase::Closed;
            self.push_event(Event::Closed);
        }
    }

    fn handle_other_version(&mut self, from: Route, found: u16, session: u64, from_newcomer: bool) {
        self.counters.other_version += 1;
        match &self.role {
            // Answers of ours are not from newcomers, so two versions never answer each other for ever.
            Role::Server(_) if from_newcomer => {
                self.counters.refused += 1;
                let refusal = Refusal::Version { server: crate::wire::PROTOCOL_VERSION, newcomer: found };
                self.send_refusal(from, session, refusal);
            }
            Role::Follower(follower)
                if self.phase == Phase::Joining && follower.server == from && session == self.instance =>
            {
                let refusal = Refusal::Version { server: found, newcomer: crate::wire::PROTOCOL_VERSION };
                self.be_refused(refusal);
            }
            _ => {}
        }
    }

    fn peer_mut(&mut self, host: HostIndex) -> Option<&mut Peer> {
        self.peers.iter_mut().find(|peer| peer.host == host)
    }

    const fn follower(&self) -> Option<&Follower> {
        match &self.role {
            Role::Follower(follower) => Some(follower),
            Role::Server(_) => None,
        }
    }

    fn send(&mut self, to: Route, control: &Control) {
        self.send_as(self.session, to, control);
    }

    fn send_refusal(&mut self, to: Route, instance: u64, refusal: Refusal) {
        self.send_as(instance, to, &Control::Refuse(refusal));
    }

    fn send_as(&mut self, session: u64, to: Route, control: &Control) {
        let bytes = encode_control(session, self.me, control);
        let bytes = bytes.expect("every message's fields are bounded so that it fits a datagram");
        self.push_transmit(Transmit { to, bytes });
    }

    fn push_transmit(&mut self, transmit: Transmit) {
        if self.transmits.len() < MOST_TRANSMITS {
            self.transmits.push_back(transmit);
        } else {
            self.counters.overflowed += 1;
        }
    }

    fn push_event(&mut self, event: Event) {
        let room = if matches!(event, Event::State { .. }) { MOST_EVENTS / 2 } else { MOST_EVENTS };
        if self.events.len() < room {
            self.events.push_back(event);
        } else {
            self.counters.overflowed += 1;
        }
    }
}
