//! What a host's instant costs: sample, receive from every peer at network steps, play out, tick.
//!
//! `cargo bench -p cotouch-host`

use std::hint::black_box;

use cotouch_host::model::HostModel;
use cotouch_host::state::HostState;
use cotouch_scene::geometry::Reading;
use cotouch_scene::names::HostIndex;
use cotouch_scene::{Override, load};
use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;

fn instants(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("host instant");
    for (users, architecture) in
        [(2, "distributed"), (8, "distributed"), (2, "centralized"), (8, "centralized")]
    {
        let overrides = [format!("session.users={users}"), format!("session.architecture={architecture}")];
        let overrides: Vec<Override> =
            overrides.iter().map(|text| text.parse().expect("an override")).collect();
        let scene = load("single-axis", &overrides).expect("a built-in scene");
        let host = HostModel::new(&scene, HostIndex::FIRST);
        let peer = HostModel::new(&scene, HostIndex(1));
        let mut state = HostState::new(&host);
        let hand = Reading::point(DVec3::X * 1e-4, DVec3::X * 1e-3);
        host.sources().for_each(|peer| state.set_present(peer, true));
        let peer_state = HostState::new(&peer);
        let mut tick = 0;
        group.bench_function(format!("{users} users, {architecture}"), |bencher| {
            bencher.iter(|| {
                if let Some(step) = host.step_due(&state, tick) {
                    black_box(host.sample(&state, step, &hand));
                    if let Some(packet) = peer.sample(&peer_state, step, &hand) {
                        host.sources().for_each(|from| host.receive(&mut state, from, &packet));
                    }
                }
                host.play_out(&mut state, tick);
                let output = host.tick(&mut state, tick, black_box(&hand));
                tick += 1;
                output
            });
        });
    }
    group.finish();
}

criterion_group!(benches, instants);
criterion_main!(benches);
