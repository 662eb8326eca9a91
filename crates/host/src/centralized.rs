//! What server and client of the centralized architecture do for each other (thesis Fig 4.3, (4.25)–(4.27), any number of
//! clients).

use cotouch_net::packet::Entry;
use cotouch_scene::geometry::Wrench;
use cotouch_scene::names::HostIndex;
use glam::DVec3;

use crate::forces::{force_of_pull, held_finger};
use crate::model::HostModel;
use crate::output::TickOutput;
use crate::packets::object_of;
use crate::state::HostState;

/// What the server returns to a finger of `client` at a network step: the force of this instant, of the held finger and
/// the present bodies. The tick that follows finds the same and moves contacts on; nothing moves here.
pub(crate) fn force_on_client(
    model: &HostModel,
    state: &HostState,
    client: HostIndex,
    finger: usize,
) -> DVec3 {
    let finger = held_finger(state, client, finger);
    force_of_pull(model, state, finger) + model.force_of_touch(state, finger)
}

/// A client renders the forces that it holds.
pub(crate) fn client_forces(state: &HostState, output: &mut TickOutput) {
    let server = &state.peers[HostIndex::FIRST.index()];
    let Some(sample) = server.samples.held() else { return };
    for entry in &sample.entries {
        if let Entry::Force { point, wrench } = entry
            && let Some(device) = output.device.get_mut(usize::from(*point))
        {
            *device = Wrench::force(server.fade * wrench.force);
        }
    }
}

/// What a client knows of the bodies is what the server said last.
pub(crate) fn show_servers_bodies(model: &HostModel, state: &mut HostState) {
    let Some(sample) = state.peers[HostIndex::FIRST.index()].samples.held() else { return };
    for &body in &model.moving {
        if let Some(held) = object_of(sample, body) {
            state.bodies[body] = held;
        }
    }
}
