//! From messages back to items. Bytes come from outside: whatever they are, the answer is an item or an error.

use arrayvec::{ArrayString, ArrayVec};
use cotouch_host::{ContactPoint, ContactRecord, ContactSurface};
use cotouch_net::{ChannelVectors, Entry, StatePacket};
use cotouch_scene::geometry::{Pose, Reading, Twist, Wrench};
use cotouch_scene::limits::MAX_CHANNEL_VECTORS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::SessionTime;
use cotouch_world::{BodyState, Phase};
use glam::{DQuat, DVec3};
use prost::Message;

use super::stream::Stream;
use super::types;
use crate::record::{DeviceRecord, Note, RecordItem, RecordKind, SurfaceRecord, TickRecord};

/// Why bytes are no message of their stream.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(crate) enum MalformedMessage {
    #[error("bytes that are no protobuf message of its type ({0})")]
    Protobuf(#[from] prost::DecodeError),
    #[error("{found} {what}, where at most {max} are allowed")]
    TooMany { what: &'static str, found: usize, max: usize },
    #[error("{what} of {found} bytes, where at most {max} are allowed")]
    TooLong { what: &'static str, found: usize, max: usize },
    #[error("{what} {found}, where {least} to {max} are allowed")]
    OutOfRange { what: &'static str, found: u64, least: u64, max: u64 },
    #[error("{0}")]
    Missing(&'static str),
}

/// The item that a message of `stream` of `host` says.
pub(crate) fn decode(host: HostIndex, stream: Stream, bytes: &[u8]) -> Result<RecordItem, MalformedMessage> {
    let (tick, kind) = match stream {
        Stream::Tick => tick_record(types::Tick::decode(bytes)?)?,
        Stream::Received => received(types::Received::decode(bytes)?)?,
        Stream::Sent => sent(types::Sent::decode(bytes)?)?,
        Stream::Events => event(types::Event::decode(bytes)?)?,
        Stream::State => {
            let types::State { tick, state } = types::State::decode(bytes)?;
            (tick, RecordKind::State(state))
        }
        Stream::Surface => surface(types::Surface::decode(bytes)?)?,
    };
    Ok(RecordItem { host, tick, kind })
}

type TickAndKind = (u64, RecordKind);

fn tick_record(message: types::Tick) -> Result<TickAndKind, MalformedMessage> {
    let contacts = message.contacts.iter().map(contact).collect::<Result<Vec<_>, _>>()?;
    let record = TickRecord {
        instant: SessionTime(message.instant_ns),
        readings: array("fingers", message.fingers.into_iter().map(reading))?,
        device_failed: message.device_failed,
        steps_in_use: array("steps in use", message.steps_in_use.iter().map(|in_use| in_use.step))?,
        fades: array("fades", message.fades.iter().copied())?,
        bodies: array("bodies", message.bodies.into_iter().map(body))?,
        wrenches: array("wrenches on bodies", message.body_wrenches.into_iter().map(wrench))?,
        contacts: array("contacts", contacts.into_iter())?,
        requested: array("requested wrenches", message.requested.into_iter().map(wrench))?,
        commanded: array("commanded wrenches", message.commanded.into_iter().map(wrench))?,
        governor_acted: array("governors", message.governor_acted.iter().copied())?,
        governor_gain: array("governors", message.governor_gain.iter().copied())?,
        energy_j: message.energy_j,
        finger_energy_j: array("fingers' energies", message.finger_energy_j.iter().copied())?,
        touches_wall: message.touches_wall,
        diverged: message.diverged,
        lateness_ns: message.lateness_ns,
        compute_ns: message.compute_ns,
    };
    Ok((message.tick, RecordKind::Tick(record)))
}

fn contact(message: &types::Contact) -> Result<ContactRecord, MalformedMessage> {
    let point = match (message.host, message.finger, message.body, message.corner) {
        (Some(of), Some(finger), None, None) => {
            ContactPoint::Finger { host: host(of)?, finger: from_1("finger", finger)? }
        }
        (None, None, Some(body), Some(corner)) => {
            ContactPoint::Corner { body: from_1("body", body)?, corner: from_1("corner", corner)? }
        }
        _ => return Err(MalformedMessage::Missing("a contact of neither a finger nor a corner")),
    };
    let surface = match (message.touched_body, message.touched_wall) {
        (Some(body), None) => ContactSurface::Body(from_1("body", body)?),
        (None, Some(wall)) => ContactSurface::Wall(from_1("wall", wall)?),
        (None, None) => ContactSurface::Soft,
        (Some(_), Some(_)) => {
            return Err(MalformedMessage::Missing("a contact with either a body or a wall"));
        }
    };
    let phase = match (message.phase(), message.pulses_left) {
        (types::contact::Phase::Free, None) => Phase::Free,
        (types::contact::Phase::MomentCancellation, Some(pulses_left)) => {
            Phase::MomentCancellation { pulses_left }
        }
        (types::contact::Phase::PreSlide, None) => Phase::PreSlide,
        (types::contact::Phase::Slide, None) => Phase::Slide,
        _ => {
            return Err(MalformedMessage::Missing(
                "pulses left where there is no moment cancellation, or none where there is",
            ));
        }
    };
    Ok(ContactRecord { point, surface, phase, force: vector(message.force_n), depth_m: message.depth_m })
}

fn surface(message: types::Surface) -> Result<TickAndKind, MalformedMessage> {
    let (positions_m, rest) = message.positions_m.as_chunks();
    if !rest.is_empty() {
        return Err(MalformedMessage::Missing("a surface whose positions are not three numbers each"));
    }
    let record = SurfaceRecord {
        period: message.period,
        ko_n_per_m: message.ko_n_per_m,
        positions_m: positions_m.to_vec(),
        stress_pa: message.stress_pa,
    };
    Ok((message.tick, RecordKind::Surface(record)))
}

fn received(message: types::Received) -> Result<TickAndKind, MalformedMessage> {
    let from = host(message.from_host)?;
    let packet = packet(message.step, &message.entries)?;
    Ok((message.tick, RecordKind::Received { from, packet }))
}

fn sent(message: types::Sent) -> Result<TickAndKind, MalformedMessage> {
    let to = message.to_host.map(host).transpose()?;
    let packet = packet(message.step, &message.entries)?;
    Ok((message.tick, RecordKind::Sent { to, packet }))
}

fn packet(step: u64, messages: &[types::Entry]) -> Result<StatePacket, MalformedMessage> {
    let entries = messages.iter().map(entry).collect::<Result<Vec<_>, _>>()?;
    Ok(StatePacket { step, entries: array("entries in a packet", entries.into_iter())? })
}

fn entry(message: &types::Entry) -> Result<Entry, MalformedMessage> {
    let motion = |motion: types::Motion| (pose(motion.pose), twist(motion.twist));
    match &message.kind {
        Some(types::entry::Kind::Hand(hand)) => {
            let (pose, twist) = motion(hand.motion);
            Ok(Entry::Hand { point: byte("haptic interface point", hand.point)?, pose, twist })
        }
        Some(types::entry::Kind::Object(object)) => {
            let (pose, twist) = motion(object.motion);
            Ok(Entry::Object { object: byte("object", object.object)?, pose, twist })
        }
        Some(types::entry::Kind::Force(force)) => Ok(Entry::Force {
            point: byte("haptic interface point", force.point)?,
            wrench: wrench(force.wrench),
        }),
        Some(types::entry::Kind::Channel(channel)) => Ok(Entry::Channel {
            to: host(channel.to_host)?,
            object: byte("object", channel.object)?,
            vectors: channel_vectors(&channel.vectors)?,
        }),
        None => {
            Err(MalformedMessage::Missing("a packet's entry that is neither hand, object, force nor channel"))
        }
    }
}

fn channel_vectors(numbers: &[f64]) -> Result<ChannelVectors, MalformedMessage> {
    let (vectors, rest) = numbers.as_chunks();
    let vectors: &[[f64; 3]; 2 * MAX_CHANNEL_VECTORS] =
        vectors
            .try_into()
            .ok()
            .filter(|_| rest.is_empty())
            .ok_or(MalformedMessage::Missing("a channel's entry with more or fewer vectors than it has"))?;
    Ok(vectors.map(DVec3::from_array))
}

fn event(message: types::Event) -> Result<TickAndKind, MalformedMessage> {
    use types::event::Kind;
    let peer = || match message.peer_host {
        Some(number) => host(number),
        None => Err(MalformedMessage::Missing("an event about a peer that names no peer")),
    };
    let count = || message.count.ok_or(MalformedMessage::Missing("an event that counts without a count"));
    let unknown = |_| MalformedMessage::Missing("an event of an unknown kind");
    let kind = match Kind::try_from(message.kind).map_err(unknown)? {
        Kind::PeerCame => RecordKind::Presence { peer: peer()?, present: true },
        Kind::PeerLeft => RecordKind::Presence { peer: peer()?, present: false },
        Kind::Adopt => RecordKind::Adopt,
        Kind::Release => RecordKind::Release,
        Kind::ForceOff => RecordKind::ForceOff,
        Kind::Changed => {
            let scene = message.scene_toml;
            RecordKind::Changed(scene.ok_or(MalformedMessage::Missing("a change without a scene"))?)
        }
        Kind::Skipped => RecordKind::Note(Note::Skipped { ticks: count()? }),
        Kind::DeviceFault => {
            let reason = message.reason.unwrap_or_default();
            RecordKind::Note(Note::DeviceFault(text("a device's reason", &reason)?))
        }
        Kind::Device => {
            let device = message.device.ok_or(MalformedMessage::Missing("a device that is not told"))?;
            let types::Device { name, max_force_n, max_torque_n_m } = device;
            let name = text("a device's name", &name)?;
            RecordKind::Device(DeviceRecord { name, max_force_n, max_torque_n_m })
        }
        Kind::Diverged => RecordKind::Note(Note::Diverged),
        Kind::Dropped => RecordKind::Note(Note::Dropped { items: count()? }),
        Kind::Ended => {
            let reason = message.reason.ok_or(MalformedMessage::Missing("an end without a reason"))?;
            RecordKind::Note(Note::Ended(reason))
        }
    };
    Ok((message.tick, kind))
}

fn text<const MAX: usize>(what: &'static str, text: &str) -> Result<ArrayString<MAX>, MalformedMessage> {
    let found = text.len();
    ArrayString::from(text).map_err(|_| MalformedMessage::TooLong { what, found, max: MAX })
}

fn array<T, const MAX: usize>(
    what: &'static str,
    elements: impl ExactSizeIterator<Item = T>,
) -> Result<ArrayVec<T, MAX>, MalformedMessage> {
    if elements.len() > MAX {
        return Err(MalformedMessage::TooMany { what, found: elements.len(), max: MAX });
    }
    Ok(elements.collect())
}

/// Hosts are counted from 1 in recordings, as in their names.
fn host(number: u32) -> Result<HostIndex, MalformedMessage> {
    let index = number.checked_sub(1).and_then(|index| u8::try_from(index).ok());
    let error =
        MalformedMessage::OutOfRange { what: "host number", found: number.into(), least: 1, max: 256 };
    index.map(HostIndex).ok_or(error)
}

fn byte(what: &'static str, number: u32) -> Result<u8, MalformedMessage> {
    let error = MalformedMessage::OutOfRange { what, found: number.into(), least: 0, max: 255 };
    u8::try_from(number).map_err(|_| error)
}

/// Fingers, bodies, corners and walls are counted from 1 in recordings.
fn from_1(what: &'static str, number: u32) -> Result<u8, MalformedMessage> {
    let error = MalformedMessage::OutOfRange { what, found: number.into(), least: 1, max: 256 };
    number.checked_sub(1).and_then(|index| u8::try_from(index).ok()).ok_or(error)
}

fn reading(motion: types::Motion) -> Reading {
    Reading { pose: pose(motion.pose), twist: twist(motion.twist) }
}

fn body(motion: types::Motion) -> BodyState {
    BodyState { pose: pose(motion.pose), twist: twist(motion.twist) }
}

fn pose(pose: types::Pose) -> Pose {
    let types::Quaternion { x, y, z, w } = pose.orientation;
    Pose { position: vector(pose.position_m), orientation: DQuat::from_xyzw(x, y, z, w) }
}

fn twist(twist: types::Twist) -> Twist {
    Twist { linear: vector(twist.linear_m_per_s), angular: vector(twist.angular_rad_per_s) }
}

fn wrench(wrench: types::Wrench) -> Wrench {
    Wrench { force: vector(wrench.force_n), torque: vector(wrench.torque_n_m) }
}

fn vector(vector: types::Vector) -> DVec3 {
    DVec3::new(vector.x, vector.y, vector.z)
}
