//! Simulated users of one finger on a line, and their scripts, against closed forms.

use std::f64::consts::TAU;

use crate::support::{TRACKING, arm, scene_of};
use cotouch_device::{Device, DeviceError, MAX_TICKS_AHEAD, Script, SecondOrderPlant, SimulatedUser, Touch};
use cotouch_scene::geometry::Wrench;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, Hand, Scene, Space};
use cotouch_testkit::scenes::edited;
use glam::DVec3;

fn scene(arm: &Hand, actions: &[Action], repeat: bool) -> Scene {
    // Scripts without length are no scene's: a user must survive them all the same.
    scene_of(&[], &[DVec3::ZERO]).edit_unchecked(|scene| {
        scene.users[0].script = actions.to_vec();
        scene.hand = arm.clone();
        scene.users[0].repeat = repeat;
    })
}

fn script(actions: &[Action], repeat: bool) -> Script {
    Script::new(&scene(&arm(), actions, repeat), HostIndex::FIRST, None)
}

fn hand_of(arm: &Hand, actions: &[Action], repeat: bool) -> SimulatedUser {
    SimulatedUser::new(&scene(arm, actions, repeat), HostIndex::FIRST).unwrap()
}

/// Positions along x at ticks 0, 1, … under no device force.
fn free_run(hand: &mut SimulatedUser, ticks: u64) -> Vec<f64> {
    let mut tick = |tick| {
        let position = hand.read(tick).unwrap()[0].pose.position;
        assert_eq!((position.y, position.z), (0.0, 0.0), "nothing leaves the line");
        hand.write(&[Wrench::default()]).unwrap();
        position.x
    };
    (0..ticks).map(&mut tick).collect()
}

fn reach(to: f64, duration_s: f64) -> Action {
    Action::Reach { to_m: DVec3::X * to, duration_s }
}

fn push(force: f64, duration_s: f64) -> Action {
    Action::Force { force_n: DVec3::new(force, 3.0, -1.0), duration_s }
}

#[test]
fn a_constant_force_accelerates_a_free_mass() {
    let arm = Hand { damping_n_s_per_m: 0.0, ..arm() };
    let x = free_run(&mut hand_of(&arm, &[push(0.5, 10.0)], false), 2001);
    for (tick, x) in x.iter().enumerate() {
        let t = tick as f64 * 1e-3;
        assert!((x - t * t).abs() < 1e-13, "{tick}");
    }
}

#[test]
fn pushing_stops_at_the_tick_where_it_lets_go() {
    let arm = Hand { damping_n_s_per_m: 0.0, ..arm() };
    let action = Action::PushAndLetGo { force_n: DVec3::X * 0.5, push_s: 0.3, duration_s: 1.0 };
    let mut hand = hand_of(&arm, &[action], false);
    free_run(&mut hand, 300);
    let speed = hand.states()[0].velocity.x;
    assert!((speed - 0.6).abs() < 1e-13, "{speed}");
    for tick in 300..2000 {
        hand.read(tick).unwrap();
        hand.write(&[Wrench::default()]).unwrap();
        assert!((hand.states()[0].velocity.x - speed).abs() < 1e-13);
    }
}

#[test]
fn a_sinusoidal_force_and_its_phase() {
    let arm = Hand { damping_n_s_per_m: 0.0, ..arm() };
    let action = Action::SinusoidalForce {
        amplitude_n: DVec3::X * 2.0,
        frequency_hz: 5.0,
        phase_rad: 0.5 * std::f64::consts::PI,
        duration_s: 10.0,
    };
    let mut hand = hand_of(&arm, &[action], false);
    free_run(&mut hand, 50);
    // A quarter of a period of a cosine: ∫ = A/ω, but for the hold of each sample (half a tick early).
    let held: f64 = (0..50).map(|tick| 2.0 * (TAU * 5.0 * f64::from(tick) * 1e-3).cos() * 1e-3).sum();
    assert!((hand.states()[0].velocity.x - held / 0.25).abs() < 1e-14);
    assert!((held - 2.0 / (TAU * 5.0)).abs() < 1.1e-3);
}

