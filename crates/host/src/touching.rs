//! A finger as a host knows it: its own as read, one of another host as held.

use cotouch_scene::geometry::Reading;
use cotouch_scene::names::HostIndex;
use cotouch_world::BodyState;
use cotouch_world::coupler::Stretch;
use glam::DVec3;

use crate::peers::PeerState;
use crate::rejoining::BodyOffset;
use crate::samples;

/// A finger that may touch bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touching<'a> {
    pub(crate) host: HostIndex,
    pub(crate) finger: usize,
    /// Whether it is another host's, known from samples only.
    pub(crate) is_held: bool,
    /// How much of its force counts, 0 to 1.
    pub(crate) fade: f64,
    /// Where it is (m) and how it moves (m/s); `None` when nothing is known of it.
    place: Option<(DVec3, DVec3)>,
    /// How far it counts as elsewhere (m), and as moving otherwise (m/s).
    offset: Stretch,
    /// How far bodies are displaced to which it is held; none of an own finger.
    bodies: &'a [BodyOffset],
}

impl<'a> Touching<'a> {
    /// A finger of the host's own user.
    pub(crate) fn own(host: HostIndex, finger: usize, reading: Option<&Reading>) -> Self {
        let place = reading.map(|reading| (reading.pose.position, reading.twist.linear));
        Self { host, finger, is_held: false, fade: 1.0, place, offset: Stretch::default(), bodies: &[] }
    }

    /// A finger of another host, as its sample in use has it.
    pub(crate) fn held(peers: &'a [PeerState], host: HostIndex, finger: usize) -> Self {
        let peer = &peers[host.index()];
        let place = peer.samples.held().and_then(|sample| samples::hand(sample, finger));
        let offset = peer.fingers.get(finger).map_or(Stretch::default(), |finger| finger.offset.value());
        Self { host, finger, is_held: true, fade: peer.fade, place, offset, bodies: &peer.bodies }
    }

    /// Where it counts as (m) and how it moves (m/s) at no body of those that move.
    pub(crate) fn place(&self) -> Option<(DVec3, DVec3)> {
        self.place.map(|place| self.displaced(place))
    }

    /// The same at the own copy of a body.
    pub(crate) fn place_at(&self, body: usize, own: &BodyState) -> Option<(DVec3, DVec3)> {
        let Some(displaced) = self.bodies.get(body) else { return self.place() };
        Some(self.displaced(displaced.seen(own, self.place?)))
    }

    fn displaced(&self, (place, velocity): (DVec3, DVec3)) -> (DVec3, DVec3) {
        (place - self.offset.position, velocity - self.offset.velocity)
    }
}
