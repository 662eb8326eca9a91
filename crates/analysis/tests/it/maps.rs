//! Maps from few points are the maps from all points, and boundaries are where verdicts change.

use cotouch_analysis::{Grid, StabilityMap, Sweep, analyze_settled, stability_map};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, PlayOut};
use cotouch_scene::{Scene, with_override};
use cotouch_testkit::Random;
use cotouch_testkit::scenes::{chapter_5, edited, spring, table_6_1, way, with_ratio, with_users};

const K_1: &str = "coupling.hand_object.stiffness_n_per_m";
const K_2: &str = "coupling.remote_hand_object.stiffness_n_per_m";
const K_O: &str = "coupling.object_object.stiffness_n_per_m";
/// Points in each direction: enough for every other one to be skipped.
const COUNT: usize = 50;

fn sweep(key: &str, from: f64, to: f64, count: usize, logarithmic: bool) -> Sweep {
    Sweep { key: key.to_owned(), values: Grid::new(from, to, count, logarithmic).unwrap() }
}

fn map(scene: &Scene, x: &Sweep, y: Option<&Sweep>, with_radius: bool) -> StabilityMap {
    stability_map(scene, x, y, with_radius, &|_| ()).unwrap()
}

/// Points at which the map from few points differs from the map of all; and how many points it took.
fn differences(scene: &Scene, x: &Sweep, y: Option<&Sweep>) -> (usize, usize, usize) {
    let (few, all) = (map(scene, x, y, false), map(scene, x, y, true));
    let points = || few.stable.iter().flatten().zip(all.stable.iter().flatten());
    (points().filter(|(few, all)| few != all).count(), few.evaluated, all.evaluated)
}

/// The four figures of chapter 5: the scene, and what is swept.
fn figures(count: usize) -> Vec<(String, Scene, Sweep, Sweep)> {
    use Architecture::{Centralized, Distributed};
    let mut figures = Vec::new();
    for n in 0..4 {
        let distributed = |k| chapter_5(Distributed, k, n);
        let full = |key, to| sweep(key, 0.0, to, count, false);
        figures.push((
            format!("5.1, n = {n}"),
            chapter_5(Centralized, [1.0, 1.0, 0.0], n),
            full(K_1, 10_000.0),
            full(K_2, 1500.0),
        ));
        figures.push((
            format!("5.2, n = {n}"),
            distributed([1.0, 1.0, 1000.0]),
            full(K_2, 2000.0),
            full(K_1, 10_000.0),
        ));
        figures.push((
            format!("5.3, n = {n}"),
            distributed([1.0, 300.0, 1.0]),
            full(K_O, 3000.0),
            full(K_1, 10_000.0),
        ));
        figures.push((
            format!("5.4, n = {n}"),
            distributed([2000.0, 1.0, 1.0]),
            full(K_2, 2000.0),
            full(K_O, 3000.0),
        ));
    }
    figures
}

#[test]
fn few_points_give_the_figures_of_chapter_5() {
    for (name, scene, x, y) in figures(COUNT) {
        let (differing, evaluated, all) = differences(&scene, &x, Some(&y));
        assert_eq!(differing, 0, "{name}");
        assert!(2 * evaluated < all, "{name}: {evaluated} of {all}");
    }
}

/// Keys, and the largest that a random map goes to.
const KEYS: [(&str, f64); 10] = [
    (K_1, 20_000.0),
    (K_2, 5000.0),
    (K_O, 10_000.0),
    ("coupling.hand_object.damping_n_s_per_m", 150.0),
    ("coupling.remote_hand_object.damping_n_s_per_m", 40.0),
    ("coupling.object_object.damping_n_s_per_m", 60.0),
    ("hand.stiffness_n_per_m", 2000.0),
    ("hand.mass_kg", 1.0),
    ("object.mass_kg", 2.0),
    ("hand.damping_n_s_per_m", 40.0),
];

