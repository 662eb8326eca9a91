//! What simulated users do about what they feel and see.

use crate::support::{TRACKING, scene_of, scene_with_box, tick};
use cotouch_device::{Drive, Script, ScriptState, SimulatedUser, Target, Touch};
use cotouch_scene::geometry::{Pose, Reading, Readings, Wrench, Wrenches};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, Scene, Space};
use cotouch_testkit::scenes::edited;
use glam::{DQuat, DVec3};
use proptest::prelude::*;

const SIZE: DVec3 = DVec3::new(0.1, 0.06, 0.04);
const SIDES: [DVec3; 2] = [DVec3::new(-0.1, 0.01, 0.0), DVec3::new(0.1, -0.01, 0.0)];

fn grasp(force_n: f64) -> Action {
    Action::Grasp { body: "box".into(), force_n, speed_m_per_s: 0.1, duration_s: 5.0 }
}

fn hold(duration_s: f64) -> Action {
    Action::Hold { duration_s }
}

fn user(scene: &Scene) -> SimulatedUser {
    SimulatedUser::new(scene, HostIndex::FIRST).unwrap()
}

/// A stiff box that moves at `velocity`, pressed on across x.
fn pressed(reading: &Reading, pose: &Pose, velocity: DVec3) -> Wrench {
    let (at, speed) = (
        pose.to_local(reading.pose.position),
        pose.orientation.conjugate() * (reading.twist.linear - velocity),
    );
    let depth = 0.5 * SIZE.x - at.x.abs();
    if depth <= 0.0 || at.y.abs() > 0.5 * SIZE.y {
        return Wrench::default();
    }
    let outwards = at.x.signum();
    let force = (2000.0 * depth - 5.0 * speed.x * outwards).max(0.0);
    Wrench::force(pose.orientation * DVec3::X * (outwards * force))
}

fn on_box(readings: &Readings, pose: &Pose) -> Wrenches {
    readings.iter().map(|reading| pressed(reading, pose, DVec3::ZERO)).collect()
}

fn action(user: &SimulatedUser) -> usize {
    user.state().scripts[0].action
}

#[test]
fn a_grasp_closes_until_the_force_is_there_and_keeps_it() {
    for arm_stiffness in [0.0, 60.0] {
        let scene = edited(&scene_with_box(Space::Plane, &[grasp(2.0), hold(10.0)], &SIDES, SIZE), |scene| {
            scene.hand.stiffness_n_per_m = arm_stiffness
        });
        let (mut user, pose) = (user(&scene), Pose::default());
        let mut ended = None;
        for k in 0..4000 {
            tick(&mut user, k, &[pose], |readings| on_box(readings, &pose));
            if ended.is_none() && action(&user) == 1 {
                ended = Some(k);
            }
        }
        let ended = ended.expect("both press before the time is over");
        // 5 cm at 10 cm/s, and the time to speed up and to press.
        assert!((500..1500).contains(&ended), "{ended}");
        for (finger, approach) in user.states().iter().zip([DVec3::X, DVec3::NEG_X]) {
            let pressing = -finger.held_force.dot(approach);
            assert!((pressing - 2.0).abs() < 0.2, "{pressing} N");
            assert!(finger.velocity.length() < 1e-4, "{}", finger.velocity);
        }
    }
}

#[test]
fn fingers_go_at_the_side_that_they_are_at_as_the_box_is_turned() {
    let starts = [DVec3::new(-0.1, 0.01, 0.0), DVec3::new(0.02, 0.2, 0.0)];
    let scene = scene_with_box(Space::Plane, &[grasp(1.0)], &starts, SIZE);
    let script = Script::new(&scene, HostIndex::FIRST, None);
    let approaches = |pose: Pose| {
        let state = script.begin(0, &touches(&starts), &[pose]);
        [state.fingers[0].approach, state.fingers[1].approach]
    };
    assert_eq!(approaches(Pose::default()), [DVec3::X, DVec3::NEG_Y]);
    let turned = Pose { position: DVec3::ZERO, orientation: DQuat::from_rotation_z(0.2) };
    let expected =
        [DVec3::new(0.2_f64.cos(), 0.2_f64.sin(), 0.0), DVec3::new(0.2_f64.sin(), -0.2_f64.cos(), 0.0)];
    for (found, expected) in approaches(turned).into_iter().zip(expected) {
        assert!((found - expected).length() < 1e-15, "{found}");
    }
    let scene = edited(&scene, |scene| {
        let shape = &mut scene.bodies[0].shape;
        (shape.kind, shape.radius_m) = (cotouch_scene::scene::ShapeKind::Ball, 0.05);
    });
    let state = Script::new(&scene, HostIndex::FIRST, None).begin(0, &touches(&starts), &[Pose::default()]);
    assert!((state.fingers[1].approach + starts[1].normalize()).length() < 1e-15, "a ball: to its centre");
}

