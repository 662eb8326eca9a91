//! Fingers on soft bodies: how they meet, press, slide and come off, and what the simulation is told of it.

use crate::common::{BLOCK, Rig, SPRING, scene};
use cotouch_host::{ContactSurface, HostModel, HostState};
use cotouch_net::{Entry, StatePacket};
use cotouch_scene::geometry::{Pose, Reading, Readings, Twist};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::LocalModelKind;
use cotouch_testkit::scenes::local_model_kinds;
use cotouch_world::local::{LawClock, local_law};
use glam::{DVec3, Vec3Swizzles as _};

const RADIUS_M: f64 = 0.005;
const N: u64 = 50;

/// A finger so deep in the spring.
fn deep(depth_m: f64) -> DVec3 {
    DVec3::X * (depth_m - RADIUS_M)
}

fn hold(rig: &mut Rig, finger: DVec3, ticks: u64) -> DVec3 {
    let mut force = DVec3::ZERO;
    for _ in 0..ticks {
        force = rig.tick(finger);
    }
    force
}

#[test]
fn a_spring_gives_way_as_eq_5_says() {
    let mut rig = Rig::new(&scene(SPRING, &[]));
    rig.tick(deep(-0.001));
    let force = hold(&mut rig, deep(0.01), 40 * N);
    let (kh, ko) = (100.0, 200.0);
    assert!((force.x + kh * ko / (kh + ko) * 0.01).abs() < 1e-9, "{force}");
    assert!((rig.anchor(0).x - kh / (kh + ko) * 0.01).abs() < 1e-11);
    let contact = rig.output.contacts[0];
    assert_eq!(contact.surface, ContactSurface::Soft);
    assert!((contact.depth_m - ko / (kh + ko) * 0.01).abs() < 1e-11);
}

#[test]
fn gains_above_ko_shake_and_gains_below_do_not() {
    // (4) is K_h < K_o with the mean returned.
    let last_change = |ratio: &str| {
        let sides = "local_model.sides=two";
        let mut rig = Rig::new(&scene(SPRING, &[&format!("local_model.stiffness_ratio={ratio}"), sides]));
        let before = hold(&mut rig, deep(0.001), 60 * N);
        (hold(&mut rig, deep(0.001), N) - before).length()
    };
    assert!(last_change("0.95") < 0.2 * last_change("1.0") && last_change("1.05") > 5.0 * last_change("1.0"));
}

#[test]
fn a_finger_that_leaves_is_let_go_and_never_pulled() {
    let mut rig = Rig::new(&scene(SPRING, &[]));
    rig.tick(deep(-0.01));
    let mut last = 0.0;
    for step in 0..4000 {
        // In by 10 mm and out again.
        let depth_m = 0.01 * (1.0 - (f64::from(step) * std::f64::consts::TAU / 2000.0).cos()) - 0.005;
        let force = rig.tick(deep(depth_m));
        assert!(force.x <= 0.0 && force.yz().length() < 1e-12, "{step}: {force}");
        // Jumps come from results of the simulation alone.
        let is_result = rig.tick % N == 1;
        assert!(is_result || (force.x - last).abs() < 100.0 * 5e-5, "{step}: {last} {force}");
        last = force.x;
    }
    assert!(!rig.state.soft.contacts[0].touching && last == 0.0);
}

const PI: [&str; 3] =
    ["local_model.kind=pi", "local_model.stiffness_ratio=0.3", "local_model.integral_ratio=0.2"];

#[test]
fn the_integral_leaves_the_entry_threshold_and_drains_linearly() {
    let mut rig = Rig::new(&scene(SPRING, &PI));
    rig.tick(deep(-0.001));
    hold(&mut rig, deep(0.01), 300 * N);
    let surface_m = rig.anchor(0).x;
    assert!((0.01 - surface_m - 2e-4).abs() < 1e-8, "(10): what stays is theta_2: {surface_m}");
    let pressed = rig.state.soft.contacts[0].force;
    assert!((pressed.x + 200.0 * surface_m).abs() < 1e-8);
    let mut expected = None;
    for tick in 0..150_u32 {
        let force = rig.tick(deep(-0.005));
        let first: DVec3 = *expected.get_or_insert(force);
        assert!((first - pressed).length() < 1e-6, "nothing jumps: {first} {pressed}");
        let share = (1.0 - f64::from(tick) / 100.0).max(0.0);
        assert!((force - first * share).length() < 1e-9, "{tick}: {force}");
        // The body feels the same.
        if let Some(input) = &rig.output.slow {
            let told = input.contacts[0];
            assert!(told.anchor.is_some() == (told.force_n.x > 0.0));
        }
    }
    hold(&mut rig, deep(-0.005), 2 * N);
    assert_eq!(rig.slow.body().state().positions_m[0].x, 0.0);
}

