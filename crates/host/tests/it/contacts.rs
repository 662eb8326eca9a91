//! Fingers that touch a box: what comes of it at a host, and what a server tells its clients.

use cotouch_host::{ContactPoint, ContactSurface, HostModel, HostState};
use cotouch_net::{Entry, StatePacket};
use cotouch_scene::geometry::{Pose, Reading, Readings, Twist};
use cotouch_scene::names::{Coordinate, HostIndex};
use cotouch_scene::scene::Scene;
use cotouch_testkit::built_in;
use cotouch_world::Phase;
use glam::{DQuat, DVec3};

const CLIENT: HostIndex = HostIndex(1);

fn grasp(overrides: &[&str]) -> Scene {
    built_in("grasp", overrides)
}

/// The fingers of a user, each pressed so deep into the side of the box that it is at.
fn pressed(scene: &Scene, host: HostIndex, depth_m: f64) -> Readings {
    let reach = 0.5 * scene.object.shape.size_m.y + scene.hand.finger_radius_m - depth_m;
    let fingers = scene.users[host.index()].fingers.iter();
    let place = |position: DVec3| position.with_y(position.y.signum() * reach);
    fingers.map(|finger| Reading::point(place(finger.position_m), DVec3::ZERO)).collect()
}

fn packet(step: u64, readings: &Readings) -> StatePacket {
    let hand =
        |(point, reading): (u8, &Reading)| Entry::Hand { point, pose: reading.pose, twist: reading.twist };
    StatePacket { step, entries: (0..).zip(readings).map(hand).collect() }
}

/// A host to which `peer` is fully coupled, with nothing of it held yet.
fn coupled(model: &HostModel, peer: HostIndex) -> HostState {
    let mut state = HostState::new(model);
    state.set_present(peer, true);
    state.peers[peer.index()].fade = 1.0;
    state
}

fn forces(packet: &StatePacket) -> Vec<DVec3> {
    let force = |entry: &Entry| match entry {
        Entry::Force { wrench, .. } => Some(wrench.force),
        Entry::Hand { .. } | Entry::Object { .. } | Entry::Channel { .. } => None,
    };
    packet.entries.iter().filter_map(force).collect()
}

/// A server that holds what `client` sampled at step 0.
fn server(scene: &Scene, client: &Readings) -> (HostModel, HostState) {
    let model = HostModel::new(scene, HostIndex::FIRST);
    let mut state = coupled(&model, CLIENT);
    model.receive(&mut state, CLIENT, &packet(0, client));
    model.play_out(&mut state, 0);
    (model, state)
}

const CENTRALIZED: [&str; 2] = ["session.architecture=centralized", "link.delay_periods=0"];

#[test]
fn a_server_returns_the_force_that_its_tick_finds() {
    let scene = grasp(&CENTRALIZED);
    let own = pressed(&scene, HostIndex::FIRST, -0.01);
    let (model, mut state) = server(&scene, &pressed(&scene, CLIENT, 2e-3));
    for tick in 0..8 {
        let told = forces(&model.respond(&state, 0, &own, CLIENT).unwrap());
        let output = model.tick(&mut state, tick, &own);
        let found: Vec<DVec3> = output.contacts.iter().map(|contact| contact.force).collect();
        assert_eq!(told, found);
        let sides: Vec<f64> = told.iter().map(|force| force.y).collect();
        assert!(sides[0] < -1.0 && sides[1] > 1.0, "both fingers are pushed out: {sides:?}");
        assert!(output.device.iter().all(|wrench| wrench.force == DVec3::ZERO), "the own fingers are free");
    }
}

#[test]
fn while_it_sticks_the_returned_force_is_linear_in_sample_and_body() {
    let scene = grasp(&CENTRALIZED);
    let own = pressed(&scene, HostIndex::FIRST, -0.01);
    let held = pressed(&scene, CLIENT, 2e-3);
    let (model, mut state) = server(&scene, &held);
    for tick in 0..4 {
        model.tick(&mut state, tick, &own);
    }
    let force_with = |by: f64| {
        let mut state = state.clone();
        for name in [
            "host1.held.host2.hand.x.age1",
            "host1.held.host2.hand2.vy.age1",
            "host1.object.y",
            "host1.object.v",
        ] {
            let coordinate: Coordinate = name.parse().unwrap();
            let value = state.coordinate(&model, 1, coordinate).unwrap();
            assert!(state.set_coordinate(&model, 1, coordinate, value + by), "{name}");
        }
        forces(&model.respond(&state, 0, &own, CLIENT).unwrap())
    };
    let (still, once, twice) = (force_with(0.0), force_with(1e-4), force_with(2e-4));
    for finger in 0..2 {
        let (change, double) = (once[finger] - still[finger], twice[finger] - still[finger]);
        assert!(change.length() > 1e-3 && (double - 2.0 * change).length() < 1e-12, "{change} {double}");
    }
}

