use cotouch_scene::{Scene, load};

use super::closed_loop;
use crate::poles::judge;
use crate::soft::Bodies;
use crate::soft::closed_body::ClosedBodies;
use crate::soft::compile::{described, fingers};
use crate::soft::touched::touched_body;
use crate::stability::analyze_settled;
use crate::verdict::LoopStability;

fn scene(name: &str, settings: &[&str]) -> Scene {
    let overrides: Vec<_> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    load(name, &overrides).unwrap()
}

/// The whole, what fingers observe, and the largest eigenvalue of what they do not.
fn both(scene: &Scene, bodies: &Bodies, set: &[usize]) -> (LoopStability, LoopStability, f64) {
    let (prepared, fingers) = (bodies.prepared(scene).unwrap(), fingers(scene));
    let body = prepared.seen_from(set);
    let of = || described(scene, &prepared, &fingers, set, &body, true).unwrap();
    let closed = ClosedBodies::new(&of()).unwrap();
    let verdict = |spec| judge(&spec, false).unwrap();
    let unobservable = closed.unobservable.map_or(0.0, |value| value.norm());
    (verdict(touched_body(of())), verdict(closed_loop(&closed, of())), unobservable)
}

fn is_closed(settings: &[&str]) -> bool {
    let scene = scene("soft-block", settings);
    let (prepared, fingers) = (Bodies::default().prepared(&scene).unwrap(), fingers(&scene));
    let (set, body) = ([0, 1, 2], prepared.seen_from(&[0, 1, 2]));
    ClosedBodies::new(&described(&scene, &prepared, &fingers, &set, &body, true).unwrap()).is_some()
}

/// Every eigenvalue that is nearly as large as the largest.
fn assert_same(whole: &LoopStability, observed: &LoopStability, label: &str) {
    let (expected, found) = (whole.spectral_radius, observed.spectral_radius);
    assert!((found / expected - 1.0).abs() < 1e-11, "{label}: {found} {expected}");
    for value in observed.eigenvalues.iter().filter(|value| value.norm() > 0.9 * expected) {
        let near = |other: &nalgebra::Complex<f64>| (other - value).norm() < 1e-9 * expected;
        assert!(whole.eigenvalues.iter().any(near), "{label}: {value}");
    }
}

#[test]
fn an_organ_as_two_users_observe_it_has_the_verdict_of_the_whole() {
    let bodies = Bodies::default();
    let mut unstable = 0;
    for kind in ["hold", "p", "compliance"] {
        for hold in ["zero", "first"] {
            for returned in ["first", "mean", "last"] {
                for delay in ["0", "2"] {
                    let settings = [
                        "session.users=2".to_owned(),
                        format!("local_model.kind={kind}"),
                        format!("local_model.hold={hold}"),
                        format!("local_model.returned_force={returned}"),
                        format!("local_model.result_delay_periods={delay}"),
                    ];
                    let scene = scene("organ", &settings.each_ref().map(String::as_str));
                    for set in [vec![1], vec![0, 1]] {
                        let (whole, observed, _) = both(&scene, &bodies, &set);
                        assert_same(&whole, &observed, &format!("{settings:?} {set:?}"));
                        unstable += usize::from(!observed.stable);
                    }
                }
            }
        }
    }
    assert!(unstable > 0);
}

/// Rates without a common measure, two fingers at one host.
#[test]
fn a_block_as_fingers_observe_it_has_the_verdict_of_the_whole() {
    let bodies = Bodies::default();
    for settings in [["local_model.kind=p"], ["local_model.kind=hold"], ["local_model.kind=compliance"]] {
        for set in [vec![0, 1], vec![2], vec![0, 1, 2]] {
            let (whole, observed, _) = both(&scene("soft-block", &settings), &bodies, &set);
            assert_same(&whole, &observed, &format!("{settings:?} {set:?}"));
        }
    }
}

/// A host whose finger touches nothing has a body on which the others press: it may be what is largest.
#[test]
fn what_no_finger_observes_counts() {
    let settings = ["session.users=2", "local_model.hold=first", "local_model.returned_force=last"];
    let (whole, observed, unobservable) = both(&scene("organ", &settings), &Bodies::default(), &[0]);
    assert_same(&whole, &observed, "unobservable");
    assert!((unobservable / whole.spectral_radius - 1.0).abs() < 1e-11);
    let rest = observed
        .eigenvalues
        .iter()
        .map(|value| value.norm())
        .filter(|norm| *norm < unobservable * (1.0 - 1e-6));
    assert!(rest.fold(0.0, f64::max) < 0.99 * unobservable);
}

#[test]
fn bodies_stay_whole_where_more_than_fingers_tell_counts() {
    assert!(is_closed(&[]));
    assert!(!is_closed(&["local_model.kind=pi"]));
    assert!(!is_closed(&["session.architecture=centralized"]));
    // Periods of 17 and 18 ticks.
    assert!(!is_closed(&["local_model.hold=first"]));
    assert!(is_closed(&["local_model.hold=first", "local_model.returned_force=first"]));
}

/// 1496 states of which every host's fingers observe some 65.
#[test]
fn eight_users_on_an_organ_have_a_verdict() {
    const OF_THE_WHOLE: f64 = 0.796_053_757_372_070_5;
    let found = analyze_settled(&scene("organ", &["session.users=8"])).unwrap();
    assert!(found.each_mode_is_stable() && found.states < 700, "{}", found.states);
    let all = found.modes.iter().find(|mode| mode.contacts.len() == 8).unwrap();
    assert!((all.spectral_radius / OF_THE_WHOLE - 1.0).abs() < 1e-11, "{}", all.spectral_radius);
}

#[test]
fn forces_that_cancel_but_for_rounding_have_the_verdict_of_the_whole() {
    // A quasi-static body gives way by what the law of compliance takes back, whenever its results come.
    let radius = |delay: u32| {
        let settings = [
            "local_model.kind=compliance".to_owned(),
            "local_model.stiffness_n_per_m=700".to_owned(),
            "soft.mesh.stiffness_n_per_m=310".to_owned(),
            format!("local_model.result_delay_periods={delay}"),
        ];
        analyze_settled(&scene("spring", &settings.each_ref().map(String::as_str))).unwrap().spectral_radius
    };
    for delay in 0..=4 {
        assert!((radius(delay) - 0.178_614_487_235).abs() < 1e-8, "{delay}: {}", radius(delay));
    }
    for name in ["soft-block", "balloon"] {
        let settings = ["local_model.kind=compliance", "soft.quasi_static=true"];
        let stability = analyze_settled(&scene(name, &settings)).unwrap();
        assert!(stability.spectral_radius < 0.9, "{name}: {}", stability.spectral_radius);
    }
}

#[test]
fn a_local_model_without_stiffness_is_a_loop_of_hands_alone() {
    for kind in ["hold", "p", "compliance"] {
        let settings = [format!("local_model.kind={kind}"), "local_model.stiffness_ratio=0".to_owned()];
        let stability = analyze_settled(&scene("balloon", &settings.each_ref().map(String::as_str))).unwrap();
        assert!(stability.each_mode_is_stable(), "{kind}: {}", stability.spectral_radius);
    }
}