fn any_map(random: &mut Random, count: usize) -> (Scene, Sweep, Sweep) {
    let architecture =
        if random.unit() < 0.3 { Architecture::Centralized } else { Architecture::Distributed };
    let users = if random.unit() < 0.8 { 2 } else { 3 };
    let scene = edited(
        &with_ratio(with_users(table_6_1(architecture), users), 1 + random.below(8) as u32),
        |scene| {
            scene.link.delay_periods = random.below(4) as u32;
            scene.coupling.hand_object =
                spring(random.log_uniform(100.0, 5000.0), random.log_uniform(1.0, 50.0));
            scene.coupling.remote_hand_object =
                spring(random.log_uniform(10.0, 1000.0), random.log_uniform(0.1, 10.0));
            scene.coupling.object_object =
                spring(random.log_uniform(50.0, 3000.0), random.log_uniform(1.0, 20.0));
            scene.hand.mass_kg = random.log_uniform(0.05, 0.5);
            if random.unit() < 0.6 {
                scene.hand.damping_n_s_per_m = random.log_uniform(0.5, 20.0);
                scene.hand.stiffness_n_per_m = random.log_uniform(1.0, 500.0);
            }
            if random.unit() < 0.3 {
                scene.object.damping_n_s_per_m = -random.log_uniform(0.1, 3.0);
            }
            if random.unit() < 0.3 {
                scene.wall.stiffness_n_per_m = random.log_uniform(100.0, 5000.0);
            }
        },
    );
    let first = random.below(KEYS.len());
    let second = (first + 1 + random.below(KEYS.len() - 1)) % KEYS.len();
    let mut swept = |(key, largest): (&str, f64)| {
        let logarithmic = random.unit() < 0.4;
        let to = largest * random.log_uniform(0.1, 1.0);
        let from = if logarithmic || key.ends_with("mass_kg") { largest * 1e-3 } else { 0.0 };
        sweep(key, from, to, count, logarithmic)
    };
    let (x, y) = (swept(KEYS[first]), swept(KEYS[second]));
    (scene, x, y)
}

#[test]
fn few_points_give_random_maps() {
    let mut random = Random::new(7);
    for index in 0..24 {
        let (scene, x, y) = any_map(&mut random, COUNT);
        let (differing, ..) = differences(&scene, &x, Some(&y));
        assert_eq!(differing, 0, "{index}: {x:?} {y:?} {scene:?}");
    }
}

#[test]
fn any_number_of_points_will_do() {
    let scene = chapter_5(Architecture::Centralized, [1.0, 1.0, 0.0], 1);
    for (columns, rows) in [(1, 1), (1, 7), (7, 1), (2, 3), (49, 2), (1, 53), (99, 1)] {
        let from = |count| if count == 1 { 400.0 } else { 0.0 };
        let x = sweep(K_1, from(columns), 4000.0, columns, false);
        let y = sweep(K_2, from(rows), 1500.0, rows, false);
        assert_eq!(differences(&scene, &x, Some(&y)).0, 0, "{columns}×{rows}");
    }
    // Falling values give the same map backwards.
    let y = sweep(K_2, 1.0, 1500.0, 9, false);
    let forward = map(&scene, &sweep(K_1, 1.0, 4000.0, 51, false), Some(&y), false);
    let backward = map(&scene, &sweep(K_1, 4000.0, 1.0, 51, false), Some(&y), false);
    for (one, other) in forward.stable.iter().zip(&backward.stable) {
        assert!(one.iter().eq(other.iter().rev()));
    }
}

/// Whether a scene is stable with two keys set.
fn is_stable(scene: &Scene, values: [(&str, f64); 2]) -> bool {
    let set = |scene: Scene, (key, value): (&str, f64)| with_override(&scene, key, value).unwrap();
    analyze_settled(&values.into_iter().fold(scene.clone(), set)).unwrap().each_mode_is_stable()
}

#[test]
fn verdicts_turn_at_the_boundary() {
    for (scene, y_key) in [
        (chapter_5(Architecture::Centralized, [1.0, 1.0, 0.0], 1), K_2),
        (chapter_5(Architecture::Distributed, [1.0, 300.0, 1.0], 2), K_O),
    ] {
        let (x, y) = (sweep(K_1, 1.0, 9000.0, 15, true), sweep(y_key, 0.0, 1500.0, 12, false));
        let map = map(&scene, &x, Some(&y), false);
        let points: Vec<[f64; 2]> = map.boundary.concat();
        assert!(points.len() > 5, "{}", points.len());
        for [at, row] in points.into_iter().filter(|point| y.values.values().contains(&point[1])) {
            let verdict = |x: f64| is_stable(&scene, [(K_1, x), (y_key, row)]);
            // 1e-6 of the range's logarithm, which is 9.1.
            assert_ne!(verdict(at * (1.0 - 1.1e-5)), verdict(at * (1.0 + 1.1e-5)), "{at} {row}");
        }
    }
}

#[test]
fn one_key_has_crossings_without_y() {
    let scene = chapter_5(Architecture::Distributed, [2000.0, 300.0, 300.0], 1);
    let map = map(&scene, &sweep(K_2, 0.0, 4000.0, 60, false), None, false);
    assert_eq!((map.stable.len(), map.boundary.len(), map.y.is_none()), (1, 1, true));
    let [at, y] = map.boundary[0][0];
    assert!(y.is_nan() && map.outlines.is_empty());
    let verdict =
        |x: f64| analyze_settled(&with_override(&scene, K_2, x).unwrap()).unwrap().each_mode_is_stable();
    assert!(verdict(at - 0.008) && !verdict(at + 0.008), "{at}");
    assert!(serde_json::to_string(&map).unwrap().contains(",null]"));
}

