//! What every host of a session does: it knows its peers, exchanges states and pings with them, notices their silence, and
//! says good-bye.

use arrayvec::ArrayVec;
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::{LocalTime, SessionTime};

use super::config::Config;
use super::event::{Event, SendError};
use super::outbox::Outbox;
use super::peer::{PING_PERIOD_NS, Peer, Presence, REACHABLE_NS};
use super::timekeeping::Timekeeping;
use super::trust::Offence;
use crate::backoff::Backoff;
use crate::clock::Exchange;
use crate::message::{Control, PeerId, Refusal};
use crate::packet::StatePacket;
use crate::plausibility::Implausible;
use crate::route::Route;
use crate::statistics::ArrivalOrder;
use crate::text::{self, Text};
use crate::wire::{
    DatagramBytes, Header, MAX_DATAGRAM, Transmit, decode_state_body, encode_control, encode_state,
};

/// A leave is repeated so often before the peer is given up.
const LEAVE_ATTEMPTS: u32 = 6;
/// A sample from further in the future than this is not believed.
const MAX_AHEAD_NS: i64 = 1_000_000_000;
/// Most expelled hosts that are remembered.
const MAX_EXPELLED: usize = 64;
/// Why a host is let go of that says, by a sample without entries, that it has no world any more.
const DIVERGED: &str = "its world has diverged";

/// One host as a member of a session, whether it serves or follows.
#[derive(Clone, Debug)]
pub(super) struct Member {
    pub(super) config: Config,
    pub(super) id: PeerId,
    /// The id of the session; 0 while it is unknown.
    pub(super) session: u64,
    /// The index of this host; `None` while it joins.
    pub(super) host: Option<HostIndex>,
    pub(super) phase: Membership,
    /// Those with whom this host exchanges data; at most one a host.
    pub(super) peers: Vec<Peer>,
    pub(super) time: Timekeeping,
    pub(super) outbox: Outbox,
    /// Those who may not return, the latest last.
    pub(super) expelled: ArrayVec<Expelled, MAX_EXPELLED>,
}

/// A host that was let go of for the rest of the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Expelled {
    /// By which it was reached: over a network its key, which is let in no more.
    pub(super) route: Route,
    /// The index that it had.
    pub host: HostIndex,
    /// Why.
    pub reason: Text,
    /// When, where the session had begun.
    pub at: Option<SessionTime>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Membership {
    Joining,
    Active,
    Leaving { reason: Text, repeat: Backoff, attempts: u32 },
    Closed,
}

/// What became of a ping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PingOutcome {
    Answered,
    /// It came from somebody who had a member's place once.
    Stale,
    Ignored,
}

impl Member {
    pub(super) fn new(config: Config, id: PeerId, time: Timekeeping) -> Self {
        Self {
            peers: Vec::with_capacity(config.names.len()),
            config,
            id,
            session: 0,
            host: None,
            phase: Membership::Joining,
            time,
            outbox: Outbox::new(),
            expelled: ArrayVec::new(),
        }
    }

    pub(super) fn become_active(&mut self, session: u64, host: HostIndex) {
        self.session = session;
        self.host = Some(host);
        self.phase = Membership::Active;
        self.outbox.tell(Event::Welcome { host, name: self.config.name_of(host) });
    }

    pub(super) fn close(&mut self) {
        if self.phase != Membership::Closed {
            self.phase = Membership::Closed;
            self.outbox.tell(Event::Closed);
        }
    }

    pub(super) fn close_refused(&mut self, refusal: Refusal) {
        self.phase = Membership::Closed;
        self.outbox.tell(Event::Refused(refusal));
    }

    pub(super) fn peer_mut(&mut self, host: HostIndex) -> Option<&mut Peer> {
        self.peers.iter_mut().find(|peer| peer.host == host)
    }

    /// When a peer that is expected, present or lost wants something to be done.
    pub(super) fn due(&self, tells_roster: bool) -> Option<LocalTime> {
        self.peers.iter().filter_map(|peer| peer.due(self.config.peer_timeout_ns, tells_roster)).min()
    }

    pub(super) fn send(&mut self, to: Route, control: &Control) {
        self.send_as(self.session, to, control);
    }

    /// Sends a message that answers one who is not a member (yet): it carries their id in place of the session's.
    pub(super) fn send_to_newcomer(&mut self, newcomer: PeerId, to: Route, control: &Control) {
        self.send_as(newcomer.0, to, control);
    }

    pub(super) fn send_refusal(&mut self, newcomer: PeerId, to: Route, refusal: Refusal) {
        self.send_to_newcomer(newcomer, to, &Control::Refuse(refusal));
    }

