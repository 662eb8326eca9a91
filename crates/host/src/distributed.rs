//! Forces at a distributed peer (thesis Fig 4.4, (4.28)–(4.29), any number of users).

use cotouch_scene::geometry::{Reading, Wrench};
use cotouch_scene::scene::Coordination;
use cotouch_world::coupler::Stretch;

use crate::model::HostModel;
use crate::state::HostState;
use crate::step::{OWN_HAND, TickOutput, couple, hand_of, hand_slot, object_of, object_slot};

/// Own hand on own copy, held remote hands on own copy, held copies on own copy.
pub(crate) fn forces(model: &HostModel, state: &HostState, reading: &Reading) -> TickOutput {
    let mut output = TickOutput::default();
    let object = state.object.point();
    let hand = (reading.pose.position, reading.twist.linear);
    let from_hand = couple(&mut output, OWN_HAND, model.hand_object, 1.0, Stretch::between(object, hand));
    let mut force = from_hand + model.grounded_force(&state.object);
    let weight = coordination_weight(model, state);
    for (index, peer) in state.peers.iter().enumerate() {
        let Some(sample) = peer.samples.held() else { continue };
        if let Some(hand) = hand_of(sample) {
            let stretch = Stretch::between(object, hand);
            force += couple(&mut output, hand_slot(index), model.remote_hand_object, peer.fade, stretch);
        }
        if let Some(copy) = object_of(sample) {
            let stretch = Stretch::between(object, copy.point());
            force +=
                couple(&mut output, object_slot(index), model.object_object, weight * peer.fade, stretch);
        }
    }
    output.device = Wrench::force(-from_hand);
    output.object_force = force;
    output
}

/// `pairwise`: every other copy counts fully. `average`: k_o to the mean of the present copies, the own one
/// included undelayed, is the same as k_o divided by their number to each of the others.
fn coordination_weight(model: &HostModel, state: &HostState) -> f64 {
    match model.coordination {
        Coordination::Pairwise => 1.0,
        Coordination::Average => 1.0 / (1.0 + state.peers.iter().map(|peer| peer.fade).sum::<f64>()),
    }
}