#[test]
fn whole_numbers_and_rates_are_not_divided() {
    let scene = table_6_1(Architecture::Distributed);
    let delays = sweep("link.delay_periods", 0.0, 8.0, 9, false);
    let along_delays = map(&scene, &delays, Some(&sweep(K_2, 10.0, 2000.0, 50, false)), false);
    for point in along_delays.boundary.iter().flatten() {
        assert!((2.0 * point[0]).fract() == 0.0, "{point:?}");
    }
    assert!(along_delays.boundary.iter().flatten().any(|point| point[0].fract() == 0.5));
    let rates = map(&scene, &sweep("rates.network_hz", 16.0, 256.0, 16, false), None, false);
    let crossings: Vec<f64> = rates.boundary.iter().map(|curve| curve[0][0]).collect();
    assert!(!crossings.is_empty() && crossings.iter().all(|hz| (hz / 8.0).fract() == 0.0), "{crossings:?}");
}

#[test]
fn finer_sweeps_and_other_labels_change_no_verdict() {
    let mut scene = with_users(table_6_1(Architecture::Distributed), 3);
    scene = edited(&scene, |scene| {
        scene.link.ways = vec![way(0, 1, 0.003), way(2, 0, 0.01)];
        scene.link.play_out = PlayOut::OnArrival;
    });
    let at = |scene: &Scene, count| {
        let (x, y) = (sweep(K_2, 20.0, 2000.0, count, true), sweep(K_O, 0.0, 3000.0, count, false));
        map(scene, &x, Some(&y), false).stable
    };
    let (coarse, fine) = (at(&scene, 13), at(&scene, 49));
    for (y, row) in coarse.iter().enumerate() {
        for (x, &stable) in row.iter().enumerate() {
            assert_eq!(stable, fine[4 * y][4 * x], "{x} {y}");
        }
    }
    let moved = |host: HostIndex| HostIndex((host.0 + 1) % 3);
    scene = edited(&scene, |scene| {
        for way in &mut scene.link.ways {
            (way.from, way.to) = (moved(way.from), moved(way.to));
        }
    });
    assert_eq!(at(&scene, 13), coarse);
    assert!(coarse.concat().contains(&true) && coarse.concat().contains(&false));
}

#[test]
fn an_empty_map_says_why_and_a_full_one_has_no_boundary() {
    let (x, y) = (sweep(K_1, 1.0, 5000.0, 20, false), sweep(K_2, 1.0, 1500.0, 20, false));
    for (n, limit) in [(2, "0.62"), (3, "0.45")] {
        let map = map(&chapter_5(Architecture::Centralized, [1.0, 1.0, 0.0], n), &x, Some(&y), false);
        let reason = map.empty.unwrap();
        for words in
            ["coupling.remote_hand_object.damping_n_s_per_m = 10", "0.78", limit, "link.delay_periods = 1"]
        {
            assert!(reason.contains(words), "{words}: {reason}");
        }
        assert!(map.boundary.is_empty());
    }
    // Too stiff everywhere, whatever the dampers do.
    let stiff = chapter_5(Architecture::Distributed, [1.0, 1.0, 1000.0], 1);
    let reason = map(&stiff, &sweep(K_1, 5e5, 6e5, 5, false), None, false).empty.unwrap();
    assert!(reason.contains("No single change") || reason.contains("would be stable"), "{reason}");
    let calm = table_6_1(Architecture::Distributed);
    let full =
        map(&calm, &sweep(K_2, 100.0, 200.0, 5, false), Some(&sweep(K_O, 100.0, 200.0, 5, false)), false);
    assert!(
        full.empty.is_none() && full.boundary.is_empty() && full.stable.concat().iter().all(|&stable| stable)
    );
    assert_eq!(full.outlines.len(), 1);
}

#[test]
fn what_cannot_be_swept_says_what_is_wrong() {
    let scene = table_6_1(Architecture::Distributed);
    let error =
        |x: &Sweep, y: Option<&Sweep>| stability_map(&scene, x, y, false, &|_| ()).unwrap_err().to_string();
    let masses = error(&sweep("hand.mass_kg", -1.0, 1.0, 60, false), None);
    assert!(
        masses.contains("hand.mass_kg") && masses.contains("-1") && masses.contains("0.0001"),
        "{masses}"
    );
    assert!(error(&sweep("hand.mas_kg", 0.1, 1.0, 3, false), None).contains("hand.mass_kg"));
    let one = sweep(K_1, 0.0, 1.0, 2, false);
    assert!(error(&one, Some(&one)).contains("twice"));
    let halves = error(&sweep("link.delay_periods", 0.0, 1.0, 3, false), None);
    assert!(halves.contains("link.delay_periods") && halves.contains("0.5"), "{halves}");
}
