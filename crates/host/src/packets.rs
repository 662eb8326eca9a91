//! What is in samples, and how to find it.

use arrayvec::ArrayVec;
use cotouch_net::packet::{Entry, StatePacket};
use cotouch_scene::geometry::{Readings, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_world::BodyState;
use glam::DVec3;

use crate::centralized;
use crate::model::HostModel;
use crate::soft_forces::soft_forces_on_client;
use crate::state::HostState;

/// What a peer or a client says about itself: its fingers, and a peer's copies of bodies.
pub(crate) fn of_self(
    model: &HostModel,
    state: &HostState,
    step: u64,
    readings: &Readings,
    copies: bool,
) -> StatePacket {
    let mut packet = StatePacket { step, entries: ArrayVec::new() };
    push_hands(&mut packet, readings);
    if copies {
        push_objects(&mut packet, model, state);
    }
    packet
}

/// What the server says to `client`: forces on its fingers, bodies, and, where there is room, the server's own fingers.
pub(crate) fn for_client(
    model: &HostModel,
    state: &HostState,
    step: u64,
    readings: &Readings,
    client: HostIndex,
) -> StatePacket {
    let mut packet = StatePacket { step, entries: ArrayVec::new() };
    let soft = soft_forces_on_client(model, state, step, readings, client);
    for finger in 0..model.fingers[client.index()] {
        let force = centralized::force_on_client(model, state, client, usize::from(finger));
        let force = force + soft.get(usize::from(finger)).copied().unwrap_or_default();
        push(&mut packet, Entry::Force { point: finger, wrench: Wrench::force(force) });
    }
    push_objects(&mut packet, model, state);
    push_hands(&mut packet, readings);
    packet
}

fn push_hands(packet: &mut StatePacket, readings: &Readings) {
    for (point, reading) in (0..).zip(readings) {
        push(packet, Entry::Hand { point, pose: reading.pose, twist: reading.twist });
    }
}

fn push_objects(packet: &mut StatePacket, model: &HostModel, state: &HostState) {
    for &index in &model.moving {
        let BodyState { pose, twist } = state.bodies[index];
        push(packet, Entry::Object { object: index as u8, pose, twist });
    }
}

/// A checked scene has no more than a packet holds.
fn push(packet: &mut StatePacket, entry: Entry) {
    let _ = packet.entries.try_push(entry);
}

/// Position (m) and velocity (m/s) of a finger in a sample.
pub(crate) fn hand_of(packet: &StatePacket, finger: usize) -> Option<(DVec3, DVec3)> {
    packet.entries.iter().find_map(|entry| match entry {
        Entry::Hand { point, pose, twist } if usize::from(*point) == finger => {
            Some((pose.position, twist.linear))
        }
        _ => None,
    })
}

/// A body in a sample.
pub(crate) fn object_of(packet: &StatePacket, body: usize) -> Option<BodyState> {
    packet.entries.iter().find_map(|entry| match entry {
        Entry::Object { object, pose, twist } if usize::from(*object) == body => {
            Some(BodyState { pose: *pose, twist: *twist })
        }
        _ => None,
    })
}