#[test]
fn a_grasp_that_finds_nothing_ends_in_time_and_stays() {
    let brief = Action::Grasp { body: "box".into(), force_n: 2.0, speed_m_per_s: 0.1, duration_s: 0.4 };
    let scene = scene_with_box(Space::Plane, &[brief, hold(5.0)], &SIDES, SIZE);
    let mut user = user(&scene);
    let nothing = |readings: &Readings| readings.iter().map(|_| Wrench::default()).collect();
    for k in 0..3000 {
        tick(&mut user, k, &[Pose::default()], nothing);
    }
    // 0.4 s at 0.1 m/s less half of the 0.2 s of setting off.
    for (finger, x) in user.states().iter().zip([-0.07, 0.07]) {
        assert!((finger.position.x - x).abs() < 0.003 && finger.velocity.length() < 1e-6, "{finger:?}");
    }
}

#[test]
fn what_is_carried_and_turned_keeps_its_grip_and_letting_go_opens_across_the_faces() {
    let actions = [
        grasp(2.0),
        Action::Carry { by_m: DVec3::new(0.02, 0.03, 0.0), duration_s: 0.5 },
        Action::CarryTo { to_m: DVec3::new(-0.01, 0.0, 0.0), duration_s: 0.5 },
        Action::Turn { angle_rad: 0.5, duration_s: 0.5 },
        hold(0.5),
        Action::LetGo { distance_m: 0.03, duration_s: 0.5 },
        hold(1.0),
    ];
    let starts = [DVec3::new(-0.1, 0.0, 0.0), DVec3::new(0.1, 0.0, 0.0)];
    let mut user = user(&scene_with_box(Space::Plane, &actions, &starts, SIZE));
    let mut pose = Pose::default();
    let (mut most_apart, mut changed_when_settled): (f64, f64) = (0.0, 0.0);
    for k in 0..7000 {
        let mut velocity = DVec3::ZERO;
        if (1..=4).contains(&action(&user)) {
            // The box is where the fingers are: between them, turned as they are.
            let [a, b] = [0, 1].map(|finger| user.states()[finger].position);
            let pressed = user.states().iter().map(|state| state.held_force.length());
            for force in pressed {
                most_apart = most_apart.max((force - 2.0).abs());
                if action(&user) > 1 {
                    changed_when_settled = changed_when_settled.max((force - 2.0).abs());
                }
            }
            velocity = 0.5 * (user.states()[0].velocity + user.states()[1].velocity);
            pose.position = 0.5 * (a + b);
            pose.orientation = DQuat::from_rotation_z((b - a).y.atan2((b - a).x));
        }
        tick(&mut user, k, &[pose], |readings| {
            readings.iter().map(|reading| pressed(reading, &pose, velocity)).collect()
        });
    }
    // Fingers of 0.25 kg that run into 2000 N/m at 0.1 m/s press by up to 2.2 N more for a moment.
    assert!(most_apart < 1.2, "the grip changed by {most_apart} N");
    assert!(changed_when_settled < 0.1, "the grip changed by {changed_when_settled} N");
    let angle = 2.0 * pose.orientation.z.asin();
    assert!((angle - 0.5).abs() < 0.01, "turned by {angle}");
    assert!((pose.position - DVec3::new(-0.01, 0.0, 0.0)).length() < 1e-3, "{}", pose.position);
    for (state, side) in user.states().iter().zip([-1.0, 1.0]) {
        let at = pose.to_local(state.position);
        let back = DVec3::X * (side * (0.5 * SIZE.x + 0.03));
        assert!((at - back).length() < 2e-3, "{at} instead of {back}");
    }
}

fn touches(positions: &[DVec3]) -> Vec<Touch> {
    positions.iter().map(|&position| Touch { position, rest: position, felt: DVec3::ZERO }).collect()
}

