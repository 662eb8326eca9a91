//! How much faster than real time a session is simulated on one core: hosts, hands, governors, protocol, wire format
//! and links. The reported throughput is simulated haptic ticks of the session a second: 1024 are real time.
//!
//! `cargo bench -p cotouch-runtime --bench virtual_time`

use cotouch_device::SimulatedUser;
use cotouch_runtime::{Station, VirtualSession};
use cotouch_testkit::built_in;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const TICKS: u64 = 1024;

fn simulated_seconds(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("one simulated second");
    group.throughput(Throughput::Elements(TICKS)).sample_size(20);
    let scenes: [(&str, &[&str]); 5] = [
        ("single-axis", &[]),
        ("single-axis-centralized", &[]),
        ("single-axis", &["session.users=8"]),
        ("grasp", &[]),
        ("grasp", &["session.architecture=centralized"]),
    ];
    for (name, overrides) in scenes {
        let scene = built_in(name, overrides);
        let users = scene.session.users;
        let mut session = VirtualSession::new(&scene, |host| {
            Station::new(&scene, host, SimulatedUser::new(&scene, host).expect("its hands are sound"), None)
        });
        let mut tick = 0;
        group.bench_function(format!("{users} users, {name}, {:?}", scene.session.architecture), |bencher| {
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
