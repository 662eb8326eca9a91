//! The running code and the analysis describe the same loop, coordinate by coordinate.
//!
//! The analysis lifts a scene to the exact map of its state over one pattern of ticks and network steps. Here the same
//! map is measured on the running session, protocol, wire format, simulated links and governor included: each
//! coordinate is moved by ±h about rest, one pattern is run, and every coordinate is read again.

use crate::support::{Probe, lifted, scene};
use cotouch_analysis::LiftedMap;
use cotouch_scene::scene::Scene;
use cotouch_testkit::scenes::edited;

/// Largest difference of an element, as a share of the matrix's norm.
const TOLERANCE: f64 = 1e-9;

fn assert_agreement(scene: &Scene, label: &str) {
    let map: LiftedMap = lifted(scene);
    let mut probe = Probe::at_rest(scene);
    let norm = map.matrix.norm();
    assert!(norm > 1.0, "{label}: a map without content agrees with anything");
    for (column, &coordinate) in map.coordinates.iter().enumerate() {
        let measured = probe.column(coordinate, &map.coordinates);
        for (row, value) in measured.iter().enumerate() {
            let expected = map.matrix[(row, column)];
            assert!(
                (value - expected).abs() <= TOLERANCE * norm,
                "{label}: d {} / d {coordinate} is {expected} in the analysis and {value} in the running code",
                map.coordinates[row],
            );
        }
    }
}

fn for_each_loop(users: u32, check: impl Fn(&Scene, &str)) {
    for architecture in ["distributed", "centralized"] {
        for n in 0..=3 {
            for ticks_per_step in [1, 2, 5, 8] {
                for integrator in ["exact-hold", "semi-implicit-euler"] {
                    for (stiffness, wall) in [(0, 0), (200, 0), (0, 30_000), (200, 30_000)] {
                        let settings = [
                            format!("session.architecture={architecture}"),
                            format!("session.users={users}"),
                            format!("session.integrator={integrator}"),
                            format!("link.delay_periods={n}"),
                            format!("rates.network_hz=1024/{ticks_per_step}"),
                            format!("hand.stiffness_n_per_m={stiffness}"),
                            format!("wall.stiffness_n_per_m={wall}"),
                        ];
                        let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
                        check(&scene(&settings), &settings.join(" "));
                    }
                }
            }
        }
    }
}

#[test]
fn two_users() {
    for_each_loop(2, assert_agreement);
}

#[test]
fn three_users() {
    for_each_loop(3, assert_agreement);
}

#[test]
fn average_coordination_rates_without_a_common_tick_and_links_with_latency() {
    for settings in [
        &["session.coordination=average", "session.users=3"][..],
        &["rates.control_hz=1000", "rates.network_hz=128"],
        &[
            "rates.control_hz=1000",
            "rates.network_hz=300",
            "session.architecture=centralized",
            "link.delay_periods=2",
        ],
        &["link.impairment.latency_s=0.012", "link.delay_periods=1"],
        &["link.impairment.latency_s=0.012", "link.delay_periods=3"],
        &["link.impairment.latency_s=0.0035", "link.play_out=on-arrival"],
        &["link.impairment.latency_s=0.02", "link.play_out=on-arrival"],
        &["link.play_out=on-arrival"],
        &["link.play_out=on-arrival", "session.architecture=centralized", "link.impairment.latency_s=0.003"],
        &["session.architecture=centralized", "link.delay_periods=3", "link.return_delay_periods=2"],
        &["session.architecture=centralized", "link.delay_periods=1", "link.impairment.latency_s=0.01"],
        &["hand.damping_n_s_per_m=5", "governor.damping_n_s_per_m=1.5", "object.damping_n_s_per_m=-3"],
    ] {
        assert_agreement(&scene(settings), &settings.join(" "));
    }
}

#[test]
fn hands_that_track_are_compiled_with_their_tracking() {
    let scene = edited(&scene(&[]), |scene| {
        for user in &mut scene.users {
            user.tracking.stiffness_n_per_m = 300.0;
            user.tracking.damping_n_s_per_m = 4.0;
            user.script = vec![cotouch_scene::scene::Action::Hold { duration_s: 1000.0 }];
        }
    });
    assert_agreement(&scene, "tracking");
}
