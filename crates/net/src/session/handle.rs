//! What any host does with datagrams of its peers, and with their silence.

use cotouch_scene::names::HostIndex;
use cotouch_scene::time::LocalTime;

use super::peer::{PING_PERIOD_NS, Peer};
use super::{Endpoint, Event, FARTHEST_FUTURE_NS, Phase, Presence, Role};
use crate::clock::Exchange;
use crate::message::{Control, Refusal};
use crate::route::Route;
use crate::statistics::Arrival;
use crate::wire::{Header, decode_state_body};

impl Endpoint {
    pub(super) fn handle_state(&mut self, now: LocalTime, from: Route, header: Header, body: &[u8]) {
        if header.session != self.session || self.phase != Phase::Active {
            self.counters.wrong_session += 1;
            return;
        }
        let sender = |peer: &&mut Peer| Some(peer.host) == header.sender && peer.route == from;
        let Some(peer) = self.peers.iter_mut().filter(|peer| peer.presence != Presence::Left).find(sender)
        else {
            self.counters.unknown_sender += 1;
            return;
        };
        let Ok((sample_time, packet)) = decode_state_body(body) else {
            self.counters.malformed += 1;
            return;
        };
        let host = peer.host;
        let session_now = self.clock().map(|clock| clock.session(now));
        let too_early = session_now.is_some_and(|now| sample_time.since(now) > FARTHEST_FUTURE_NS);
        if sample_time != self.config.network_hz.instant(packet.step) || too_early {
            self.counters.unexpected += 1;
            return;
        }
        let due = self.config.due(host, packet.step);
        let is_late = due.zip(session_now).is_some_and(|(due, now)| now > due);
        self.hear(now, host);
        let peer = self.peer_mut(host).expect("it was found above");
        if peer.sequence.arrive(packet.step) == Arrival::Duplicate {
            self.counters.duplicates += 1;
            return;
        }
        peer.late += u64::from(is_late);
        self.push_event(Event::State { from: host, packet, received: now });
    }

    pub(super) fn handle_control(&mut self, now: LocalTime, from: Route, header: Header, control: Control) {
        match control {
            Control::Join(join) => return self.handle_join(now, from, header.session, &join),
            Control::SceneRequest { offset, padding } => {
                return self.handle_scene_request(from, header.session, offset, padding.len());
            }
            Control::ScenePart { .. } => return self.counters.unexpected += 1,
            Control::Challenge { .. } | Control::Welcome { .. } | Control::Refuse(_) => {
                return self.handle_answer_to_join(now, from, header.session, control);
            }
            _ => {}
        }
        if header.session != self.session || self.phase == Phase::Joining {
            self.counters.wrong_session += 1;
            return;
        }
        let Some(sender) = header.sender else {
            self.counters.unknown_sender += 1;
            return;
        };
        match control {
            Control::Ping { instance, sent_ns, ready } => {
                self.handle_ping(now, from, sender, instance, sent_ns, ready);
            }
            Control::Leave { instance, reason } => self.handle_leave(now, from, sender, instance, &reason),
            _ if self.peer_mut(sender).is_none_or(|peer| peer.route != from) => {
                self.counters.unknown_sender += 1;
            }
            Control::Pong { instance, sent_ns, received_ns, answered_ns } => {
                let exchange = Exchange { sent: LocalTime(sent_ns), received_ns, answered_ns, returned: now };
                self.handle_pong(now, sender, instance, &exchange);
            }
            Control::Roster(roster) => self.handle_roster(now, sender, &roster),
            Control::RosterReceived { revision } => self.handle_roster_received(now, sender, revision),
            Control::LeaveReceived => self.handle_leave_received(sender),
            // All others were dealt with above.
            _ => self.counters.unexpected += 1,
        }
    }

    fn handle_ping(
        &mut self,
        now: LocalTime,
        from: Route,
        sender: HostIndex,
        instance: u64,
        sent_ns: i64,
        ready: bool,
    ) {
        if self.phase != Phase::Active {
            return;
        }
        let Some(peer) = self.peer_mut(sender) else {
            self.counters.unknown_sender += 1;
            return;
        };
        if peer.instance != instance || peer.presence == Presence::Left {
            self.counters.unknown_sender += 1;
            if matches!(self.role, Role::Server(_)) {
                self.send_refusal(from, instance, Refusal::Replaced);
            }
            return;
        }
        // Who knows session and instance is the peer, also behind a new address (a router forgot the old one).
        peer.route = from;
        peer.ready = ready;
        self.hear(now, sender);
        let (received_ns, answered_ns) = (now.0, now.0);
        self.send(from, &Control::Pong { instance: self.instance, sent_ns, received_ns, answered_ns });
        self.start_if_all_are_there(now);
    }

