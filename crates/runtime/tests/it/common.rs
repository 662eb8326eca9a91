//! Items for the tests: any that there can be, and a small session's.

use std::collections::BTreeMap;
use std::path::Path;

use arrayvec::{ArrayString, ArrayVec};
use cotouch_host::{ContactPoint, ContactRecord, ContactSurface};
use cotouch_net::{Entry, StatePacket};
use cotouch_runtime::{
    DeviceRecord, FaultText, Note, RecordItem, RecordKind, Recorder, RecordingHeader, SurfaceRecord,
    TickRecord,
};
use cotouch_scene::geometry::{Pose, Reading, Twist, Wrench};
use cotouch_scene::limits::{MAX_CONTACTS, MAX_ENTRIES};
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::{Rate, SessionTime};
use cotouch_world::{BodyState, Phase};
use glam::{DQuat, DVec3};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;

pub(crate) fn header() -> RecordingHeader {
    RecordingHeader {
        cotouch_version: "0.1.0".to_owned(),
        scene_toml: "name = \"single-axis\"\n".to_owned(),
        control_hz: Rate::new(1024, 1).unwrap(),
        epoch_unix_ns: 0,
        facts: BTreeMap::from([
            ("seed".to_owned(), "7".to_owned()),
            ("format".to_owned(), "mine".to_owned()),
        ]),
    }
}

/// The bytes of a finished recording of `items`.
pub(crate) fn record(items: &[RecordItem]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("test.mcap");
    write(&path, items);
    std::fs::read(&path).unwrap()
}

pub(crate) fn write(path: &Path, items: &[RecordItem]) {
    let mut recorder = Recorder::create(path, &header()).unwrap();
    items.iter().for_each(|item| recorder.write(item).unwrap());
    recorder.finish(BTreeMap::from([("stable".to_owned(), "true".to_owned())])).unwrap();
}

/// Equal bit for bit, which `==` is not where something is not a number.
pub(crate) fn bytes(items: &[RecordItem]) -> Vec<Vec<u8>> {
    items.iter().map(|item| postcard::to_allocvec(item).unwrap()).collect()
}

/// `ticks` ticks of two hosts, with packets every eighth tick, an event and a state.
pub(crate) fn session(ticks: u64) -> Vec<RecordItem> {
    (0..ticks).flat_map(|tick| [0, 1].map(|host| (HostIndex(host), tick))).flat_map(items_of_tick).collect()
}

fn items_of_tick((host, tick): (HostIndex, u64)) -> Vec<RecordItem> {
    let mut kinds = Vec::new();
    if tick.is_multiple_of(1000) {
        kinds.push(RecordKind::State(vec![host.0, 1, 2]));
    }
    if tick == 3 {
        kinds.push(RecordKind::Presence { peer: HostIndex(1 - host.0), present: true });
    }
    if tick.is_multiple_of(8) {
        kinds.push(RecordKind::Sent { to: None, packet: packet(tick / 8) });
        kinds.push(RecordKind::Received { from: HostIndex(1 - host.0), packet: packet(tick / 8) });
    }
    kinds.push(RecordKind::Tick(tick_record(tick)));
    kinds.into_iter().map(|kind| RecordItem { host, tick, kind }).collect()
}

pub(crate) fn tick_record(tick: u64) -> TickRecord {
    let place = tick as f64 * 1e-3;
    TickRecord {
        instant: Rate::new(1024, 1).unwrap().instant(tick),
        readings: [Reading::point(DVec3::new(place, 0.1, -0.0), DVec3::X), Reading::default()]
            .into_iter()
            .collect(),
        steps_in_use: [None, tick.checked_sub(9)].into_iter().collect(),
        fades: [0.0, 0.75].into_iter().collect(),
        bodies: [BodyState::at_rest(DVec3::new(place / 3.0, 0.0, 0.0))].into_iter().collect(),
        wrenches: [Wrench::force(DVec3::new(-1.5, 0.0, 0.0))].into_iter().collect(),
        contacts: contacts(tick),
        governor_gain: [1.0, 1.0].into_iter().collect(),
        energy_j: place * place,
        finger_energy_j: [place * place, -0.0].into_iter().collect(),
        ..TickRecord::default()
    }
}