#[test]
fn a_reach_arrives_and_stays() {
    let x = free_run(&mut hand_of(&arm(), &[reach(0.1, 0.5), Action::Hold { duration_s: 2.0 }], false), 2500);
    assert!(x.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 1.4 * 1.875 * 0.1 / 0.5 * 1e-3));
    assert!((x[2499] - 0.1).abs() < 1e-9, "{}", x[2499]);
}

#[test]
fn a_loaded_hand_that_goes_from_reach_to_hold_does_not_sag() {
    let arm = Hand { stiffness_n_per_m: 200.0, ..arm() };
    let x = free_run(&mut hand_of(&arm, &[reach(0.1, 0.5), Action::Hold { duration_s: 3.0 }], false), 4000);
    let balance = 500.0 / 700.0 * 0.1;
    assert!((x[1500] - balance).abs() < 1e-6 && (x[3999] - balance).abs() < 1e-12);
}

#[test]
fn after_a_push_a_hold_keeps_where_the_hand_was() {
    let actions = [push(2.0, 1.0), Action::Hold { duration_s: 2.0 }, Action::Relax { duration_s: 1.0 }];
    let x = free_run(&mut hand_of(&arm(), &actions, false), 5000);
    let pushed = 2.0 / 500.0;
    assert!((x[1000] - pushed).abs() < 1e-6, "against the spring to the target: {}", x[1000]);
    assert!((x[2999] - x[1000]).abs() < 1e-9, "{} {}", x[2999], x[1000]);
    assert!((x[4999] - x[2999]).abs() < 1e-9, "the target stays after the script: {}", x[4999]);
}

#[test]
fn a_sinusoid_settles_into_the_discrete_steady_state() {
    let (amplitude, rate, period) = (0.05, TAU * 1.5, 1e-3);
    let action = Action::Sinusoid {
        amplitude_m: DVec3::X * amplitude,
        frequency_hz: 1.5,
        phase_rad: 0.7,
        duration_s: 100.0,
    };
    let x = free_run(&mut hand_of(&arm(), &[action], false), 8000);
    // A held input sees the plant half a tick late, to second order in ωT.
    let (m, b, k) = (0.25, 25.0, 500.0);
    let (input_re, input_im) = (500.0 * amplitude, 20.0 * rate * amplitude);
    let (plant_re, plant_im) = (k - m * rate * rate, b * rate);
    let gain = (input_re.hypot(input_im)) / plant_re.hypot(plant_im);
    let phase = input_im.atan2(input_re) - plant_im.atan2(plant_re) - 0.5 * rate * period;
    for (tick, x) in x.iter().enumerate().skip(4000) {
        let expected = gain * (rate * tick as f64 * period + 0.7 + phase).sin();
        assert!((x - expected).abs() < 1e-5 * amplitude, "{tick}: {x} {expected}");
    }
}

#[test]
fn targets_never_jump_from_action_to_action() {
    let sinusoid = |phase_rad| Action::Sinusoid {
        amplitude_m: DVec3::X * 0.02,
        frequency_hz: 2.0,
        phase_rad,
        duration_s: 0.7305,
    };
    let actions = [
        sinusoid(1.0),
        sinusoid(-0.5),
        reach(0.05, 0.3),
        Action::Force { force_n: DVec3::X, duration_s: 0.01 },
        Action::Hold { duration_s: 0.05 },
        sinusoid(0.0),
        Action::Relax { duration_s: 0.3333 },
        reach(0.0, 0.4),
    ];
    let script = script(&actions, true);
    let mut state = script.begin(0, &[Touch::default()], &[]);
    let touch = Touch { position: DVec3::X * 0.01, ..Touch::default() };
    let mut last = script.drive(&mut state, 0, &[Touch::default()], &[])[0].target;
    assert!(last.position.length() < 1e-16 && last.velocity.length() < 1e-15, "{last:?}");
    for tick in 1..20_000 {
        let target = script.drive(&mut state, tick, &[touch], &[])[0].target;
        // What is left over a tick is the path's jerk, which is bounded (60·d/T³, 24,000 m/s³ in the shortest one).
        let predicted = last.position + last.velocity * 1e-3 + last.acceleration * 0.5e-6;
        assert!((target.position - predicted).length() < 3e-5, "{tick}");
        let predicted = last.velocity + last.acceleration * 1e-3;
        assert!((target.velocity - predicted).length() < 0.02, "{tick}");
        assert!((target.acceleration - last.acceleration).length() < 25.0, "{tick}");
        last = target;
    }
}

