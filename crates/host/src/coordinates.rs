//! Where each coordinate of a session's state lives at a host, so that it can be read and written by its name.

use cotouch_net::{Entry, StatePacket};
use cotouch_scene::geometry::{Pose, Twist};
use cotouch_scene::names::{Axis, Coordinate, Part, Quantity};
use cotouch_world::coupler::rotation_vector;
use glam::DQuat;

use crate::model::HostModel;
use crate::state::HostState;

impl HostState {
    /// The value of one of this host's coordinates at network step `step`, before anything is sampled at it; `None`
    /// where it lives elsewhere (a hand in its device, a sample still in flight). Turns are counted from
    /// [`HostModel::about`].
    #[must_use]
    pub fn coordinate(&self, model: &HostModel, step: u64, coordinate: Coordinate) -> Option<f64> {
        let mut value = None;
        // Reading and writing share one path, so that they cannot disagree about where a coordinate lives.
        self.clone().visit(model, step, coordinate, &mut |place| value = Some(*place));
        value
    }

    /// Sets one of this host's coordinates; whether it lives here.
    pub fn set_coordinate(
        &mut self,
        model: &HostModel,
        step: u64,
        coordinate: Coordinate,
        value: f64,
    ) -> bool {
        let mut found = false;
        self.visit(model, step, coordinate, &mut |place| {
            *place = value;
            found = true;
        });
        found
    }

    fn visit(&mut self, model: &HostModel, step: u64, coordinate: Coordinate, act: &mut dyn FnMut(&mut f64)) {
        match coordinate {
            Coordinate::Own { host, part: Part::Object(index), quantity } if host == model.host => {
                if let Some(body) = self.bodies.get_mut(usize::from(index)) {
                    visit_motion(quantity, about(model, index), &mut body.pose, &mut body.twist, act);
                }
            }
            Coordinate::Held { host, from, part, quantity, age } if host == model.host => {
                let Some(sampled) = step.checked_sub(u64::from(age)) else { return };
                let Some(peer) = self.peers.get_mut(from.index()) else { return };
                if let Some(packet) = peer.samples.sample_mut(sampled) {
                    visit_packet(packet, model, part, quantity, act);
                }
            }
            Coordinate::SchemeMemory { host, from, object, quantity, vector } if host == model.host => {
                let (Quantity::Position(axis) | Quantity::Rotation(axis)) = quantity else { return };
                let turns = matches!(quantity, Quantity::Rotation(_));
                let copies = model.copies.as_ref();
                let place =
                    copies.and_then(|copies| copies.memory_place(&model.bodies, object, turns, vector));
                if let Some((place, peer)) = place.zip(self.peers.get_mut(from.index())) {
                    act(&mut peer.memory[place][axis.index()]);
                }
            }
            _ => {}
        }
    }
}

/// Reads or writes the number that `part` and `quantity` name in a packet, wherever that packet is.
pub fn visit_packet(
    packet: &mut StatePacket,
    model: &HostModel,
    part: Part,
    quantity: Quantity,
    act: &mut dyn FnMut(&mut f64),
) {
    for entry in &mut packet.entries {
        match (part, entry) {
            (Part::Hand(index), Entry::Hand { point, pose, twist }) if index == *point => {
                visit_motion(quantity, DQuat::IDENTITY, pose, twist, act);
            }
            (Part::Object(index), Entry::Object { object, pose, twist }) if index == *object => {
                visit_motion(quantity, about(model, index), pose, twist, act);
            }
            (Part::Force(index), Entry::Force { point, wrench }) if index == *point => {
                if let Quantity::Force(axis) = quantity {
                    act(&mut wrench.force[axis.index()]);
                }
            }
            (Part::Channel(index), Entry::Channel { to, object, vectors }) if *to == model.host => {
                let first = usize::from(*object) * vectors.len();
                let vector = usize::from(index).checked_sub(first).and_then(|vector| vectors.get_mut(vector));
                if let (Some(vector), Quantity::Force(axis)) = (vector, quantity) {
                    act(&mut vector[axis.index()]);
                }
            }
            _ => {}
        }
    }
}

fn about(model: &HostModel, body: u8) -> DQuat {
    model.about.get(usize::from(body)).copied().unwrap_or(DQuat::IDENTITY)
}

fn visit_motion(
    quantity: Quantity,
    about: DQuat,
    pose: &mut Pose,
    twist: &mut Twist,
    act: &mut dyn FnMut(&mut f64),
) {
    match quantity {
        Quantity::Position(axis) => act(&mut pose.position[axis.index()]),
        Quantity::Velocity(axis) => act(&mut twist.linear[axis.index()]),
        Quantity::AngularVelocity(axis) => act(&mut twist.angular[axis.index()]),
        Quantity::Rotation(axis) => visit_turn(axis, about, &mut pose.orientation, act),
        Quantity::Force(_) => {}
    }
}

/// One component of the rotation vector (world frame) from `about` to `orientation`.
fn visit_turn(axis: Axis, about: DQuat, orientation: &mut DQuat, act: &mut dyn FnMut(&mut f64)) {
    let mut turn = rotation_vector(*orientation * about.conjugate());
    let before = turn[axis.index()];
    act(&mut turn[axis.index()]);
    // What is only read stays as it is, bit for bit.
    if turn[axis.index()] != before {
        *orientation = (DQuat::from_scaled_axis(turn) * about).normalize();
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn turns_are_read_as_they_were_written_small_and_large() {
        let about = DQuat::from_scaled_axis(DVec3::new(0.3, -1.0, 2.0));
        for size in [1e-12, 1e-6, 1e-3, 1.0, 3.0] {
            let mut orientation = about;
            let written = DVec3::new(0.6, -0.64, 0.48) * size;
            // Each component for itself: the others stay.
            for axis in Axis::ALL {
                visit_turn(axis, about, &mut orientation, &mut |value| *value = written[axis.index()]);
            }
            let mut read = DVec3::ZERO;
            for axis in Axis::ALL {
                visit_turn(axis, about, &mut orientation, &mut |value| read[axis.index()] = *value);
            }
            assert!((read - written).length() < 1e-15 + 1e-12 * size, "{read} {written}");
        }
    }
}
