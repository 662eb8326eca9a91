//! Fingers on mechanisms: encoders, velocity estimates, motors, stops, links.

use std::f64::consts::{PI, TAU};

use crate::support::{arm, point, scene_of};
use cotouch_device::{Device, FingerState, SimulatedUser};
use cotouch_scene::geometry::{Reading, Wrench};
use cotouch_scene::mechanism::{Mechanism, Placed, endpoint_inertia};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, DeviceKind, DeviceSpec, Hand, Scene, Space, VelocityEstimate};
use cotouch_testkit::scenes::edited;
use glam::DVec3;
use proptest::prelude::*;

const START: DVec3 = DVec3::new(0.3, -0.1, 0.05);
fn free() -> Hand {
    Hand { damping_n_s_per_m: 0.0, ..arm() }
}

fn on(device: DeviceSpec, hand: Hand, actions: &[Action]) -> Scene {
    edited(&scene_of(actions, &[START]), |scene| {
        scene.space = if device.kind == DeviceKind::Phantom { Space::Space } else { Space::Plane };
        (scene.device, scene.hand) = (device, hand);
    })
}

fn user(scene: &Scene) -> SimulatedUser {
    SimulatedUser::new(scene, HostIndex::FIRST).unwrap()
}

fn tick(user: &mut SimulatedUser, tick: u64, force: DVec3) -> Reading {
    let reading = user.read(tick).unwrap()[0];
    user.write(&[Wrench::force(force)]).unwrap();
    reading
}

fn push(force_n: DVec3) -> Action {
    Action::Force { force_n, duration_s: 100.0 }
}

#[test]
fn a_perfect_encoder_reads_the_place_and_a_coarse_one_is_off_by_half_a_count() {
    for kind in [DeviceKind::Pantograph, DeviceKind::Phantom] {
        let action = Action::SinusoidalForce {
            amplitude_n: DVec3::new(0.3, -0.2, 0.1),
            frequency_hz: 1.0,
            phase_rad: 0.5 * PI,
            duration_s: 10.0,
        };
        let mut worst: f64 = 0.0;
        for counts in [0, 4096] {
            let device = DeviceSpec { kind, encoder_counts_per_turn: counts, ..point() };
            let mut user = user(&on(device, arm(), std::slice::from_ref(&action)));
            let mechanism = Mechanism::of_kind(kind).unwrap();
            let bound = 1.1 * PI / 4096.0 * mechanism.longest_lever_m() * mechanism.joints() as f64;
            let mut widest: f64 = 0.0;
            for k in 0..1000 {
                let place = user.states()[0].position;
                widest = widest.max(place.distance(START));
                let reading = tick(&mut user, k, DVec3::ZERO);
                let error = (reading.pose.position - place).length();
                worst = worst.max(error);
                assert!(error <= if counts == 0 { 0.0 } else { bound }, "{kind:?}: {error} above {bound}");
            }
            assert!(widest > 0.01, "{widest}");
        }
        assert!(worst > 1e-5, "{kind:?}: counts are seen: {worst}");
    }
}

#[test]
fn a_difference_lags_by_half_a_tick_and_a_filter_by_its_time_constant() {
    let estimate = |velocity| DeviceSpec { velocity, velocity_cutoff_hz: 20.0, ..point() };
    let scene = |velocity| on(estimate(velocity), free(), &[push(DVec3::X * 0.5)]);
    let mut exact = user(&scene(VelocityEstimate::Exact));
    let mut difference = user(&scene(VelocityEstimate::Difference));
    let mut filtered = user(&scene(VelocityEstimate::Filtered));
    // x = a·t²/2 with a = 2 m/s²: the difference is a·(t − T/2); the filter follows it as a low pass does.
    let (a, period) = (2.0, 1e-3);
    let decay = (-TAU * 20.0 * period).exp();
    for k in 0..500 {
        let t = k as f64 * period;
        let [v, d, f] = [&mut exact, &mut difference, &mut filtered]
            .map(|user| tick(user, k, DVec3::ZERO).twist.linear.x);
        assert!((v - a * t).abs() < 1e-12);
        let expected = if k == 0 { 0.0 } else { a * (t - 0.5 * period) };
        assert!((d - expected).abs() < 1e-12, "{k}: {d} {expected}");
        // Σ over earlier differences: d_k − a·T·Σ decay^i + …, written out for a ramp that begins at tick 1.
        let lag = a * period * decay * (1.0 - decay.powi(k as i32)) / (1.0 - decay)
            - 0.5 * a * period * decay.powi(k as i32);
        let expected = if k == 0 { 0.0 } else { expected - lag };
        assert!((f - expected).abs() < 1e-12, "{k}: {f} {expected}");
    }
    let states = [exact, difference, filtered].map(|user| user.states()[0]);
    assert_eq!(states[0].sensor.position, START, "an exact device remembers nothing");
    assert_eq!(states[1].position, states[0].position);
    assert!(states[1].sensor.position.x < states[1].position.x && states[1].sensor.velocity == DVec3::ZERO);
    assert!(states[2].sensor.velocity.x > 0.0);
}