#[test]
fn going_out_the_exit_threshold_counts() {
    let mut rig = Rig::new(&scene(SPRING, &PI));
    rig.tick(deep(-0.001));
    hold(&mut rig, deep(0.01), 300 * N);
    let before = rig.state.soft.contacts[0].integral_n;
    // The finger stays where it is and says that it goes out, or in, slowly.
    let per_tick = 0.2 * 200.0 / N as f64;
    for (velocity, threshold_m) in [(-0.1, 5e-4), (0.1, 2e-4)] {
        let mut rig = rig.clone();
        rig.tick_with([Reading::point(deep(0.01), DVec3::X * velocity)].into_iter().collect());
        let change = rig.state.soft.contacts[0].integral_n - before;
        assert!((change - per_tick * (2e-4 - threshold_m)).abs() < 1e-8, "{change}");
    }
}

#[test]
fn a_first_order_hold_does_not_jump() {
    let largest_jump = |hold: &str| {
        let hold = format!("local_model.hold={hold}");
        let mut rig = Rig::new(&scene(SPRING, &[&hold]));
        rig.tick(deep(0.0));
        let mut last = 0.0;
        let mut jump = 0.0_f64;
        for tick in 0..1000 {
            let force = rig.tick(deep(1e-5 * f64::from(tick)));
            jump = jump.max((force.x - last).abs());
            last = force.x;
        }
        jump
    };
    // The hand moves by 10 µm a tick and K_h is 100 N/m.
    assert!(largest_jump("first") < 2.1e-3, "{}", largest_jump("first"));
    assert!(largest_jump("zero") > 1e-2, "{}", largest_jump("zero"));
}

#[test]
fn with_the_compliance_the_answer_is_there_before_the_simulation_gives_it() {
    let overrides =
        ["local_model.kind=compliance", "local_model.stiffness_ratio=5", "local_model.returned_force=last"];
    let mut rig = Rig::new(&scene(SPRING, &overrides));
    rig.tick(deep(-0.001));
    let expected = -1.0 / (1.0 / 1000.0 + 1.0 / 200.0) * 0.01;
    for tick in 0..10 * N {
        let force = rig.tick(deep(0.01));
        assert!((force.x - expected).abs() < 1e-9, "{tick}: {force}");
    }
    // And it lets go.
    assert_eq!(hold(&mut rig, deep(-0.003), 2 * N), DVec3::ZERO);
    assert!(!rig.state.soft.contacts[0].touching);
}

#[test]
fn the_estimate_finds_the_springs_stiffness() {
    let mut rig = Rig::new(&scene(SPRING, &["local_model.stiffness_from=estimate"]));
    let ko = |rig: &Rig| rig.state.soft.frame.as_ref().unwrap().ko_n_per_m;
    assert!((ko(&rig) - 200.0).abs() < 1.0, "{}", ko(&rig));
    rig.tick(deep(-0.001));
    hold(&mut rig, deep(0.01), 20 * N);
    assert!((ko(&rig) - 200.0).abs() < 1.0, "{}", ko(&rig));
}

/// On the block's top, pressed, then moved along x: in every tick the normal that it began with, and the force.
fn drawn(rig: &mut Rig, depth_m: f64, far_m: f64) -> Vec<(DVec3, DVec3)> {
    let top = 0.04 + RADIUS_M;
    let mut forces = Vec::new();
    let from = DVec3::new(0.025, 0.042, top);
    let mut tick = |finger: DVec3| {
        let before = rig.state.soft.contacts[0];
        let force = rig.tick(finger);
        if before.touching && rig.state.soft.contacts[0].touching {
            forces.push((before.normal, force));
        }
    };
    for at in 0..400 {
        tick(from - DVec3::Z * depth_m * f64::from(at) / 400.0);
    }
    for at in 0..1000 {
        tick(from + DVec3::X * far_m * f64::from(at) / 1000.0 - DVec3::Z * depth_m);
    }
    forces
}

#[test]
fn friction_keeps_to_its_cone_and_fingers_slide() {
    // A force that is held does not keep to the cone.
    let ticks = |kind: &&LocalModelKind| local_law(**kind).clock() == LawClock::Tick;
    for kind in LocalModelKind::ALL.iter().filter(ticks) {
        // Under a small threshold the integral brings the finger to the surface, and the next result may take it off.
        let (kind_is, thresholds) = (
            format!("local_model.kind={kind}"),
            ["local_model.entry_threshold_m=0.002", "local_model.exit_threshold_m=0.003"],
        );
        let mut rig = Rig::new(&scene(BLOCK, &[&kind_is, thresholds[0], thresholds[1]]));
        let forces = drawn(&mut rig, 0.004, 0.03);
        assert!(forces.len() > 1300, "{kind}: it touches: {}", forces.len());
        let mut slid = 0;
        for (normal, force) in &forces {
            let push = force.dot(*normal);
            let along = force.reject_from(*normal).length();
            assert!(push >= 0.0 && along <= 0.5 * push + 1e-9, "{kind}: {force} on {normal}");
            slid += u32::from(along > 0.499 * push && push > 0.0);
        }
        assert!(slid > 100, "{kind}: {slid}");
        let moved_m = rig.anchor(0).x - 0.025;
        assert!(moved_m > 0.015, "{kind}: the anchor follows: {moved_m}");
        assert!(forces.last().unwrap().1.x < 0.0, "{kind}");
    }
}

