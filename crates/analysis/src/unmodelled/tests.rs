use cotouch_scene::scene::Scene;

use super::demand::demanded_n;
use super::unmodelled;

fn load(name: &str, set: &[&str]) -> Scene {
    let set: Vec<_> = set.iter().map(|text| text.parse().unwrap()).collect();
    cotouch_scene::load(name, &set).unwrap()
}

/// Which keys are named as left out.
fn keys(name: &str, set: &[&str]) -> Vec<String> {
    let in_brackets = |text: &str| {
        let (_, rest) = text.rsplit_once('(').unwrap();
        rest.strip_suffix(')').unwrap().to_owned()
    };
    unmodelled(&load(name, set)).iter().map(|left_out| in_brackets(&left_out.what)).collect()
}

#[test]
fn nothing_of_the_built_in_scenes_is_left_out_because_of_its_keys() {
    for name in cotouch_scene::builtin::names() {
        assert_eq!(keys(name, &[]), Vec::<String>::new(), "{name}");
    }
}

#[test]
fn what_acts_and_is_in_no_loop_is_named_by_its_key() {
    let rows: &[(&str, &[&str], &[&str])] = &[
        (
            "single-axis",
            &["device.kind=phantom", "device.encoder_counts_per_turn=4000", "device.velocity=difference"],
            &["device.encoder_counts_per_turn"],
        ),
        ("sinusoid", &["device.encoder_counts_per_turn=1000"], &["device.encoder_counts_per_turn"]),
        ("sinusoid", &["device.inertia=true"], &["device.inertia"]),
        ("sinusoid", &["device.max_joint_torque_n_m=0.05"], &["device.max_joint_torque_n_m"]),
        ("sinusoid", &["device.max_joint_torque_n_m=50"], &[]),
        ("single-axis", &["governor.max_slew_n_per_s=3"], &["governor.max_slew_n_per_s"]),
        ("sinusoid", &["governor.max_slew_n_per_s=20"], &["governor.max_slew_n_per_s"]),
        // Of 0.1 N, the default slew passes as little in a tick.
        (
            "single-axis",
            &["governor.max_force_n=0.1"],
            &["governor.max_force_n", "governor.max_slew_n_per_s"],
        ),
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
        assert_eq!(keys(name, set), *expected, "{name} {set:?}");
    }
}

#[test]
fn what_a_session_asks_for_is_estimated_by_statics() {
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} and {expected}");
    // Twice the other's newton, and twice a pointer's.
    near(demanded_n(&load("single-axis", &[])), 2.0 * 1.0 + 2.0);
    // The path's finger feels twice the other's 2 N, and a pointer's newton.
    near(demanded_n(&load("sinusoid", &[])), 2.0 * 2.0 + 2.0);
    // Two fingers lift a box of 0.3 kg and its copy, and grip it with 6 N.
    near(demanded_n(&load("hand-over", &[])), 2.0 * (6.0 + 0.3 * 9.81) + 2.0);
    // Grip, three other fingers' shares of 2 N, and 38 mm towards a wall by 200 N/m.
    near(demanded_n(&load("grasp", &[])), 2.0 * (2.0 + 3.0) + 0.038 * 200.0);
    // Devices' own damper at the largest speed of a path: a sinusoid's, and 15/8·d/T.
    let damped = |name: &str| {
        let still = demanded_n(&load(name, &[]));
        demanded_n(&load(name, &["governor.damping_n_s_per_m=3"])) - still
    };
    // 5 cm at 2 rad/s.
    near(damped("sinusoid"), 3.0 * 0.05 * 2.0);
    near(damped("single-axis"), 0.0);
    assert!(damped("hand-over") > 0.0);
}

#[test]
fn a_path_that_ends_inside_a_fixed_body_presses_as_its_spring_does() {
    let pressed = |to: &str| {
        let text = format!(
            r#"
space = "space"
[session]
users = 2
[[body]]
shape = "ball"
radius_m = 0.05
fixed = true
[[user]]
tracking = {{ stiffness_n_per_m = 1000, damping_n_s_per_m = 10 }}
script = [{{ do = "reach", to_m = [{to}, 0, 0], duration_s = 60 }}]
[[user.finger]]
position_m = [0.2, 0, 0]
[[user]]
"#
        );
        demanded_n(&cotouch_scene::parse(&text, "test", None, &[]).unwrap())
    };
    // A finger of 8 mm goes 28 mm deep.
    assert!((pressed("0.03") - 28.0).abs() < 1e-9, "{}", pressed("0.03"));
    assert_eq!(pressed("0.06"), 2.0);
}
