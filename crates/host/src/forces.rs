//! Forces at a host that keeps a world: own fingers, held fingers of others, and what acts on bodies by itself.
//!
//! A finger pulls at the centre of a body without a surface, and touches a body that has one ([`crate::contacts`]).

use cotouch_scene::geometry::{Readings, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::SpringDamper;
use cotouch_world::coupler::Stretch;
use glam::DVec3;

use crate::contacts::Touching;
use crate::distributed::Copies;
use crate::model::{HostModel, Role};
use crate::output::{CouplerOutput, TickOutput};
use crate::packets::hand_of;
use crate::state::HostState;

/// All forces of one tick at a peer or a server.
pub(crate) fn of_world(
    model: &HostModel,
    state: &mut HostState,
    readings: &Readings,
    output: &mut TickOutput,
) {
    for (finger, reading) in readings.iter().enumerate() {
        let place = Some((reading.pose.position, reading.twist.linear));
        let touching = Touching { host: model.host, finger, place, fade: 1.0 };
        let force = pull(model, state, output, touching) + model.touch_bodies(state, output, touching);
        output.device[finger] = Wrench::force(force);
    }
    for (index, body) in model.bodies.iter().enumerate().filter(|(_, body)| !body.fixed) {
        let own = body.own_wrench(&state.bodies[index]);
        output.wrenches[index].force += own.force;
        output.wrenches[index].torque += own.torque;
        output.touches_wall |= body.touches_wall(&state.bodies[index]);
    }
    let copies = (model.role == Role::Peer).then(|| Copies::new(model, state));
    for peer in model.host.others(model.users) {
        held_fingers(model, state, output, peer);
        if let Some(copies) = &copies {
            copies.couple(model, state, output, peer);
        }
    }
    model.touch_corners(state, output);
}

fn held_fingers(model: &HostModel, state: &mut HostState, output: &mut TickOutput, host: HostIndex) {
    for finger in 0..usize::from(model.fingers[host.index()]) {
        let touching = held_finger(state, host, finger);
        pull(model, state, output, touching);
        model.touch_bodies(state, output, touching);
    }
}

/// A finger of another host, as it is held.
pub(crate) fn held_finger(state: &HostState, host: HostIndex, finger: usize) -> Touching {
    let peer = &state.peers[host.index()];
    let place = peer.samples.held().and_then(|sample| hand_of(sample, finger));
    Touching { host, finger, place, fade: peer.fade }
}

/// Couples a finger to the centres of bodies without a surface. The force on the finger, N.
fn pull(model: &HostModel, state: &HostState, output: &mut TickOutput, finger: Touching) -> DVec3 {
    let mut on_finger = DVec3::ZERO;
    let Some(hand) = finger.place else { return on_finger };
    for &body in &model.points {
        let stretch = Stretch::between(state.bodies[body].point(), hand);
        let (spring, slot) =
            (model.coupling_to(finger.host), model.finger_slot(finger.host, finger.finger, body));
        let from_hand = couple(output, slot, finger.host != model.host, spring, finger.fade, stretch);
        output.wrenches[body].force += from_hand;
        on_finger -= from_hand;
    }
    on_finger
}

/// The force (N) that [`pull`] would find for this finger.
pub(crate) fn force_of_pull(model: &HostModel, state: &HostState, finger: Touching) -> DVec3 {
    let Some(hand) = finger.place else { return DVec3::ZERO };
    let force = |&body: &usize| {
        let stretch = Stretch::between(hand, state.bodies[body].point());
        finger.fade * cotouch_world::coupler::force(model.coupling_to(finger.host), stretch)
    };
    model.points.iter().map(force).sum()
}

impl HostModel {
    /// The coupling to the fingers of `host`.
    fn coupling_to(&self, host: HostIndex) -> SpringDamper {
        if host == self.host { self.hand_object } else { self.remote_hand_object }
    }
}

/// The force (N) of a coupler on its near end, `fade` times its nominal gains; also lists the coupler.
pub(crate) fn couple(
    output: &mut TickOutput,
    slot: u16,
    held: bool,
    spring: SpringDamper,
    fade: f64,
    stretch: Stretch,
) -> DVec3 {
    let stiffness_n_per_m = fade * spring.stiffness_n_per_m;
    // What finds no place in the list counts all the same.
    let _ =
        output.couplers.try_push(CouplerOutput { slot, held, stiffness_n_per_m, stretch: stretch.position });
    fade * cotouch_world::coupler::force(spring, stretch)
}