#[test]
fn without_friction_nothing_holds_along_the_surface() {
    let mut rig = Rig::new(&scene(BLOCK, &["local_model.friction=0"]));
    let forces = drawn(&mut rig, 0.002, 0.02);
    for (normal, force) in forces {
        assert!(
            force.reject_from(normal).length() <= 1e-9 && force.dot(normal) >= 0.0,
            "{force} on {normal}"
        );
    }
}

fn hand(step: u64, finger: DVec3) -> StatePacket {
    let pose = Pose { position: finger, ..Pose::default() };
    StatePacket {
        step,
        entries: [Entry::Hand { point: 0, pose, twist: Twist::default() }].into_iter().collect(),
    }
}

fn coupled(rig: &mut Rig, peer: HostIndex, finger: DVec3) {
    rig.state.set_present(peer, true);
    rig.state.peers[peer.index()].fade = 1.0;
    rig.model.receive(&mut rig.state, peer, &hand(0, finger));
    rig.model.play_out(&mut rig.state, 0);
}

#[test]
fn a_server_returns_the_force_that_its_tick_finds() {
    for kind in local_model_kinds() {
        let kind = format!("local_model.kind={kind}");
        let overrides = [kind.as_str(), "session.architecture=centralized", "link.delay_periods=0"];
        let mut rig = Rig::new(&scene(BLOCK, &overrides));
        let other = DVec3::new(0.055, 0.038, 0.04 + RADIUS_M - 0.0009);
        coupled(&mut rig, HostIndex(1), other);
        for tick in 0..200 {
            let depth_m = 1e-5 * f64::from(tick);
            let own = Reading::point(DVec3::new(0.025, 0.042, 0.04 + RADIUS_M - depth_m), DVec3::ZERO);
            let own: Readings = [own].into_iter().collect();
            rig.begin();
            let step = rig.model.step_due(&rig.state, rig.tick);
            let told = step.and_then(|step| rig.model.respond(&rig.state, step, &own, HostIndex(1)));
            rig.finish(&own);
            let Some(told) = told else { continue };
            let force = told.entries.iter().find_map(|entry| match entry {
                Entry::Force { wrench, .. } => Some(wrench.force),
                Entry::Hand { .. } | Entry::Object { .. } | Entry::Channel { .. } => None,
            });
            let found = rig.state.soft.contacts[1].force;
            assert_eq!(force, Some(found), "{kind} at tick {tick}");
        }
        assert!(rig.state.soft.contacts[1].force.z > 0.01, "{kind}");
    }
}

#[test]
fn one_user_feels_what_another_does_to_the_body() {
    let scene = scene(BLOCK, &["link.delay_periods=0"]);
    let mine = DVec3::new(0.035, 0.04, 0.04 + RADIUS_M - 0.001);
    let press = |depth_m: f64| {
        let mut rig = Rig::new(&scene);
        coupled(&mut rig, HostIndex(1), DVec3::new(0.045, 0.04, 0.04 + RADIUS_M - depth_m));
        rig.tick(mine + DVec3::Z * 0.002);
        (0..1000).map(|_| rig.tick(mine)).last().unwrap().z
    };
    let (alone, together) = (press(-0.01), press(0.001));
    assert!(together < 0.9 * alone, "the other makes way for the finger: {together} of {alone}");
}

#[test]
fn a_peer_that_fades_counts_for_less() {
    let mut rig = Rig::new(&scene(BLOCK, &["link.delay_periods=0"]));
    coupled(&mut rig, HostIndex(1), DVec3::new(0.055, 0.038, 0.04 + RADIUS_M - 0.0009));
    rig.tick(DVec3::splat(0.2));
    rig.state.peers[1].going = true;
    rig.state.peers[1].present = false;
    for _ in 0..99 {
        rig.tick(DVec3::splat(0.2));
    }
    let fade = rig.state.peers[1].fade;
    assert!(fade > 0.1 && fade < 0.9, "{fade}");
    let force = rig.state.soft.contacts[1].force;
    assert!(force.z > 0.0 && rig.output.contacts[0].force == fade * force);
    // The simulation gets as much, of every tick of the period.
    let told = rig.output.slow.as_ref().unwrap().contacts[1].force_n;
    assert!(told.z < -fade * 0.8 * force.z && told.z > -(fade + 0.1) * 1.2 * force.z, "{told} {force}");
}

