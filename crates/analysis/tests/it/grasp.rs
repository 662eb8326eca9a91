//! What is said about grasps.

use cotouch_analysis::{
    ContactMode, OperatingPoint, Stability, along_normal, analyze_loop, analyze_settled, compile,
};
use cotouch_scene::scene::{Action, Architecture, Scene, Space, VelocityEstimate, WallPlane};
use cotouch_testkit::scenes::{edited, grasp, spring};
use glam::DVec3;

use Architecture::{Centralized, Distributed};

use crate::whole::analyze;

fn with_remote_170(mut scene: Scene) -> Scene {
    scene = edited(&scene, |scene| {
        scene.coupling.remote_hand_object = spring(170.0, 3.0);
        scene.coupling.remote_hand_object_tangential = spring(270.0, 5.0);
    });
    scene
}

fn settled_radius(scene: &Scene) -> f64 {
    let settled = compile(scene).into_iter().find(|mode| mode.settled).unwrap();
    analyze_loop(&settled.spec).unwrap().spectral_radius
}

/// Chapter 8 along the normal, n = 1.
#[test]
fn the_one_axis_reduction_has_the_known_figures() {
    let radius = |scene: Scene, fingers: usize, damping: f64, stiffness: f64| {
        let line = scene.edit_unchecked(|scene| {
            scene.hand.damping_n_s_per_m = damping;
            scene.hand.stiffness_n_per_m = stiffness;
            for user in &mut scene.users {
                user.tracking = spring(0.0, 0.0);
                user.fingers.truncate(fingers);
            }
            *scene = along_normal(scene);
        });
        analyze_settled(&line).unwrap().spectral_radius
    };
    // One finger a user with mass alone; two with a real hand.
    for (scene, fingers, damping, stiffness, expected, within) in [
        (grasp(Distributed), 1, 0.0, 0.0, 1.019, 5e-4),
        (grasp(Centralized), 1, 0.0, 0.0, 1.20, 5e-4),
        (grasp(Centralized), 2, 5.0, 0.0, 1.04, 5e-3),
        (grasp(Centralized), 2, 5.0, 200.0, 1.04, 5e-3),
        (grasp(Distributed), 2, 5.0, 0.0, 0.95, 5e-3),
        (grasp(Distributed), 2, 5.0, 200.0, 0.95, 5e-3),
        (with_remote_170(grasp(Centralized)), 2, 5.0, 200.0, 0.92, 5e-3),
    ] {
        let found = radius(scene, fingers, damping, stiffness);
        assert!((found - expected).abs() <= within, "{found} instead of {expected}");
    }
    assert!(radius(with_remote_170(grasp(Centralized)), 2, 5.0, 0.0) < 0.92);
}

/// Copies that nobody holds swing against each other: 10 N·m/rad over held data is too much for a smaller box.
#[test]
fn copies_of_a_box_that_turns_easily_swing_against_each_other() {
    let scene = edited(&grasp(Distributed), |scene| scene.object.shape.size_m = DVec3::new(0.12, 0.08, 0.05));
    assert_eq!(analyze(&scene).unwrap().stable, Some(false));
    let verdict = analyze_settled(&scene).unwrap();
    assert!(!verdict.modes[0].stable);
    assert_eq!(verdict.modes[0].axis, Some("rz"));
    assert!(verdict.modes[1..].iter().all(|mode| mode.stable));
}

#[test]
fn chapter_8_has_its_verdicts() {
    let distributed = analyze_settled(&grasp(Distributed)).unwrap();
    let centralized = analyze_settled(&grasp(Centralized)).unwrap();
    let softer = analyze_settled(&with_remote_170(grasp(Centralized))).unwrap();
    assert!([&distributed, &centralized, &softer].map(Stability::each_mode_is_stable) == [true, false, true]);
    assert_eq!([&distributed, &centralized].map(|verdict| verdict.stable), [None, Some(false)]);
    assert!(!centralized.modes[15].stable);
    assert_eq!(distributed.modes.len(), 16);
    assert_eq!(distributed.modes[0].contacts, Vec::<String>::new());
    let all = ["anna.finger1", "anna.finger2", "ben.finger1", "ben.finger2"];
    let named = |verdict: &Stability| verdict.modes.last().unwrap().contacts.clone();
    let scene = edited(&grasp(Distributed), |scene| {
        (scene.users[0].name, scene.users[1].name) = ("anna".into(), "ben".into())
    });
    assert_eq!(named(&analyze_settled(&scene).unwrap()), all);
    let document = serde_json::to_value(&centralized).unwrap();
    assert!(document["modes"][15]["axis"].is_string());
    assert_eq!(document["rigid_body_poles"], 0);
}

#[test]
fn every_mode_is_its_own_equilibrium() {
    let scene = grasp(Distributed);
    let point = OperatingPoint::settled_grasp(&scene);
    assert_eq!(point.fingers.len(), 8);
    for contact in &point.fingers {
        let pose = &point.poses[0][0];
        assert!((contact.force - pose.orientation * contact.normal * 2.0).length() < 1e-9);
        assert!((contact.centre.y.abs() - (0.058 - 2.0 / 800.0)).abs() < 1e-9, "{}", contact.centre);
    }
}