#[test]
fn without_tracking_actions_there_is_no_tracking_impedance() {
    assert_eq!(script(&[push(1.0, 1.0)], true).tracking().stiffness_n_per_m, 0.0);
    assert_eq!(script(&[push(1.0, 1.0), reach(0.1, 1.0)], true).tracking(), TRACKING);
}

#[test]
fn actions_follow_each_other_at_exact_ticks_for_ever() {
    let actions = [push(1.0, 0.1), push(2.0, 0.2), push(3.0, 0.3)];
    let script = script(&actions, true);
    let mut state = script.begin(0, &[Touch::default()], &[]);
    for tick in 0..600_000 {
        let expected = match tick % 600 {
            0..100 => 1.0,
            100..300 => 2.0,
            _ => 3.0,
        };
        assert_eq!(script.drive(&mut state, tick, &[Touch::default()], &[])[0].force.x, expected, "{tick}");
    }
}

#[test]
fn scripts_of_no_length_do_not_hang() {
    for actions in [vec![], vec![push(1.0, 0.0)], vec![push(1.0, 0.0), reach(0.1, 0.0), push(1.0, 1e-9)]] {
        let x = free_run(&mut hand_of(&arm(), &actions, true), 50);
        assert!(x.iter().all(|x| x.is_finite()));
    }
}

#[test]
fn skipped_ticks_are_ticks_with_the_last_force_held() {
    let actions = [reach(0.1, 0.05), Action::Tremor { rms_n: DVec3::ONE, duration_s: 1.0 }];
    let (mut steady, mut skipping) = (hand_of(&arm(), &actions, false), hand_of(&arm(), &actions, false));
    let wrench = Wrench::force(DVec3::new(-1.0, 2.0, 0.0));
    for tick in 0..60 {
        steady.read(tick).unwrap();
        steady.write(&[wrench]).unwrap();
    }
    skipping.read(0).unwrap();
    skipping.write(&[wrench]).unwrap();
    let reading = skipping.read(60).unwrap();
    assert_eq!(reading, steady.read(60).unwrap());
    assert_eq!(reading, skipping.read(60).unwrap(), "reading twice is reading once");
    assert_eq!(skipping.state(), steady.state());
    let past = skipping.read(59).unwrap_err();
    assert!(matches!(past, DeviceError::TickOutOfReach { asked: 59, at: 60, .. }), "{past}");
    assert!(skipping.read(61 + MAX_TICKS_AHEAD).is_err());
    assert!(skipping.write(&[Wrench::force(DVec3::NAN)]).is_err());
    assert_eq!(skipping.state(), steady.state(), "a refused force does not move the hand");
}

#[test]
fn a_state_can_be_saved_restored_and_repeated() {
    let actions = [reach(0.1, 0.3), Action::Tremor { rms_n: DVec3::X, duration_s: 0.3 }, push(1.0, 0.2)];
    let mut hand = hand_of(&arm(), &actions, true);
    free_run(&mut hand, 777);
    let text = serde_json::to_string(hand.state()).unwrap();
    let mut other = hand_of(&arm(), &actions, true);
    other.restore(serde_json::from_str(&text).unwrap());
    for tick in 777..2500 {
        assert_eq!(hand.read(tick), other.read(tick));
        hand.write(&[Wrench::force(DVec3::X)]).unwrap();
        other.write(&[Wrench::force(DVec3::X)]).unwrap();
    }
    assert_eq!(hand.state(), other.state());
}

