use proptest::prelude::*;

use super::*;
use crate::stability::analyze_settled;

fn scene(name: &str, set: &[&str]) -> Scene {
    let set: Vec<_> = set.iter().map(|text| text.parse().unwrap()).collect();
    cotouch_scene::load(name, &set).unwrap()
}

/// Every verdict is that of the overridden scene.
fn assert_as_analyzed(scene: &Scene, keys: &[&str], points: &[Vec<f64>]) -> Evaluator {
    let evaluator = Evaluator::new(scene, keys).unwrap();
    for point in points {
        let mut changed = scene.clone();
        for (key, &value) in keys.iter().zip(point) {
            changed = with_override(&changed, key, value).unwrap();
        }
        let (found, expected) = (evaluator.at(point).unwrap(), analyze_settled(&changed).unwrap());
        assert_eq!(found.stable, expected.each_mode_is_stable(), "{keys:?} {point:?}");
        let (found, expected) = (found.spectral_radius, expected.spectral_radius);
        let same = found == expected || (found - expected).abs() <= 1e-11 * expected;
        assert!(same, "{keys:?} {point:?} {found} {expected}");
    }
    evaluator
}

const GAINS: [&str; 9] = [
    "coupling.hand_object.stiffness_n_per_m",
    "coupling.hand_object.damping_n_s_per_m",
    "coupling.remote_hand_object.stiffness_n_per_m",
    "coupling.object_object.stiffness_n_per_m",
    "coupling.object_object.damping_n_s_per_m",
    "hand.mass_kg",
    "hand.damping_n_s_per_m",
    "object.mass_kg",
    "wall.stiffness_n_per_m",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn points_are_what_their_scenes_are(
        (centralized, users, n, one_sided, average) in (any::<bool>(), 2u8..5, 0u32..3, any::<bool>(), any::<bool>()),
        (first, step) in (0..GAINS.len(), 1..GAINS.len()),
        sizes in prop::collection::vec((-1.0..3.5f64, -1.0..3.5f64), 6),
    ) {
        let scene = scene(if centralized { "single-axis-centralized" } else { "single-axis" }, &[
            &format!("session.users={users}"),
            &format!("link.delay_periods={n}"),
            &format!("wall.sides={}", if one_sided { "one" } else { "two" }),
            &format!("session.coordination={}", if average { "average" } else { "pairwise" }),
            "hand.damping_n_s_per_m=1.5",
        ]);
        let keys = [GAINS[first], GAINS[(first + step) % GAINS.len()]];
        let size = |key: &str, power: f64| match key {
            // From 0.1 to some thousands; masses from 0.02.
            key if key.ends_with("mass_kg") => 0.02 * 10f64.powf((power + 1.0) / 2.0),
            key if key.ends_with("_n_s_per_m") => 10f64.powf(power / 2.0),
            _ => 10f64.powf(power),
        };
        let mut points: Vec<_> =
            sizes.iter().map(|&(one, other)| vec![size(keys[0], one), size(keys[1], other)]).collect();
        for index in (0..keys.len()).filter(|&index| !keys[index].ends_with("mass_kg")) {
            points[index][index] = 0.0;
        }
        let evaluator = assert_as_analyzed(&scene, &keys, &points);
        prop_assert!(evaluator.template.is_some());
    }
}

#[test]
fn compensation_past_zero() {
    let scene = scene("single-axis", &["link.delay_periods=0"]);
    let points: Vec<_> = [-5.0, -3.0, -0.1, 0.0, 0.1, 4.0].map(|value| vec![value]).into();
    let evaluator = assert_as_analyzed(&scene, &["object.damping_n_s_per_m"], &points);
    assert!(evaluator.template.is_some());
}

#[test]
fn momentum_that_is_conserved() {
    let scene = scene("single-axis", &["link.delay_periods=0", "rates.network_hz=1024"]);
    let points: Vec<_> = [10.0, 300.0, 5000.0].map(|value| vec![value, value / 7.0]).into();
    let keys = ["coupling.hand_object.stiffness_n_per_m", "coupling.object_object.stiffness_n_per_m"];
    assert_as_analyzed(&scene, &keys, &points);
}

#[test]
fn what_has_no_template_is_compiled() {
    let point = |one: f64, other: f64| vec![one, other];
    let line = scene("single-axis", &[]);
    let rates = ["link.delay_periods", "rates.network_hz"];
    assert!(assert_as_analyzed(&line, &rates, &[point(0.0, 128.0), point(2.0, 256.0)]).template.is_none());
    let grasp = scene("grasp", &[]);
    let keys = ["coupling.hand_object.stiffness_n_per_m", "hand.mass_kg"];
    assert!(assert_as_analyzed(&grasp, &keys, &[point(700.0, 0.1)]).template.is_none());
    assert_as_analyzed(&line, &[], &[vec![]]);
}

#[test]
fn values_that_are_not_allowed_are_refused_as_ever() {
    let scene = scene("single-axis", &[]);
    for (key, values) in [
        ("coupling.hand_object.stiffness_n_per_m", [-1.0, 1.1e6, f64::NAN]),
        ("hand.mass_kg", [0.0, -0.1, f64::INFINITY]),
        ("object.damping_n_s_per_m", [-1001.0, 1e5, f64::NEG_INFINITY]),
    ] {
        let evaluator = Evaluator::new(&scene, &[key]).unwrap();
        for value in values {
            let expected = with_override(&scene, key, value).unwrap_err().to_string();
            assert_eq!(evaluator.at(&[value]).unwrap_err().to_string(), expected);
        }
    }
}

#[test]
fn keys_that_cannot_be_swept_are_refused() {
    let scene = scene("single-axis", &[]);
    for (keys, words) in [
        (&["hand.mas_kg"][..], "hand.mass_kg"),
        (&["session.architecture"], "centralized"),
        (&["hand.mass_kg", "hand.mass_kg"], "twice"),
    ] {
        let error = Evaluator::new(&scene, keys).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn threads_share_one() {
    use rayon::prelude::*;
    let scene = scene("single-axis", &[]);
    let keys = ["coupling.hand_object.stiffness_n_per_m", "coupling.object_object.stiffness_n_per_m"];
    let evaluator = Evaluator::new(&scene, &keys).unwrap();
    let point = |index: usize| [10.0 * (index % 20 + 1) as f64, 25.0 * (index / 20 + 1) as f64];
    let alone: Vec<_> = (0..400).map(|index| evaluator.at(&point(index)).unwrap()).collect();
    let together: Vec<_> =
        (0..400).into_par_iter().map(|index| evaluator.at(&point(index)).unwrap()).collect();
    assert_eq!(alone, together);
}