#[test]
fn readings_that_are_no_numbers_stop_the_world_and_nothing_else() {
    let mut rig = Rig::new(&scene(SPRING, &[]));
    rig.tick(deep(0.001));
    assert_eq!(rig.tick(DVec3::NAN), DVec3::ZERO);
    assert!(rig.output.diverged && rig.state.diverged);
    let mut rig = Rig::new(&scene(SPRING, &[]));
    hold(&mut rig, DVec3::X * 1e7, 10);
    hold(&mut rig, DVec3::X * -1e9, 10);
    assert!(rig.slow.body().state().positions_m.iter().all(|node| node.is_finite()));
}

#[test]
fn without_a_frame_there_is_no_force_and_a_client_has_no_body() {
    let spring = scene(SPRING, &[]);
    let model = HostModel::new(&spring, HostIndex::FIRST);
    let mut state = HostState::new(&model);
    let readings: Readings = [Reading::point(deep(0.01), DVec3::ZERO)].into_iter().collect();
    let output = model.tick(&mut state, 0, &readings);
    assert!(output.device[0].force == DVec3::ZERO && output.slow.is_none());
    let block = scene(BLOCK, &["session.architecture=centralized"]);
    let client = HostModel::new(&block, HostIndex(1));
    assert!(!client.has_soft_body() && HostModel::new(&block, HostIndex::FIRST).has_soft_body());
    assert_eq!(client.frame_due(100), None);
}

#[test]
fn a_tick_that_was_left_out_does_not_leave_out_a_period() {
    let mut rig = Rig::new(&scene(SPRING, &["local_model.result_delay_periods=1"]));
    rig.tick(deep(-0.001));
    hold(&mut rig, deep(0.01), N - 2);
    assert!(rig.output.slow.is_none());
    // The last tick of period 0 is left out.
    rig.tick += 1;
    rig.tick(deep(0.01));
    let input = rig.output.slow.clone().unwrap();
    assert_eq!(input.period, 0);
    assert!(input.contacts[0].force_n.x > 0.9);
    hold(&mut rig, deep(0.01), N - 1);
    assert_eq!(rig.output.slow.as_ref().unwrap().period, 1);
}

#[test]
fn a_frame_that_was_moved_moves_the_force_by_k_h() {
    let mut rig = Rig::new(&scene(SPRING, &["local_model.sides=two"]));
    hold(&mut rig, deep(0.01), 30 * N + 10);
    let force_with = |by: DVec3| {
        let mut rig = rig.clone();
        let frame = rig.state.soft.frame.clone().unwrap();
        let positions_m = frame.positions_m.iter().map(|node| *node + by).collect();
        rig.state.soft.frame = Some(std::sync::Arc::new(frame.moved_to(positions_m).unwrap()));
        rig.tick(deep(0.01))
    };
    let by = DVec3::new(1e-5, -2e-5, 3e-5);
    assert!((force_with(by) - force_with(DVec3::ZERO) - 100.0 * by).length() < 1e-12);
    let frame = rig.slow.rest_frame();
    assert!(frame.moved_to(vec![DVec3::ZERO]).is_err());
    assert_eq!(
        frame.moved_to(frame.positions_m.clone()).unwrap().surface.generation(),
        frame.surface.generation()
    );
}

#[test]
fn frames_may_come_late_and_two_at_a_time() {
    let mut rig = Rig::new(&scene(BLOCK, &["local_model.hold=first"]));
    let finger = |tick: u64| DVec3::new(0.025, 0.042, 0.06 - 4e-5 * tick.min(500) as f64);
    let readings =
        |tick: u64| -> Readings { [Reading::point(finger(tick), DVec3::ZERO)].into_iter().collect() };
    let mut frames = Vec::new();
    for tick in 0..1000 {
        // Nothing comes for a tenth of a second; then all of it, in the middle of a period.
        if tick % 100 == 57 {
            for frame in frames.drain(..) {
                rig.model.take_frame(&mut rig.state, tick, frame);
            }
        }
        rig.model.tick_into(&mut rig.state, tick, &readings(tick), &mut rig.output);
        assert!(rig.output.device[0].force.is_finite() && rig.output.device[0].force.length() < 5.0);
        frames.extend(rig.output.slow.as_ref().map(|input| rig.slow.step(input)));
    }
    assert!(rig.state.soft.contacts[0].touching && rig.output.device[0].force.z > 0.05);
}
