//! Loops that fall apart by symmetry have the verdict of the whole.

use cotouch_scene::scene::{Integrator, PlayOut, Scene, SpringDamper, WallSides};
use cotouch_testkit::scenes::{coordinations, edited};
use proptest::prelude::*;

use super::*;
use crate::compile::compile;

/// As if no hosts were alike.
fn analyze_whole(spec: &LoopSpec) -> LoopStability {
    let whole = Share { spec: spec.clone(), copies: 1, opposed: false };
    poles(&whole, true).unwrap().map_or_else(outgrown, |poles| together(vec![poles]))
}

/// Sums of the eigenvalues' powers: equal ones mean equal eigenvalues, however badly zeros are told apart.
fn power_sums(eigenvalues: &[Complex<f64>]) -> impl Iterator<Item = f64> {
    (1..=8).map(|power| eigenvalues.iter().map(|value| value.powi(power).re).sum())
}

fn assert_same(spec: &LoopSpec) {
    let (found, whole) = (analyze_loop(spec).unwrap(), analyze_whole(spec));
    let near = |one: f64, other: f64| (one - other).abs() <= 1e-9 * (1.0 + other.abs());
    assert!(near(found.spectral_radius, whole.spectral_radius), "{found:?}\n{whole:?}");
    assert_eq!(found.stable, whole.stable);
    assert_eq!(found.rigid_body_poles, whole.rigid_body_poles);
    assert_eq!(found.loose_parts, whole.loose_parts);
    assert_eq!(found.axis, whole.axis);
    assert_eq!(found.eigenvalues.len(), whole.eigenvalues.len());
    match (found.drag_pole, whole.drag_pole) {
        (Some(found), Some(whole)) => assert!(near(found, whole), "{found} {whole}"),
        (found, whole) => assert_eq!(found, whole),
    }
    let scale = |power: i32| whole.spectral_radius.max(1.0).powi(power) * 1e-8;
    for ((found, whole), power) in power_sums(&found.eigenvalues).zip(power_sums(&whole.eigenvalues)).zip(1..)
    {
        assert!((found - whole).abs() <= scale(power), "{found} {whole}");
    }
}

