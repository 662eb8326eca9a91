//! What users perceive of a soft object, against closed forms and a simulation in time.

use cotouch_analysis::transparency::{AdmittanceQuantity, added_damping, admittance, equivalent_stiffness};
use cotouch_scene::Scene;
use cotouch_scene::names::HostIndex;
use cotouch_soft::{MaterialPoint, soft_body};
use cotouch_testkit::scenes::{built_in, edited};
use glam::DVec3;
use nalgebra::{Complex, DVector};

const ARCHITECTURES: [&str; 2] = ["distributed", "centralized"];

fn scene(name: &str, overrides: &[String]) -> Scene {
    built_in(name, &overrides.iter().map(String::as_str).collect::<Vec<_>>())
}

fn set(key: &str, value: impl std::fmt::Display) -> String {
    format!("{key}={value}")
}

fn stiffness(scene: &Scene) -> Vec<(f64, f64)> {
    let users = equivalent_stiffness(scene).unwrap().users;
    users.iter().map(|user| (user.stiffness_n_per_m, user.ideal_n_per_m)).collect()
}

fn assert_close(one: f64, other: f64, relative: f64) {
    assert!((one - other).abs() <= relative * other.abs(), "{one} {other}");
}

/// Two springs in a row, and with an integral the object's own: Barbagli et al. 2003, (3) and (6) at rest.
#[test]
fn a_spring_feels_as_its_local_model_says() {
    for (kind, expected) in [("p", 90.0), ("hold", 90.0), ("compliance", 90.0), ("pi", 900.0)] {
        for returned in ["first", "mean", "last"] {
            let overrides = [
                set("local_model.kind", kind),
                set("local_model.returned_force", returned),
                set("local_model.integral_n_per_m", 20),
            ];
            for (felt, ideal) in stiffness(&scene("spring", &overrides)) {
                assert_close(felt, expected, 1e-12);
                assert_close(ideal, 900.0, 1e-12);
            }
        }
    }
}

#[test]
fn the_hand_has_a_spring_of_its_own() {
    let with_hand = scene("spring", &[set("hand.stiffness_n_per_m", 40)]);
    let [(felt, ideal)] = stiffness(&with_hand)[..] else { panic!("one user") };
    assert_close(felt, 90.0 + 40.0, 1e-12);
    assert_close(ideal, 900.0 + 40.0, 1e-12);
    let document = equivalent_stiffness(&with_hand).unwrap();
    assert_eq!(document.ideal_n_per_m, ideal);
    assert!(document.notes.iter().any(|note| note.contains("scripts")), "{:?}", document.notes);
}

/// `1/K = 1/K_h + 1/K_ideal` for a finger that presses anywhere on any body, whoever computes it and however late.
#[test]
fn a_balloon_adds_its_compliance_to_that_of_the_local_model() {
    for architecture in ARCHITECTURES {
        for n in [0, 1] {
            for (kind, kh) in [("p", 30.0), ("hold", 20.0), ("compliance", 300.0)] {
                let overrides = [
                    set("session.architecture", architecture),
                    set("link.delay_periods", n),
                    set("local_model.kind", kind),
                    set("local_model.stiffness_n_per_m", kh),
                ];
                for (felt, ideal) in stiffness(&scene("balloon", &overrides)) {
                    assert_close(felt.recip(), f64::recip(kh) + ideal.recip(), 1e-9);
                }
            }
        }
    }
}

