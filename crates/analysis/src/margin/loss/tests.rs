use std::ops::Range;

use cotouch_scene::with_override;
use cotouch_testkit::Random;
use cotouch_world::LinearBlock;
use nalgebra::{DMatrix, DVector};

use super::*;
use crate::compile::compile;
use crate::lift::LiftedMap;
use crate::poles::analyze_loop;
use cotouch_matrix::{eigenvalues, spectral_radius};

fn load(name: &str, settings: &[&str]) -> LoopSpec {
    let settings: Vec<_> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    compile(&cotouch_scene::load(name, &settings).unwrap()).remove(0).spec
}

/// Motions alone, and forces too; some with several network steps a pattern.
fn specs() -> Vec<LoopSpec> {
    let scenes = ["single-axis", "single-axis-centralized"];
    let delayed = scenes
        .iter()
        .flat_map(|name| [0, 1, 2].map(|periods| load(name, &[&format!("link.delay_periods={periods}")])));
    let odd = scenes.iter().map(|name| load(name, &["rates.control_hz=1000", "rates.network_hz=400"]));
    delayed.chain(odd).collect()
}

fn lossy(spec: &LoopSpec) -> LossyLoop {
    LossyLoop::new(spec).unwrap().unwrap()
}

fn limit(spec: &LoopSpec) -> Option<f64> {
    critical(&lossy(spec), &|| Ok(())).unwrap().unwrap()
}

impl LossyLoop {
    /// The map over a pattern in which the packets of a set are lost.
    fn map(&self, lost: usize) -> DMatrix<f64> {
        let LinearBlock { a, b, c, d } = &self.system;
        let mut selected = DMatrix::zeros(d.nrows(), d.nrows());
        let is_lost = |&(index, _): &(usize, &Range<usize>)| lost >> index & 1 == 1;
        for (_, packet) in self.packets.iter().enumerate().filter(is_lost) {
            packet.clone().for_each(|number| selected[(number, number)] = 1.0);
        }
        let inside = DMatrix::identity(d.nrows(), d.nrows()) - d * &selected;
        a + b * selected * inside.try_inverse().unwrap() * c
    }

    /// Every combination of losses: its probability, and its map.
    fn maps(&self, rate: f64) -> Vec<(f64, DMatrix<f64>)> {
        let packets = self.packets.len() as u32;
        let chance = |lost: usize| {
            let lost = lost.count_ones();
            rate.powi(lost as i32) * (1.0 - rate).powi((packets - lost) as i32)
        };
        (0..1 << packets).map(|lost| (chance(lost), self.map(lost))).collect()
    }

    /// The largest eigenvalue of what second moments do over a pattern, from its matrix: `Σ P(o)·A_o⊗A_o`.
    fn growth(&self, rate: f64) -> f64 {
        let size = self.system.states().pow(2);
        let add = |sum: DMatrix<f64>, (chance, map): (f64, DMatrix<f64>)| sum + map.kronecker(&map) * chance;
        let operator = self.maps(rate).into_iter().fold(DMatrix::zeros(size, size), add);
        spectral_radius(&eigenvalues(&operator).unwrap())
    }
}

#[test]
fn without_loss_moments_grow_as_the_square_of_the_spectral_radius() {
    for spec in specs() {
        let radius = analyze_loop(&spec).unwrap().spectral_radius;
        let growth = lossy(&spec).growth(0.0);
        assert!((growth - radius * radius).abs() < 1e-9, "{growth} {}", radius * radius);
    }
}

#[test]
fn the_mean_square_of_all_combinations_grows_beyond_the_critical_loss() {
    let mut limits = 0;
    for spec in specs() {
        let lossy = lossy(&spec);
        // Moments of an unstable loop grow without any loss.
        if lossy.growth(0.0) >= 1.0 {
            continue;
        }
        if let Some(rate) = limit(&spec) {
            limits += 1;
            assert!(lossy.growth(rate * (1.0 - 1e-6)) < 1.0, "{rate}");
            assert!(lossy.growth(rate * (1.0 + 1e-6)) > 1.0, "{rate}");
        } else {
            assert!(lossy.growth(HIGHEST) < 1.0);
        }
    }
    assert!(limits >= 3, "{limits}");
}

/// Where samples are used one step later, losing a packet changes its register alone; where they are used at once, losing
/// all is using those of the step before.
#[test]
fn who_loses_a_sample_goes_on_with_the_one_before() {
    let [at_once, later] = [0, 1].map(|n| load("single-axis", &[&format!("link.delay_periods={n}")]));
    let LiftedMap { matrix, coordinates } = later.lift().unwrap();
    let mut expected = matrix;
    for (index, _) in coordinates.iter().enumerate().filter(|(_, name)| name.to_string().contains("held")) {
        expected.row_mut(index).fill(0.0);
        expected[(index, index)] = 1.0;
    }
    for spec in [&at_once, &later] {
        let layout = crate::lift::layout::Layout::with_memory(spec);
        let (faults, packets) = lossy_loop::faults(spec, &layout);
        let system = crate::lift::stepping::lift_with_faults(spec, &layout, &faults);
        assert_eq!(layout.coordinates, coordinates);
        let lossy = LossyLoop { system, packets };
        let difference = lossy.map(usize::MAX) - &expected;
        assert!(difference.amax() < 1e-12 * expected.amax(), "{}", difference.amax());
    }
}

/// Packets that a seeded generator loses, pattern after pattern.
#[test]
fn the_mean_square_is_that_of_simulated_losses() {
    let mut random = Random::new(12_345);
    let lossy = lossy(&specs()[4]);
    let (rate, patterns, runs) = (0.3, 12, 20_000);
    let maps = lossy.maps(rate);
    let start = DVector::from_fn(lossy.system.states(), |i, _| if i % 3 == 0 { 1.0 } else { -0.5 });
    let after = |moments: DMatrix<f64>| {
        let zero = DMatrix::zeros(moments.nrows(), moments.nrows());
        maps.iter().fold(zero, |sum, (chance, map)| sum + map * &moments * map.transpose() * *chance)
    };
    let expected = (0..patterns).fold(&start * start.transpose(), |moments, _| after(moments)).trace();
    let mut sum = 0.0;
    for _ in 0..runs {
        let mut state = start.clone();
        for _ in 0..patterns {
            let lost = (0..lossy.packets.len())
                .filter(|_| random.unit() < rate)
                .fold(0, |set, packet| set | 1 << packet);
            state = &maps[lost].1 * state;
        }
        sum += state.norm_squared();
    }
    let mean = sum / f64::from(runs);
    assert!((mean - expected).abs() < 0.03 * expected, "{mean} {expected}");
}

#[test]
fn a_packet_that_depends_on_itself_is_found() {
    let packets = [0..1, 1..3];
    let mut d = DMatrix::zeros(3, 3);
    d[(2, 0)] = 1.0;
    assert!(lossy_loop::is_causal(&d, &packets));
    d[(0, 1)] = 1.0;
    assert!(!lossy_loop::is_causal(&d, &packets));
}

/// Forces and motions of many clients, on a network whose pattern has several steps.
#[test]
fn many_packets_have_a_limit_too() {
    let scene = cotouch_scene::load("single-axis-centralized", &[]).unwrap();
    let scene = with_override(&scene, "session.users", 5.0).unwrap();
    let scene = with_override(&scene, "rates.network_hz", 1024.0 / 2.5).unwrap();
    let spec = compile(&scene).remove(0).spec;
    assert!(lossy(&spec).packets.len() == 16);
    let rate = limit(&spec).unwrap();
    assert!(rate > 0.0 && rate < 1.0, "{rate}");
}
