//! A user whose fingers a pointer draws: nothing jumps, nothing gets lost, and without a pointer nothing is different.

use std::sync::{Arc, Mutex};

use crate::support::{TRACKING, arm, point, scene_of, scene_with_box};
use cotouch_device::{
    Device, Guide, GuidedUser, POINTER_FADE_S, POINTER_REACH_M, POINTER_STOP_S, ScriptProgress,
    SimulatedUser, Targets, WorldView, guided_scene, pointer_spring,
};
use cotouch_scene::geometry::{Pose, Readings, Wrench, Wrenches};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, DeviceKind, DeviceSpec, Scene, Space};
use cotouch_testkit::scenes::edited;
use glam::DVec3;

/// A pointer, and a guide that says what it says.
#[derive(Clone, Default)]
struct Pointer(Arc<Mutex<Option<Targets>>>);

impl Pointer {
    fn at(&self, targets: &[DVec3]) {
        *self.0.lock().unwrap() = Some(targets.iter().copied().collect());
    }

    fn leave(&self) {
        *self.0.lock().unwrap() = None;
    }
}

impl Guide for Pointer {
    fn targets(&mut self) -> Option<Targets> {
        self.0.lock().unwrap().clone()
    }
}

fn guided(scene: &Scene) -> (GuidedUser<Pointer>, Pointer) {
    let pointer = Pointer::default();
    (GuidedUser::new(scene, HostIndex::FIRST, pointer.clone()).unwrap(), pointer)
}

/// One tick of a user who sees a body at the origin and feels a damper of 2 N·s/m.
fn tick(user: &mut dyn Device, tick: u64) -> Readings {
    let readings = user.read(tick).unwrap();
    user.observe(&WorldView { bodies: &[Pose::default()] });
    let wrenches: Wrenches =
        readings.iter().map(|reading| Wrench::force(reading.twist.linear * -2.0)).collect();
    user.write(&wrenches).unwrap();
    readings
}

/// Runs the ticks, and gives the velocity of the first finger at each, m/s.
fn velocities(user: &mut dyn Device, ticks: std::ops::Range<u64>) -> Vec<f64> {
    ticks.map(|number| tick(user, number)[0].twist.linear.x).collect()
}

/// By how much the force on a finger changes at most from tick to tick, N, by how its velocity does.
fn largest_step_n(velocities: &[f64]) -> f64 {
    let force = |pair: &[f64]| (pair[1] - pair[0]) * 1000.0 * arm().mass_kg;
    let forces: Vec<f64> = velocities.windows(2).map(force).collect();
    forces.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max)
}

fn busy_script() -> Vec<Action> {
    let (to_m, duration_s) = (DVec3::new(0.02, 0.01, 0.0), 0.3);
    vec![
        Action::Reach { to_m, duration_s },
        Action::Force { force_n: to_m * 10.0, duration_s },
        Action::Tremor { rms_n: to_m, duration_s },
        Action::Grasp { body: "box".into(), force_n: 0.2, speed_m_per_s: 0.2, duration_s },
        Action::Carry { by_m: -to_m, duration_s },
        Action::LetGo { distance_m: 0.02, duration_s },
    ]
}

fn busy_scene() -> Scene {
    let starts = [DVec3::X * -0.05, DVec3::X * 0.05, DVec3::Y * 0.05];
    edited(&scene_with_box(Space::Plane, &busy_script(), &starts, DVec3::splat(0.05)), |scene| {
        scene.users[0].repeat = true;
        scene.users[0].fingers[2].script = busy_script()[1..3].to_vec();
    })
}

#[test]
fn without_a_pointer_it_is_the_simulated_user_to_the_bit() {
    let mut scene = busy_scene();
    let pantograph = DeviceSpec {
        kind: DeviceKind::Pantograph,
        encoder_counts_per_turn: 20_000,
        max_joint_torque_n_m: 0.3,
        ..point()
    };
    for device in [point(), pantograph] {
        scene = edited(&scene, |scene| scene.device = device);
        let mut plain = SimulatedUser::new(&scene, HostIndex::FIRST).unwrap();
        let (mut guided, _pointer) = guided(&scene);
        for user in [&mut plain as &mut dyn Device, &mut guided] {
            user.start(3);
            user.recentre(DVec3::new(0.01, 0.02, 0.0));
        }
        for number in (3..4000).filter(|number| number % 17 > 2) {
            assert_eq!(tick(&mut plain, number), tick(&mut guided, number));
        }
        assert_eq!(plain.state(), guided.user().state());
        assert!(guided.pointer_targets().is_empty());
    }
}

