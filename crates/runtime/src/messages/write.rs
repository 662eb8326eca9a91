//! From items to messages.

use cotouch_host::{ContactPoint, ContactRecord, ContactSurface};
use cotouch_net::{Entry, StatePacket};
use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_world::Phase;
use glam::{DQuat, DVec3};
use prost::Message;

use super::stream::Stream;
use super::types;
use crate::record::{Note, RecordItem, RecordKind, SurfaceRecord, TickRecord};

/// Appends `item` as a message to `bytes`; which stream it belongs to.
pub(crate) fn encode(item: &RecordItem, bytes: &mut Vec<u8>) -> Stream {
    let tick = item.tick;
    match &item.kind {
        RecordKind::Tick(record) => {
            append(&tick_message(tick, record), bytes);
            Stream::Tick
        }
        RecordKind::Received { from, packet } => {
            append(&received(tick, *from, packet), bytes);
            Stream::Received
        }
        RecordKind::Sent { to, packet } => {
            append(&sent(tick, *to, packet), bytes);
            Stream::Sent
        }
        RecordKind::State(state) => {
            append(&types::State { tick, state: state.clone() }, bytes);
            Stream::State
        }
        RecordKind::Surface(record) => {
            append(&surface(tick, record), bytes);
            Stream::Surface
        }
        RecordKind::Presence { .. }
        | RecordKind::Adopt
        | RecordKind::Release
        | RecordKind::ForceOff
        | RecordKind::Changed(_)
        | RecordKind::Device(_)
        | RecordKind::Note(_) => {
            append(&event(tick, &item.kind), bytes);
            Stream::Events
        }
    }
}

/// [`Message::encode`] without its error: a vector always has room.
fn append(message: &impl Message, bytes: &mut Vec<u8>) {
    message.encode_raw(bytes);
}

fn tick_message(tick: u64, record: &TickRecord) -> types::Tick {
    // Every field is named, so that a new one cannot be forgotten here.
    let TickRecord {
        instant,
        readings,
        device_failed,
        steps_in_use,
        fades,
        bodies,
        wrenches,
        contacts,
        requested,
        commanded,
        governor_acted,
        governor_gain,
        energy_j,
        finger_energy_j,
        touches_wall,
        diverged,
        lateness_ns,
        compute_ns,
    } = record;
    types::Tick {
        tick,
        instant_ns: instant.0,
        fingers: readings.iter().map(|reading| motion(&reading.pose, &reading.twist)).collect(),
        device_failed: *device_failed,
        steps_in_use: steps_in_use.iter().map(|&step| types::StepInUse { step }).collect(),
        fades: fades.to_vec(),
        bodies: bodies.iter().map(|body| motion(&body.pose, &body.twist)).collect(),
        body_wrenches: wrenches.iter().map(wrench).collect(),
        contacts: contacts.iter().map(contact).collect(),
        requested: requested.iter().map(wrench).collect(),
        commanded: commanded.iter().map(wrench).collect(),
        governor_acted: governor_acted.to_vec(),
        governor_gain: governor_gain.to_vec(),
        energy_j: *energy_j,
        finger_energy_j: finger_energy_j.to_vec(),
        touches_wall: *touches_wall,
        diverged: *diverged,
        lateness_ns: *lateness_ns,
        compute_ns: *compute_ns,
    }
}

fn contact(contact: &ContactRecord) -> types::Contact {
    let mut message =
        types::Contact { force_n: vector(contact.force), depth_m: contact.depth_m, ..Default::default() };
    match contact.point {
        ContactPoint::Finger { host, finger } => {
            (message.host, message.finger) = (Some(number(host)), Some(from_1(finger)));
        }
        ContactPoint::Corner { body, corner } => {
            (message.body, message.corner) = (Some(from_1(body)), Some(from_1(corner)));
        }
    }
    match contact.surface {
        ContactSurface::Body(body) => message.touched_body = Some(from_1(body)),
        ContactSurface::Wall(wall) => message.touched_wall = Some(from_1(wall)),
        ContactSurface::Soft => {}
    }
    if let Phase::MomentCancellation { pulses_left } = contact.phase {
        message.pulses_left = Some(pulses_left);
    }
    message.set_phase(match contact.phase {
        Phase::Free => types::contact::Phase::Free,
        Phase::MomentCancellation { .. } => types::contact::Phase::MomentCancellation,
        Phase::PreSlide => types::contact::Phase::PreSlide,
        Phase::Slide => types::contact::Phase::Slide,
    });
    message
}

fn from_1(index: u8) -> u32 {
    u32::from(index) + 1
}

fn surface(tick: u64, record: &SurfaceRecord) -> types::Surface {
    types::Surface {
        tick,
        period: record.period,
        ko_n_per_m: record.ko_n_per_m,
        positions_m: record.positions_m.as_flattened().to_vec(),
        stress_pa: record.stress_pa.clone(),
    }
}

fn received(tick: u64, from: HostIndex, packet: &StatePacket) -> types::Received {
    types::Received { tick, from_host: number(from), step: packet.step, entries: entries(packet) }
}

