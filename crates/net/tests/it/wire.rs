//! Encoding and decoding: exact, and safe for whatever comes.

use cotouch_net::{
    Control, Entry, HEADER_BYTES, MAX_DATAGRAM, MAX_TEXT_BYTES, PeerId, Roster, RosterEntry, Route,
    StatePacket, Text, WireError, decode_control, decode_state, encode_control, encode_state, open,
};
use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::limits::{MAX_ENTRIES, MAX_USERS};
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::SessionTime;
use glam::{DQuat, DVec3};
use proptest::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

fn finite() -> impl Strategy<Value = f64> {
    proptest::num::f64::NORMAL | proptest::num::f64::SUBNORMAL | proptest::num::f64::ZERO
}

fn vector() -> impl Strategy<Value = DVec3> {
    [finite(), finite(), finite()].prop_map(DVec3::from_array)
}

fn orientation() -> impl Strategy<Value = DQuat> {
    let angles = (-3.1..3.1, -3.1..3.1, -3.1..3.1);
    angles.prop_map(|(x, y, z)| DQuat::from_euler(glam::EulerRot::XYZ, x, y, z))
}

fn entry() -> impl Strategy<Value = Entry> {
    let motion = || (any::<u8>(), vector(), orientation(), vector(), vector());
    prop_oneof![
        motion().prop_map(|(point, position, orientation, linear, angular)| Entry::Hand {
            point,
            pose: Pose { position, orientation },
            twist: Twist { linear, angular },
        }),
        motion().prop_map(|(object, position, orientation, linear, angular)| Entry::Object {
            object,
            pose: Pose { position, orientation },
            twist: Twist { linear, angular },
        }),
        (any::<u8>(), vector(), vector())
            .prop_map(|(point, force, torque)| Entry::Force { point, wrench: Wrench { force, torque } }),
        (0..MAX_USERS as u8, any::<u8>(), proptest::array::uniform4(vector()))
            .prop_map(|(to, object, vectors)| Entry::Channel { to: HostIndex(to), object, vectors }),
    ]
}

fn packet() -> impl Strategy<Value = StatePacket> {
    (any::<u64>(), proptest::collection::vec(entry(), 0..=MAX_ENTRIES))
        .prop_map(|(step, entries)| StatePacket { step, entries: entries.into_iter().collect() })
}

fn encoded(packet: &StatePacket) -> Vec<u8> {
    let mut out = [0xaa; MAX_DATAGRAM];
    let length = encode_state(3, HostIndex(2), SessionTime(-4), packet, &mut out).unwrap();
    out[..length].to_vec()
}

/// Makes the checksum right again.
fn reseal(bytes: &mut [u8]) {
    let sum = xxh3_64(&bytes[8..]) as u32;
    bytes[4..8].copy_from_slice(&sum.to_le_bytes());
}

proptest! {
    #[test]
    fn a_state_survives_bit_for_bit(packet in packet()) {
        let bytes = encoded(&packet);
        let (header, at, decoded) = decode_state(&bytes).unwrap();
        prop_assert_eq!((header.session, header.sender, at), (3, Some(HostIndex(2)), SessionTime(-4)));
        // Compared as bytes too: −0 equals 0 otherwise.
        prop_assert_eq!(encoded(&decoded), bytes);
        prop_assert_eq!(decoded, packet);
    }

    #[test]
    fn any_damage_is_noticed(packet in packet(), at in any::<prop::sample::Index>(), flip in 1u8..) {
        let mut bytes = encoded(&packet);
        let at = at.index(bytes.len());
        bytes[at] ^= flip;
        prop_assert!(decode_state(&bytes).is_err());
    }

    #[test]
    fn any_other_length_is_refused(packet in packet(), cut in any::<prop::sample::Index>()) {
        let mut bytes = encoded(&packet);
        let whole = bytes.len();
        bytes.truncate(cut.index(whole));
        if bytes.len() >= HEADER_BYTES {
            reseal(&mut bytes);
        }
        let refused = matches!(decode_state(&bytes), Err(WireError::Length { .. }));
        prop_assert!(refused);
        let mut longer = encoded(&packet);
        longer.push(0);
        reseal(&mut longer);
        let expected = Err(WireError::Length { found: whole + 1, expected: whole });
        prop_assert_eq!(decode_state(&longer), expected);
    }

    #[test]
    fn arbitrary_bytes_never_panic(
        mut bytes in proptest::collection::vec(any::<u8>(), 0..1300),
        kind in 0u8..6,
        count in 0u8..12,
        tags in proptest::collection::vec(0u8..6, 12),
    ) {
        let _ = decode_state(&bytes);
        let _ = decode_control(&bytes);
        if bytes.len() < HEADER_BYTES {
            return Ok(());
        }
        bytes[..4].copy_from_slice(&[b'c', b'o', 2, 0]);
        bytes[8..12].copy_from_slice(&[kind, 1, 0, 0]);
        if bytes.len() > 40 {
            bytes[36..40].copy_from_slice(&[count, 0, 0, 0]);
            for (entry, tag) in tags.iter().enumerate() {
                if let Some(byte) = bytes.get_mut(40 + entry * 106) {
                    *byte = *tag;
                }
            }
        }
        reseal(&mut bytes);
        let _ = open(&bytes);
        if let Ok((_, _, packet)) = decode_state(&bytes) {
            prop_assert!(packet.entries.len() <= MAX_ENTRIES);
        }
        let _ = decode_control(&bytes);
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused(
        packet in packet(),
        which in 0usize..13,
        bad in prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY)],
    ) {
        let mut bytes = encoded(&packet);
        prop_assume!(!packet.entries.is_empty());
        let (first, numbers) = match packet.entries[0] {
            Entry::Force { .. } => (42, 6),
            Entry::Channel { .. } => (43, 12),
            Entry::Hand { .. } | Entry::Object { .. } => (42, 13),
        };
        let at = first + 8 * (which % numbers);
        bytes[at..at + 8].copy_from_slice(&bad.to_le_bytes());
        reseal(&mut bytes);
        prop_assert_eq!(decode_state(&bytes), Err(WireError::NotFinite { entry: 0 }));
    }
}