#[test]
fn a_hand_over_ends_when_half_of_the_load_is_gone() {
    let actions = [hold(1.0), Action::HandOver { duration_s: 4.0 }, hold(1.0)];
    let mut scene = scene_with_box(Space::Space, &actions, &SIDES, SIZE);
    scene = edited(&scene, |scene| scene.gravity_m_per_s2 = DVec3::new(0.0, 0.0, -9.81));
    let script = Script::new(&scene, HostIndex::FIRST, None);
    let run = |relieved_at: u64| {
        let mut touches = touches(&SIDES);
        let mut state = script.begin(0, &touches, &[Pose::default()]);
        (0..10_000).find(|&k| {
            let load = if k < relieved_at { 1.0 } else { 0.2 };
            touches.iter_mut().for_each(|touch| touch.felt = DVec3::new(3.0, 1.0, -load));
            script.drive(&mut state, k, &touches, &[Pose::default()]);
            state.action == 2
        })
    };
    // 0.2 + 0.8·e^{−t/τ} = 0.5.
    let expected = 2000 + (0.05 * (0.8_f64 / 0.3).ln() * 1e3) as u64;
    let ended = run(2000).unwrap();
    assert!(ended.abs_diff(expected) <= 2, "{ended} {expected}");
    assert_eq!(run(9000), Some(5000), "nobody takes it");
    scene = edited(&scene, |scene| scene.gravity_m_per_s2 = DVec3::ZERO);
    let weightless = Script::new(&scene, HostIndex::FIRST, None);
    let mut state = weightless.begin(0, &touches(&SIDES), &[]);
    let ended = (0..10_000).find(|&k| {
        weightless.drive(&mut state, k, &touches(&SIDES), &[]);
        state.action == 2
    });
    assert_eq!(ended, Some(5000), "no weight is handed over");
}

#[test]
fn people_wait_for_the_same_instant() {
    let actions =
        [hold(0.3), Action::WaitUntil { until_s: 0.75 }, Action::WaitUntil { until_s: 0.2 }, hold(1.0)];
    let script = Script::new(&scene_of(&actions, &[DVec3::ZERO]), HostIndex::FIRST, None);
    let mut state = script.begin(100, &touches(&[DVec3::ZERO]), &[]);
    for k in 100..2000 {
        script.drive(&mut state, k, &touches(&[DVec3::ZERO]), &[]);
        let expected = match k {
            ..400 => 0,
            400..750 => 1,
            750..1750 => 3,
            _ => 4,
        };
        assert_eq!(state.action, expected, "{k}");
    }
}

#[test]
fn a_push_is_shared_and_fades() {
    let force_n = DVec3::new(3.0, -1.0, 0.0);
    let actions = [Action::Push { force_n, duration_s: 1.0 }, hold(1.0)];
    let script = Script::new(&scene_with_box(Space::Plane, &actions, &SIDES, SIZE), HostIndex::FIRST, None);
    let mut state = script.begin(0, &touches(&SIDES), &[]);
    let mut last = DVec3::ZERO;
    for k in 0..1500 {
        let drives = script.drive(&mut state, k, &touches(&SIDES), &[]);
        let sum: DVec3 = drives.iter().map(|drive| drive.force).sum();
        assert_eq!(drives[0].force, drives[1].force);
        assert!((sum - last).length() < force_n.length() * 1.9 / 200.0);
        if (200..=800).contains(&k) {
            assert_eq!(sum, force_n);
        }
        last = sum;
    }
    assert_eq!(last, DVec3::ZERO);
}

#[test]
fn several_fingers_reach_alike_and_one_may_have_its_own_script() {
    let to_m = DVec3::new(0.0, 0.05, 0.0);
    let mut scene =
        scene_with_box(Space::Plane, &[Action::Reach { to_m, duration_s: 0.5 }, hold(9.0)], &SIDES, SIZE);
    let extra = scene.users[0].fingers[0].clone();
    scene = edited(&scene, |scene| {
        scene.users[0].fingers.insert(1, extra);
        scene.users[0].fingers[1].script = vec![Action::Force { force_n: DVec3::Y, duration_s: 0.1 }];
    });
    let mut user = user(&scene);
    for k in 0..4000 {
        tick(&mut user, k, &[], |readings| readings.iter().map(|_| Wrench::default()).collect());
    }
    let [first, own, third] = [0, 1, 2].map(|finger| user.states()[finger].position);
    assert!((first - to_m).length() < 1e-6, "{first}");
    assert!((third - (SIDES[1] + to_m - SIDES[0])).length() < 1e-6, "{third}");
    assert!(own.y > SIDES[0].y + 0.001 && own.x == SIDES[0].x, "{own}: pushed, and tracks nothing");
}

