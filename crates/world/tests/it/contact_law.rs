//! The law of a contact that sticks, its pulses and its fading.

use crate::common::{self, T, cuboid, model};
use cotouch_scene::geometry::{Pose, Twist};
use cotouch_world::{Cancellation, ContactModel, ContactState, Phase, Sphere, Surface, touch, touch_plane};
use glam::{DQuat, DVec3};
use proptest::prelude::*;

fn vector(size: f64) -> impl Strategy<Value = DVec3> {
    [-size..size, -size..size, -size..size].prop_map(DVec3::from)
}

fn rough() -> ContactModel {
    ContactModel { static_friction: 1e6, dynamic_friction: 1e6, ..model() }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn on_a_flat_face_it_is_linear_in_the_body_frame(
        position in vector(1.0), turn in vector(3.0), linear in vector(0.05), angular in vector(0.5),
        velocity in vector(0.05), at in vector(0.015), moved in vector(0.002),
    ) {
        let surface = Surface::new(&cuboid(DVec3::splat(0.06)));
        let pose = Pose { position, orientation: DQuat::from_scaled_axis(turn) };
        let twist = Twist { linear, angular };
        let (n, radius_m) = (DVec3::X, 0.01);
        let first = DVec3::new(0.03 + 0.006, at.y, at.z);
        let mut state = ContactState::default();
        let sphere = |local: DVec3| Sphere { centre: pose.to_world(local), velocity, radius_m };
        touch(&rough(), &mut state, &surface, (&pose, &twist), &sphere(first), 0.0).expect("in contact");
        let second = first + moved;
        let now = sphere(second);
        let force = touch(&rough(), &mut state, &surface, (&pose, &twist), &now, 0.0).expect("in contact");

        let anchor = DVec3::new(0.03 + radius_m, first.y, first.z);
        let velocity = velocity - linear - angular.cross(now.centre - position);
        let velocity = pose.orientation.conjugate() * velocity;
        let law = |gain_n: f64, gain_t: f64, x: DVec3| gain_n * n * n.dot(x) + gain_t * (x - n * n.dot(x));
        let expected = -law(2000.0, 1500.0, second - anchor) - law(8.0, 5.0, velocity);
        prop_assert_eq!(force.phase, Phase::PreSlide);
        prop_assert!((pose.orientation * expected - force.force).length() < 1e-9);
        prop_assert!((force.normal - pose.orientation * n).length() < 1e-12);
        prop_assert!((force.depth_m - (radius_m - (second.x - 0.03))).abs() < 1e-12);

        // Action and reaction are on one line: no force and no torque on both together.
        let (on_body, on_sphere) = (force.on_surface(DVec3::ZERO), force.on_sphere(DVec3::ZERO));
        prop_assert!((on_body.force + on_sphere.force).length() < 1e-15);
        prop_assert!((on_body.torque + on_sphere.torque).length() < 1e-12);
        prop_assert_eq!(force.point, now.centre);
    }

    #[test]
    fn it_never_pulls_and_stays_in_the_cone(moves in proptest::collection::vec(vector(0.002), 1..200)) {
        let surface = Surface::new(&cuboid(DVec3::splat(0.06)));
        let (pose, twist) = (Pose::default(), Twist::default());
        let mut state = ContactState::default();
        let mut sphere = Sphere { centre: DVec3::Y * 0.039, velocity: DVec3::ZERO, radius_m: 0.01 };
        for by in moves {
            sphere.centre += by;
            sphere.velocity = by / T;
            if let Some(force) = touch(&model(), &mut state, &surface, (&pose, &twist), &sphere, 0.0) {
                prop_assert!(force.normal_force_n >= 0.0 && force.depth_m > 0.0);
                prop_assert!(force.force.dot(force.normal) >= -1e-12);
                let friction = if force.phase == Phase::Slide { 0.4 } else { 0.5 };
                prop_assert!(force.tangential_force_n <= friction * force.normal_force_n * (1.0 + 1e-12));
            } else {
                prop_assert_eq!(state.phase, Phase::Free);
            }
        }
    }
}

fn hard() -> ContactModel {
    ContactModel { cancellation: Some(Cancellation { max_force_n: 8.0, mass_kg: 0.3 }), ..model() }
}