/// The ideal against the body's compliance at nodes of a balloon's skin, over which fingers stand: one presses, two pinch.
#[test]
fn the_ideal_is_the_body_where_it_is_touched() {
    let balloon = scene("balloon", &[]);
    let body = soft_body(&balloon).unwrap();
    let nodes = body.rest_m();
    let towards = |direction: DVec3| {
        let node = |&(_, one): &(usize, &DVec3), &(_, other): &(usize, &DVec3)| {
            one.dot(direction).total_cmp(&other.dot(direction))
        };
        nodes.iter().enumerate().max_by(node).unwrap().0
    };
    let [left, right, top] = [DVec3::NEG_X, DVec3::X, DVec3::Z].map(towards);
    let outward = [left, right, top].map(|node| nodes[node].normalize());
    let above = [left, right, top].map(|node| nodes[node] + 0.03 * nodes[node].normalize());
    let balloon = edited(&balloon, |balloon| {
        let finger = &balloon.users[0].fingers[0];
        balloon.users[0].fingers = vec![finger.clone(), finger.clone()];
        balloon.users[0].fingers[0].position_m = above[0];
        balloon.users[0].fingers[1].position_m = above[1];
        balloon.users[1].fingers[0].position_m = above[2];
    });
    let point = |node: usize| MaterialPoint::on_triangle([node as u32, 0, 1], [1.0, 0.0, 0.0]);
    let compliance = body.compliance(&[left, right, top].map(point)).unwrap();
    let along = |weights: [f64; 3]| {
        let numbers = outward.iter().zip(weights).flat_map(|(&normal, weight)| (normal * weight).to_array());
        let along = DVector::from_iterator(9, numbers);
        along.dot(&(&compliance * &along)).recip()
    };
    let ideals: Vec<f64> = stiffness(&balloon).into_iter().map(|(_, ideal)| ideal).collect();
    assert_close(ideals[0], along([0.5, 0.5, 0.0]), 1e-9);
    assert_close(ideals[1], along([0.0, 0.0, 1.0]), 1e-9);
}

#[test]
fn slow_forces_meet_the_stiffness() {
    let cases = [
        ("spring", "pi", 0.1),
        ("balloon", "compliance", 4.0),
        ("soft-block", "p", 0.4),
        ("organ", "hold", 0.2),
    ];
    for (name, kind, ratio) in cases {
        let ratios = ["stiffness", "integral"].map(|gain| set(&format!("local_model.{gain}_ratio"), ratio));
        let [stiffness_ratio, integral_ratio] = ratios;
        let scene = scene(name, &[set("local_model.kind", kind), stiffness_ratio, integral_ratio]);
        let felt = stiffness(&scene);
        let slow = admittance(&scene, &[1e-3]).unwrap();
        assert_eq!(slow.quantity, AdmittanceQuantity::Position);
        assert_eq!(slow.users.len(), felt.len());
        for (user, (felt, ideal)) in slow.users.iter().zip(felt) {
            assert!(user.stable, "{name} {}", user.name);
            assert_close(user.magnitude[0], felt.recip(), 1e-5);
            assert_close(user.fundamental_magnitude[0], felt.recip(), 1e-5);
            assert_close(user.ideal.magnitude[0], ideal.recip(), 1e-5);
        }
    }
}

#[test]
fn what_is_held_to_the_ground_has_no_damping() {
    for name in ["spring", "organ"] {
        let damping = added_damping(&built_in(name, &[]), HostIndex::FIRST).unwrap();
        assert_eq!((damping.damping_n_s_per_m, damping.mean_damping_n_s_per_m), (None, None));
        assert_eq!(damping.dampers_of_scene_n_s_per_m, 5.0);
        assert!(damping.notes.iter().any(|note| note.contains("no damping")), "{:?}", damping.notes);
    }
}

/// A finger on the scene `spring`, written out: a massless spring K_o whose end is where the force of a slow period's first
/// tick, or the mean of all, put it.
struct Pressed<'a> {
    scene: &'a Scene,
    mean: bool,
    x: f64,
    v: f64,
    surface: f64,
    returned: f64,
}