#[test]
fn in_space_every_axis_is_the_line() {
    let to_m = DVec3::new(0.1, 0.2, -0.3);
    let scene = edited(&scene(&arm(), &[Action::Reach { to_m, duration_s: 0.3 }], false), |scene| {
        scene.space = Space::Space
    });
    let mut free = SimulatedUser::new(&scene, HostIndex::FIRST).unwrap();
    let mut lines: Vec<SimulatedUser> =
        to_m.to_array().map(|to| hand_of(&arm(), &[reach(to, 0.3)], false)).into();
    let forces = DVec3::new(1.0, -2.0, 0.5);
    for tick in 0..500 {
        let along: Vec<f64> =
            lines.iter_mut().map(|line| line.read(tick).unwrap()[0].pose.position.x).collect();
        assert_eq!(free.read(tick).unwrap()[0].pose.position, DVec3::from_slice(&along));
        for (line, force) in lines.iter_mut().zip(forces.to_array()) {
            line.write(&[Wrench::force(DVec3::X * force)]).unwrap();
        }
        free.write(&[Wrench::force(forces)]).unwrap();
    }
}

#[test]
fn in_a_plane_nothing_leaves_it() {
    let scene =
        edited(&scene(&arm(), &[Action::Force { force_n: DVec3::ONE, duration_s: 1.0 }], false), |scene| {
            scene.space = Space::Plane;
            scene.users[0].fingers[0].position_m = DVec3::new(0.1, 0.2, 0.3);
        });
    let mut hand = SimulatedUser::new(&scene, HostIndex::FIRST).unwrap();
    for tick in 0..500 {
        let position = hand.read(tick).unwrap()[0].pose.position;
        assert_eq!(position.z, 0.3);
        hand.write(&[Wrench::force(DVec3::ONE)]).unwrap();
    }
    assert!(hand.states()[0].position.x > 0.2 && hand.states()[0].position.y > 0.3);
}

#[test]
fn on_a_line_one_finger_is_the_plant_to_the_bit() {
    let arm = Hand { stiffness_n_per_m: 30.0, ..arm() };
    let mut hand = hand_of(&arm, &[push(0.7, 10.0)], false);
    let plant = SecondOrderPlant::new(0.25, 5.0, 30.0, 1e-3);
    let (mut x, mut v) = (0.0, 0.0);
    for tick in 0..3000 {
        let reading = hand.read(tick).unwrap()[0];
        assert_eq!((reading.pose.position.x, reading.twist.linear.x), (x, v));
        let force = -300.0 * x + 0.1 * (tick as f64 * 0.013).sin();
        hand.write(&[Wrench::force(DVec3::new(force, 1.0, 2.0))]).unwrap();
        (x, v) = plant.step(x, v, 0.7 + force);
    }
}

#[test]
fn impossible_hands_are_refused() {
    let user = |arm: Hand| SimulatedUser::new(&scene(&arm, &[], false), HostIndex::FIRST).map(|_| ());
    let massless = user(Hand { mass_kg: 0.0, ..arm() }).unwrap_err();
    assert!(massless.to_string().contains("found 0 kg"), "{massless}");
    assert!(user(Hand { stiffness_n_per_m: f64::NAN, ..arm() }).is_err());
}

#[test]
fn a_user_who_joins_late_begins_the_script_then() {
    let actions = [push(0.5, 0.1), reach(0.1, 0.3)];
    let (mut early, mut late) = (hand_of(&arm(), &actions, false), hand_of(&arm(), &actions, false));
    let joined = 12_345_678;
    assert!(late.read(joined).is_err());
    late.restart(joined);
    for tick in 0..600 {
        let (early_reading, late_reading) = (early.read(tick).unwrap(), late.read(joined + tick).unwrap());
        let apart = early_reading[0].pose.position - late_reading[0].pose.position;
        assert!(apart.length() < 1e-10, "{tick}: {apart}");
        early.write(&[Wrench::default()]).unwrap();
        late.write(&[Wrench::default()]).unwrap();
    }
}
