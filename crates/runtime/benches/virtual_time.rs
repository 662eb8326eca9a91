//! How much faster than real time a session is simulated on one core: hosts, hands, governors, protocol, wire format
//! and links. The reported throughput is simulated haptic ticks of the session a second: 1024 are real time.
//!
//! `cargo bench -p cotouch-runtime --bench virtual_time`

use cotouch_device::hand::SimulatedHand;
use cotouch_runtime::station::Station;
use cotouch_runtime::virtual_time::VirtualSession;
use cotouch_scene::{Override, load};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const TICKS: u64 = 1024;

fn simulated_seconds(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("one simulated second");
    group.throughput(Throughput::Elements(TICKS)).sample_size(20);
    for (users, name) in [(2, "single-axis"), (2, "single-axis-centralized"), (8, "single-axis")] {
        let users_override: Override = format!("session.users={users}").parse().expect("an override");
        let scene = load(name, &[users_override]).expect("a built-in scene");
        let mut session = VirtualSession::new(&scene, |host| {
            Station::new(
                &scene,
                host,
                SimulatedHand::of_scene(&scene, host).expect("its hands are sound"),
                None,
            )
        });
        let mut tick = 0;
        group.bench_function(format!("{users} users, {name}"), |bencher| {
            bencher.iter(|| {
                tick += TICKS;
                assert!(session.run_to_tick(tick, |_, _| {}), "the hosts join");
            });
        });
    }
    group.finish();
}

criterion_group!(benches, simulated_seconds);
criterion_main!(benches);
