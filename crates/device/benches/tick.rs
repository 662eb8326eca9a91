//! One haptic tick of a simulated hand, the governor and the port's energy.
#![allow(missing_docs, reason = "criterion's macros")]

use std::hint::black_box;

use cotouch_device::device::Device;
use cotouch_device::energy::PortEnergy;
use cotouch_device::governor::{Governor, GovernorInput};
use cotouch_device::hand::{Freedom, HandModel, SimulatedHand};
use cotouch_device::script::Script;
use cotouch_scene::geometry::Wrench;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, GovernorLimits, Hand, SpringDamper, User};
use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;

const LIMITS: GovernorLimits = GovernorLimits {
    max_force_n: 8.0,
    max_slew_n_per_s: 8000.0,
    watchdog_s: 0.02,
    soft_start_s: 0.5,
    release_s: 0.1,
    damping_n_s_per_m: 1.0,
};

fn hand(action: Action, freedom: Freedom) -> SimulatedHand {
    let tracking = SpringDamper { stiffness_n_per_m: 400.0, damping_n_s_per_m: 10.0 };
    let user = User { name: "ada".into(), tracking, script: vec![action], repeat: true };
    let arm = Hand { mass_kg: 0.3, damping_n_s_per_m: 2.0, stiffness_n_per_m: 0.0 };
    let script = Script::new(&user, 1, HostIndex(0), "1000".parse().expect("a rate"));
    SimulatedHand::new("ada", HandModel::new(&arm, freedom, script).expect("a hand"), DVec3::ZERO)
}

fn tick(criterion: &mut Criterion) {
    let vector = DVec3::new(0.02, 0.01, 0.005);
    let sinusoid =
        Action::Sinusoid { amplitude_m: vector, frequency_hz: 2.0, phase_rad: 0.0, duration_s: 1.0 };
    let cases = [
        ("push", Action::Force { force_n: vector, duration_s: 1.0 }, Freedom::Line(DVec3::X)),
        ("sinusoid", sinusoid, Freedom::Line(DVec3::X)),
        ("reach in space", Action::Reach { to_m: vector, duration_s: 1.0 }, Freedom::Space),
        ("tremor in space", Action::Tremor { rms_n: vector, duration_s: 1.0 }, Freedom::Space),
    ];
    let governor = Governor::new(
        &LIMITS,
        hand(cases[0].1.clone(), Freedom::Space).limits(),
        "1000".parse().expect("a rate"),
    );
    let mut group = criterion.benchmark_group("hand, governor and port, one tick");
    for (name, action, freedom) in cases {
        let (mut hand, mut state, mut port) =
            (hand(action, freedom), governor.start(), PortEnergy::default());
        let mut tick = 0;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let reading = hand.read(tick).expect("in order");
                let requested = Wrench::force(black_box(reading.pose.position * -100.0));
                let output = governor.govern(&mut state, &GovernorInput::healthy(requested, reading));
                port.observe(&reading, output.commanded);
                hand.write(output.commanded).expect("finite");
                tick += 1;
            });
        });
    }
    group.finish();
    criterion.bench_function("governor, one tick", |bencher| {
        let (mut state, mut push) = (governor.start(), 1.0);
        bencher.iter(|| {
            push = -push;
            let input = GovernorInput::healthy(Wrench::force(black_box(DVec3::X * push)), Default::default());
            governor.govern(&mut state, &input)
        });
    });
}

criterion_group!(benches, tick);
criterion_main!(benches);
