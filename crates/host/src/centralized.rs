//! Forces of the centralized architecture (thesis Fig 4.3, (4.25)–(4.27), any number of clients).

use cotouch_net::packet::Entry;
use cotouch_scene::geometry::{Reading, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_world::coupler::Stretch;
use glam::DVec3;

use crate::model::HostModel;
use crate::state::HostState;
use crate::step::{OWN_HAND, TickOutput, couple, hand_of, hand_slot, object_of};

/// The server's own user and every held remote hand on the one object.
pub(crate) fn server_forces(model: &HostModel, state: &HostState, reading: &Reading) -> TickOutput {
    let mut output = TickOutput::default();
    let object = state.object.point();
    let hand = (reading.pose.position, reading.twist.linear);
    let from_hand = couple(&mut output, OWN_HAND, model.hand_object, 1.0, Stretch::between(object, hand));
    let mut force = from_hand + model.grounded_force(&state.object);
    for (index, peer) in state.peers.iter().enumerate() {
        if let Some(hand) = peer.samples.held().and_then(hand_of) {
            let stretch = Stretch::between(object, hand);
            force += couple(&mut output, hand_slot(index), model.remote_hand_object, peer.fade, stretch);
        }
    }
    output.device = Wrench::force(-from_hand);
    output.object_force = force;
    output
}

/// What the server returns to `client` at a network step.
pub(crate) fn force_on_client(model: &HostModel, state: &HostState, client: HostIndex) -> DVec3 {
    let peer = &state.peers[client.index()];
    let Some(hand) = peer.samples.held().and_then(hand_of) else { return DVec3::ZERO };
    let stretch = Stretch::between(hand, state.object.point());
    peer.fade * cotouch_world::coupler::force(model.remote_hand_object, stretch)
}

/// A client renders the force it holds.
pub(crate) fn client_forces(state: &HostState) -> TickOutput {
    let server = &state.peers[HostIndex::FIRST.index()];
    let held = server.samples.held().and_then(|packet| {
        packet.entries.iter().find_map(|entry| match entry {
            Entry::Force { point: 0, wrench } => Some(wrench.force),
            _ => None,
        })
    });
    TickOutput { device: Wrench::force(server.fade * held.unwrap_or(DVec3::ZERO)), ..TickOutput::default() }
}

/// What a client knows of the object is what the server said last.
pub(crate) fn show_servers_object(state: &mut HostState) {
    if let Some(object) = state.peers[HostIndex::FIRST.index()].samples.held().and_then(object_of) {
        state.object = object;
    }
}
