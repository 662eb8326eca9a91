//! The endpoint that callers see: what comes in is handed to the part that it concerns.

use cotouch_scene::names::HostIndex;
use cotouch_scene::time::LocalTime;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::config::Config;
use super::event::{Event, SendError};
use super::follower::{self, Follower};
use super::member::{Expelled, Member, Membership, PingOutcome};
use super::outbox::Counters;
use super::peer::{Peer, Presence};
use super::server::{self, Server};
use super::timekeeping::Timekeeping;
use crate::clock::{ClockMap, Exchange};
use crate::message::{Control, PeerId, Refusal};
use crate::packet::StatePacket;
use crate::route::Route;
use crate::statistics::LinkStatistics;
use crate::wire::{DatagramKind, Header, PROTOCOL_VERSION, Transmit, WireError, decode_control_body, open};

/// A peer, for display.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PeerInfo {
    /// The index of its host.
    pub host: HostIndex,
    /// Which life of that host it is.
    pub id: PeerId,
    /// The name of its user.
    pub name: String,
    /// Where it is reached.
    pub route: Route,
    /// Whether it is there.
    pub presence: Presence,
}

/// One host's end of a session. Deterministic: the same calls give the same answers.
#[derive(Clone, Debug)]
pub struct Endpoint {
    member: Member,
    role: Role,
}

#[derive(Clone, Debug)]
enum Role {
    Server(Server),
    Follower(Follower),
}