#[test]
fn what_a_sensor_remembers_is_part_of_the_state() {
    let device = DeviceSpec {
        kind: DeviceKind::Pantograph,
        encoder_counts_per_turn: 20_000,
        velocity: VelocityEstimate::Filtered,
        ..point()
    };
    let scene = on(device, arm(), &[push(DVec3::new(0.4, 0.2, 0.0))]);
    let (mut one, mut other) = (user(&scene), user(&scene));
    for k in 0..100 {
        tick(&mut one, k, DVec3::ZERO);
    }
    let text = serde_json::to_string(one.state()).unwrap();
    other.restore(serde_json::from_str(&text).unwrap());
    for k in 100..300 {
        assert_eq!(one.read(k).unwrap(), one.read(k).unwrap(), "reading twice is reading once");
        assert_eq!(tick(&mut one, k, DVec3::Y), tick(&mut other, k, DVec3::Y));
    }
    assert_eq!(one, other);
    let mut changed = other.states()[0];
    changed.sensor.position.x -= 1e-3;
    other.set_state(0, changed);
    let (before, after) = (one.read(300).unwrap()[0], other.read(300).unwrap()[0]);
    assert_eq!(before.pose, after.pose);
    assert!(after.twist.linear.x > before.twist.linear.x + 0.1);
}

#[test]
fn motors_give_less_in_the_same_direction() {
    for kind in [DeviceKind::Pantograph, DeviceKind::Phantom] {
        let device = DeviceSpec { kind, max_joint_torque_n_m: 0.2, ..point() };
        let mut user = user(&on(device, arm(), &[]));
        let mechanism = Mechanism::of_kind(kind).unwrap();
        let joints = mechanism.joints_at(mechanism.workspace().centre).unwrap();
        let force = DVec3::new(0.3, -0.7, if kind == DeviceKind::Phantom { 0.4 } else { 0.0 });
        let everywhere = user.limits().max_force_n;
        assert!(everywhere > 0.3 && everywhere < 10.0, "{everywhere}");
        user.read(0).unwrap();
        user.write(&[Wrench::force(force.normalize() * everywhere)]).unwrap();
        assert_eq!(user.states()[0].held_force, force.normalize() * everywhere);
        let place = user.states()[0].position;
        user.set_state(0, FingerState { position: START, velocity: DVec3::ZERO, ..user.states()[0] });
        user.read(1).unwrap();
        user.write(&[Wrench::force(force * 1e6)]).unwrap();
        let held = user.states()[0].held_force;
        assert!(held.normalize().dot(force.normalize()) > 1.0 - 1e-15 && place.is_finite());
        let torques = mechanism.torques(joints, held).unwrap();
        assert!((torques.abs().max_element() - 0.2).abs() < 1e-12, "{torques}");
    }
    assert_eq!(user(&on(point(), arm(), &[])).limits().max_force_n, f64::INFINITY);
}