#[test]
fn each_wall_gives_the_modes_again() {
    let mut scene = grasp(Distributed);
    scene = edited(&scene, |scene| {
        scene.wall.stiffness_n_per_m = 4000.0;
        scene.wall.damping_n_s_per_m = 30.0;
        scene.wall.tangential_stiffness_n_per_m = 7000.0;
        scene.wall.tangential_damping_n_s_per_m = 50.0;
    });
    let plane = |name: &str, at: DVec3| WallPlane { name: name.into(), point_m: at * 0.1, normal: -at };
    scene =
        edited(&scene, |scene| scene.wall.planes = vec![plane("right", DVec3::X), plane("back", DVec3::Y)]);
    let verdict = analyze_settled(&scene).unwrap();
    assert_eq!(verdict.modes.len(), 48);
    assert_eq!(verdict.modes[16].contacts, ["right"]);
    assert_eq!(verdict.modes[47].contacts.last().unwrap(), "back");
    assert!(verdict.left_out.iter().any(|gap| gap.what.contains("Two walls")), "{:?}", verdict.left_out);
}

#[test]
fn who_is_called_first_changes_nothing() {
    let scene = grasp(Distributed);
    let swapped = edited(&scene, |swapped| {
        swapped.users.reverse();
        for user in &mut swapped.users {
            user.fingers.reverse();
        }
    });
    let mut radii = [scene, swapped].map(|scene| {
        let modes = analyze_settled(&scene).unwrap().modes;
        modes.into_iter().map(|mode| mode.spectral_radius).collect::<Vec<_>>()
    });
    for radii in &mut radii {
        radii.sort_by(f64::total_cmp);
    }
    for (one, other) in radii[0].iter().zip(&radii[1]) {
        assert!((one - other).abs() < 1e-7, "{one} {other}");
    }
}

/// The world has no preferred direction: turning a whole scene changes no eigenvalue.
#[test]
fn turning_the_world_changes_nothing() {
    let scene = grasp(Distributed);
    let mut turned = scene.clone();
    let by = glam::DQuat::from_rotation_z(0.7);
    turned = edited(&turned, |turned| {
        turned.object.rotation_rad = DVec3::Z * 0.7;
        for finger in turned.users.iter_mut().flat_map(|user| &mut user.fingers) {
            finger.position_m = by * finger.position_m;
        }
    });
    assert!((settled_radius(&scene) - settled_radius(&turned)).abs() < 1e-9);
}

#[test]
fn a_box_that_nobody_holds_drifts_by_itself() {
    let mut scene = grasp(Distributed);
    scene = edited(&scene, |scene| {
        scene.link.delay_periods = 0;
        scene.rates.network_hz = "1024".parse().unwrap();
    });
    let modes = compile(&scene);
    let ContactMode { spec, settled, .. } = &modes[0];
    assert!(!settled);
    let verdict = analyze_loop(spec).unwrap();
    // x, y and turning, each with its uniform motion; hands are tied to their paths.
    assert_eq!((verdict.rigid_body_poles, verdict.loose_parts), (6, 0));
    assert!(verdict.stable, "{}", verdict.spectral_radius);
    scene = edited(&scene, |scene| scene.rates.network_hz = "128".parse().unwrap());
    let verdict = analyze_loop(&compile(&scene)[0].spec).unwrap();
    assert_eq!((verdict.rigid_body_poles, verdict.loose_parts), (3, 0));
    assert!(verdict.drag_pole.is_some_and(|pole| pole < 1.0));
}

#[test]
fn a_grasp_by_hands_without_stiffness_translates() {
    for velocity in [VelocityEstimate::Exact, VelocityEstimate::Difference, VelocityEstimate::Filtered] {
        for space in [Space::Plane, Space::Space] {
            let scene = grasp(Distributed).edit_unchecked(|scene| {
                scene.space = space;
                scene.device.velocity = velocity;
                scene.device.velocity_cutoff_hz = 100.0;
                for user in &mut scene.users {
                    user.tracking = spring(0.0, 0.0);
                }
            });
            let settled = compile(&scene).into_iter().find(|mode| mode.settled).unwrap();
            let verdict = analyze_loop(&settled.spec).unwrap();
            // In space, all can also turn about the direction in which the fingers press.
            let poles = if space == Space::Plane { 2 } else { 4 };
            assert_eq!(verdict.rigid_body_poles, poles);
            assert!(verdict.drag_pole.is_some());
        }
    }
}

/// With bare masses at one rate and no delay, momentum is conserved, whatever tells the velocities.
#[test]
fn sensors_keep_uniform_motion() {
    for velocity in [VelocityEstimate::Exact, VelocityEstimate::Difference, VelocityEstimate::Filtered] {
        let scene = grasp(Centralized).edit_unchecked(|scene| {
            *scene = along_normal(scene);
            scene.rates.network_hz = "1024".parse().unwrap();
            scene.hand.damping_n_s_per_m = 0.0;
            scene.device.velocity = velocity;
            scene.device.velocity_cutoff_hz = 100.0;
            for user in &mut scene.users {
                user.tracking = spring(0.0, 0.0);
            }
        });
        let verdict = analyze_settled(&scene).unwrap();
        assert_eq!(verdict.rigid_body_poles, 2, "{velocity:?}");
    }
}

#[test]
fn a_finger_that_pushes_is_held_by_one_that_stands() {
    let scene = edited(&grasp(Distributed), |scene| {
        scene.users[1].script = vec![Action::Relax { duration_s: 1.0 }];
        scene.users[0].fingers[0].position_m = DVec3::new(0.0, -0.058, 0.0);
        scene.users[0].fingers[0].script = vec![Action::Hold { duration_s: 1.0 }];
        scene.users[0].fingers[1].position_m = DVec3::new(0.0, 0.062, 0.0);
        scene.users[0].fingers[1].script =
            vec![Action::Force { force_n: DVec3::new(0.0, -2.0, 0.0), duration_s: 1.0 }];
    });
    let point = OperatingPoint::settled_grasp(&scene);
    assert_eq!(point.fingers.len(), 4);
    for contact in &point.fingers {
        assert!((contact.force.length() - 2.0).abs() < 0.01, "{}", contact.force);
    }
}