#[test]
fn turns_are_coordinates_of_bodies_and_of_samples() {
    let scene = grasp(&[]);
    let mut model = HostModel::new(&scene, HostIndex::FIRST);
    let about = DQuat::from_rotation_z(0.4);
    model.about[0] = about;
    let mut state = coupled(&model, CLIENT);
    let object = Entry::Object {
        object: 0,
        pose: Pose { position: DVec3::ZERO, orientation: about },
        twist: Twist::default(),
    };
    model.receive(&mut state, CLIENT, &StatePacket { step: 6, entries: [object].into_iter().collect() });
    state.bodies[0].pose.orientation = about;
    for name in [
        "host1.object.rz",
        "host1.held.host2.object.rz.age1",
        "host1.object.wz",
        "host1.held.host2.object.vy.age1",
    ] {
        let coordinate: Coordinate = name.parse().unwrap();
        assert!(state.coordinate(&model, 7, coordinate).unwrap().abs() < 1e-15, "{name}");
        assert!(state.set_coordinate(&model, 7, coordinate, 1e-5));
        assert!((state.coordinate(&model, 7, coordinate).unwrap() - 1e-5).abs() < 1e-15, "{name}");
    }
    let turned = DQuat::from_rotation_z(0.4 + 1e-5);
    assert!(state.bodies[0].pose.orientation.abs_diff_eq(turned, 1e-15));
    assert_eq!(state.coordinate(&model, 7, "host1.object2.x".parse().unwrap()), None);
}

#[test]
fn a_grasp_at_a_peer_goes_through_its_phases_and_pushes_the_box_alike_from_both_sides() {
    let scene = grasp(&[]);
    let model = HostModel::new(&scene, HostIndex::FIRST);
    let mut state = HostState::new(&model);
    let mut approaching = pressed(&scene, HostIndex::FIRST, 1e-3);
    for reading in &mut approaching {
        reading.twist.linear.y = -2.0 * reading.pose.position.y.signum();
    }
    let resting = pressed(&scene, HostIndex::FIRST, 1e-3);
    let first = model.tick(&mut state, 0, &approaching);
    assert_eq!(first.contacts.len(), 2);
    for (finger, contact) in first.contacts.iter().enumerate() {
        assert_eq!(contact.point, ContactPoint::Finger { host: HostIndex::FIRST, finger: finger as u8 });
        assert_eq!(contact.surface, ContactSurface::Body(0));
        assert!(matches!(contact.phase, Phase::MomentCancellation { .. }), "{contact:?}");
        assert_eq!(contact.force.length(), scene.governor.max_force_n);
        assert_eq!(first.device[finger].force, contact.force);
    }
    let mut last = first;
    for tick in 1..40 {
        last = model.tick(&mut state, tick, &resting);
    }
    assert!(last.contacts.iter().all(|contact| contact.phase == Phase::PreSlide));
    let push = scene.coupling.hand_object.stiffness_n_per_m * 1e-3;
    assert!(last.device.iter().all(|wrench| (wrench.force.y.abs() - push).abs() < 1e-9), "{:?}", last.device);
    assert!(last.wrenches[0].force.length() < 1e-9 && last.wrenches[0].torque.length() < 1e-9);
    // Away again: free, and nothing is left of it.
    let output = model.tick(&mut state, 40, &pressed(&scene, HostIndex::FIRST, -0.1));
    assert!(output.contacts.is_empty() && output.device.iter().all(|wrench| wrench.force == DVec3::ZERO));
    assert!(state.contacts.all.iter().all(|contact| contact.phase == Phase::Free));
}

#[test]
fn a_box_in_a_wall_is_pushed_out_by_its_corners() {
    let scene = grasp(&[]);
    let model = HostModel::new(&scene, HostIndex::FIRST);
    let mut state = HostState::new(&model);
    let away = pressed(&scene, HostIndex::FIRST, -0.5);
    state.bodies[0].pose.position.x = 0.14 - 0.1 + 1e-3;
    let output = model.tick(&mut state, 0, &away);
    assert!(output.touches_wall && output.wrenches[0].force.x < -1.0, "{:?}", output.wrenches);
    let wall = output.contacts[0];
    assert!(matches!(wall.point, ContactPoint::Corner { body: 0, .. }));
    assert_eq!(wall.surface, ContactSurface::Wall(0));
    assert!((wall.depth_m - 1e-3).abs() < 1e-12);
}

#[test]
fn a_hand_that_is_no_number_stops_the_world_and_panics_nowhere() {
    let scene = grasp(&[]);
    let model = HostModel::new(&scene, HostIndex::FIRST);
    let mut state = HostState::new(&model);
    let mut readings = pressed(&scene, HostIndex::FIRST, 1e-3);
    readings[1].pose.position.x = f64::NAN;
    let output = model.tick(&mut state, 0, &readings);
    assert!(output.diverged && output.device.iter().all(|wrench| wrench.force == DVec3::ZERO));
    assert_eq!(state.bodies[0], HostState::new(&model).bodies[0]);
}
