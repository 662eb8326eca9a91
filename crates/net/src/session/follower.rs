//! Joining a session, and following what its server says.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Architecture;
use cotouch_scene::time::{LocalTime, SessionTime};

use super::event::Event;
use super::member::{Member, Membership};
use super::peer::{Peer, Presence};
use crate::backoff::Backoff;
use crate::clock::Exchange;
use crate::message::{Control, Join, PeerId, Refusal, Roster, RosterEntry};
use crate::route::Route;
use crate::text::{self, Text};

/// What a host that joined another remembers of that.
#[derive(Clone, Debug)]
pub(super) struct Follower {
    /// Where the session was joined.
    server: Route,
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

    pub(super) fn drive_join(&mut self, member: &mut Member, now: LocalTime) {
        if now >= self.give_up {
            return member.close_refused(Refusal::NoAnswer);
        }
        if now < self.repeat.due() {
            return;
        }
        self.repeat.again(now);
        let name = match member.config.user.as_deref().map(Text::from) {
            None => None,
            Some(Ok(name)) => Some(name),
            // No scene has so long a name: `Config` refuses it.
            Some(Err(error)) => {
                let name = text::shortened(error.element());
                return member.close_refused(Refusal::UnknownName { name });
            }
        };
        let join = Join {
            cookie: self.cookie,
            scene_hash: member.config.scene_hash,
            control_hz: member.config.control_hz,
            network_hz: member.config.network_hz,
            name,
            padding: ([0; 32], [0; 32]),
        };
        member.send_to_newcomer(member.id, self.server, &Control::Join(join));
    }

    /// Challenge, welcome or refusal. They carry this host's id, which only the server was told.
    pub(super) fn handle_answer_to_join(
        &mut self,
        member: &mut Member,
        now: LocalTime,
        from: Route,
        newcomer: PeerId,
        answer: Control,
    ) {
        if self.server != from || newcomer != member.id {
            member.outbox.counters.unknown_sender += 1;
            return;
        }
        match (answer, &member.phase) {
            (Control::Challenge { cookie }, Membership::Joining) if cookie != self.cookie => {
                self.cookie = cookie;
                self.repeat = Backoff::from(now);
                self.drive_join(member, now);
            }
            (Control::Welcome { session, host, server }, Membership::Joining) => {
                accept_welcome(member, now, from, session, host, server);
            }
            (Control::Refuse(refusal), Membership::Joining) => member.close_refused(refusal),
            // While leaving or left, to be replaced is no news.
            (Control::Refuse(refusal @ Refusal::Replaced), Membership::Active) => {
                member.close_refused(refusal)
            }
            // Answers to repeated joins.
            _ => {}
        }
    }

    /// The server speaks another version of the protocol.
    pub(super) fn handle_other_version(
        &self,
        member: &mut Member,
        from: Route,
        newcomer: PeerId,
        refusal: Refusal,
    ) {
        if member.phase == Membership::Joining && self.server == from && newcomer == member.id {
            member.close_refused(refusal);
        }
    }

    pub(super) fn handle_roster(
        &mut self,
        member: &mut Member,
        now: LocalTime,
        from: Route,
        sender: HostIndex,
        roster: &Roster,
    ) {
        if sender != HostIndex::FIRST || member.phase != Membership::Active {
            member.outbox.counters.unexpected += 1;
            return;
        }
        let is_news = roster.revision > self.revision;
        self.revision = self.revision.max(roster.revision);
        member.note_heard(now, sender);
        member.send(from, &Control::RosterReceived { revision: roster.revision });
        if !is_news {
            return;
        }
        member.time.set_origin(roster.origin_ns);
        if member.config.architecture == Architecture::Distributed {
            update_peers(member, now, from, roster);
        }
        announce_clock_and_start(member, now);
        member.send_due_pings(now);
    }
}

fn accept_welcome(
    member: &mut Member,
    now: LocalTime,
    from: Route,
    session: u64,
    host: HostIndex,
    server: PeerId,
) {
    if host == HostIndex::FIRST || host.index() >= member.config.names.len() {
        member.outbox.counters.unexpected += 1;
        return;
    }
    member.become_active(session, host);
    member.peers.push(Peer::new(HostIndex::FIRST, server, from, now));
    member.note_heard(now, HostIndex::FIRST);
    member.send_due_pings(now);
}

/// Brings the peers in line with the roster of the server at `server`.
fn update_peers(member: &mut Member, now: LocalTime, server: Route, roster: &Roster) {
    for entry in &roster.hosts {
        let is_other = Some(entry.host) != member.host && entry.host != HostIndex::FIRST;
        if is_other && entry.host.index() < member.config.names.len() {
            update_peer(member, now, entry, entry.route.relayed_by(server));
        }
    }
    for peer in &mut member.peers {
        let is_listed = roster.hosts.iter().any(|entry| entry.host == peer.host);
        if peer.host == HostIndex::FIRST || is_listed || peer.presence == Presence::Left {
            continue;
        }
        peer.presence = Presence::Left;
        if peer.introduced {
            let reason = "it left the session".to_owned();
            member.outbox.tell(Event::PeerLeft { host: peer.host, reason });
        }
    }
}

fn update_peer(member: &mut Member, now: LocalTime, entry: &RosterEntry, route: Route) {
    if member.expulsion(route).is_some() {
        return;
    }
    let is_known = member.peer_mut(entry.host).is_some_and(|peer| peer.id == entry.id && peer.route == route);
    if !is_known {
        member.replace_peer(now, entry.host, entry.id, route);
    }
}

/// Takes an exchange with the server.
pub(super) fn observe_clock(member: &mut Member, now: LocalTime, exchange: &Exchange) {
    if let Some(by_ns) = member.time.observe(exchange) {
        member.outbox.tell(Event::ClockContradicted { by_ns });
    }
    announce_clock_and_start(member, now);
}

/// Tells the caller, once each, that the clock is agreed upon and that tick 0 is set.
fn announce_clock_and_start(member: &mut Member, now: LocalTime) {
    if !member.time.is_agreed() {
        return;
    }
    if !member.time.has_started() && !member.time.start_can_be(now) {
        return member.close_refused(Refusal::Time);
    }
    if member.time.become_ready() {
        member.outbox.tell(Event::ClockReady);
        // The server waits for this news.
        if let Some(server) = member.peer_mut(HostIndex::FIRST) {
            server.next_ping = now;
        }
        member.send_due_pings(now);
    }
    if member.time.start() {
        let at = member.time.session(now).unwrap_or(SessionTime(0)).max(SessionTime(0));
        member.outbox.tell(Event::Started { at });
    }
}