#[test]
fn a_loaded_finger_with_links_settles_where_the_springs_balance() {
    for kind in [DeviceKind::Pantograph, DeviceKind::Phantom] {
        let device = DeviceSpec { kind, inertia: true, ..point() };
        let mut user = user(&on(device, Hand { stiffness_n_per_m: 100.0, ..arm() }, &[]));
        for k in 0..10_000 {
            tick(&mut user, k, DVec3::new(2.0, -1.5, 0.0));
        }
        let FingerState { position, velocity, .. } = user.states()[0];
        assert!(position.distance(START + DVec3::new(0.02, -0.015, 0.0)) < 1e-12, "{position}");
        assert!(velocity.length() < 1e-12);
    }
}

/// Without damping, hand, links and spring keep their energy; links that take part make it slower than the hand alone.
#[test]
fn links_keep_their_energy() {
    for (kind, velocity) in [
        (DeviceKind::Pantograph, DVec3::new(0.9, -0.6, 0.0)),
        (DeviceKind::Phantom, DVec3::new(0.7, -0.4, 0.5)),
    ] {
        let device = DeviceSpec { kind, inertia: true, ..point() };
        let hand = Hand { stiffness_n_per_m: 100.0, mass_kg: 0.1, damping_n_s_per_m: 0.0, ..arm() };
        let mut user = user(&on(device.clone(), hand, &[]));
        user.set_state(0, FingerState { velocity, ..user.states()[0] });
        let energy = |state: &FingerState| {
            let inertia = endpoint_inertia(&device, 0.1, START, state.position);
            0.5 * state.velocity.dot(inertia * state.velocity)
                + 50.0 * (state.position - START).length_squared()
        };
        let begin = energy(&user.states()[0]);
        assert!(begin > 0.5 * 0.1 * velocity.length_squared() * 1.1);
        let mut widest: f64 = 0.0;
        for k in 0..20_000 {
            tick(&mut user, k, DVec3::ZERO);
            let state = user.states()[0];
            let drift = (energy(&state) - begin).abs() / begin;
            assert!(drift < 1e-7, "{kind:?} at {k}: {drift:e}");
            widest = widest.max(state.position.distance(START));
        }
        assert!(widest > 0.03 && widest < 0.09, "{widest}");
    }
}

#[test]
fn a_guided_finger_with_links_keeps_to_its_line() {
    let device = DeviceSpec { kind: DeviceKind::Phantom, inertia: true, ..point() };
    let scene =
        edited(&on(device, arm(), &[push(DVec3::new(1.0, 2.0, 3.0))]), |scene| scene.space = Space::Line);
    let mut user = user(&scene);
    for k in 0..200 {
        let position = tick(&mut user, k, DVec3::Y).pose.position;
        assert_eq!((position.y, position.z), (START.y, START.z));
    }
    assert!(user.states()[0].position.x > START.x + 1e-3);
}

fn any_force() -> impl Strategy<Value = DVec3> {
    (-60.0..60.0, -60.0..60.0, -60.0..60.0_f64).prop_map(DVec3::from)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn nothing_leaves_the_workspace(
        forces in prop::collection::vec(any_force(), 1..12),
        phantom in any::<bool>(),
        inertia in any::<bool>(),
        counts in proptest::sample::select(vec![0_u32, 500, 20_000]),
        torque in proptest::sample::select(vec![0.0, 0.3]),
    ) {
        let kind = if phantom { DeviceKind::Phantom } else { DeviceKind::Pantograph };
        let device = DeviceSpec {
            kind,
            inertia,
            encoder_counts_per_turn: counts,
            max_joint_torque_n_m: torque,
            ..point()
        };
        let mut user = user(&on(device.clone(), free(), &[]));
        let Placed { mechanism, offset } = Placed::of_finger(&device, START).unwrap();
        let workspace = mechanism.workspace();
        for k in 0..1500 {
            let reading = tick(&mut user, k, forces[k as usize / 50 % forces.len()]);
            prop_assert!(reading.is_finite());
            let beyond = workspace.nearest(reading.pose.position + offset) - offset - reading.pose.position;
            prop_assert!(beyond.length() < 1e-12, "{}", reading.pose.position);
            let held = user.states()[0].held_force;
            prop_assert!(held.length() <= 60.0 * 3.0_f64.sqrt());
        }
    }
}
