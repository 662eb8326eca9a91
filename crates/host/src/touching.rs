//! A finger as a host knows it: its own as read, one of another host as held.

use cotouch_scene::geometry::Reading;
use cotouch_scene::names::HostIndex;
use glam::DVec3;

use crate::peers::PeerState;
use crate::samples;

/// A finger that may touch bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touching {
    pub(crate) host: HostIndex,
    pub(crate) finger: usize,
    /// Whether it is another host's, known from samples only.
    pub(crate) is_held: bool,
    /// Where it is (m) and how it moves (m/s); `None` when nothing is known of it.
    pub(crate) place: Option<(DVec3, DVec3)>,
    /// How much of its force counts, 0 to 1.
    pub(crate) fade: f64,
}

impl Touching {
    /// A finger of the host's own user.
    pub(crate) fn own(host: HostIndex, finger: usize, reading: Option<&Reading>) -> Self {
        let place = reading.map(|reading| (reading.pose.position, reading.twist.linear));
        Self { host, finger, is_held: false, place, fade: 1.0 }
    }

    /// A finger of another host, as its sample in use has it.
    pub(crate) fn held(peers: &[PeerState], host: HostIndex, finger: usize) -> Self {
        let peer = &peers[host.index()];
        let place = peer.samples.held().and_then(|sample| samples::hand(sample, finger));
        Self { host, finger, is_held: true, place, fade: peer.fade }
    }
}