#[test]
fn the_largest_packet_fits() {
    let entry = Entry::Hand { point: 0, pose: Pose::default(), twist: Twist::default() };
    let packet = StatePacket { step: 1, entries: [entry; MAX_ENTRIES].into_iter().collect() };
    assert_eq!(encoded(&packet).len(), 1100);
    let mut short = [0; 1099];
    let refused = encode_state(3, HostIndex(2), SessionTime(0), &packet, &mut short);
    assert_eq!(refused, Err(WireError::Length { found: 1099, expected: 1100 }));
}

#[test]
fn a_channel_to_a_host_that_no_session_has_is_refused() {
    let entry = Entry::Channel { to: HostIndex(MAX_USERS as u8), object: 0, vectors: Default::default() };
    let packet = StatePacket { step: 1, entries: [entry].into_iter().collect() };
    assert_eq!(decode_state(&encoded(&packet)), Err(WireError::Recipient { entry: 0, found: 16 }));
}

#[test]
fn a_turn_that_is_none_is_refused() {
    let mut bytes = encoded(&StatePacket {
        step: 0,
        entries: [Entry::Hand { point: 0, pose: Pose::default(), twist: Twist::default() }]
            .into_iter()
            .collect(),
    });
    for bad in [0.0, 1.01, 1e300] {
        // w of the first entry's quaternion.
        bytes[42 + 48..42 + 56].copy_from_slice(&f64::to_le_bytes(bad));
        reseal(&mut bytes);
        assert_eq!(decode_state(&bytes), Err(WireError::NotUnit { entry: 0 }));
    }
}

#[test]
fn errors_tell_what_was_found() {
    let bytes = encoded(&StatePacket::default());
    let with = |at: usize, value: u8| {
        let mut bytes = bytes.clone();
        bytes[at] = value;
        reseal(&mut bytes);
        decode_state(&bytes).unwrap_err()
    };
    assert_eq!(with(0, 0), WireError::Magic);
    assert_eq!(with(2, 9), WireError::Version { found: 9, session: 3, from_newcomer: false });
    assert_eq!(
        with(2, 9).to_string(),
        "the datagram is of protocol version 9; this program speaks version 4"
    );
    assert_eq!(with(8, 77), WireError::Kind(77));
    assert_eq!(with(8, 2), WireError::Kind(2));
    assert_eq!(with(9, 16), WireError::Sender(16));
    assert_eq!(with(10, 1), WireError::Reserved);
    assert_eq!(with(36, 11), WireError::EntryCount(11));
    assert_eq!(with(37, 1), WireError::Reserved);
}

#[test]
fn control_messages_end_where_they_end() {
    let bytes = encode_control(5, None, &Control::LeaveReceived).unwrap();
    assert_eq!(decode_control(&bytes).unwrap().1, Control::LeaveReceived);
    let mut longer = bytes.to_vec();
    longer.push(0);
    reseal(&mut longer);
    let expected = WireError::Length { found: longer.len(), expected: bytes.len() };
    assert_eq!(decode_control(&longer), Err(expected));
}

#[test]
fn the_longest_roster_fits() {
    let route = Route::Named(Text::from(&"x".repeat(MAX_TEXT_BYTES)).unwrap());
    let entry = |host| RosterEntry { host: HostIndex(host), id: PeerId(u64::MAX), route };
    let hosts = (1..MAX_USERS as u8).map(entry).collect();
    let roster = Control::Roster(Roster { revision: u32::MAX, origin_ns: Some(i64::MIN), hosts });
    let bytes = encode_control(u64::MAX, Some(HostIndex(0)), &roster).unwrap();
    assert_eq!(decode_control(&bytes).unwrap().1, roster);
}