fn sent(tick: u64, to: Option<HostIndex>, packet: &StatePacket) -> types::Sent {
    types::Sent { tick, to_host: to.map(number), step: packet.step, entries: entries(packet) }
}

/// Hosts are counted from 1 in recordings, as in their names.
fn number(host: HostIndex) -> u32 {
    u32::from(host.0) + 1
}

fn entries(packet: &StatePacket) -> Vec<types::Entry> {
    packet.entries.iter().map(|entry| types::Entry { kind: Some(entry_kind(entry)) }).collect()
}

fn entry_kind(entry: &Entry) -> types::entry::Kind {
    match entry {
        Entry::Hand { point, pose, twist } => {
            types::entry::Kind::Hand(types::Hand { point: u32::from(*point), motion: motion(pose, twist) })
        }
        Entry::Object { object, pose, twist } => types::entry::Kind::Object(types::Object {
            object: u32::from(*object),
            motion: motion(pose, twist),
        }),
        Entry::Force { point, wrench: rendered } => {
            types::entry::Kind::Force(types::Force { point: u32::from(*point), wrench: wrench(rendered) })
        }
        Entry::Channel { to, object, vectors } => types::entry::Kind::Channel(types::Channel {
            to_host: number(*to),
            object: u32::from(*object),
            vectors: vectors.iter().flat_map(|vector| vector.to_array()).collect(),
        }),
    }
}

fn event(tick: u64, kind: &RecordKind) -> types::Event {
    use types::event::Kind;
    let scene_toml = match kind {
        RecordKind::Changed(scene_toml) => Some(scene_toml.clone()),
        _ => None,
    };
    let device = match kind {
        RecordKind::Device(device) => Some(types::Device {
            name: device.name.to_string(),
            max_force_n: device.max_force_n,
            max_torque_n_m: device.max_torque_n_m,
        }),
        _ => None,
    };
    let (kind, text, peer, count, reason) = match kind {
        RecordKind::Presence { peer, present: true } => {
            (Kind::PeerCame, format!("{peer} came"), Some(*peer), None, None)
        }
        RecordKind::Presence { peer, present: false } => {
            (Kind::PeerLeft, format!("{peer} left"), Some(*peer), None, None)
        }
        RecordKind::Adopt => {
            (Kind::Adopt, "takes the world from the first peer that it hears".to_owned(), None, None, None)
        }
        RecordKind::Release => (Kind::Release, "the governor lets go".to_owned(), None, None, None),
        RecordKind::ForceOff => {
            let text = "the loop stood still: the force was switched off and begins again softly";
            (Kind::ForceOff, text.to_owned(), None, None, None)
        }
        RecordKind::Changed(_) => {
            (Kind::Changed, "the settings of the session have changed".to_owned(), None, None, None)
        }
        RecordKind::Device(device) => {
            (Kind::Device, format!("the device is {}", device.name), None, None, None)
        }
        RecordKind::Note(note) => note_parts(note),
        RecordKind::Received { .. }
        | RecordKind::Sent { .. }
        | RecordKind::Tick(_)
        | RecordKind::Surface(_)
        | RecordKind::State(_) => {
            unreachable!("encode sends these to their own streams")
        }
    };
    let (kind, peer_host) = (kind.into(), peer.map(number));
    types::Event { tick, kind, text, peer_host, count, reason, scene_toml, device }
}

type EventParts = (types::event::Kind, String, Option<HostIndex>, Option<u64>, Option<String>);

fn note_parts(note: &Note) -> EventParts {
    use types::event::Kind;
    match note {
        Note::Skipped { ticks } => {
            (Kind::Skipped, format!("late: {ticks} ticks skipped"), None, Some(*ticks), None)
        }
        Note::DeviceFault(reason) => {
            let text = format!("the device could not be read or written: {reason}");
            (Kind::DeviceFault, text, None, None, Some(reason.to_string()))
        }
        Note::Diverged => (Kind::Diverged, "the world left all bounds".to_owned(), None, None, None),
        Note::Dropped { items } => {
            let text = format!("the recorder could not keep up: {items} items are missing here");
            (Kind::Dropped, text, None, Some(*items), None)
        }
        Note::Ended(reason) => (Kind::Ended, format!("ended: {reason}"), None, None, Some(reason.clone())),
    }
}

fn motion(pose: &Pose, twist: &Twist) -> types::Motion {
    types::Motion {
        pose: types::Pose { position_m: vector(pose.position), orientation: quaternion(pose.orientation) },
        twist: types::Twist {
            linear_m_per_s: vector(twist.linear),
            angular_rad_per_s: vector(twist.angular),
        },
    }
}

fn wrench(wrench: &Wrench) -> types::Wrench {
    types::Wrench { force_n: vector(wrench.force), torque_n_m: vector(wrench.torque) }
}

fn vector(vector: DVec3) -> types::Vector {
    types::Vector { x: vector.x, y: vector.y, z: vector.z }
}

fn quaternion(quaternion: DQuat) -> types::Quaternion {
    types::Quaternion { x: quaternion.x, y: quaternion.y, z: quaternion.z, w: quaternion.w }
}