    fn send_as(&mut self, session: u64, to: Route, control: &Control) {
        let bytes = encode_control(session, self.host, control);
        let bytes = bytes.expect("every message's fields are bounded so that it fits a datagram");
        self.outbox.send(Transmit { to, bytes });
    }

    pub(super) fn send_state(&mut self, packet: &StatePacket, to: HostIndex) -> Result<(), SendError> {
        let bytes = self.state_datagram(packet)?;
        let peer = self.peer_mut(to).filter(|peer| peer.takes_samples());
        let peer = peer.ok_or(SendError::NotPresent(to))?;
        peer.sent += 1;
        let to = peer.route;
        self.outbox.send(Transmit { to, bytes });
        Ok(())
    }

    pub(super) fn send_state_to_all(&mut self, packet: &StatePacket) -> Result<usize, SendError> {
        let bytes = self.state_datagram(packet)?;
        let mut count = 0;
        for peer in self.peers.iter_mut().filter(|peer| peer.takes_samples()) {
            peer.sent += 1;
            count += 1;
            self.outbox.send(Transmit { to: peer.route, bytes: bytes.clone() });
        }
        Ok(count)
    }

    fn state_datagram(&self, packet: &StatePacket) -> Result<DatagramBytes, SendError> {
        let host = self.host.filter(|_| self.phase == Membership::Active).ok_or(SendError::NotJoined)?;
        let mut bytes = DatagramBytes::from([0; MAX_DATAGRAM]);
        let sample_time = self.config.network_hz.instant(packet.step);
        let length = encode_state(self.session, host, sample_time, packet, &mut bytes);
        bytes.truncate(length.expect("a state packet fits a datagram, as wire.rs asserts"));
        Ok(bytes)
    }

    /// Takes a datagram with a state; whether its sender was expelled for it.
    pub(super) fn handle_state(&mut self, now: LocalTime, from: Route, header: Header, body: &[u8]) -> bool {
        let counters = &mut self.outbox.counters;
        if header.session != self.session || self.phase != Membership::Active {
            counters.wrong_session += 1;
            return false;
        }
        let is_sender = |peer: &Peer| {
            Some(peer.host) == header.sender && peer.route == from && peer.presence != Presence::Left
        };
        let Some(index) = self.peers.iter().position(is_sender) else {
            counters.unknown_sender += 1;
            return false;
        };
        match decode_state_body(body) {
            Ok((sample_time, packet)) => self.take_sample(now, index, sample_time, packet),
            Err(_) => {
                counters.malformed += 1;
                self.refuse_sample(now, index, None, Implausible::Unreadable)
            }
        }
    }

    /// Takes a sample of the peer at `index`; whether it was expelled for it.
    fn take_sample(
        &mut self,
        now: LocalTime,
        index: usize,
        sample_time: SessionTime,
        packet: StatePacket,
    ) -> bool {
        let session_now = self.time.session(now);
        let too_early = session_now.is_some_and(|now| sample_time.since(now) > MAX_AHEAD_NS);
        if sample_time != self.config.network_hz.instant(packet.step) || too_early {
            self.outbox.counters.unexpected += 1;
            return false;
        }
        let peer = &mut self.peers[index];
        let host = peer.host;
        if peer.sequence.arrive(packet.step) == ArrivalOrder::Duplicate {
            self.outbox.counters.duplicates += 1;
            return false;
        }
        let due = self.config.due(host, packet.step);
        peer.late += u64::from(due.zip(session_now).is_some_and(|(due, now)| now > due));
        let max_age_ns = self.config.max_age_ns(host);
        if session_now.is_some_and(|now| now.since(sample_time) > max_age_ns) {
            peer.stale += 1;
            return false;
        }
        if packet.entries.is_empty() {
            self.expel(now, host, DIVERGED);
            return true;
        }
        let own = self.host.unwrap_or(HostIndex::FIRST);
        let before = peer.trust.before(packet.step);
        let plausibility = self.config.plausibility.as_ref();
        let can_be = plausibility.map_or(Ok(()), |can| can.check(host, own, before.as_ref(), &packet));
        if let Err(why) = can_be {
            return self.refuse_sample(now, index, Some(&packet), why);
        }
        if !peer.trust.believe(&packet) {
            return false;
        }
        self.note_sample(now, index);
        self.outbox.tell(Event::State { from: host, packet, received: now });
        false
    }