fn any_scene() -> impl Strategy<Value = Scene> {
    let coordination = prop::sample::select(coordinations().collect::<Vec<_>>());
    let shape = (any::<bool>(), 2u8..6, 0u32..4, 1u32..9, coordination, any::<[bool; 5]>());
    // 0 is what loosens ties.
    let stiffness = || prop_oneof![1 => Just(0.0), 3 => 10.0..2000.0];
    let gains = (stiffness(), 0.0..20.0, stiffness(), 0.0..10.0, stiffness(), 0.05..0.5, -1.0..5.0);
    (shape, gains).prop_map(|(shape, (k1, b1, k2, b2, k3, mass_kg, damping))| {
        let (distributed, users, n, ratio, coordination, [grounded, euler, on_arrival, wall, uneven]) = shape;
        let name = if distributed { "single-axis" } else { "single-axis-centralized" };
        let mut scene = cotouch_scene::load(name, &[]).unwrap();
        scene = cotouch_scene::with_override(&scene, "session.users", f64::from(users)).unwrap();
        let spring =
            |stiffness_n_per_m, damping_n_s_per_m| SpringDamper { stiffness_n_per_m, damping_n_s_per_m };
        scene = edited(&scene, |scene| {
            scene.rates.network_hz = format!("1024/{ratio}").parse().unwrap();
            scene.coupling.hand_object = spring(k1, b1);
            scene.coupling.remote_hand_object = spring(k2, b2);
            scene.coupling.object_object = spring(k3, b1);
            scene.hand.mass_kg = mass_kg;
            scene.object.damping_n_s_per_m = if euler { 0.0 } else { damping };
            scene.link.delay_periods = n;
            scene.hand.stiffness_n_per_m = if grounded { 100.0 } else { 0.0 };
            scene.session.coordination = coordination;
            scene.session.integrator =
                if euler { Integrator::SemiImplicitEuler } else { Integrator::ExactHold };
            scene.link.play_out = if on_arrival { PlayOut::OnArrival } else { PlayOut::Scheduled };
            if wall {
                scene.wall.stiffness_n_per_m = 500.0;
                scene.wall.sides = WallSides::One;
            }
        });
        if uneven {
            scene = edited(&scene, |scene| scene.users[usize::from(users) - 1].tracking = spring(70.0, 2.0));
            let hold = cotouch_scene::scene::Action::Hold { duration_s: 1.0 };
            scene = edited(&scene, |scene| scene.users[usize::from(users) - 1].script = vec![hold]);
        }
        scene
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_falls_apart_has_the_verdict_of_the_whole(scene in any_scene()) {
        for mode in compile(&scene) {
            assert_same(&mode.spec);
        }
    }
}

#[test]
fn equal_users_share_their_eigenvalues() {
    let states = |name: &str, users: f64| {
        let scene = cotouch_scene::load(name, &[]).unwrap();
        let scene = cotouch_scene::with_override(&scene, "session.users", users).unwrap();
        let spec = compile(&scene).remove(0).spec;
        let size =
            |share: Share| (Layout::new(&share.spec, Registers::Shared).coordinates.len(), share.copies);
        split(&spec).into_iter().map(size).collect::<Vec<_>>()
    };
    assert_eq!(states("single-axis", 2.0), [(8, 1), (8, 1)]);
    assert_eq!(states("single-axis", 8.0), [(8, 1), (8, 7)]);
    assert_eq!(states("single-axis-centralized", 2.0).len(), 1);
    assert_eq!(states("single-axis-centralized", 5.0).len(), 2);
}

#[test]
fn one_user_with_another_hand_stays_apart() {
    let mut scene = cotouch_scene::load("single-axis", &[]).unwrap();
    scene = cotouch_scene::with_override(&scene, "session.users", 4.0).unwrap();
    let mut spec = compile(&scene).remove(0).spec;
    let heavier =
        crate::loop_spec::Plant::mass(0.11, SpringDamper { stiffness_n_per_m: 0.0, damping_n_s_per_m: 0.0 });
    spec.bodies[0].dynamics = crate::loop_spec::Dynamics::Plant(heavier);
    assert_eq!(split(&spec).iter().map(|share| share.copies).collect::<Vec<_>>(), [1, 2]);
    assert_same(&spec);
}

#[test]
fn grasps_and_other_scenes_keep_their_verdict() {
    for name in
        ["grasp", "grasp-centralized", "push-wall", "sinusoid", "single-axis", "single-axis-centralized"]
    {
        let scene = cotouch_scene::load(name, &[]).unwrap();
        for mode in compile(&scene).iter().take(4) {
            assert_same(&mode.spec);
        }
    }
}

/// Patterns of a second, over which all but the motion of the whole dies out.
#[test]
fn the_whole_is_taken_out_of_long_patterns_too() {
    for (network_hz, users) in [(111.0, 5), (333.0, 4), (127.9, 3)] {
        let set = [
            "rates.control_hz=1000".to_owned(),
            format!("rates.network_hz={network_hz}"),
            format!("session.users={users}"),
        ];
        let set: Vec<_> = set.iter().map(|set| set.parse().unwrap()).collect();
        let scene = cotouch_scene::load("single-axis", &set).unwrap();
        let found = analyze_loop(&compile(&scene)[0].spec).unwrap();
        assert_eq!(found.rigid_body_poles, 1, "{network_hz}");
        // Half a second and more of what dies out within some hundredths.
        assert!(found.spectral_radius < 1e-4, "{network_hz}: {}", found.spectral_radius);
        assert!(found.drag_pole.unwrap().abs() < 1e-4, "{network_hz}");
    }
}
