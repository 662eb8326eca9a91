//! Many verdicts on one scene: points of a sweep with equal and with unequal users, whole maps, and eigenvalues alone.

use std::hint::black_box;

use cotouch_analysis::{Evaluator, Sweep, eigenvalues, stability_map};
use cotouch_scene::Scene;
use cotouch_scene::scene::{Action, SpringDamper};
use cotouch_testkit::scenes::edited;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use nalgebra::DMatrix;

const KEYS: [&str; 2] =
    ["coupling.hand_object.stiffness_n_per_m", "coupling.remote_hand_object.stiffness_n_per_m"];

/// 16, 64 and 64 states.
const SCENES: [(&str, &[&str]); 3] = [
    ("2 users, n = 1, 16 states", &["link.delay_periods=1"]),
    ("8 users, n = 1, 64 states", &["link.delay_periods=1", "session.users=8"]),
    ("2 users, n = 7, 64 states", &["link.delay_periods=7"]),
];

fn scene(set: &[&str]) -> Scene {
    let set: Vec<_> = set.iter().map(|text| text.parse().unwrap()).collect();
    cotouch_scene::load("single-axis", &set).unwrap()
}

/// No two users alike: each holds on a little more firmly than the one before.
fn uneven(mut scene: Scene) -> Scene {
    scene = edited(&scene, |scene| {
        for (index, user) in scene.users.iter_mut().enumerate() {
            let stiffness_n_per_m = 0.001 * (index + 1) as f64;
            user.tracking = SpringDamper { stiffness_n_per_m, damping_n_s_per_m: 0.0 };
            user.script = vec![Action::Hold { duration_s: 1.0 }];
        }
    });
    scene
}

fn points(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("a point");
    for (name, set) in SCENES {
        for (users, scene) in [("equal users", scene(set)), ("unequal users", uneven(scene(set)))] {
            let evaluator = Evaluator::new(&scene, &KEYS).unwrap();
            let mut gain = 100.0;
            group.bench_function(BenchmarkId::new(users, name), |bencher| {
                bencher.iter(|| {
                    gain = if gain > 5000.0 { 100.0 } else { gain + 17.0 };
                    evaluator.at(black_box(&[gain, 0.1 * gain])).unwrap()
                });
            });
        }
    }
    group.bench_function("a mass and a damping, 16 states", |bencher| {
        let evaluator =
            Evaluator::new(&scene(SCENES[0].1), &["hand.mass_kg", "hand.damping_n_s_per_m"]).unwrap();
        bencher.iter(|| evaluator.at(black_box(&[0.13, 1.7])).unwrap());
    });
    group.bench_function("preparation, 16 states", |bencher| {
        let scene = scene(SCENES[0].1);
        bencher.iter(|| Evaluator::new(black_box(&scene), &KEYS).unwrap());
    });
    group.finish();
}

fn maps(criterion: &mut Criterion) {
    let sweep = |key: &str, range: &str| -> Sweep { format!("{key}={range}").parse().unwrap() };
    let (x, y) = (sweep(KEYS[0], "0..6000:200"), sweep(KEYS[1], "0..1500:200"));
    let mut group = criterion.benchmark_group("a map of 200×200");
    group.sample_size(10);
    for (name, set) in SCENES {
        let scene = scene(set);
        for (what, with_radius) in [("verdicts and boundary", false), ("radii", true)] {
            group.bench_function(BenchmarkId::new(what, name), |bencher| {
                bencher.iter(|| stability_map(&scene, &x, Some(&y), with_radius, &|_| ()).unwrap());
            });
        }
    }
    group.finish();
}

/// Up to the states of four people with two fingers each.
fn spectra(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("eigenvalues");
    for size in [4, 8, 16, 32, 64, 128, 384] {
        let element = |i: usize, j: usize| ((i * 37 + j * 101 + i * j) % 97) as f64 / 97.0 - 0.5;
        let matrix = DMatrix::from_fn(size, size, element);
        group.bench_function(BenchmarkId::from_parameter(size), |bencher| {
            bencher.iter(|| eigenvalues(black_box(&matrix)).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, points, spectra, maps);
criterion_main!(benches);
