//! What recording a tick costs: the haptic thread, and the recorder's.

use std::hint::black_box;

use cotouch_runtime::{
    RECORD_RING_BYTES, RecordItem, RecordKind, RecordSink, Recorder, RecordingHeader, RecordingReader,
    TickRecord, record_ring,
};
use cotouch_scene::geometry::{Reading, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::Rate;
use cotouch_world::BodyState;
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};

const TICKS: u64 = 1024;

fn ticks() -> Vec<RecordItem> {
    let record = TickRecord {
        steps_in_use: [None, Some(70)].into_iter().collect(),
        fades: [0.0, 1.0].into_iter().collect(),
        readings: [Reading::default(); 2].into_iter().collect(),
        bodies: [BodyState::default()].into_iter().collect(),
        wrenches: [Wrench::default()].into_iter().collect(),
        requested: [Wrench::default(); 2].into_iter().collect(),
        commanded: [Wrench::default(); 2].into_iter().collect(),
        governor_acted: [0; 2].into_iter().collect(),
        governor_gain: [1.0; 2].into_iter().collect(),
        ..TickRecord::default()
    };
    let item = |tick| RecordItem { host: HostIndex(0), tick, kind: RecordKind::Tick(record.clone()) };
    (0..TICKS).map(item).collect()
}

fn header() -> RecordingHeader {
    RecordingHeader {
        cotouch_version: String::new(),
        scene_toml: String::new(),
        control_hz: Rate::new(1024, 1).expect("a rate"),
        epoch_unix_ns: 0,
        facts: Default::default(),
    }
}

fn benchmark(criterion: &mut Criterion) {
    let items = ticks();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("bench.mcap");
    let mut group = criterion.benchmark_group("recorder, a tick");
    group.throughput(Throughput::Elements(TICKS));
    group.bench_function("haptic thread: into the ring", |bencher| {
        bencher.iter_batched_ref(
            || record_ring(HostIndex(0), RECORD_RING_BYTES),
            |(producer, _consumer)| items.iter().for_each(|item| producer.record(black_box(item))),
            BatchSize::PerIteration,
        );
    });
    group.bench_function("recorder: into the file", |bencher| {
        bencher.iter_batched_ref(
            || Recorder::create(&path, &header()).expect("a recorder"),
            |recorder| items.iter().for_each(|item| recorder.record(black_box(item))),
            BatchSize::PerIteration,
        );
    });
    group.bench_function("reader: out of the file", |bencher| {
        bencher.iter(|| RecordingReader::open(&path).expect("a recording").map(black_box).count());
    });
    group.finish();
}

criterion_group!(benches, benchmark);
criterion_main!(benches);