#[test]
fn as_many_pulses_as_the_law_says() {
    // 0.3 kg · 0.2 m/s / (8 N / 1024 Hz) = 7.68.
    let mut state = ContactState::default();
    let sphere = Sphere { centre: DVec3::Y * 0.0099, velocity: DVec3::new(0.3, -0.2, 0.0), radius_m: 0.01 };
    for left in (1..=7).rev() {
        let force = touch_plane(&hard(), &mut state, &common::floor(), &sphere).expect("in contact");
        assert_eq!(force.phase, Phase::MomentCancellation { pulses_left: left });
        assert_eq!(force.force, DVec3::Y * 8.0);
    }
    let after = touch_plane(&hard(), &mut state, &common::floor(), &sphere).expect("in contact");
    assert!(matches!(after.phase, Phase::PreSlide | Phase::Slide));
    assert!((after.normal_force_n - (2000.0 * 0.0001 + 8.0 * 0.2)).abs() < 1e-12);
    // Of what meets a body only the reduced mass counts: 0.3 kg against 0.1 kg is 0.075 kg.
    assert_eq!(hard().pulses(0.2, 0.0), 7);
    assert_eq!(hard().pulses(0.2, 10.0), 1);
    assert_eq!(hard().pulses(-0.2, 0.0), 0);
    assert_eq!(hard().pulses(f64::NAN, 0.0), 0);
    assert_eq!(model().pulses(0.2, 0.0), 0);
}

#[test]
fn pulses_stop_a_device_without_turning_it_round() {
    let mut state = ContactState::default();
    let mut sphere = Sphere { centre: DVec3::Y * 0.0099, velocity: DVec3::Y * -0.2, radius_m: 0.01 };
    loop {
        let force = touch_plane(&hard(), &mut state, &common::floor(), &sphere).expect("in contact");
        if !matches!(force.phase, Phase::MomentCancellation { .. }) {
            break;
        }
        sphere.velocity += force.force / 0.3 * T;
        sphere.centre += sphere.velocity * T;
    }
    let left = -sphere.velocity.y;
    assert!((0.0..8.0 / 0.3 * T).contains(&left), "{left}");
}

#[test]
fn contact_ends_when_the_sphere_leaves_and_begins_anew() {
    let mut state = ContactState::default();
    let at = |x: f64, y: f64| Sphere { centre: DVec3::new(x, y, 0.0), velocity: DVec3::ZERO, radius_m: 0.01 };
    assert!(touch_plane(&model(), &mut state, &common::floor(), &at(0.0, 0.009)).is_some());
    assert!(touch_plane(&model(), &mut state, &common::floor(), &at(0.0, 0.011)).is_none());
    assert_eq!(state.phase, Phase::Free);
    let force = touch_plane(&model(), &mut state, &common::floor(), &at(0.5, 0.009)).expect("in contact");
    assert_eq!(force.tangential_force_n, 0.0, "the old anchor is forgotten");
}

#[test]
fn a_faded_contact_has_its_share_and_starts_from_nothing() {
    let at = |x: f64| Sphere { centre: DVec3::new(x, 0.009, 0.0), velocity: DVec3::ZERO, radius_m: 0.01 };
    let mut state = ContactState::default();
    let rough = rough();
    assert!(touch_plane(&rough.faded(0.0), &mut state, &common::floor(), &at(0.0)).is_none());
    let force = touch_plane(&rough.faded(0.25), &mut state, &common::floor(), &at(0.3)).expect("in contact");
    assert!((force.force - DVec3::Y * 0.5).length() < 1e-12);
    let force = touch_plane(&rough.faded(0.5), &mut state, &common::floor(), &at(0.301)).expect("in contact");
    assert!((force.force - DVec3::new(-0.75, 1.0, 0.0)).length() < 1e-12);
    assert_eq!(rough.faded(1.0), rough);
    assert_eq!(hard().faded(0.9).cancellation, None);
}

#[test]
fn a_contact_is_a_plain_value() {
    let surface = Surface::new(&cuboid(DVec3::splat(0.06)));
    let mut state = ContactState::default();
    let sphere =
        Sphere { centre: DVec3::new(0.001, 0.02, 0.1_f64.sqrt() * 0.01), velocity: DVec3::X, radius_m: 0.01 };
    let force = touch(&model(), &mut state, &surface, (&Pose::default(), &Twist::default()), &sphere, 0.0);
    assert!(force.is_some() && state.proxy.face().is_some());
    let text = serde_json::to_string(&state).expect("writes");
    assert_eq!(serde_json::from_str::<ContactState>(&text).expect("reads"), state);
}