#[test]
fn fingers_go_where_the_pointer_says() {
    let starts = [DVec3::ZERO, DVec3::X * 0.1];
    let scene = edited(&scene_of(&[], &starts), |scene| scene.users[0].repeat = true);
    let (mut user, pointer) = guided(&scene);
    pointer.at(&[DVec3::new(0.05, 3.0, 0.0)]);
    velocities(&mut user, 0..1500);
    let readings = user.read(1500).unwrap();
    assert!((readings[0].pose.position - DVec3::X * 0.05).length() < 1e-6, "{readings:?}");
    assert!((readings[1].pose.position - DVec3::X * 0.1).length() < 1e-12, "nobody said where to");
    let drawn = user.pointer_targets();
    assert!((drawn[0] - DVec3::X * 0.05).length() < 1e-6 && drawn.len() == 2, "{drawn:?}");
    pointer.leave();
    user.read(1500).unwrap();
    assert!(user.pointer_targets().is_empty());
}

#[test]
fn a_pointer_that_speaks_in_steps_moves_its_target_smoothly() {
    let (mut user, pointer) = guided(&scene_of(&[], &[DVec3::ZERO]));
    let mut places = Vec::new();
    for number in 0..3000 {
        if number % 50 == 0 {
            // 0.3 m/s, told 20 times a second, and then far away at once.
            let place = if number < 2000 { 0.3e-3 * number as f64 } else { -2.0 };
            pointer.at(&[DVec3::X * place]);
        }
        tick(&mut user, number);
        places.push(user.pointer_targets()[0].x);
    }
    let speed = |pair: &[f64]| (pair[1] - pair[0]) * 1000.0;
    let speeds: Vec<f64> = places.windows(2).map(speed).collect();
    assert!(speeds.iter().all(|speed| speed.abs() <= 1.0 + 1e-9));
    assert!(speeds[1000..2000].iter().all(|speed| (speed - 0.3).abs() < 0.25), "it does not stop and go");
    let accelerations = speeds.windows(2).map(|pair| (pair[1] - pair[0]).abs() * 1000.0);
    assert!(accelerations.fold(0.0, f64::max) < 60.0);
}

#[test]
fn taking_and_leaving_do_not_jump() {
    let duration_s = 10.0;
    let scripts = [
        vec![Action::Hold { duration_s }],
        vec![Action::Sinusoid {
            amplitude_m: DVec3::X * 0.02,
            frequency_hz: 1.0,
            phase_rad: 0.0,
            duration_s,
        }],
        vec![Action::SinusoidalForce {
            amplitude_n: DVec3::X,
            frequency_hz: 1.0,
            phase_rad: 0.0,
            duration_s,
        }],
    ];
    for script in scripts {
        let tracks = script[0].tracks();
        let scene = edited(&scene_of(&script, &[DVec3::ZERO]), |scene| {
            scene.users[0].tracking = if tracks { TRACKING } else { scene.users[1].tracking }
        });
        let (mut user, pointer) = guided(&scene);
        let mut run = velocities(&mut user, 0..700);
        let before_n = largest_step_n(&run[300..]);
        let from_tick = run.len() - 3;
        pointer.at(&[]);
        run.extend(velocities(&mut user, 700..1000));
        pointer.at(&[DVec3::X * (user.pointer_targets()[0].x + 0.02)]);
        run.extend(velocities(&mut user, 1000..2000));
        pointer.leave();
        // Back in the middle of stopping, and in the middle of fading.
        for (pause, from) in [(100, 2000), (400, 3000), (5000, 4000)] {
            run.extend(velocities(&mut user, from..from + pause));
            if pause < 1000 {
                pointer.at(&[]);
                run.extend(velocities(&mut user, from + pause..from + 1000));
                pointer.leave();
            }
        }
        // 2 cm are 10 N at 500 N/m: had the target jumped, so had the force.
        let step_n = largest_step_n(&run[from_tick..]);
        assert!(step_n < before_n + 0.2, "{script:?}: {step_n} N in one tick, {before_n} N before");
    }
}