/// Another host's finger touches always, a finger of host 2 in some ticks.
fn contacts(tick: u64) -> ArrayVec<ContactRecord, MAX_CONTACTS> {
    let contact = |host, phase| ContactRecord {
        point: ContactPoint::Finger { host: HostIndex(host), finger: 1 },
        surface: ContactSurface::Body(0),
        phase,
        force: DVec3::new(0.0, -0.5, -0.0),
        depth_m: 1e-3,
    };
    let own = tick.is_multiple_of(2).then(|| contact(1, Phase::MomentCancellation { pulses_left: 3 }));
    [contact(7, Phase::Slide)].into_iter().chain(own).collect()
}

fn packet(step: u64) -> StatePacket {
    let hand = Entry::Hand { point: 0, pose: Pose::default(), twist: Twist::default() };
    let force = Entry::Force { point: 0, wrench: Wrench::force(DVec3::new(0.5, 0.0, 0.0)) };
    StatePacket { step, entries: [hand, force].into_iter().collect() }
}

/// Any bit pattern, the odd ones often.
pub(crate) fn any_real() -> impl Strategy<Value = f64> {
    let odd = [0.0, -0.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, -f64::NAN, f64::from_bits(1), f64::MAX];
    prop_oneof![any::<u64>().prop_map(f64::from_bits), prop::sample::select(odd.to_vec())]
}

fn any_vector() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(any_real()).prop_map(DVec3::from_array)
}

fn any_pose() -> impl Strategy<Value = Pose> {
    (any_vector(), prop::array::uniform4(any_real()))
        .prop_map(|(position, turn)| Pose { position, orientation: DQuat::from_array(turn) })
}

fn any_twist() -> impl Strategy<Value = Twist> {
    (any_vector(), any_vector()).prop_map(|(linear, angular)| Twist { linear, angular })
}

fn any_wrench() -> impl Strategy<Value = Wrench> {
    (any_vector(), any_vector()).prop_map(|(force, torque)| Wrench { force, torque })
}

fn any_entry() -> impl Strategy<Value = Entry> {
    prop_oneof![
        (any::<u8>(), any_pose(), any_twist()).prop_map(|(point, pose, twist)| Entry::Hand {
            point,
            pose,
            twist
        }),
        (any::<u8>(), any_pose(), any_twist()).prop_map(|(object, pose, twist)| Entry::Object {
            object,
            pose,
            twist
        }),
        (any::<u8>(), any_wrench()).prop_map(|(point, wrench)| Entry::Force { point, wrench }),
        (0..16_u8, any::<u8>(), prop::array::uniform4(any_vector()))
            .prop_map(|(to, object, vectors)| Entry::Channel { to: HostIndex(to), object, vectors }),
    ]
}

fn any_packet() -> impl Strategy<Value = StatePacket> {
    (any::<u64>(), vec(any_entry(), 0..=MAX_ENTRIES))
        .prop_map(|(step, entries)| StatePacket { step, entries: entries.into_iter().collect() })
}

fn any_host() -> impl Strategy<Value = HostIndex> {
    any::<u8>().prop_map(HostIndex)
}

fn any_reading() -> impl Strategy<Value = Reading> {
    (any_pose(), any_twist()).prop_map(|(pose, twist)| Reading { pose, twist })
}

fn any_body() -> impl Strategy<Value = BodyState> {
    (any_pose(), any_twist()).prop_map(|(pose, twist)| BodyState { pose, twist })
}

fn any_contact() -> impl Strategy<Value = ContactRecord> {
    let point = prop_oneof![
        (any_host(), any::<u8>()).prop_map(|(host, finger)| ContactPoint::Finger { host, finger }),
        (any::<u8>(), any::<u8>()).prop_map(|(body, corner)| ContactPoint::Corner { body, corner }),
    ];
    let surface = prop_oneof![
        any::<u8>().prop_map(ContactSurface::Body),
        any::<u8>().prop_map(ContactSurface::Wall),
        Just(ContactSurface::Soft)
    ];
    let phase = prop_oneof![
        Just(Phase::Free),
        any::<u32>().prop_map(|pulses_left| Phase::MomentCancellation { pulses_left }),
        Just(Phase::PreSlide),
        Just(Phase::Slide),
    ];
    (point, surface, phase, any_vector(), any_real()).prop_map(|(point, surface, phase, force, depth_m)| {
        ContactRecord { point, surface, phase, force, depth_m }
    })
}

