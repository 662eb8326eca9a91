//! Joining a session, and following what its server says.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Architecture;
use cotouch_scene::time::{LocalTime, SessionTime};

use super::peer::{Backoff, Peer};
use super::{Endpoint, Event, Phase, Presence, Role};
use crate::message::{Control, Join, Refusal, Roster, RosterEntry};
use crate::route::Route;
use crate::text::{self, Text};

/// What a host that joined another remembers of that.
#[derive(Clone, Debug)]
pub(super) struct Follower {
    pub(super) server: Route,
    cookie: u64,
    repeat: Backoff,
    give_up: LocalTime,
    /// Of the newest roster.
    revision: u32,
}

impl Follower {
    pub(super) const fn new(server: Route, now: LocalTime, timeout_ns: i64) -> Self {
        let give_up = now.plus_ns(timeout_ns);
        Self { server, cookie: 0, repeat: Backoff::from(now), give_up, revision: 0 }
    }

    pub(super) fn due(&self) -> LocalTime {
        self.repeat.due().min(self.give_up)
    }
}

impl Endpoint {
    pub(super) fn drive_join(&mut self, now: LocalTime) {
        let Role::Follower(follower) = &mut self.role else { return };
        if now >= follower.give_up {
            return self.be_refused(Refusal::NoAnswer);
        }
        if now < follower.repeat.due() {
            return;
        }
        follower.repeat.again(now);
        let (server, cookie) = (follower.server, follower.cookie);
        let name = match &self.config.user {
            None => None,
            Some(name) => match Text::from(name) {
                Ok(name) => Some(name),
                // No scene has so long a name: `Config` refuses it.
                Err(_) => return self.be_refused(Refusal::UnknownName { name: text::shortened(name) }),
            },
        };
        let join = Join {
            cookie,
            scene_hash: self.config.scene_hash,
            control_hz: self.config.control_hz,
            network_hz: self.config.network_hz,
            name,
            padding: ([0; 32], [0; 32]),
        };
        self.send_as(self.instance, server, &Control::Join(join));
    }

    /// Challenge, welcome or refusal. They carry this host's instance, which only the server was told.
    pub(super) fn handle_answer_to_join(
        &mut self,
        now: LocalTime,
        from: Route,
        instance: u64,
        answer: Control,
    ) {
        let Role::Follower(follower) = &mut self.role else {
            self.counters.unexpected += 1;
            return;
        };
        if follower.server != from || instance != self.instance {
            self.counters.unknown_sender += 1;
            return;
        }
        match (answer, &self.phase) {
            (Control::Challenge { cookie }, Phase::Joining) if cookie != follower.cookie => {
                follower.cookie = cookie;
                follower.repeat = Backoff::from(now);
                self.drive_join(now);
            }
            (Control::Welcome { session, host, server }, Phase::Joining) => {
                self.be_welcome(now, from, session, host, server);
            }
            (Control::Refuse(refusal), Phase::Joining) => self.be_refused(refusal),
            // While leaving or left, to be replaced is no news.
            (Control::Refuse(refusal @ Refusal::Replaced), Phase::Active) => self.be_refused(refusal),
            // Answers to repeated joins.
            _ => {}
        }
    }

    fn be_welcome(&mut self, now: LocalTime, from: Route, session: u64, host: HostIndex, server: u64) {
        if host == HostIndex::FIRST || host.index() >= self.config.names.len() {
            self.counters.unexpected += 1;
            return;
        }
        self.session = session;
        self.me = Some(host);
        self.phase = Phase::Active;
        let name = self.config.name_of(host);
        self.push_event(Event::Welcome { host, name });
        self.peers.push(Peer::new(HostIndex::FIRST, server, from, now));
        self.hear(now, HostIndex::FIRST);
        self.send_due_pings(now);
    }

    pub(super) fn be_refused(&mut self, refusal: Refusal) {
        self.phase = Phase::Closed;
        self.push_event(Event::Refused(refusal));
    }

    pub(super) fn handle_roster(&mut self, now: LocalTime, sender: HostIndex, roster: &Roster) {
        let Role::Follower(follower) = &mut self.role else {
            self.counters.unexpected += 1;
            return;
        };
        if sender != HostIndex::FIRST || self.phase != Phase::Active {
            self.counters.unexpected += 1;
            return;
        }
        let server = follower.server;
        let is_news = roster.revision > follower.revision;
        follower.revision = follower.revision.max(roster.revision);
        self.hear(now, sender);
        self.send(server, &Control::RosterReceived { revision: roster.revision });
        if !is_news {
            return;
        }
        // The origin is set once; a running session's time never jumps.
        self.origin_ns = self.origin_ns.or(roster.origin_ns);
        if self.config.architecture == Architecture::Distributed {
            self.meet(now, server, roster);
        }
        self.announce_clock_and_start(now);
        self.send_due_pings(now);
    }

    /// Brings the peers in line with the roster.
    fn meet(&mut self, now: LocalTime, server: Route, roster: &Roster) {
        for entry in &roster.hosts {
            let is_other = Some(entry.host) != self.me && entry.host != HostIndex::FIRST;
            if is_other && entry.host.index() < self.config.names.len() {
                self.meet_one(now, entry.route.relayed_by(server), entry);
            }
        }
        for index in 0..self.peers.len() {
            let peer = &mut self.peers[index];
            let is_listed = roster.hosts.iter().any(|entry| entry.host == peer.host);
            if peer.host == HostIndex::FIRST || is_listed || peer.presence == Presence::Left {
                continue;
            }
            peer.presence = Presence::Left;
            let (host, introduced) = (peer.host, peer.introduced);
            if introduced {
                self.push_event(Event::PeerLeft { host, reason: "it left the session".to_owned() });
            }
        }
    }

    fn meet_one(&mut self, now: LocalTime, route: Route, entry: &RosterEntry) {
        let Some(peer) = self.peer_mut(entry.host) else {
            self.peers.push(Peer::new(entry.host, entry.instance, route, now));
            return;
        };
        if peer.instance == entry.instance {
            if peer.presence == Presence::Expected || peer.presence == Presence::Lost {
                peer.route = route;
            }
            return;
        }
        let was_present = peer.presence == Presence::Present;
        peer.restart(entry.instance, route, now);
        if was_present {
            self.push_event(Event::PeerLost { host: entry.host });
        }
    }

    /// Tells the caller, once each, that the clock is agreed upon and that tick 0 is set.
    pub(super) fn announce_clock_and_start(&mut self, now: LocalTime) {
        if !self.clock.is_agreed() {
            return;
        }
        if !self.announced.clock {
            self.announced.clock = true;
            self.push_event(Event::ClockReady);
            // The server waits for this news.
            if let Some(server) = self.peer_mut(HostIndex::FIRST) {
                server.next_ping = now;
            }
            self.send_due_pings(now);
        }
        if self.origin_ns.is_some() && !self.announced.start {
            self.announced.start = true;
            self.clock.keep_steady();
            let at = self.clock().map_or(SessionTime(0), |clock| clock.session(now)).max(SessionTime(0));
            self.push_event(Event::Started { at });
        }
    }
}
