//! What only host 0 does: let newcomers in, tell all who is there, and set tick 0.

use arrayvec::ArrayVec;
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::{LocalTime, SessionTime};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

use super::peer::{Backoff, Peer};
use super::{Endpoint, Event, MILLISECOND, Phase, Presence, Role, StartWhen};
use crate::message::{Control, Join, Refusal, Roster, RosterEntry, SCENE_PART_BYTES, SCENE_REQUEST_PADDING};
use crate::route::Route;
use crate::text::MAX_TEXT_BYTES;

/// A host that has been silent for so long gives way to a new one of the same name.
const TAKEOVER_SILENCE_NS: i64 = 1_000 * MILLISECOND;
/// A newcomer whose name's holder is still heard after so long is refused.
const TAKEOVER_WAIT_NS: i64 = 2_000 * MILLISECOND;

/// What only host 0 remembers.
#[derive(Clone, Debug)]
pub(super) struct Server {
    /// Key of the cookies.
    secret: u64,
    revision: u32,
}

impl Server {
    pub(super) const fn new(secret: u64) -> Self {
        Self { secret, revision: 1 }
    }

    /// A number that only one who receives at `route` can know. Never 0.
    fn cookie(&self, route: Route, instance: u64) -> u64 {
        let text: ArrayVec<u8, { MAX_TEXT_BYTES + size_of::<u64>() }> =
            route.distinguishing_bytes().into_iter().chain(instance.to_le_bytes()).collect();
        xxh3_64_with_seed(&text, self.secret) | 1
    }
}

/// What becomes of a newcomer.
enum Seat {
    Taken(HostIndex),
    /// The name's holder may be dead; time will tell.
    Unclear,
    Refused(Refusal),
}

impl Endpoint {
    pub(super) fn handle_join(&mut self, now: LocalTime, from: Route, instance: u64, join: &Join) {
        let Role::Server(server) = &self.role else {
            self.counters.unexpected += 1;
            return;
        };
        let cookie = server.cookie(from, instance);
        if let Some(refusal) = self.objection(join) {
            self.counters.refused += 1;
            return self.send_refusal(from, instance, refusal);
        }
        if join.cookie != cookie {
            return self.send_as(instance, from, &Control::Challenge { cookie });
        }
        if let Some(peer) = self.peers.iter_mut().find(|peer| peer.instance == instance) {
            // It was let in; the welcome got lost.
            peer.route = from;
            let host = peer.host;
            return self.send_welcome(from, instance, host);
        }
        match self.find_seat(now, from, instance, join) {
            Seat::Taken(host) => self.admit(now, from, instance, host),
            Seat::Unclear => {}
            Seat::Refused(refusal) => {
                self.counters.refused += 1;
                self.send_refusal(from, instance, refusal);
            }
        }
    }

    /// What is wrong with a newcomer, whoever it is.
    fn objection(&self, join: &Join) -> Option<Refusal> {
        let config = &self.config;
        if self.phase != Phase::Active {
            Some(Refusal::Closing)
        } else if join.scene_hash != config.scene_hash {
            Some(Refusal::Scene { server: config.scene_hash, newcomer: join.scene_hash })
        } else if (join.control_hz, join.network_hz) != (config.control_hz, config.network_hz) {
            Some(Refusal::Rates { control_hz: config.control_hz, network_hz: config.network_hz })
        } else {
            let name = join.name.filter(|name| !config.names.iter().any(|known| known == name.as_str()))?;
            Some(Refusal::UnknownName { name })
        }
    }

    fn find_seat(&mut self, now: LocalTime, from: Route, instance: u64, join: &Join) -> Seat {
        let Some(name) = join.name else { return self.find_free_seat(from) };
        let index = self.config.names.iter().position(|known| known == name.as_str());
        let host = HostIndex(index.expect("an unknown name was objected to") as u8);
        if host == HostIndex::FIRST {
            return Seat::Refused(Refusal::NameTaken { name });
        }
        let Some(peer) = self.peer_mut(host) else { return Seat::Taken(host) };
        let is_silent = now.since(peer.last_heard) >= TAKEOVER_SILENCE_NS;
        // Two programs cannot receive at one address: the old one is gone.
        if peer.presence != Presence::Present || peer.route == from || is_silent {
            return Seat::Taken(host);
        }
        let (contender, since) = *peer.contender.get_or_insert((instance, now));
        if contender != instance {
            peer.contender = Some((instance, now));
        } else if now.since(since) >= TAKEOVER_WAIT_NS {
            peer.contender = None;
            return Seat::Refused(Refusal::NameTaken { name });
        }
        Seat::Unclear
    }