#[test]
fn the_moment_of_taking_pulls_as_the_script_did() {
    let script = [Action::Force { force_n: DVec3::X * 2.0, duration_s: 10.0 }];
    let scene =
        edited(&scene_of(&script, &[DVec3::ZERO]), |scene| scene.users[0].tracking = scene.users[1].tracking);
    let (mut user, pointer) = guided(&scene);
    let mut run = velocities(&mut user, 0..500);
    pointer.at(&[]);
    run.extend(velocities(&mut user, 500..503));
    let step_n = largest_step_n(&run[495..]);
    assert!(step_n < 0.1, "{step_n} N of 2 N");
}

#[test]
fn after_leaving_the_hand_comes_to_rest_and_its_script_begins_anew() {
    let script = [
        Action::Hold { duration_s: 0.5 },
        Action::Reach { to_m: DVec3::X * 0.1, duration_s: 0.5 },
        Action::Hold { duration_s: 60.0 },
    ];
    let scene = edited(&scene_of(&script, &[DVec3::ZERO]), |scene| scene.users[0].repeat = true);
    let (mut user, pointer) = guided(&scene);
    velocities(&mut user, 0..2000);
    assert_eq!(user.user().state().scripts[0].action, 2);
    pointer.at(&[DVec3::X * -0.05]);
    velocities(&mut user, 2000..4000);
    pointer.leave();
    let gone = 4001 + ((POINTER_STOP_S + POINTER_FADE_S) * 1000.0) as u64;
    velocities(&mut user, 4000..gone);
    let state = user.user().state();
    assert_eq!((state.scripts[0].action, state.tick), (0, gone));
    assert!(state.fingers[0].velocity.length() < 1e-3);
    assert!((state.fingers[0].position + DVec3::X * 0.05).length() < 1e-3);
    velocities(&mut user, gone..gone + 2000);
    assert!((user.user().states()[0].position - DVec3::X * 0.1).length() < 1e-3);
}

#[test]
fn a_hand_whose_script_does_not_repeat_keeps_its_grip_until_it_is_taken_again() {
    let script = [Action::Hold { duration_s: 60.0 }];
    let (mut user, pointer) = guided(&scene_of(&script, &[DVec3::ZERO]));
    assert_eq!(user.script_progress(), ScriptProgress::Running);
    velocities(&mut user, 0..1000);
    // It presses against something that pushes back.
    let load = Wrench::force(DVec3::X * -1.0);
    let press = |user: &mut GuidedUser<Pointer>, ticks: std::ops::Range<u64>| {
        for number in ticks {
            user.read(number).unwrap();
            user.write(&[load]).unwrap();
        }
        user.user().states()[0].position.x
    };
    pointer.at(&[DVec3::X * 0.05]);
    let held_m = press(&mut user, 1000..3000);
    let target_m = user.pointer_targets()[0].x;
    assert!(target_m > held_m + 1e-3, "the spring is stretched: {target_m} and {held_m} m");
    pointer.leave();
    let left_m = press(&mut user, 3000..6000);
    assert!((left_m - held_m).abs() < 1e-6, "{held_m} and {left_m} m");
    assert!((user.pointer_targets()[0].x - target_m).abs() < 1e-6);
    assert_eq!(user.script_progress(), ScriptProgress::Over);
    pointer.at(&[]);
    let again_m = press(&mut user, 6000..8000);
    assert!((again_m - held_m).abs() < 1e-6, "taken again, nothing moves: {again_m} m");
}

#[test]
fn what_is_not_a_place_is_not_heeded_and_what_is_far_is_brought_near() {
    let (mut user, pointer) = guided(&scene_of(&[], &[DVec3::ZERO]));
    pointer.at(&[DVec3::X * 0.05]);
    velocities(&mut user, 0..1500);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        pointer.at(&[DVec3::new(bad, 0.0, 0.0)]);
        let from = user.user().state().tick;
        velocities(&mut user, from..from + 100);
        assert!((user.user().states()[0].position.x - 0.05).abs() < 1e-6, "{bad}");
    }
    pointer.at(&[DVec3::X * f64::MAX]);
    velocities(&mut user, 1800..14_000);
    assert!((user.user().states()[0].position.x - POINTER_REACH_M).abs() < 1e-3);
}

