//! Rigid-body poles of loops with blocks, against all eigenvalues of their maps.

use cotouch_scene::scene::{Architecture, Scene, VelocityEstimate};
use cotouch_testkit::scenes::{built_in, edited, grasp, spring, table_6_1, with_users};

use nalgebra::Complex;

use crate::compile::schemes_with_memory::{Filtered, WithMemory};
use crate::compile::{compile, compile_with_schemes};
use crate::loop_spec::LoopSpec;
use crate::{LoopStability, analyze_loop, eigenvalues};

use std::sync::Arc;

const DISTRIBUTED: Architecture = Architecture::Distributed;

fn modes(scene: &Scene, share: f64, filtered: Filtered) -> Vec<LoopSpec> {
    let modes = compile_with_schemes(scene, |gains| Arc::new(WithMemory { gains, share, filtered }));
    modes.into_iter().map(|mode| mode.spec).collect()
}

/// The share of a first-order low pass of 50 Hz at 1024 Hz.
fn share_at_50_hz() -> f64 {
    -(-std::f64::consts::TAU * 50.0 / 1024.0).exp_m1()
}

/// The verdict, held to the eigenvalues of the whole map: double ones are found to half the digits.
fn verdict(spec: &LoopSpec) -> LoopStability {
    const ONE: f64 = 1e-5;
    let verdict = analyze_loop(spec).unwrap();
    let all = eigenvalues(&spec.lift_shared().unwrap().matrix).unwrap();
    let (ones, others): (Vec<Complex<f64>>, Vec<_>) =
        all.iter().partition(|value| (**value - 1.0).norm() < ONE);
    assert_eq!(ones.len(), usize::from(verdict.rigid_body_poles) + verdict.loose_parts, "{verdict:?}");
    if verdict.loose_parts == 0 {
        let radius = others.iter().map(|value| value.norm()).fold(0.0, f64::max);
        assert!((radius - verdict.spectral_radius).abs() < 1e-9, "{radius} {}", verdict.spectral_radius);
    }
    verdict
}

#[test]
fn a_scheme_that_reads_differences_leaves_the_whole_free() {
    let scene = built_in("single-axis", &[]);
    let found = verdict(&modes(&scene, share_at_50_hz(), Filtered::Apart)[0]);
    assert_eq!((found.rigid_body_poles, found.loose_parts), (1, 0));
    assert!((found.drag_pole.unwrap() - 0.9024).abs() < 5e-5, "{:?}", found.drag_pole);
    assert!(found.stable);
}

#[test]
fn a_scheme_that_sends_places_leaves_the_whole_free() {
    for users in [2, 3] {
        let scene = edited(&with_users(table_6_1(DISTRIBUTED), users), |scene| scene.link.delay_periods = 2);
        for share in [0.2, 0.7, 1.0] {
            let found = verdict(&modes(&scene, share, Filtered::Sent)[0]);
            assert_eq!((found.rigid_body_poles, found.loose_parts), (1, 0));
            assert!(found.drag_pole.is_some());
        }
    }
}

#[test]
fn a_scheme_that_reads_a_place_ties_to_it() {
    let found = verdict(&modes(&table_6_1(DISTRIBUTED), 0.3, Filtered::ToStart)[0]);
    assert_eq!((found.rigid_body_poles, found.loose_parts), (0, 0));
    assert!(found.drag_pole.is_none());
}

#[test]
fn momentum_is_conserved_through_blocks() {
    for velocity in [VelocityEstimate::Exact, VelocityEstimate::Difference, VelocityEstimate::Filtered] {
        let scene = edited(&table_6_1(DISTRIBUTED), |scene| {
            scene.rates.network_hz = scene.rates.control_hz;
            scene.device.velocity = velocity;
            scene.device.velocity_cutoff_hz = 100.0;
        });
        let found = verdict(&modes(&scene, 0.3, Filtered::Apart)[0]);
        assert_eq!((found.rigid_body_poles, found.drag_pole), (2, None), "{velocity:?}");
    }
}

#[test]
fn what_no_stiffness_ties_is_loose() {
    let scene = edited(&table_6_1(DISTRIBUTED), |scene| {
        scene.coupling.object_object = spring(0.0, 3.0);
        scene.coupling.remote_hand_object = spring(0.0, 1.0);
    });
    let pairwise = analyze_loop(&compile(&scene)[0].spec).unwrap();
    let found = verdict(&modes(&scene, 0.3, Filtered::Apart)[0]);
    let poles = |found: &LoopStability| (found.rigid_body_poles, found.loose_parts, found.stable);
    assert_eq!(poles(&pairwise), (2, 1, false));
    assert_eq!(poles(&found), poles(&pairwise));
}

#[test]
fn grasps_have_the_poles_of_their_maps() {
    let free = edited(&grasp(DISTRIBUTED), |scene| {
        scene.link.delay_periods = 0;
        scene.rates.network_hz = scene.rates.control_hz;
    });
    let by_light_hands = grasp(DISTRIBUTED).edit_unchecked(|scene| {
        scene.users.iter_mut().for_each(|user| user.tracking = spring(0.0, 0.0));
    });
    let both = [Filtered::Apart, Filtered::Sent];
    for (scene, schemes) in [(grasp(DISTRIBUTED), &both[..]), (free, &both[..1]), (by_light_hands, &both[..])]
    {
        let pairwise = compile(&scene);
        for &filtered in schemes {
            for (mode, spec) in pairwise.iter().zip(modes(&scene, share_at_50_hz(), filtered)) {
                let (known, found) = (analyze_loop(&mode.spec).unwrap(), verdict(&spec));
                let of = |verdict: &LoopStability| (verdict.rigid_body_poles, verdict.loose_parts);
                if filtered == Filtered::Apart {
                    assert_eq!(of(&known), of(&found), "{:?}", mode.contacts);
                }
            }
        }
    }
}

/// A low pass that goes all the way in one tick is none.
#[test]
fn a_filter_that_passes_everything_changes_nothing() {
    for scene in [built_in("single-axis", &[]), with_users(table_6_1(DISTRIBUTED), 3), grasp(DISTRIBUTED)] {
        for (mode, spec) in compile(&scene).iter().zip(modes(&scene, 1.0, Filtered::Apart)) {
            let (known, found) = (analyze_loop(&mode.spec).unwrap(), verdict(&spec));
            assert_eq!(known.rigid_body_poles, found.rigid_body_poles, "{:?}", mode.contacts);
            assert!((known.spectral_radius - found.spectral_radius).abs() < 1e-9);
            match (known.drag_pole, found.drag_pole) {
                (Some(known), Some(found)) => assert!((known - found).abs() < 1e-9, "{known} {found}"),
                (known, found) => assert_eq!(known, found, "{:?}", mode.contacts),
            }
        }
    }
}
