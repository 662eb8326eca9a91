//! Who may take part, and in whose place: what the server decides about a newcomer.

use cotouch_scene::names::HostIndex;
use cotouch_scene::time::LocalTime;

use super::config::MILLISECOND;
use super::member::{Member, Membership};
use super::peer::Presence;
use crate::message::{Join, PeerId, Refusal};
use crate::route::Route;
use crate::text::Text;

/// A host that has been silent for so long gives way to a new one of the same name.
const TAKEOVER_SILENCE_NS: i64 = 1_000 * MILLISECOND;
/// A newcomer whose name's holder is still heard after so long is refused.
const TAKEOVER_WAIT_NS: i64 = 2_000 * MILLISECOND;

/// What becomes of a newcomer.
pub(super) enum Admission {
    /// It takes part at this host.
    Granted(HostIndex),
    /// The name's holder may be dead; time will tell.
    Undecided,
    Refused(Refusal),
}

/// What is wrong with a newcomer, whoever it is.
pub(super) fn objection(member: &Member, join: &Join) -> Option<Refusal> {
    let config = &member.config;
    if member.phase != Membership::Active {
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

/// Finds a place for a newcomer to which there is no objection.
pub(super) fn decide(
    member: &mut Member,
    now: LocalTime,
    from: Route,
    newcomer: PeerId,
    name: Option<Text>,
) -> Admission {
    match name {
        Some(name) => decide_by_name(member, now, from, newcomer, name),
        None => any_place(member, from),
    }
}

fn decide_by_name(
    member: &mut Member,
    now: LocalTime,
    from: Route,
    newcomer: PeerId,
    name: Text,
) -> Admission {
    let index = member.config.names.iter().position(|known| known == name.as_str());
    let host = HostIndex(index.expect("an unknown name was objected to") as u8);
    if host == HostIndex::FIRST {
        return Admission::Refused(Refusal::NameTaken { name });
    }
    let Some(peer) = member.peer_mut(host) else { return Admission::Granted(host) };
    let is_silent = now.since(peer.last_heard) >= TAKEOVER_SILENCE_NS;
    // Two programs cannot receive by one route: the old one is gone.
    if peer.presence != Presence::Present || peer.route == from || is_silent {
        return Admission::Granted(host);
    }
    let (contender, since) = *peer.contender.get_or_insert((newcomer, now));
    if contender != newcomer {
        peer.contender = Some((newcomer, now));
    } else if now.since(since) >= TAKEOVER_WAIT_NS {
        peer.contender = None;
        return Admission::Refused(Refusal::NameTaken { name });
    }
    Admission::Undecided
}

/// The first place that was never taken; else one whose host left; else one whose host is lost.
fn any_place(member: &Member, from: Route) -> Admission {
    let users = member.config.names.len() as u8;
    let rank = |host: HostIndex| match member.peers.iter().find(|peer| peer.host == host) {
        Some(peer) if peer.route == from => Some(0),
        None => Some(1),
        Some(peer) if peer.presence == Presence::Left => Some(2),
        Some(peer) if peer.presence == Presence::Lost => Some(3),
        Some(_) => None,
    };
    let places = HostIndex::FIRST.others(users).filter_map(|host| Some((rank(host)?, host)));
    places.min().map_or(Admission::Refused(Refusal::Full { users }), |(_, host)| Admission::Granted(host))
}