    fn handle_pong(&mut self, now: LocalTime, sender: HostIndex, instance: u64, exchange: &Exchange) {
        let is_follower = matches!(self.role, Role::Follower(_));
        let Some(peer) = self.peer_mut(sender) else { return };
        let known = peer.instance == instance && peer.presence != Presence::Left;
        if !known || !peer.take_ping(exchange.sent) {
            self.counters.unexpected += 1;
            return;
        }
        match exchange.round_trip_ns() {
            Some(round_trip_ns) => peer.round_trip.record(round_trip_ns),
            None => self.counters.unexpected += 1,
        }
        self.hear(now, sender);
        if is_follower && sender == HostIndex::FIRST {
            self.clock.observe(exchange);
            self.announce_clock_and_start(now);
        }
    }

    fn handle_leave(&mut self, now: LocalTime, from: Route, sender: HostIndex, instance: u64, reason: &str) {
        let Some(peer) = self.peer_mut(sender).filter(|peer| peer.instance == instance) else {
            self.counters.unknown_sender += 1;
            return;
        };
        let was_known = peer.introduced && peer.presence != Presence::Left;
        peer.presence = Presence::Left;
        self.send(from, &Control::LeaveReceived);
        if was_known {
            self.push_event(Event::PeerLeft { host: sender, reason: reason.to_owned() });
            self.change_roster(now);
        }
    }

    fn handle_leave_received(&mut self, sender: HostIndex) {
        if !matches!(self.phase, Phase::Leaving { .. }) {
            self.counters.unexpected += 1;
            return;
        }
        if let Some(peer) = self.peer_mut(sender) {
            // Nothing more is to be said to it.
            peer.presence = Presence::Left;
        }
        if self.peers.iter().all(|peer| peer.presence == Presence::Left) {
            self.close();
        }
    }

    /// Something came from a peer: it is there.
    pub(super) fn hear(&mut self, now: LocalTime, host: HostIndex) {
        let Some(peer) = self.peer_mut(host) else { return };
        peer.last_heard = peer.last_heard.max(now);
        if peer.presence == Presence::Present || peer.presence == Presence::Left {
            return;
        }
        peer.presence = Presence::Present;
        peer.next_ping = now;
        let restarted = std::mem::take(&mut peer.restarted);
        let event = match std::mem::replace(&mut peer.introduced, true) {
            false => Event::PeerJoined { host, name: self.config.name_of(host) },
            true => Event::PeerReturned { host, restarted },
        };
        self.push_event(event);
    }

    pub(super) fn lose_silent_peers(&mut self, now: LocalTime) {
        for index in 0..self.peers.len() {
            let peer = &mut self.peers[index];
            if peer.presence == Presence::Present && now.since(peer.last_heard) >= self.config.peer_timeout_ns
            {
                peer.presence = Presence::Lost;
                peer.ready = false;
                peer.unanswered = 0;
                let host = peer.host;
                self.push_event(Event::PeerLost { host });
            }
        }
    }

    /// Before tick 0 there are no states to hear: pings alone must tell within the time-out, also over a bad link, that
    /// a host is there.
    fn ping_period_ns(&self, now: LocalTime) -> i64 {
        let states_flow = self.clock().is_some_and(|clock| clock.session(now).0 >= 0);
        if states_flow { PING_PERIOD_NS } else { PING_PERIOD_NS.min(self.config.peer_timeout_ns / 10) }
    }

    pub(super) fn send_due_pings(&mut self, now: LocalTime) {
        let wants_clock = matches!(self.role, Role::Follower(_)) && !self.clock.is_agreed();
        let period_ns = self.ping_period_ns(now);
        for index in 0..self.peers.len() {
            let peer = &mut self.peers[index];
            if peer.presence == Presence::Left || now < peer.next_ping {
                continue;
            }
            peer.note_ping(now, wants_clock && peer.host == HostIndex::FIRST, period_ns);
            let to = peer.route;
            let ping = Control::Ping { instance: self.instance, sent_ns: now.0, ready: self.announced.clock };
            self.send(to, &ping);
        }
    }
}
