//! What must hold for every loop.

use cotouch_analysis::loop_spec::LoopSpec;
use cotouch_analysis::{analyze_loop, analyze_settled, compile, eigenvalues, spectral_radius};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, Architecture};
use cotouch_testkit::scenes::{any_scene, coordinations, edited, spring, table_6_1, with_ratio, with_users};
use nalgebra::DMatrix;
use proptest::prelude::*;

/// Sums of powers of the eigenvalues: as many equal ones as there are states mean equal eigenvalues other than 0.
fn power_sums(matrix: &DMatrix<f64>, count: usize) -> Vec<f64> {
    let mut power = matrix.clone();
    let mut sums = Vec::new();
    for _ in 0..count {
        sums.push(power.trace());
        power = &power * matrix;
    }
    sums
}

fn assert_same_spectrum(one: &LoopSpec, other: &LoopSpec) {
    let (one, other) = (one.lift().unwrap().matrix, other.lift_shared().unwrap().matrix);
    let count = one.nrows().min(other.nrows()).min(24);
    for (a, b) in power_sums(&one, count).into_iter().zip(power_sums(&other, count)) {
        assert!((a - b).abs() <= 1e-8 * (1.0 + a.abs()), "{a} {b}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn sharing_samples_changes_no_eigenvalue(scene in any_scene()) {
        let spec = &compile(&scene)[0].spec;
        assert_same_spectrum(spec, spec);
    }

    #[test]
    fn relabelling_users_changes_nothing(scene in any_scene(), by in 1u8..4) {
        // Only the server of a centralized session is special.
        let users = scene.session.users;
        let first = u8::from(scene.session.architecture == Architecture::Centralized);
        let moved = |host: HostIndex| {
            if host.0 < first { host } else { HostIndex((host.0 - first + by) % (users - first) + first) }
        };
        let scene = edited(&scene, |scene| {
            scene.users[usize::from(users) - 1].tracking = spring(70.0, 2.0);
            scene.users[usize::from(users) - 1].script = vec![Action::Hold { duration_s: 1.0 }];
        });
        let relabelled = edited(&scene, |relabelled| {
            for host in HostIndex::all(users) {
                relabelled.users[moved(host).index()] = scene.users[host.index()].clone();
            }
            for way in &mut relabelled.link.ways {
                (way.from, way.to) = (moved(way.from), moved(way.to));
            }
        });
        assert_same_spectrum(&compile(&scene)[0].spec, &compile(&relabelled)[0].spec);
    }

    #[test]
    fn the_poles_left_over_and_the_structural_ones_are_all(scene in any_scene()) {
        let spec = &compile(&scene)[0].spec;
        let verdict = analyze_loop(spec).unwrap();
        let matrix = spec.lift_shared().unwrap().matrix;
        prop_assert_eq!(verdict.eigenvalues.len() + usize::from(verdict.rigid_body_poles), matrix.nrows());
        for (power, sum) in (1..=6).zip(power_sums(&matrix, 6)) {
            let remaining: f64 = verdict.eigenvalues.iter().map(|value| value.powi(power).re).sum();
            let all = remaining + f64::from(verdict.rigid_body_poles);
            prop_assert!((all - sum).abs() <= 1e-8 * (1.0 + sum.abs()), "{} {}", all, sum);
        }
    }

    #[test]
    fn any_finite_matrix_has_eigenvalues(numbers in prop::collection::vec(-1e3..1e3, 49), zeros in any::<u64>()) {
        let matrix = DMatrix::from_fn(7, 7, |i, j| {
            if zeros >> (i * 7 + j) & 1 == 1 { 0.0 } else { numbers[i * 7 + j] }
        });
        let values = eigenvalues(&matrix).unwrap();
        let trace: f64 = values.iter().map(|value| value.re).sum();
        prop_assert!((trace - matrix.trace()).abs() <= 1e-9 * (1.0 + spectral_radius(&values)));
    }
}

#[test]
fn where_the_round_trip_is_split_changes_no_eigenvalue() {
    for ratio in [1, 3, 8] {
        let split = |back| {
            let scene =
                edited(&with_ratio(with_users(table_6_1(Architecture::Centralized), 3), ratio), |scene| {
                    scene.link.delay_periods = 3;
                    scene.link.return_delay_periods = back;
                });
            compile(&scene).remove(0).spec
        };
        // Every cycle through a client passes both of its ways, so only their sum counts.
        for back in 1..=3 {
            assert_same_spectrum(&split(0), &split(back));
        }
    }
}

#[test]
fn sixteen_users_are_tractable() {
    for coordination in coordinations() {
        let scene = edited(&with_users(table_6_1(Architecture::Distributed), 16), |scene| {
            scene.session.coordination = coordination;
            scene.link.delay_periods = 2;
        });
        let verdict = analyze_settled(&scene).unwrap();
        assert_eq!(verdict.states, 64 + 16 * 15 * 4 * 2);
        assert_eq!(verdict.rigid_body_poles, 1);
    }
}

#[test]
fn what_nothing_ties_to_the_rest_is_not_stable() {
    let scene = edited(&table_6_1(Architecture::Centralized), |scene| {
        scene.coupling.remote_hand_object = spring(0.0, 1.0)
    });
    let verdict = analyze_settled(&scene).unwrap();
    assert_eq!(verdict.stable, Some(false));
    assert_eq!(verdict.spectral_radius, 1.0);
    assert!(verdict.warnings.iter().any(|warning| warning.contains("no stiffness")));
}

#[test]
fn a_state_that_outgrows_floating_point_is_unstable() {
    let scene = table_6_1(Architecture::Distributed).edit_unchecked(|scene| {
        scene.rates.control_hz = "1000".parse().unwrap();
        scene.coupling.hand_object = spring(1e9, 0.0);
    });
    let verdict = analyze_settled(&scene).unwrap();
    assert_eq!(verdict.stable, Some(false));
    assert!(serde_json::to_value(&verdict).unwrap()["spectral_radius"].is_null());
}