    /// The first seat that was never taken; else one whose host left; else one whose host is lost.
    fn find_free_seat(&self, from: Route) -> Seat {
        let users = self.config.names.len() as u8;
        let rank = |host: HostIndex| match self.peers.iter().find(|peer| peer.host == host) {
            Some(peer) if peer.route == from => Some(0),
            None => Some(1),
            Some(peer) if peer.presence == Presence::Left => Some(2),
            Some(peer) if peer.presence == Presence::Lost => Some(3),
            Some(_) => None,
        };
        let seats = HostIndex::FIRST.others(users).filter_map(|host| Some((rank(host)?, host)));
        seats.min().map_or(Seat::Refused(Refusal::Full { users }), |(_, host)| Seat::Taken(host))
    }

    fn admit(&mut self, now: LocalTime, from: Route, instance: u64, host: HostIndex) {
        match self.peer_mut(host) {
            None => self.peers.push(Peer::new(host, instance, from, now)),
            Some(peer) => {
                let was_present = peer.presence == Presence::Present;
                peer.restart(instance, from, now);
                if was_present {
                    self.push_event(Event::PeerLost { host });
                }
            }
        }
        self.send_welcome(from, instance, host);
        self.hear(now, host);
        self.change_roster(now);
    }

    fn send_welcome(&mut self, to: Route, instance: u64, host: HostIndex) {
        let welcome = Control::Welcome { session: self.session, host, server: self.instance };
        self.send_as(instance, to, &welcome);
    }

    /// Who is there, or when it starts, has changed: all are told. Does nothing at a follower.
    pub(super) fn change_roster(&mut self, now: LocalTime) {
        let Role::Server(server) = &mut self.role else { return };
        server.revision += 1;
        for peer in &mut self.peers {
            peer.roster = Backoff::from(now);
            peer.roster_known = false;
        }
        self.send_due_rosters(now);
    }

    pub(super) fn send_due_rosters(&mut self, now: LocalTime) {
        let Role::Server(server) = &self.role else { return };
        let is_due = |peer: &Peer| {
            peer.presence == Presence::Present && !peer.roster_known && peer.roster.due() <= now
        };
        if self.phase != Phase::Active || !self.peers.iter().any(is_due) {
            return;
        }
        let listed = self.peers.iter().filter(|peer| peer.presence != Presence::Left);
        let entry = |peer: &Peer| RosterEntry { host: peer.host, instance: peer.instance, route: peer.route };
        let hosts: ArrayVec<_, _> = listed.map(entry).collect();
        let roster = Control::Roster(Roster { revision: server.revision, origin_ns: self.origin_ns, hosts });
        for index in 0..self.peers.len() {
            let peer = &mut self.peers[index];
            if is_due(peer) {
                peer.roster.again(now);
                let to = peer.route;
                self.send(to, &roster);
            }
        }
    }

    pub(super) fn handle_roster_received(&mut self, now: LocalTime, sender: HostIndex, revision: u32) {
        let Role::Server(server) = &self.role else {
            self.counters.unexpected += 1;
            return;
        };
        let is_current = revision == server.revision;
        self.hear(now, sender);
        if let Some(peer) = self.peer_mut(sender) {
            peer.roster_known |= is_current;
        }
    }

    /// Sets tick 0 when it is time to. Does nothing at a follower.
    pub(super) fn start_if_all_are_there(&mut self, now: LocalTime) {
        if !matches!(self.role, Role::Server(_)) || self.origin_ns.is_some() || self.phase != Phase::Active {
            return;
        }
        let delay_ns = match self.config.start {
            StartWhen::Immediately => 0,
            StartWhen::Hosts(wanted) => {
                let ready = |peer: &&Peer| peer.presence == Presence::Present && peer.ready;
                if self.peers.iter().filter(ready).count() + 1 < usize::from(wanted) {
                    return;
                }
                self.config.start_delay_ns
            }
        };
        self.origin_ns = Some(now.plus_ns(delay_ns).0);
        self.announced.start = true;
        self.push_event(Event::Started { at: SessionTime(0) });
        self.change_roster(now);
    }

    /// Hands out a part of the scene's text: no state, and no longer than the question.
    pub(super) fn handle_scene_request(&mut self, to: Route, instance: u64, offset: u32, padding: usize) {
        let text = self.config.scene_text.as_bytes();
        let is_server = matches!(self.role, Role::Server(_));
        let rest = usize::try_from(offset).ok().and_then(|offset| text.get(offset..));
        let (Some(rest), SCENE_REQUEST_PADDING, true) = (rest, padding, is_server) else {
            self.counters.unexpected += 1;
            return;
        };
        let part = Control::ScenePart {
            hash: xxh3_64(text),
            total: text.len() as u32,
            offset,
            bytes: rest.iter().copied().take(SCENE_PART_BYTES).collect(),
        };
        self.send_as(instance, to, &part);
    }
}