impl Endpoint {
    /// Host 0, whom the others join. Its user is the scene's first.
    #[must_use]
    pub fn serve(config: Config, now: LocalTime) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(config.seed);
        let mut server = Server::new(random.random());
        let session = random.random();
        let mut member = Member::new(config, PeerId(random.random()), Timekeeping::keeper());
        member.become_active(session, HostIndex::FIRST);
        member.outbox.tell(Event::ClockReady);
        server.start_if_all_are_there(&mut member, now);
        Self { member, role: Role::Server(server) }
    }

    /// A newcomer to the session at `server`.
    #[must_use]
    pub fn join(config: Config, server: impl Into<Route>, now: LocalTime) -> Self {
        let id = PeerId(Pcg64Mcg::seed_from_u64(config.seed).random());
        let follower = Follower::new(server.into(), now, config.join_timeout_ns);
        Self { member: Member::new(config, id, Timekeeping::follower()), role: Role::Follower(follower) }
    }

    /// Takes a datagram that came from `from`. A state from a peer that is present allocates nothing. Whatever the bytes are, this does not fail; what is of no use is counted.
    pub fn handle_datagram(&mut self, now: LocalTime, from: Route, bytes: &[u8]) {
        if self.member.phase == Membership::Closed {
            return;
        }
        let counters = &mut self.member.outbox.counters;
        match open(bytes) {
            Ok((header, body)) => match header.kind {
                DatagramKind::State => self.handle_state(now, from, header, body),
                DatagramKind::Control => match decode_control_body(body) {
                    Ok(control) => self.handle_control(now, from, header, control),
                    Err(_) => counters.malformed += 1,
                },
                // Not a session's, or the secured layer's affair.
                DatagramKind::Probe
                | DatagramKind::Echo
                | DatagramKind::Initiation
                | DatagramKind::Response
                | DatagramKind::Rejection => counters.unexpected += 1,
            },
            Err(WireError::Version { found, session, from_newcomer }) => {
                self.handle_other_version(from, found, PeerId(session), from_newcomer);
            }
            Err(_) => counters.malformed += 1,
        }
    }

    /// The next datagram to send. The time stamps in it were taken when it was made, so poll without delay.
    pub fn poll_transmit(&mut self) -> Option<Transmit> {
        self.member.outbox.next_transmit()
    }

    /// The next event that the caller has not taken yet.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.member.outbox.next_event()
    }

    /// When to call [`Self::handle_timeout`] at the latest; `None` while nothing is due.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<LocalTime> {
        match (&self.member.phase, &self.role) {
            (Membership::Closed, _) => None,
            (Membership::Leaving { repeat, .. }, _) => Some(repeat.due()),
            (Membership::Joining, Role::Follower(follower)) => Some(follower.due()),
            (_, role) => self.member.due(matches!(role, Role::Server(_))),
        }
    }

    /// Does what is due: repeats, pings, time-outs. Calling it early or twice does no harm.
    pub fn handle_timeout(&mut self, now: LocalTime) {
        match (&self.member.phase, &mut self.role) {
            (Membership::Closed, _) => {}
            (Membership::Leaving { .. }, _) => self.member.repeat_leave(now),
            (Membership::Joining, Role::Follower(follower)) => follower.drive_join(&mut self.member, now),
            (_, role) => {
                self.member.lose_silent_peers(now);
                self.member.send_due_pings(now);
                if let Role::Server(server) = role {
                    server.send_due_rosters(&mut self.member, now);
                    server.start_if_all_are_there(&mut self.member, now);
                }
            }
        }
    }

    /// Sends a state to one host. Does not allocate while sending keeps up.
    ///
    /// # Errors
    /// When this host or the other does not take part.
    pub fn send_state(&mut self, packet: &StatePacket, to: HostIndex) -> Result<(), SendError> {
        self.member.send_state(packet, to)
    }

    /// Sends a state to every peer that is present and returns to how many. Does not allocate while sending keeps up.
    ///
    /// # Errors
    /// When this host does not take part.
    pub fn send_state_to_all(&mut self, packet: &StatePacket) -> Result<usize, SendError> {
        self.member.send_state_to_all(packet)
    }

    /// Says good-bye to all, in words; [`Event::Closed`] follows when all know or do not answer (within 2 s).
    pub fn leave(&mut self, now: LocalTime, reason: &str) {
        self.member.leave(now, reason);
    }

    /// The map from this host's clock to the session's, once tick 0 is set and the clock agreed upon.
    #[must_use]
    pub fn clock(&self) -> Option<ClockMap> {
        self.member.time.map()
    }

    /// This host's index, once it was welcomed.
    #[must_use]
    pub const fn host(&self) -> Option<HostIndex> {
        self.member.host
    }

    /// Whether nothing more will happen.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.member.phase == Membership::Closed
    }

    /// What the link to a peer did so far.
    #[must_use]
    pub fn statistics(&self, host: HostIndex) -> Option<LinkStatistics> {
        self.member.peers.iter().find(|peer| peer.host == host).map(Peer::statistics)
    }

    /// Those with whom this host exchanges or exchanged data.
    pub fn peers(&self) -> impl Iterator<Item = PeerInfo> {
        self.member.peers.iter().map(|peer| PeerInfo {
            host: peer.host,
            id: peer.id,
            name: self.member.config.name_of(peer.host),
            route: peer.route,
            presence: peer.presence,
        })
    }

    /// Whom this host has let go of for the rest of the session, the first one first.
    #[must_use]
    pub fn expelled(&self) -> &[Expelled] {
        &self.member.expelled
    }

    /// What led to nothing so far.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.member.outbox.counters
    }

    fn handle_state(&mut self, now: LocalTime, from: Route, header: Header, body: &[u8]) {
        let is_expelled = self.member.handle_state(now, from, header, body);
        if let (true, Role::Server(server)) = (is_expelled, &mut self.role) {
            server.change_roster(&mut self.member, now);
        }
    }

    fn handle_control(&mut self, now: LocalTime, from: Route, header: Header, control: Control) {
        let newcomer = PeerId(header.session);
        let member = &mut self.member;
        match (control, &mut self.role) {
            (Control::Join(join), Role::Server(server)) => {
                server.handle_join(member, now, from, newcomer, &join);
            }
            (Control::SceneRequest { offset, padding }, Role::Server(_)) => {
                server::handle_scene_request(member, from, newcomer, offset, padding.len());
            }
            (
                answer @ (Control::Challenge { .. } | Control::Welcome { .. } | Control::Refuse(_)),
                Role::Follower(follower),
            ) => follower.handle_answer_to_join(member, now, from, newcomer, answer),
            (
                Control::Join(_)
                | Control::SceneRequest { .. }
                | Control::ScenePart { .. }
                | Control::Challenge { .. }
                | Control::Welcome { .. }
                | Control::Refuse(_),
                _,
            ) => member.outbox.counters.unexpected += 1,
            (control, _) => self.handle_members_control(now, from, header, control),
        }
    }

    /// What only members of the session say to each other.
    fn handle_members_control(&mut self, now: LocalTime, from: Route, header: Header, control: Control) {
        let member = &mut self.member;
        if header.session != member.session || member.phase == Membership::Joining {
            member.outbox.counters.wrong_session += 1;
            return;
        }
        let Some(sender) = header.sender else {
            member.outbox.counters.unknown_sender += 1;
            return;
        };
        match (control, &mut self.role) {
            (Control::Ping { id, sent_ns, ready }, role) => {
                let outcome = member.handle_ping(now, from, sender, id, sent_ns, ready);
                match (outcome, role) {
                    (PingOutcome::Answered, Role::Server(server)) => {
                        server.start_if_all_are_there(member, now);
                    }
                    (PingOutcome::Stale, Role::Server(_)) => member.send_refusal(id, from, Refusal::Replaced),
                    _ => {}
                }
            }
            (Control::Leave { id, reason }, role) => {
                let is_news = member.handle_leave(from, sender, id, &reason);
                if let (true, Role::Server(server)) = (is_news, role) {
                    server.change_roster(member, now);
                }
            }
            _ if member.peer_mut(sender).is_none_or(|peer| peer.route != from) => {
                member.outbox.counters.unknown_sender += 1;
            }
            (Control::Pong { id, sent_ns, received_ns, answered_ns }, role) => {
                let exchange = Exchange { sent: LocalTime(sent_ns), received_ns, answered_ns, returned: now };
                let is_answer = member.handle_pong(now, sender, id, &exchange);
                if is_answer && sender == HostIndex::FIRST && matches!(role, Role::Follower(_)) {
                    follower::observe_clock(member, now, &exchange);
                }
            }
            (Control::Roster(roster), Role::Follower(follower)) => {
                follower.handle_roster(member, now, from, sender, &roster);
            }
            (Control::RosterReceived { revision }, Role::Server(server)) => {
                server.handle_roster_received(member, now, sender, revision);
            }
            (Control::LeaveReceived, _) => member.handle_leave_received(sender),
            // A roster for the server, or what is no members' business.
            _ => member.outbox.counters.unexpected += 1,
        }
    }

    fn handle_other_version(&mut self, from: Route, found: u16, newcomer: PeerId, from_newcomer: bool) {
        self.member.outbox.counters.other_version += 1;
        match &self.role {
            // Answers of ours are not from newcomers, so two versions never answer each other for ever.
            Role::Server(_) if from_newcomer => {
                self.member.outbox.counters.refused += 1;
                let refusal = Refusal::Version { server: PROTOCOL_VERSION, newcomer: found };
                self.member.send_refusal(newcomer, from, refusal);
            }
            Role::Server(_) => {}
            Role::Follower(follower) => {
                let refusal = Refusal::Version { server: found, newcomer: PROTOCOL_VERSION };
                follower.handle_other_version(&mut self.member, from, newcomer, refusal);
            }
        }
    }
}
