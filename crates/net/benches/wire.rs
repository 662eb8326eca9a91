//! Cost of writing and reading one state packet.

use std::hint::black_box;

use cotouch_net::{Entry, MAX_DATAGRAM, StatePacket, decode_state, encode_state};
use cotouch_scene::geometry::{Pose, Twist};
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::SessionTime;
use criterion::{Criterion, criterion_group, criterion_main};

/// What a distributed host with one hand and one object sends.
fn packet() -> StatePacket {
    let entries = [
        Entry::Hand { point: 0, pose: Pose::default(), twist: Twist::default() },
        Entry::Object { object: 0, pose: Pose::default(), twist: Twist::default() },
    ];
    StatePacket { step: 7, entries: entries.into_iter().collect() }
}

fn wire(criterion: &mut Criterion) {
    let packet = packet();
    let mut out = [0; MAX_DATAGRAM];
    let encode = |packet: &StatePacket, out: &mut [u8]| {
        encode_state(1, HostIndex(0), SessionTime(7_812_500), packet, out).expect("the buffer is long enough")
    };
    let length = encode(&packet, &mut out);
    criterion.bench_function("wire/encode two entries", |bencher| {
        bencher.iter(|| encode(black_box(&packet), black_box(&mut out)));
    });
    let bytes = out[..length].to_vec();
    criterion.bench_function("wire/decode two entries", |bencher| {
        bencher.iter(|| decode_state(black_box(&bytes)));
    });
}

criterion_group!(benches, wire);
criterion_main!(benches);
