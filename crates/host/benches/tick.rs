//! What a host's instant costs: sample, receive from every peer at network steps, play out, tick.
//!
//! `cargo bench -p cotouch-host`

use std::hint::black_box;

use cotouch_host::{HostModel, HostState, TickOutput};
use cotouch_scene::geometry::{Reading, Readings};
use cotouch_scene::scene::Scene;
use cotouch_scene::{Override, load};
use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;

fn instants(criterion: &mut Criterion) {
    for (users, architecture) in
        [(2_u8, "distributed"), (8, "distributed"), (2, "centralized"), (8, "centralized")]
    {
        let overrides = [format!("session.users={users}"), format!("session.architecture={architecture}")];
        let overrides: Vec<Override> =
            overrides.iter().map(|text| text.parse().expect("an override")).collect();
        let scene = load("single-axis", &overrides).expect("a built-in scene");
        let finger = Reading::point(DVec3::X * 1e-4, DVec3::X * 1e-3);
        let readings = vec![[finger].into_iter().collect(); usize::from(users)];
        bench(criterion, &format!("{users} users, {architecture}"), &scene, &readings);
    }
    for architecture in ["distributed", "centralized"] {
        let architecture_override: Override =
            format!("session.architecture={architecture}").parse().expect("an override");
        let scene = load("grasp", &[architecture_override]).expect("a built-in scene");
        bench(criterion, &format!("grasp, {architecture}"), &scene, &grasping(&scene));
    }
}

/// Every finger where it rests, but 2 mm inside the box on its side.
fn grasping(scene: &Scene) -> Vec<Readings> {
    let half = 0.5 * scene.object.shape.size_m.y;
    let depth_m = 2e-3 - scene.hand.finger_radius_m;
    let reading = |finger: &cotouch_scene::scene::Finger| {
        let side = finger.position_m.y.signum();
        Reading::point(finger.position_m.with_y(side * (half - depth_m)), DVec3::ZERO)
    };
    scene.users.iter().map(|user| user.fingers.iter().map(reading).collect()).collect()
}

/// Host 1 with all its peers, who hold still.
fn bench(criterion: &mut Criterion, name: &str, scene: &Scene, readings: &[Readings]) {
    let models: Vec<_> = scene.hosts().map(|host| HostModel::new(scene, host)).collect();
    let host = &models[0];
    let mut state = HostState::new(host);
    host.sources().for_each(|peer| state.set_present(peer, true));
    let start = state.clone();
    let mut peers: Vec<_> = models.iter().map(HostState::new).collect();
    let mut tick = 0;
    criterion.bench_function(&format!("host instant: {name}"), |bencher| {
        let mut output = TickOutput::default();
        bencher.iter(|| {
            if let Some(step) = host.step_due(&state, tick) {
                black_box(host.sample(&mut state, step, &readings[0]));
                for from in host.sources() {
                    let peer = from.index();
                    if let Some(packet) = models[peer].sample(&mut peers[peer], step, &readings[peer]) {
                        host.receive(&mut state, from, &packet);
                    }
                }
            }
            host.play_out(&mut state, tick);
            // Fingers that hold still push no body far; it stays where they touch it.
            state.bodies.copy_from_slice(&start.bodies);
            host.tick_into(&mut state, tick, black_box(&readings[0]), &mut output);
            tick += 1;
            black_box(&output.wrenches);
        });
    });
}

criterion_group!(benches, instants);
criterion_main!(benches);
