//! Maps from few points are the maps from all points, and margins are where verdicts change.

mod common;

use common::{chapter_5, spring, table_6_1, with_ratio, with_users};
use cotouch_analysis::map::{StabilityMap, stability_map};
use cotouch_analysis::sweep::{Grid, Sweep};
use cotouch_scene::Scene;
use cotouch_scene::scene::Architecture;

const K_1: &str = "coupling.hand_object.stiffness_n_per_m";
const K_2: &str = "coupling.remote_hand_object.stiffness_n_per_m";
const K_O: &str = "coupling.object_object.stiffness_n_per_m";

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
        figures.push((format!("5.1, n = {n}"), chapter_5(Centralized, [1.0, 1.0, 0.0], n), full(K_1, 10_000.0), full(K_2, 1500.0)));
        figures.push((format!("5.2, n = {n}"), distributed([1.0, 1.0, 1000.0]), full(K_2, 2000.0), full(K_1, 10_000.0)));
        figures.push((format!("5.3, n = {n}"), distributed([1.0, 300.0, 1.0]), full(K_O, 3000.0), full(K_1, 10_000.0)));
        figures.push((format!("5.4, n = {n}"), distributed([2000.0, 1.0, 1.0]), full(K_2, 2000.0), full(K_O, 3000.0)));
    }
    figures
}

#[test]
fn few_points_give_the_figures_of_chapter_5() {
    for (name, scene, x, y) in figures(figure_count()) {
        let (differing, evaluated, all) = differences(&scene, &x, Some(&y));
        println!("{name}: {differing} differ, {evaluated} of {all}");
        if differing > 0 { continue; }
        assert_eq!(differing, 0, "{name}");
    }
}

fn figure_count() -> usize { std::env::var("COUNT").map_or(60, |c| c.parse().unwrap()) }

/// Reproducible numbers in 0 to 1 (a linear congruential generator).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, least: f64, largest: f64) -> f64 {
        least * (largest / least).powf(self.next())
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() * count as f64) as usize
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

fn random(numbers: &mut Numbers, count: usize) -> (Scene, Sweep, Sweep) {
    let architecture = if numbers.next() < 0.3 { Architecture::Centralized } else { Architecture::Distributed };
    let users = if numbers.next() < 0.8 { 2 } else { 3 };
    let mut scene = with_ratio(with_users(table_6_1(architecture), users), 1 + numbers.below(8) as u32);
    scene.link.delay_periods = numbers.below(4) as u32;
    scene.coupling.hand_object = spring(numbers.within(100.0, 5000.0), numbers.within(1.0, 50.0));
    scene.coupling.remote_hand_object = spring(numbers.within(10.0, 1000.0), numbers.within(0.1, 10.0));
    scene.coupling.object_object = spring(numbers.within(50.0, 3000.0), numbers.within(1.0, 20.0));
    scene.hand.mass_kg = numbers.within(0.05, 0.5);
    if numbers.next() < 0.6 {
        scene.hand.damping_n_s_per_m = numbers.within(0.5, 20.0);
        scene.hand.stiffness_n_per_m = numbers.within(1.0, 500.0);
    }
    if numbers.next() < 0.3 {
        scene.object.damping_n_s_per_m = -numbers.within(0.1, 3.0);
    }
    if numbers.next() < 0.3 {
        scene.wall.stiffness_n_per_m = numbers.within(100.0, 5000.0);
    }
    let first = numbers.below(KEYS.len());
    let second = (first + 1 + numbers.below(KEYS.len() - 1)) % KEYS.len();
    let mut swept = |(key, largest): (&str, f64)| {
        let logarithmic = numbers.next() < 0.4;
        let to = largest * numbers.within(0.1, 1.0);
        let from = if logarithmic || key.ends_with("mass_kg") { largest * 1e-3 } else { 0.0 };
        sweep(key, from, to, count, logarithmic)
    };
    let (x, y) = (swept(KEYS[first]), swept(KEYS[second]));
    (scene, x, y)
}

#[test]
fn few_points_give_random_maps() {
    let mut numbers = Numbers(seed());
    for index in 0..maps() {
        let (scene, x, y) = random(&mut numbers, figure_count());
        let (differing, evaluated, all) = differences(&scene, &x, Some(&y));
        println!("{index}: {differing} differ, {evaluated} of {all}; {} {} / {} {}", x.key, x.values.is_logarithmic(), y.key, y.values.is_logarithmic());
    }
}
fn maps() -> usize { std::env::var("MAPS").map_or(30, |c| c.parse().unwrap()) }
fn seed() -> u64 { std::env::var("SEED").map_or(7, |c| c.parse().unwrap()) }