fn any_tick_record() -> impl Strategy<Value = TickRecord> {
    let motions = (vec(any_reading(), 0..=4), vec(any_body(), 0..=8));
    let forces = (
        vec(any_wrench(), 0..=8),
        vec(any_wrench(), 0..=4),
        vec(any_wrench(), 0..=4),
        vec(any_contact(), 0..=32),
    );
    let governors = (vec(any::<u32>(), 0..=4), vec(any_real(), 0..=4));
    let flags = (any::<bool>(), any::<bool>(), any::<bool>());
    let numbers = (any_real(), any::<i64>(), any::<i64>(), any::<i64>());
    let peers = (vec(option::of(any::<u64>()), 0..=16), vec(any_real(), 0..=16));
    (motions, forces, governors, flags, numbers, peers).prop_map(
        |(motions, forces, governors, flags, numbers, peers)| TickRecord {
            instant: SessionTime(numbers.1),
            readings: motions.0.into_iter().collect(),
            device_failed: flags.0,
            steps_in_use: peers.0.into_iter().collect(),
            fades: peers.1.into_iter().collect(),
            bodies: motions.1.into_iter().collect(),
            wrenches: forces.0.into_iter().collect(),
            contacts: forces.3.into_iter().collect(),
            requested: forces.1.into_iter().collect(),
            commanded: forces.2.into_iter().collect(),
            governor_acted: governors.0.into_iter().collect(),
            governor_gain: governors.1.iter().copied().collect(),
            energy_j: numbers.0,
            finger_energy_j: governors.1.iter().map(|gain| -gain).collect(),
            touches_wall: flags.1,
            diverged: flags.2,
            lateness_ns: numbers.2,
            compute_ns: numbers.3,
        },
    )
}

fn any_surface() -> impl Strategy<Value = SurfaceRecord> {
    let single = || any::<u32>().prop_map(f32::from_bits);
    let nodes = vec(prop::array::uniform3(single()), 0..20);
    (any::<u64>(), any_real(), nodes, vec(single(), 0..20)).prop_map(
        |(period, ko_n_per_m, positions_m, stress_pa)| SurfaceRecord {
            period,
            ko_n_per_m,
            positions_m,
            stress_pa,
        },
    )
}

fn any_note() -> impl Strategy<Value = Note> {
    prop_oneof![
        any::<u64>().prop_map(|ticks| Note::Skipped { ticks }),
        any::<u64>().prop_map(|items| Note::Dropped { items }),
        "\\PC{0,40}".prop_map(|text| Note::DeviceFault(FaultText::from(&text).unwrap())),
        Just(Note::Diverged),
        any::<String>().prop_map(Note::Ended),
    ]
}

fn any_device() -> impl Strategy<Value = DeviceRecord> {
    ("\\PC{0,12}", any_real(), any_real()).prop_map(|(name, max_force_n, max_torque_n_m)| DeviceRecord {
        name: ArrayString::from(&name).unwrap(),
        max_force_n,
        max_torque_n_m,
    })
}

fn any_kind() -> impl Strategy<Value = RecordKind> {
    prop_oneof![
        (any_host(), any_packet()).prop_map(|(from, packet)| RecordKind::Received { from, packet }),
        (option::of(any_host()), any_packet()).prop_map(|(to, packet)| RecordKind::Sent { to, packet }),
        (any_host(), any::<bool>()).prop_map(|(peer, present)| RecordKind::Presence { peer, present }),
        Just(RecordKind::Adopt),
        Just(RecordKind::Release),
        Just(RecordKind::ForceOff),
        any_device().prop_map(RecordKind::Device),
        ".{0,40}".prop_map(RecordKind::Changed),
        any_note().prop_map(RecordKind::Note),
        any_tick_record().prop_map(RecordKind::Tick),
        any_surface().prop_map(RecordKind::Surface),
        vec(any::<u8>(), 0..200).prop_map(RecordKind::State),
    ]
}

pub(crate) fn any_item() -> impl Strategy<Value = RecordItem> {
    (any_host(), any::<u64>(), any_kind()).prop_map(|(host, tick, kind)| RecordItem { host, tick, kind })
}