#[test]
fn a_moved_user_sees_and_acts_in_the_moved_world() {
    use cotouch_device::Device;
    let scene = scene_with_box(Space::Plane, &[grasp(2.0), hold(10.0)], &SIDES, SIZE);
    let (mut there, mut moved) = (user(&scene), user(&scene));
    let by = DVec3::new(0.25, 0.5, 0.0);
    moved.recentre(SIDES[0] + by);
    let (here_pose, moved_pose) = (Pose::default(), Pose::at(by));
    for k in 0..2000 {
        tick(&mut there, k, &[here_pose], |readings| on_box(readings, &here_pose));
        tick(&mut moved, k, &[moved_pose], |readings| on_box(readings, &moved_pose));
    }
    assert_eq!(action(&there), 1);
    assert_eq!(action(&moved), 1);
    for (one, other) in there.states().iter().zip(moved.states()) {
        assert!((one.position - other.position).length() < 1e-9);
    }
    let reading = moved.read(2000).unwrap()[0].pose.position;
    assert!((reading - by - moved.states()[0].position).length() < 1e-15);
}

fn any_vector() -> impl Strategy<Value = DVec3> {
    (-0.1..0.1, -0.1..0.1, -0.1..0.1_f64).prop_map(DVec3::from)
}

fn any_action() -> impl Strategy<Value = Action> {
    let duration = || 0.15..0.8_f64;
    let timed = (any_vector(), duration(), 0..14_usize, -1.0..1.0_f64);
    timed.prop_map(|(vector, duration_s, kind, number)| match kind {
        0 => Action::Relax { duration_s },
        1 => Action::Hold { duration_s },
        2 => Action::Reach { to_m: vector, duration_s },
        3 => Action::Sinusoid {
            amplitude_m: 0.3 * vector,
            frequency_hz: 1.001 + number,
            phase_rad: number,
            duration_s,
        },
        4 => Action::Force { force_n: vector, duration_s },
        5 | 6 => Action::Grasp {
            body: "box".into(),
            force_n: 1.0,
            speed_m_per_s: 0.1 + 0.05 * number,
            duration_s: 2.0 * duration_s,
        },
        7 => Action::Carry { by_m: vector, duration_s },
        8 => Action::CarryTo { to_m: vector, duration_s },
        9 => Action::Lift { height_m: vector.x, duration_s },
        10 => Action::Turn { angle_rad: number, duration_s },
        11 => Action::HandOver { duration_s },
        12 => Action::LetGo { distance_m: 0.001 + vector.y.abs(), duration_s },
        _ => Action::Push { force_n: vector, duration_s },
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever is felt and seen: between ticks targets follow their own velocity and acceleration.
    #[test]
    fn targets_never_jump(
        actions in prop::collection::vec(any_action(), 1..8),
        places in prop::collection::vec((any_vector(), any_vector()), 20),
        loads in prop::collection::vec(-2.0..2.0_f64, 20),
    ) {
        let scene = edited(&scene_with_box(Space::Space, &actions, &SIDES, SIZE), |scene| {
            scene.gravity_m_per_s2 = DVec3::new(0.0, 0.0, -9.81);
            scene.users[0].repeat = true;
        });
        let script = Script::new(&scene, HostIndex::FIRST, None);
        let pose = |k: u64| Pose {
            position: places[k as usize / 97 % 20].0 * 0.1,
            orientation: DQuat::from_scaled_axis(places[k as usize / 97 % 20].1 * 5.0),
        };
        let mut touches = touches(&SIDES);
        let mut state: ScriptState = script.begin(0, &touches, &[pose(0)]);
        let mut last: Option<Vec<Target>> = None;
        for k in 0..4000 {
            let drives = script.drive(&mut state, k, &touches, &[pose(k)]);
            let targets: Vec<Target> = drives.iter().map(|drive: &Drive| drive.target).collect();
            for (now, before) in targets.iter().zip(last.iter().flatten()) {
                let ahead = before.position + before.velocity * 1e-3 + before.acceleration * 0.5e-6;
                prop_assert!((now.position - ahead).length() < 5e-5, "{k}: {before:?} {now:?}");
                let ahead = before.velocity + before.acceleration * 1e-3;
                prop_assert!((now.velocity - ahead).length() < 0.05, "{k}: {before:?} {now:?}");
            }
            for (finger, (touch, target)) in touches.iter_mut().zip(&targets).enumerate() {
                touch.position = target.position + places[finger].0 * 0.05;
                touch.felt = places[k as usize / 61 % 20].0 * 20.0 * loads[k as usize / 200 % 20];
            }
            last = Some(targets);
        }
        prop_assert_eq!(script.tracking().stiffness_n_per_m > 0.0, actions.iter().any(Action::tracks));
        prop_assert_eq!(TRACKING.stiffness_n_per_m, 500.0);
    }
}
