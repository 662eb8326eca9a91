//! One haptic tick of a simulated user, the governors and the ports' energy.
#![allow(missing_docs, reason = "criterion's macros")]

use std::hint::black_box;

use cotouch_device::{Device, Governor, GovernorInput, PortEnergy, SimulatedUser, WorldView};
use cotouch_scene::geometry::{Pose, Wrench, Wrenches};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, DeviceKind, Finger, Scene, Space, SpringDamper, VelocityEstimate};
use cotouch_testkit::scenes::edited;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::DVec3;

fn scene(action: Action, space: Space) -> Scene {
    edited(&cotouch_scene::load("single-axis", &[]).expect("built in"), |scene| {
        (scene.space, scene.hand.mass_kg, scene.hand.damping_n_s_per_m) = (space, 0.3, 2.0);
        scene.users[0].tracking = SpringDamper { stiffness_n_per_m: 400.0, damping_n_s_per_m: 10.0 };
        (scene.users[0].script, scene.users[0].repeat) = (vec![action], true);
    })
}

fn user(scene: &Scene) -> SimulatedUser {
    SimulatedUser::new(scene, HostIndex::FIRST).expect("a hand")
}

fn one_finger(criterion: &mut Criterion) {
    let vector = DVec3::new(0.02, 0.01, 0.005);
    let sinusoid =
        Action::Sinusoid { amplitude_m: vector, frequency_hz: 2.0, phase_rad: 0.0, duration_s: 1.0 };
    let cases = [
        ("push", Action::Force { force_n: vector, duration_s: 1.0 }, Space::Line),
        ("sinusoid", sinusoid, Space::Line),
        ("reach in space", Action::Reach { to_m: vector, duration_s: 1.0 }, Space::Space),
        ("tremor in space", Action::Tremor { rms_n: vector, duration_s: 1.0 }, Space::Space),
    ];
    let mut group = criterion.benchmark_group("user of one finger, governor and port, one tick");
    for (name, action, space) in cases {
        let scene = scene(action, space);
        let mut user = user(&scene);
        let governor = Governor::new(&scene, user.limits());
        let (mut state, mut port, mut tick) = (governor.start(), PortEnergy::default(), 0);
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let reading = user.read(tick).expect("in order")[0];
                let requested = Wrench::force(black_box(reading.pose.position * -100.0));
                let output = governor.govern(&mut state, &GovernorInput::healthy(requested, reading));
                port.observe(&reading, output.commanded);
                user.write(&[output.commanded]).expect("finite");
                tick += 1;
            });
        });
    }
    group.finish();
}

fn two_fingers(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("user of two fingers, one tick");
    for (kind, name) in [
        (DeviceKind::Point, "point"),
        (DeviceKind::Pantograph, "pantograph"),
        (DeviceKind::Phantom, "phantom"),
    ] {
        for (counts, inertia, what) in
            [(0, false, "perfect"), (20_000, false, "encoders"), (20_000, true, "encoders and inertia")]
        {
            let vector = DVec3::new(0.02, 0.01, 0.005);
            let mut scene = scene(Action::Carry { by_m: vector, duration_s: 1.0 }, Space::Plane);
            let finger = |x| Finger { position_m: DVec3::X * x, script: Vec::new() };
            scene = edited(&scene, |scene| {
                scene.users[0].fingers = vec![finger(-0.05), finger(0.05)];
                scene.users[0].repeat = false;
                (scene.device.kind, scene.device.inertia) = (kind, inertia);
                scene.device.encoder_counts_per_turn = counts;
                scene.device.velocity = VelocityEstimate::Filtered;
                scene.device.max_joint_torque_n_m = 0.5;
            });
            let (mut user, mut tick) = (user(&scene), 0);
            group.bench_function(BenchmarkId::new(name, what), |bencher| {
                bencher.iter(|| {
                    let readings = user.read(tick).expect("in order");
                    user.observe(&WorldView { bodies: &[Pose::default()] });
                    let wrench = |reading: &cotouch_scene::geometry::Reading| {
                        Wrench::force(reading.twist.linear * black_box(-0.1))
                    };
                    let wrenches: Wrenches = readings.iter().map(wrench).collect();
                    user.write(&wrenches).expect("finite");
                    tick += 1;
                });
            });
        }
    }
    group.finish();
}

fn governor_alone(criterion: &mut Criterion) {
    let scene = scene(Action::Relax { duration_s: 1.0 }, Space::Line);
    let governor = Governor::new(&scene, user(&scene).limits());
    criterion.bench_function("governor, one tick", |bencher| {
        let (mut state, mut push) = (governor.start(), 1.0);
        bencher.iter(|| {
            push = -push;
            let input = GovernorInput::healthy(Wrench::force(black_box(DVec3::X * push)), Default::default());
            governor.govern(&mut state, &input)
        });
    });
}

criterion_group!(benches, one_finger, two_fingers, governor_alone);
criterion_main!(benches);
