//! One verdict: description, map, structure and eigenvalues.

use std::hint::black_box;

use cotouch_analysis::{analyze, compile};
use cotouch_scene::ScriptedDemand;
use cotouch_scene::scene::Architecture;
use cotouch_testkit::scenes::{edited, grasp, table_6_1, with_users};
use criterion::{Criterion, criterion_group, criterion_main};

fn verdicts(criterion: &mut Criterion) {
    for users in [2, 8] {
        let scene = edited(&with_users(table_6_1(Architecture::Distributed), users), |scene| {
            scene.link.delay_periods = 1
        });
        criterion.bench_function(&format!("verdict, {users} users, N = 8, n = 1"), |bencher| {
            bencher.iter(|| analyze(black_box(&scene), |_| ScriptedDemand::default()).unwrap());
        });
        let modes = compile(&scene);
        criterion.bench_function(&format!("map, {users} users, N = 8, n = 1"), |bencher| {
            bencher.iter(|| black_box(&modes[0].spec).lift_shared().unwrap());
        });
    }
}

fn grasps(criterion: &mut Criterion) {
    let scene = grasp(Architecture::Distributed);
    criterion.bench_function("verdict on 16 modes, a grasp in the plane, N = 8, n = 1", |bencher| {
        bencher.iter(|| analyze(black_box(&scene), |_| ScriptedDemand::default()).unwrap());
    });
}

criterion_group!(benches, verdicts, grasps);
criterion_main!(benches);
