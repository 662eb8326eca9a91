//! What only host 0 does: let newcomers in, tell all who is there, set tick 0, and hand out the scene.

use arrayvec::ArrayVec;
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::{LocalTime, SessionTime};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

use super::admission::{self, Admission};
use super::config::StartWhen;
use super::event::Event;
use super::member::{Member, Membership};
use super::peer::{Peer, Presence};
use crate::backoff::Backoff;
use crate::message::{
    Control, Join, PeerId, Refusal, Roster, RosterEntry, SCENE_PART_BYTES, SCENE_REQUEST_PADDING,
};
use crate::route::Route;
use crate::text::MAX_TEXT_BYTES;

/// What only host 0 remembers.
#[derive(Clone, Debug)]
pub(super) struct Server {
    /// Key of the cookies.
    secret: u64,
    /// Of the newest roster.
    revision: u32,
}

impl Server {
    pub(super) const fn new(secret: u64) -> Self {
        Self { secret, revision: 1 }
    }

    pub(super) fn handle_join(
        &mut self,
        member: &mut Member,
        now: LocalTime,
        from: Route,
        newcomer: PeerId,
        join: &Join,
    ) {
        if let Some(refusal) = admission::objection(member, join) {
            return refuse(member, newcomer, from, refusal);
        }
        if let Some(reason) = member.expulsion(from) {
            return refuse(member, newcomer, from, Refusal::Expelled { reason });
        }
        let cookie = self.cookie(from, newcomer);
        if join.cookie != cookie && !member.config.routes_are_proven {
            return member.send_to_newcomer(newcomer, from, &Control::Challenge { cookie });
        }
        let is_newcomer = |peer: &&Peer| peer.id == newcomer && peer.route == from;
        if let Some(host) = member.peers.iter().find(is_newcomer).map(|peer| peer.host) {
            // It was let in; the welcome got lost.
            return send_welcome(member, newcomer, from, host);
        }
        match admission::decide(member, now, from, newcomer, join.name) {
            Admission::Granted(host) => self.admit(member, now, from, newcomer, host),
            Admission::Undecided => {}
            Admission::Refused(refusal) => refuse(member, newcomer, from, refusal),
        }
    }

    /// A number that only one who receives at `route` can know. Never 0.
    fn cookie(&self, route: Route, newcomer: PeerId) -> u64 {
        let text: ArrayVec<u8, { MAX_TEXT_BYTES + size_of::<PeerId>() }> =
            route.distinguishing_bytes().into_iter().chain(newcomer.0.to_le_bytes()).collect();
        xxh3_64_with_seed(&text, self.secret) | 1
    }

    fn admit(&mut self, member: &mut Member, now: LocalTime, from: Route, newcomer: PeerId, host: HostIndex) {
        member.replace_peer(now, host, newcomer, from);
        send_welcome(member, newcomer, from, host);
        member.note_heard(now, host);
        self.change_roster(member, now);
    }

    /// Who is there, or when it starts, has changed: all are told.
    pub(super) fn change_roster(&mut self, member: &mut Member, now: LocalTime) {
        self.revision += 1;
        for peer in &mut member.peers {
            peer.roster = Backoff::from(now);
            peer.roster_known = false;
        }
        self.send_due_rosters(member, now);
    }

    pub(super) fn send_due_rosters(&self, member: &mut Member, now: LocalTime) {
        let is_due = |peer: &Peer| {
            peer.presence == Presence::Present && !peer.roster_known && peer.roster.due() <= now
        };
        if member.phase != Membership::Active || !member.peers.iter().any(is_due) {
            return;
        }
        let roster = self.roster(member);
        for index in 0..member.peers.len() {
            let peer = &mut member.peers[index];
            if is_due(peer) {
                peer.roster.again(now);
                let to = peer.route;
                member.send(to, &roster);
            }
        }
    }

    fn roster(&self, member: &Member) -> Control {
        let listed = member.peers.iter().filter(|peer| peer.presence != Presence::Left);
        let entry = |peer: &Peer| RosterEntry { host: peer.host, id: peer.id, route: peer.route };
        let (revision, origin_ns) = (self.revision, member.time.origin_ns());
        Control::Roster(Roster { revision, origin_ns, hosts: listed.map(entry).collect() })
    }

    pub(super) fn handle_roster_received(
        &self,
        member: &mut Member,
        now: LocalTime,
        sender: HostIndex,
        revision: u32,
    ) {
        member.note_heard(now, sender);
        if let Some(peer) = member.peer_mut(sender) {
            peer.roster_known |= revision == self.revision;
        }
    }

    /// Sets tick 0 when it is time to.
    pub(super) fn start_if_all_are_there(&mut self, member: &mut Member, now: LocalTime) {
        if member.time.origin_ns().is_some() || member.phase != Membership::Active {
            return;
        }
        let delay_ns = match member.config.start {
            StartWhen::Immediately => 0,
            StartWhen::Hosts(wanted) => {
                let ready = |peer: &&Peer| peer.presence == Presence::Present && peer.ready;
                if member.peers.iter().filter(ready).count() + 1 < usize::from(wanted) {
                    return;
                }
                member.config.start_delay_ns
            }
        };
        member.time.set_origin(Some(now.plus_ns(delay_ns).0));
        if member.time.start() {
            member.outbox.tell(Event::Started { at: SessionTime(0) });
        }
        self.change_roster(member, now);
    }
}

fn refuse(member: &mut Member, newcomer: PeerId, from: Route, refusal: Refusal) {
    member.outbox.counters.refused += 1;
    member.send_refusal(newcomer, from, refusal);
}

fn send_welcome(member: &mut Member, newcomer: PeerId, to: Route, host: HostIndex) {
    let welcome = Control::Welcome { session: member.session, host, server: member.id };
    member.send_to_newcomer(newcomer, to, &welcome);
}

/// Hands out a part of the scene's text: no state, and no longer than the question.
pub(super) fn handle_scene_request(
    member: &mut Member,
    to: Route,
    newcomer: PeerId,
    offset: u32,
    padding: usize,
) {
    let text = member.config.scene_text.as_bytes();
    let rest = usize::try_from(offset).ok().and_then(|offset| text.get(offset..));
    let (Some(rest), SCENE_REQUEST_PADDING) = (rest, padding) else {
        member.outbox.counters.unexpected += 1;
        return;
    };
    let part = Control::ScenePart {
        hash: xxh3_64(text),
        total: text.len() as u32,
        offset,
        bytes: rest.iter().copied().take(SCENE_PART_BYTES).collect(),
    };
    member.send_to_newcomer(newcomer, to, &part);
}