    /// Leaves out a sample of the peer at `index`, and expels the peer if there are too many like it; whether so.
    fn refuse_sample(
        &mut self,
        now: LocalTime,
        index: usize,
        packet: Option<&StatePacket>,
        why: Implausible,
    ) -> bool {
        let most = self.config.max_implausible();
        let peer = &mut self.peers[index];
        peer.implausible += 1;
        let host = peer.host;
        let offence = match packet {
            Some(packet) if why.may_be_accident() => peer.trust.excuse(packet, most),
            packet => peer.trust.refuse(packet.map_or(0, |packet| packet.step), most),
        };
        match offence {
            Offence::First => self.outbox.tell(Event::Implausible { host, why }),
            Offence::Again => {}
            Offence::TooMany => self.expel(now, host, &why.to_string()),
        }
        offence == Offence::TooMany
    }

    /// Lets go of a peer for the rest of the session, and says so to it and to the caller.
    fn expel(&mut self, now: LocalTime, host: HostIndex, why: &str) {
        let at = self.time.session(now);
        let Some(peer) = self.peer_mut(host) else { return };
        peer.presence = Presence::Left;
        let route = peer.route;
        let reason = text::shortened(why);
        if self.expelled.is_full() {
            self.expelled.remove(0);
        }
        self.expelled.push(Expelled { route, host, reason, at });
        self.tell_expelled(route, reason);
        self.outbox.tell(Event::Expelled { host, reason: why.to_owned() });
    }

    /// Why the host that is reached by `route` was expelled, if it was.
    pub(super) fn expulsion(&self, route: Route) -> Option<Text> {
        self.expelled.iter().find(|expelled| expelled.route == route).map(|expelled| expelled.reason)
    }

    fn tell_expelled(&mut self, route: Route, reason: Text) {
        let reason = text::shortened(&format!("expelled: {reason}"));
        self.send(route, &Control::Leave { id: self.id, reason });
    }

    pub(super) fn handle_ping(
        &mut self,
        now: LocalTime,
        from: Route,
        sender: HostIndex,
        id: PeerId,
        sent_ns: i64,
        ready: bool,
    ) -> PingOutcome {
        if self.phase != Membership::Active {
            return PingOutcome::Ignored;
        }
        if let Some(reason) = self.expulsion(from) {
            // It did not hear it the first time.
            self.tell_expelled(from, reason);
            return PingOutcome::Ignored;
        }
        let Some(peer) = self.peer_mut(sender) else {
            self.outbox.counters.unknown_sender += 1;
            return PingOutcome::Ignored;
        };
        if peer.id != id || peer.presence == Presence::Left {
            self.outbox.counters.unknown_sender += 1;
            return PingOutcome::Stale;
        }
        // All members know the ids of all: the route alone shows who it is.
        if peer.route != from {
            self.outbox.counters.unknown_sender += 1;
            return PingOutcome::Ignored;
        }
        peer.ready = ready;
        self.note_heard(now, sender);
        let (received_ns, answered_ns) = (now.0, now.0);
        self.send(from, &Control::Pong { id: self.id, sent_ns, received_ns, answered_ns });
        PingOutcome::Answered
    }

    /// Takes an answer to a ping of this host; whether it was one.
    pub(super) fn handle_pong(
        &mut self,
        now: LocalTime,
        sender: HostIndex,
        id: PeerId,
        exchange: &Exchange,
    ) -> bool {
        let Some(peer) = self.peers.iter_mut().find(|peer| peer.host == sender) else { return false };
        let known = peer.id == id && peer.presence != Presence::Left;
        if !known || !peer.take_ping(exchange.sent) {
            self.outbox.counters.unexpected += 1;
            return false;
        }
        match exchange.round_trip_ns() {
            Some(round_trip_ns) => peer.round_trip.record(round_trip_ns),
            None => self.outbox.counters.unexpected += 1,
        }
        self.note_heard(now, sender);
        true
    }

    /// Something came from a peer: it is there, unless it has sent samples before, of which one must come then.
    pub(super) fn note_heard(&mut self, now: LocalTime, host: HostIndex) {
        let Some(index) = self.peers.iter().position(|peer| peer.host == host) else { return };
        let peer = &mut self.peers[index];
        peer.last_heard = peer.last_heard.max(now);
        peer.is_reachable = true;
        if peer.last_sample.is_none() {
            self.note_present(now, index);
        }
    }

    /// A sample that can be used came from the peer at `index`: it is there.
    fn note_sample(&mut self, now: LocalTime, index: usize) {
        let peer = &mut self.peers[index];
        peer.last_sample = peer.last_sample.max(Some(now));
        self.note_heard(now, self.peers[index].host);
        self.note_present(now, index);
    }

    fn note_present(&mut self, now: LocalTime, index: usize) {
        let peer = &mut self.peers[index];
        if peer.presence == Presence::Present || peer.presence == Presence::Left {
            return;
        }
        peer.presence = Presence::Present;
        peer.next_ping = now;
        let host = peer.host;
        let restarted = std::mem::take(&mut peer.restarted);
        self.outbox.tell(match std::mem::replace(&mut peer.introduced, true) {
            false => Event::PeerJoined { host, name: self.config.name_of(host) },
            true => Event::PeerReturned { host, restarted },
        });
    }

