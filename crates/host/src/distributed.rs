//! How copies of bodies are kept together at a distributed peer (thesis Fig 4.4, (4.28)–(4.29), any number of users).

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Coordination;
use cotouch_world::coupler::{Stretch, Turn, torque};

use crate::forces::couple;
use crate::model::HostModel;
use crate::output::{CouplerOutput, TickOutput, copy_slot, turn_slot};
use crate::packets::object_of;
use crate::state::HostState;

/// The couplers from held copies to the own ones.
pub(crate) struct Copies {
    weight: f64,
}

impl Copies {
    /// `pairwise`: every other copy counts fully. `average`: k_o to the mean of the present copies, the own one
    /// included undelayed, is the same as k_o divided by their number to each of the others.
    pub(crate) fn new(model: &HostModel, state: &HostState) -> Self {
        let weight = match model.coordination {
            Coordination::Pairwise => 1.0,
            Coordination::Average => 1.0 / (1.0 + state.peers.iter().map(|peer| peer.fade).sum::<f64>()),
        };
        Self { weight }
    }

    /// The pull of `host`'s held copies.
    pub(crate) fn couple(
        &self,
        model: &HostModel,
        state: &HostState,
        output: &mut TickOutput,
        host: HostIndex,
    ) {
        let peer = &state.peers[host.index()];
        let Some(sample) = peer.samples.held() else { return };
        let fade = self.weight * peer.fade;
        for &index in &model.moving {
            let Some(copy) = object_of(sample, index) else { continue };
            let body = &state.bodies[index];
            let stretch = Stretch::between(body.point(), copy.point());
            let slot = copy_slot(host.index(), index);
            let pull = couple(output, slot, true, model.object_object, fade, stretch);
            output.wrenches[index].force += pull;
            if model.turns {
                let spring = model.object_object_rotational;
                let turn = Turn::between(
                    (body.pose.orientation, body.twist.angular),
                    (copy.pose.orientation, copy.twist.angular),
                );
                output.wrenches[index].torque += fade * torque(spring, turn);
                let _ = output.couplers.try_push(CouplerOutput {
                    slot: turn_slot(host.index(), index),
                    held: true,
                    stiffness_n_per_m: fade * spring.stiffness_n_m_per_rad,
                    stretch: turn.rotation,
                });
            }
        }
    }
}
