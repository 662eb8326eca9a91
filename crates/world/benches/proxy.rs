//! One probe of a bumpy ball of 1k, 10k and 100k triangles, 50 mm in radius, and one new shape of it.
#![allow(missing_docs, reason = "criterion's macros")]

use std::hint::black_box;

use cotouch_testkit::meshes::{Mesh, bumpy_ball, bumpy_radius};
use cotouch_world::{MeshSurface, ProxyState};
use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;

const BALL_M: f64 = 0.05;
const BUMP_M: f64 = 0.002;
const WAVES: f64 = 9.0;

fn surface_of(mesh: &Mesh) -> MeshSurface {
    MeshSurface::new(mesh.vertices.clone(), &mesh.triangles).unwrap()
}

/// A way around the ball that closes, `height` (m) above its surface, in ticks of 1 ms at `speed` (m/s).
fn way(height: f64, speed: f64) -> Vec<DVec3> {
    let ticks = (std::f64::consts::TAU * BALL_M / speed * 1000.0) as u32;
    let at = |tick: u32| {
        let turn = std::f64::consts::TAU * f64::from(tick) / f64::from(ticks);
        let direction = DVec3::new(turn.cos(), turn.sin(), 0.5 * (3.0 * turn).sin()).normalize();
        direction * (bumpy_radius(direction, BALL_M, BUMP_M, WAVES) + height)
    };
    (0..ticks).map(at).collect()
}

fn probe(criterion: &mut Criterion) {
    for n in [7, 22, 71] {
        let mesh = bumpy_ball(BALL_M, BUMP_M, WAVES, n);
        let surface = surface_of(&mesh);
        let triangles = mesh.triangles.len();
        let cases = [
            ("slide 0.2 m/s, sphere 5 mm", 0.003, 0.2, 0.005),
            ("slide 0.2 m/s, sphere 1 mm", -0.001, 0.2, 0.001),
            ("slide 1 m/s, sphere 5 mm", 0.003, 1.0, 0.005),
            ("free 0.2 m/s, sphere 5 mm", 0.006, 0.2, 0.005),
        ];
        for (name, height, speed, radius) in cases {
            let way = way(height, speed);
            let mut state = ProxyState::default();
            surface.probe(&mut state, way[0] * 2.0, radius);
            let mut ticks = way.iter().cycle();
            criterion.bench_function(&format!("{name}/{triangles}"), |bencher| {
                bencher.iter(|| {
                    let centre = *ticks.next().expect("a cycle");
                    black_box(surface.probe(&mut state, black_box(centre), radius))
                });
            });
        }
        let shapes = [1.0, 1.001].map(|size| mesh.vertices.iter().map(|at| at * size).collect::<Vec<_>>());
        let mut surface = surface;
        let mut shape = shapes.iter().cycle();
        criterion.bench_function(&format!("new shape/{triangles}"), |bencher| {
            bencher.iter(|| surface.deform(shape.next().expect("a cycle")));
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_secs(1))
        .sample_size(50)
        .without_plots();
    targets = probe
}
criterion_main!(benches);