    pub(super) fn lose_silent_peers(&mut self, now: LocalTime) {
        let (timeout_ns, most) = (self.config.peer_timeout_ns, self.config.max_implausible());
        for peer in &mut self.peers {
            peer.is_reachable &= now.since(peer.last_heard) < REACHABLE_NS;
            if peer.presence == Presence::Present && now.since(peer.last_sign()) >= timeout_ns {
                peer.presence = Presence::Lost;
                peer.ready = false;
                peer.unanswered = 0;
                peer.trust.forget(most);
                self.outbox.tell(Event::PeerLost { host: peer.host });
            }
        }
    }

    /// A new life of a peer has come.
    pub(super) fn replace_peer(&mut self, now: LocalTime, host: HostIndex, id: PeerId, route: Route) {
        match self.peers.iter_mut().find(|peer| peer.host == host) {
            None => self.peers.push(Peer::new(host, id, route, now)),
            Some(peer) => {
                let was_present = peer.presence == Presence::Present;
                peer.restart(id, route, now);
                if was_present {
                    self.outbox.tell(Event::PeerLost { host });
                }
            }
        }
    }

    /// Before tick 0 there are no states to hear: pings alone must tell within the time-out, also over a bad link, that
    /// a host is there.
    fn ping_period_ns(&self, now: LocalTime) -> i64 {
        let states_flow = self.time.session(now).is_some_and(|session| session.0 >= 0);
        if states_flow { PING_PERIOD_NS } else { PING_PERIOD_NS.min(self.config.peer_timeout_ns / 10) }
    }

    pub(super) fn send_due_pings(&mut self, now: LocalTime) {
        let wants_clock = !self.time.is_agreed();
        let period_ns = self.ping_period_ns(now);
        let ping = Control::Ping { id: self.id, sent_ns: now.0, ready: self.time.is_ready() };
        for index in 0..self.peers.len() {
            let peer = &mut self.peers[index];
            if peer.presence == Presence::Left || now < peer.next_ping {
                continue;
            }
            peer.note_ping(now, wants_clock && peer.host == HostIndex::FIRST, period_ns);
            let to = peer.route;
            self.send(to, &ping);
        }
    }

    pub(super) fn leave(&mut self, now: LocalTime, reason: &str) {
        match self.phase {
            Membership::Joining => self.close(),
            Membership::Active => {
                let reason = text::shortened(reason);
                self.phase = Membership::Leaving { reason, repeat: Backoff::from(now), attempts: 0 };
                self.repeat_leave(now);
            }
            Membership::Leaving { .. } | Membership::Closed => {}
        }
    }

    pub(super) fn repeat_leave(&mut self, now: LocalTime) {
        let Membership::Leaving { reason, repeat, attempts } = &mut self.phase else { return };
        if now < repeat.due() {
            return;
        }
        let leave = Control::Leave { id: self.id, reason: *reason };
        *attempts += 1;
        repeat.again(now);
        let given_up = *attempts > LEAVE_ATTEMPTS;
        if given_up || self.all_have_left() {
            return self.close();
        }
        for index in 0..self.peers.len() {
            if self.peers[index].presence != Presence::Left {
                self.send(self.peers[index].route, &leave);
            }
        }
    }

    /// Takes a peer's good-bye; whether it is news.
    pub(super) fn handle_leave(&mut self, from: Route, sender: HostIndex, id: PeerId, reason: &str) -> bool {
        let is_sender = |peer: &&mut Peer| peer.id == id && peer.route == from;
        let Some(peer) = self.peer_mut(sender).filter(is_sender) else {
            self.outbox.counters.unknown_sender += 1;
            return false;
        };
        let was_known = peer.introduced && peer.presence != Presence::Left;
        peer.presence = Presence::Left;
        self.send(from, &Control::LeaveReceived);
        if was_known {
            self.outbox.tell(Event::PeerLeft { host: sender, reason: reason.to_owned() });
        }
        was_known
    }

    pub(super) fn handle_leave_received(&mut self, sender: HostIndex) {
        if !matches!(self.phase, Membership::Leaving { .. }) {
            self.outbox.counters.unexpected += 1;
            return;
        }
        if let Some(peer) = self.peer_mut(sender) {
            // Nothing more is to be said to it.
            peer.presence = Presence::Left;
        }
        if self.all_have_left() {
            self.close();
        }
    }

    fn all_have_left(&self) -> bool {
        self.peers.iter().all(|peer| peer.presence == Presence::Left)
    }
}