#[test]
fn a_target_beyond_the_stops_waits_at_them() {
    let scene =
        edited(&busy_scene(), |scene| scene.device = DeviceSpec { kind: DeviceKind::Pantograph, ..point() });
    let (mut user, pointer) = guided(&scene);
    pointer.at(&[DVec3::splat(5.0)]);
    for number in 0..2000 {
        tick(&mut user, number);
    }
    let model = user.user().model().fingers()[0].clone();
    let placed = model.device().unwrap();
    let stop = placed.mechanism.workspace().nearest(DVec3::splat(5.0) + placed.offset) - placed.offset;
    let drawn = user.pointer_targets()[0];
    assert!((drawn - stop).truncate().length() < 1e-6, "{drawn} {stop}");
    // Pushed firmly against the stops, it would take long to come back.
    pointer.at(&[model.rest()]);
    for number in 2000..3000 {
        tick(&mut user, number);
    }
    assert!((user.user().states()[0].position - model.rest()).length() < 1e-3);
}

#[test]
fn a_pointer_speaks_of_the_world_that_the_user_has_come_to() {
    let (mut user, pointer) = guided(&scene_of(&[], &[DVec3::ZERO]));
    user.start(100);
    user.recentre(DVec3::X * 2.0);
    pointer.at(&[DVec3::X * 2.1]);
    velocities(&mut user, 100..1600);
    let shown = user.read(1600).unwrap()[0].pose.position;
    assert!((shown - DVec3::X * 2.1).length() < 1e-6, "{shown}");
    assert!((user.pointer_targets()[0] - DVec3::X * 2.1).length() < 1e-6);
}

#[test]
fn the_analysis_is_told_of_the_spring() {
    let scene = cotouch_scene::load("single-axis", &[]).unwrap();
    let second = HostIndex(1);
    let guided = guided_scene(&scene, &[second]);
    assert_eq!(guided.users[0], scene.users[0]);
    assert_eq!(guided.users[1].tracking, pointer_spring(&scene, second));
    assert!(guided.users[1].tracking.stiffness_n_per_m > 0.0);
    assert!(guided.users[1].script.iter().any(Action::tracks));
    for name in ["single-axis", "single-axis-centralized", "grasp", "sinusoid", "push-wall", "four-hands"] {
        let scene = cotouch_scene::load(name, &[]).unwrap();
        let hosts: Vec<HostIndex> = scene.hosts().collect();
        let guided = guided_scene(&scene, &hosts);
        for (before, after) in scene.users.iter().zip(&guided.users) {
            let grasps = |script: &[Action]| {
                script.iter().filter(|action| matches!(action, Action::Grasp { .. })).count()
            };
            assert_eq!(grasps(&before.script), grasps(&after.script), "{name}: they hold what they held");
        }
        let text = cotouch_scene::to_toml(&guided);
        assert_eq!(cotouch_scene::parse(&text, name, None, &[]).unwrap().users, guided.users, "{name}");
    }
}

#[test]
fn what_the_spring_pulls_with_when_the_pointer_leaves_fades_out() {
    let scene = edited(&scene_of(&[], &[DVec3::ZERO]), |scene| {
        (scene.users[0].tracking, scene.users[0].repeat) = (TRACKING, true);
    });
    let (mut user, pointer) = guided(&scene);
    let load = Wrench::force(DVec3::X * -1.0);
    let mut pulls = Vec::new();
    pointer.at(&[]);
    for number in 0..2000 {
        if number == 1000 {
            pointer.leave();
        }
        let before = user.read(number).unwrap()[0].twist.linear.x;
        user.write(&[load]).unwrap();
        let after = user.read(number + 1).unwrap()[0].twist.linear.x;
        // m·v′ is the load, the arm's and the spring's pull.
        let arm_n = arm().damping_n_s_per_m * before;
        pulls.push((after - before) * 1000.0 * arm().mass_kg + arm_n - load.force.x);
    }
    assert!((pulls[999] - 1.0).abs() < 0.003, "the spring carries the load: {} N", pulls[999]);
    let (stopped, gone) = (
        1000 + (POINTER_STOP_S * 1000.0) as usize,
        1000 + ((POINTER_STOP_S + POINTER_FADE_S) * 1000.0) as usize,
    );
    assert!((pulls[stopped - 2] - 1.0).abs() < 0.003);
    assert!(pulls[gone + 2].abs() < 0.01, "nothing pulls any more: {} N", pulls[gone + 2]);
    // 1 N within 0.3 s by the path of least jerk: at most 6 N/s, and what the damper adds.
    for (tick, pair) in pulls.windows(2).enumerate().skip(900) {
        assert!((pair[1] - pair[0]).abs() < 0.06, "tick {tick}: from {} to {} N", pair[0], pair[1]);
    }
}
