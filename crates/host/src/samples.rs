//! What is in samples, and how to find it.

use cotouch_net::{ChannelVectors, Entry, StatePacket};
use cotouch_scene::geometry::Readings;
use cotouch_scene::names::HostIndex;
use cotouch_world::BodyState;
use glam::DVec3;

/// Adds the fingers of the own user.
pub(crate) fn push_hands(packet: &mut StatePacket, readings: &Readings) {
    for (point, reading) in (0..).zip(readings) {
        push(packet, Entry::Hand { point, pose: reading.pose, twist: reading.twist });
    }
}

/// Adds the bodies at these places.
pub(crate) fn push_bodies(packet: &mut StatePacket, places: &[usize], bodies: &[BodyState]) {
    for &index in places {
        let BodyState { pose, twist } = bodies[index];
        push(packet, Entry::Object { object: index as u8, pose, twist });
    }
}

/// A checked scene has no more entries than a packet holds.
pub(crate) fn push(packet: &mut StatePacket, entry: Entry) {
    let _ = packet.entries.try_push(entry);
}

/// Position (m) and velocity (m/s) of a finger.
pub(crate) fn hand(packet: &StatePacket, finger: usize) -> Option<(DVec3, DVec3)> {
    packet.entries.iter().find_map(|entry| match entry {
        Entry::Hand { point, pose, twist } if usize::from(*point) == finger => {
            Some((pose.position, twist.linear))
        }
        _ => None,
    })
}

/// The sender's copy of a body.
pub(crate) fn body(packet: &StatePacket, body: usize) -> Option<BodyState> {
    packet.entries.iter().find_map(|entry| match entry {
        Entry::Object { object, pose, twist } if usize::from(*object) == body => {
            Some(BodyState { pose: *pose, twist: *twist })
        }
        _ => None,
    })
}

/// What the sender's coordination scheme says to `host` about a body; zeros where it says nothing.
pub(crate) fn channel(packet: &StatePacket, host: HostIndex, body: usize) -> ChannelVectors {
    let said = packet.entries.iter().find_map(|entry| match entry {
        Entry::Channel { to, object, vectors } if *to == host && usize::from(*object) == body => {
            Some(*vectors)
        }
        _ => None,
    });
    said.unwrap_or_default()
}
