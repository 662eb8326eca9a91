//! Cost of encoding one picture of two people with two fingers each who hold a box, and its size.

use std::hint::black_box;

use cotouch_runtime::{FingerSnapshot, HostSnapshot, LinkSnapshot, Snapshot};
use cotouch_scene::geometry::{Pose, Reading, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_viewer::encode_picture;
use cotouch_world::Phase;
use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;

fn host(index: u8) -> HostSnapshot {
    let finger = FingerSnapshot {
        reading: Reading::default(),
        commanded: Wrench::default(),
        contact: Phase::PreSlide,
        proxy: Some(DVec3::X),
        target: None,
        governor_acted: 0,
        governor_gain: 1.0,
        energy_j: 0.1,
    };
    let link = LinkSnapshot {
        peer: HostIndex(1 - index),
        present: true,
        round_trip_ms: 0.2,
        rms_jitter_ms: 0.05,
        received: 1000,
        lost: 0,
    };
    HostSnapshot {
        host: HostIndex(index),
        fingers: [finger, finger].into_iter().collect(),
        bodies: [Pose::default()].into_iter().collect(),
        links: [link].into_iter().collect(),
        ..HostSnapshot::default()
    }
}

fn pictures(criterion: &mut Criterion) {
    let snapshot = Snapshot { hosts: vec![host(0), host(1)], ..Snapshot::default() };
    let mut out = Vec::new();
    encode_picture(&snapshot, 1, None, &mut out);
    eprintln!("a picture of a grasp has {} bytes", out.len());
    criterion.bench_function("picture/encode a grasp", |bencher| {
        bencher.iter(|| encode_picture(black_box(&snapshot), 1, None, black_box(&mut out)));
    });
}

criterion_group!(benches, pictures);
criterion_main!(benches);
