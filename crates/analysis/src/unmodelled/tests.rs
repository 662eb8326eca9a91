use cotouch_runtime::scripted_demand;
use cotouch_scene::scene::Scene;
use cotouch_scene::{AskedForce, DemandExtent, ScriptedDemand};

use super::{limits, unmodelled};
use crate::left_out::LeftOut;

fn load(name: &str, set: &[&str]) -> Scene {
    let set: Vec<_> = set.iter().map(|text| text.parse().unwrap()).collect();
    cotouch_scene::load(name, &set).unwrap()
}

/// The keys that are named as left out.
fn keys(left_out: &[LeftOut]) -> Vec<String> {
    let in_brackets = |text: &str| match text.rsplit_once('(') {
        Some((_, rest)) => rest.strip_suffix(')').unwrap().to_owned(),
        None => text.to_owned(),
    };
    left_out.iter().map(|left_out| in_brackets(&left_out.what)).collect()
}

/// The limits that the scene's own scripts may meet.
fn limits_met(name: &str, set: &[&str]) -> Vec<String> {
    let scene = load(name, set);
    keys(&limits(&scene, &scripted_demand(&scene, &|| true)))
}

#[test]
fn nothing_of_the_built_in_scenes_is_left_out_because_of_its_keys() {
    for name in cotouch_scene::builtin::names() {
        assert_eq!(keys(&unmodelled(&load(name, &[]))), Vec::<String>::new(), "{name}");
        assert_eq!(limits_met(name, &[]), Vec::<String>::new(), "{name}");
    }
}

#[test]
fn what_acts_and_is_in_no_loop_is_named_by_its_key() {
    let rows: &[(&str, &[&str], &[&str])] = &[
        (
            "single-axis",
            &["device.kind=phantom", "device.encoder_counts_per_turn=1000000", "device.velocity=difference"],
            &["device.encoder_counts_per_turn"],
        ),
        ("sinusoid", &["device.encoder_counts_per_turn=1000"], &["device.encoder_counts_per_turn"]),
        ("sinusoid", &["device.inertia=true"], &["device.inertia"]),
        ("single-axis", &["governor.passivity_control=true"], &["governor.passivity_control"]),
        ("single-axis", &["link.impairment.loss_rate=0.01"], &["link.impairment.loss_rate"]),
        // More than one loss in a row is as rare as the link has it: of 0.3, gaps of 0.05 s are not.
        (
            "sinusoid",
            &["link.impairment.loss_rate=0.3"],
            &["link.impairment.loss_rate", "session.rejoin_after_s"],
        ),
        (
            "single-axis",
            &["session.peer_timeout_s=0.01", "link.impairment.loss_rate=0.5"],
            &["link.impairment.loss_rate", "session.peer_timeout_s"],
        ),
        // Between two samples a peer is silent by itself.
        (
            "single-axis",
            &["session.peer_timeout_s=0.1", "rates.network_hz=8"],
            &["session.peer_timeout_s", "session.rejoin_after_s"],
        ),
        (
            "single-axis",
            &["link.play_out=on-arrival", "link.impairment.jitter_s=0.03"],
            // Of so slow a link, e^-8 of the packets keep all others waiting for a quarter of a second.
            &["link.impairment.jitter_s", "session.peer_timeout_s", "session.rejoin_after_s"],
        ),
        ("single-axis", &["link.impairment.jitter_s=0.003"], &["link.impairment.jitter_s"]),
        // Buffered for 7.8 ms, of which 0.1 ms is used in the mean: e^-78 come late.
        ("single-axis", &["link.impairment.jitter_s=0.0001"], &[]),
        ("single-axis", &["link.impairment.latency_s=0.02", "link.impairment.duplicate_rate=0.5"], &[]),
        (
            "single-axis",
            &["link.impairment.rate_limit_bytes_per_s=1e5"],
            &["link.impairment.rate_limit_bytes_per_s"],
        ),
        ("single-axis", &["link.impairment.outage_duration_s=0.6"], &["link.impairment.outage_duration_s"]),
        ("soft-block", &["local_model.stiffness_from=estimate"], &["local_model.stiffness_from"]),
    ];
    for (name, set, expected) in rows {
        assert_eq!(keys(&unmodelled(&load(name, set))), *expected, "{name} {set:?}");
    }
}

#[test]
fn limits_that_scripts_may_meet_are_named_by_their_keys() {
    let rows: &[(&str, &str, &[&str])] = &[
        ("sinusoid", "device.max_joint_torque_n_m=0.05", &["device.max_joint_torque_n_m"]),
        ("sinusoid", "device.max_joint_torque_n_m=50", &[]),
        ("single-axis", "governor.max_slew_n_per_s=3", &["governor.max_slew_n_per_s"]),
        ("sinusoid", "governor.max_slew_n_per_s=20", &["governor.max_slew_n_per_s"]),
        // Of 0.1 N, the default slew passes as little in a tick.
        ("single-axis", "governor.max_force_n=0.1", &["governor.max_force_n", "governor.max_slew_n_per_s"]),
    ];
    for (name, set, expected) in rows {
        assert_eq!(limits_met(name, &[set]), *expected, "{name} {set}");
    }
}

/// What is said of limits where anna's second finger asks for so much.
fn said(set: &[&str], force_n: f64, change_n: f64, extent: DemandExtent) -> Vec<String> {
    let asked = |newtons| AskedForce { newtons, user: "anna".to_owned(), finger: 1, at_s: 1.25 };
    let demand = ScriptedDemand { force: asked(force_n), change: asked(change_n), extent };
    limits(&load("grasp", set), &demand).iter().map(ToString::to_string).collect()
}

#[test]
fn a_limit_that_one_and_a_half_times_the_found_force_and_a_pointer_reach_is_left_out() {
    let whole = || DemandExtent::Whole;
    assert_eq!(said(&[], 12.0, 0.0, whole()), Vec::<String>::new());
    let [near] = &said(&[], 12.1, 0.0, whole())[..] else { panic!("one limit") };
    assert!(near.contains("asks for 12.100 N at finger 2 at 1.250 s; 1.5 times that"), "{near}");
    let [over] = &said(&[], 32.8, 0.0, whole())[..] else { panic!("one limit") };
    assert!(over.starts_with("The limit of forces at 20 N (governor.max_force_n)"), "{over}");
    assert!(over.ends_with("anna's script asks for 32.800 N at finger 2 at 1.250 s."), "{over}");
    let [slew] = &said(&["governor.max_slew_n_per_s=10240"], 3.0, 8.0, whole())[..] else {
        panic!("one limit")
    };
    assert!(
        slew.contains("(governor.max_slew_n_per_s)") && slew.contains("8.000 N more within one tick"),
        "{slew}"
    );
}

#[test]
fn what_of_the_scripts_was_not_looked_at_is_left_out() {
    let [until] = &said(&[], 1.0, 1.0, DemandExtent::Until { at_s: 300.0 })[..] else { panic!("one") };
    assert!(until.contains("after 300.0 s"), "{until}");
    let [diverged] = &said(&[], 1.0, 1.0, DemandExtent::Diverged { at_s: 2.5 })[..] else { panic!("one") };
    assert!(diverged.contains("2.500 s"), "{diverged}");
    let not_run = DemandExtent::NotRun { why: "nobody came".to_owned() };
    let [not_run] = &said(&[], 0.0, 0.0, not_run)[..] else { panic!("one") };
    assert!(not_run.contains("nobody came"), "{not_run}");
}
