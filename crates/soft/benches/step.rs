//! One period of a clamped beam that swings under its weight: 1 000, 5 000 and 20 000 tetrahedra.

#[path = "../examples/step_times/beam.rs"]
mod beam;

use std::hint::black_box;

use beam::{beam, body};
use cotouch_soft::SoftBody;
use criterion::{Criterion, criterion_group, criterion_main};

fn periods(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("period");
    group.sample_size(20);
    for cells in [[10, 4, 4], [17, 7, 7], [28, 11, 11]] {
        let mesh = beam(cells);
        let mut swinging = body(&mesh);
        group.bench_function(format!("{} tetrahedra", mesh.tetrahedra.len()), |bencher| {
            bencher.iter(|| black_box(&mut swinging).step(&[]));
        });
    }
}

criterion_group!(benches, periods);
criterion_main!(benches);
