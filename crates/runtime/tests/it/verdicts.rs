//! What runs are called: the same however long they go on, whatever bounds what shakes.

use cotouch_runtime::{Divergence, RunVerdict, Summary, virtual_run};
use cotouch_scene::scene::{Action, Scene};
use glam::DVec3;

fn load(scene: &str, settings: &[&str]) -> Scene {
    let settings: Vec<_> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    cotouch_scene::load(scene, &settings).unwrap()
}

fn run(scene: &Scene, duration_s: f64) -> Summary {
    let summary = virtual_run::run(scene, duration_s, None, |_| true).unwrap();
    assert_eq!(summary.stable, summary.verdict == RunVerdict::Quiet);
    assert_eq!(summary.diverged.is_some(), summary.verdict == RunVerdict::Diverging);
    summary
}

#[test]
fn a_part_that_chatters_at_the_force_limit_is_not_stable_at_any_duration() {
    let part = load(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/verdicts/part.toml"), &[]);
    for duration_s in [5.0, 8.0, 12.0] {
        let summary = run(&part, duration_s);
        assert_eq!(summary.verdict, RunVerdict::Diverging, "{duration_s} s: {summary:?}");
        let shaking = &summary.shaking[0];
        assert_eq!((shaking.user.as_str(), shaking.finger), ("anna", 1));
        assert!((2.5..3.5).contains(&shaking.from_s) && shaking.rms_n > 1.0, "{shaking:?}");
    }
}

#[test]
fn a_limit_cycle_that_friction_bounds_shakes() {
    let scene = load("grasp-centralized", &[]);
    for duration_s in [6.0, 20.0] {
        let summary = run(&scene, duration_s);
        assert_eq!(summary.verdict, RunVerdict::Shaking, "{duration_s} s: {:?}", summary.diverged);
        let of = |user: &str| summary.shaking.iter().any(|shaking| shaking.user == user && shaking.hz > 8.0);
        assert!(of("anna") && of("ben"), "{:?}", summary.shaking);
    }
}

#[test]
fn what_grew_is_told_though_it_ends_quietly() {
    let settings =
        ["local_model.kind=pi", "local_model.stiffness_ratio=0.3", "local_model.integral_ratio=0.5"];
    let summary = run(&load("soft-block", &settings), 20.0);
    assert_ne!(summary.verdict, RunVerdict::Quiet);
    assert!(summary.shaking.iter().any(|shaking| shaking.rms_n > 0.5 && shaking.to_s < 15.0));
}

#[test]
fn runs_that_end_in_a_touch_are_quiet() {
    for (name, durations_s) in
        [("soft-block", [5.0, 2.3]), ("organ", [3.0, 2.1]), ("stack", [2.0, 3.1]), ("sinusoid", [2.0, 1.6])]
    {
        for duration_s in durations_s {
            let summary = run(&load(name, &[]), duration_s);
            assert!(summary.stable, "{name} {duration_s} s: {:?} {:?}", summary.diverged, summary.shaking);
        }
    }
}

#[test]
fn what_a_script_asks_for_is_no_shaking() {
    let asked = [
        Action::Tremor { rms_n: DVec3::X * 0.5, duration_s: 60.0 },
        Action::SinusoidalForce {
            amplitude_n: DVec3::X,
            frequency_hz: 10.0,
            phase_rad: 0.0,
            duration_s: 60.0,
        },
    ];
    for action in asked {
        let scene = load("single-axis", &[]).edit(|scene| {
            scene.users[0].script = vec![action.clone()];
        });
        let summary = run(&scene.unwrap(), 8.0);
        assert!(summary.stable, "{action:?}: {:?} {:?}", summary.diverged, summary.shaking);
    }
}

#[test]
fn past_the_line_a_session_shakes_or_diverges_and_before_it_it_is_quiet() {
    // The line is at 1412 N/m.
    for (stiffness, settles) in [(1300, true), (1380, true), (1470, false), (1600, false), (2500, false)] {
        let setting = format!("coupling.object_object.stiffness_n_per_m={stiffness}");
        let summary = run(&load("single-axis", &[&setting]), 30.0);
        assert_eq!(summary.stable, settles, "{stiffness} N/m: {:?} {:?}", summary.diverged, summary.shaking);
        // Near the line it grows too slowly to be called more than shaking for as long as it is below the limits.
        let cause = summary.diverged.map(|diverged| diverged.cause);
        let grew = matches!(cause, Some(Divergence::Growth | Divergence::GovernorLimit));
        assert!(grew || stiffness < 1600, "{stiffness} N/m: {cause:?}");
    }
}
