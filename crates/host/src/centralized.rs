//! What a client of the centralized architecture does with what the server says: Fotoohi Ghiam 2006, Fig. 4.3,
//! (4.25)–(4.27), any number of clients.

use cotouch_net::Entry;
use cotouch_scene::geometry::Wrench;
use cotouch_scene::names::HostIndex;
use cotouch_world::BodyState;
use glam::DVec3;

use crate::bodies::Bodies;
use crate::output::TickOutput;
use crate::peers::PeerState;
use crate::samples;

/// Renders the forces that are held.
pub(crate) fn render(peers: &[PeerState], output: &mut TickOutput) {
    let server = &peers[HostIndex::FIRST.index()];
    let Some(sample) = server.samples.held() else { return };
    for entry in &sample.entries {
        if let Entry::Force { point, wrench } = entry
            && let Some(device) = output.device.get_mut(usize::from(*point))
        {
            let offset =
                server.forces.get(usize::from(*point)).map_or(DVec3::ZERO, |force| force.value().position);
            *device = Wrench::force(server.fade * (wrench.force - offset));
        }
    }
}

/// What is known of the bodies is what the server said last.
pub(crate) fn follow(bodies: &Bodies, states: &mut [BodyState], peers: &[PeerState]) {
    let Some(sample) = peers[HostIndex::FIRST.index()].samples.held() else { return };
    for &body in bodies.moving() {
        if let Some(held) = samples::body(sample, body) {
            states[body] = held;
        }
    }
}