impl Pressed<'_> {
    const TICKS: usize = 50;
    const TICKS_OF_STEP: usize = 10;
    const SUBSTEPS: usize = 60;

    /// Twice the mean of position times `e^(−jωt)` over the last slow periods: in the middle of substeps, and at the first
    /// ticks of slow periods under a force that is held from network step to network step.
    fn responses(scene: &Scene, mean: bool, frequency: f64, periods: usize) -> [Complex<f64>; 2] {
        [false, true].map(|held| {
            let mut pressed = Pressed { scene, mean, x: 0.0, v: 0.0, surface: 0.0, returned: 0.0 };
            let mut sum = Complex::default();
            for period in 0..20 * periods {
                let counts = period >= 19 * periods;
                sum += pressed.period(period, frequency, held) * f64::from(u8::from(counts));
            }
            sum * 2.0 / periods as f64
        })
    }

    fn period(&mut self, period: usize, frequency: f64, held: bool) -> Complex<f64> {
        let turned = |x: f64, time_s: f64| Complex::from_polar(x, -frequency * time_s);
        self.surface = self.returned / 900.0;
        self.returned = 0.0;
        let mut sum = Complex::default();
        let substep_s = 1e-3 / Self::SUBSTEPS as f64;
        for tick in 0..Self::TICKS {
            let start_s = (period * Self::TICKS + tick) as f64 * 1e-3;
            let force = 100.0 * (self.surface - self.x);
            match (self.mean, tick) {
                (true, _) => self.returned -= force / Self::TICKS as f64,
                (false, 0) => self.returned = -force,
                (false, _) => {}
            }
            if held && tick == 0 {
                sum += turned(self.x, start_s);
            }
            let step_s = (period * Self::TICKS + tick) / Self::TICKS_OF_STEP * Self::TICKS_OF_STEP;
            for substep in 0..Self::SUBSTEPS {
                let middle_s = start_s + (substep as f64 + 0.5) * substep_s;
                let push = (frequency * if held { step_s as f64 * 1e-3 } else { middle_s }).cos();
                let before = self.x;
                self.step(force + push, substep_s);
                if !held {
                    sum += turned(0.5 * (before + self.x), middle_s) / (Self::TICKS * Self::SUBSTEPS) as f64;
                }
            }
        }
        sum
    }

    /// Exactly, under a constant force.
    fn step(&mut self, force: f64, duration_s: f64) {
        let (mass, damping) = (self.scene.hand.mass_kg, self.scene.hand.damping_n_s_per_m);
        let (steady, rate) = (force / damping, damping / mass);
        let rest = (-rate * duration_s).exp();
        self.x += steady * duration_s + (self.v - steady) * (1.0 - rest) / rate;
        self.v = steady + (self.v - steady) * rest;
    }
}

#[test]
fn sinusoidal_forces_on_a_spring_meet_the_predicted_response() {
    for (returned, mean) in [("first", false), ("mean", true)] {
        let overrides =
            [set("local_model.returned_force", returned), set("local_model.result_delay_periods", 0)];
        let scene = scene("spring", &overrides);
        for periods in [3, 7, 40] {
            let frequency = std::f64::consts::TAU * 20.0 / periods as f64;
            let predicted = &admittance(&scene, &[frequency]).unwrap().users[0];
            let [fundamental, slow_rate] = Pressed::responses(&scene, mean, frequency, periods);
            let exact =
                Complex::from_polar(predicted.fundamental_magnitude[0], predicted.fundamental_phase_rad[0]);
            assert!((fundamental - exact).norm() < 1e-5 * exact.norm(), "{fundamental} {exact}");
            let exact = Complex::from_polar(predicted.magnitude[0], predicted.phase_rad[0]);
            assert!((slow_rate - exact).norm() < 1e-9 * exact.norm(), "{slow_rate} {exact}");
        }
    }
}

/// Shares at which a decomposition once went wrong, and others.
#[test]
fn stiffness_at_rest_is_that_of_the_slowest_motion() {
    for ratio in [0.4, 0.5, 0.8, 1.0, 4.0] {
        let overrides = [set("local_model.kind", "compliance"), set("local_model.stiffness_ratio", ratio)];
        let scene = scene("soft-block", &overrides);
        let slowest = admittance(&scene, &[1e-3]).unwrap();
        for ((felt, _), user) in stiffness(&scene).into_iter().zip(&slowest.users) {
            assert_close(felt, user.magnitude[0].recip(), 1e-5);
        }
    }
}

#[test]
fn a_stiffness_that_is_never_come_to_is_told_so() {
    let stable = |kind: &str| {
        let scene = scene("organ", &[set("session.users", 1), set("local_model.kind", kind)]);
        equivalent_stiffness(&scene).unwrap().users[0].stable
    };
    assert!(stable("compliance") && !stable("pi"));
}
