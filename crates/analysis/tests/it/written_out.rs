//! The full map against a session that is written out tick by tick: column by column, for every kind of scene.

use crate::naive::Simulation;
use cotouch_analysis::{LiftedMap, compile};
use cotouch_scene::scene::{Action, Architecture, Coordination, Integrator, PlayOut, Scene, WallSides};
use cotouch_testkit::scenes::{edited, latency, spring, table_6_1, way, with_ratio, with_users};

const BOTH: [Architecture; 2] = [Architecture::Distributed, Architecture::Centralized];

fn assert_columns_agree(scene: &Scene) {
    for mode in compile(scene) {
        let wall = scene.wall.exists() && (scene.wall.sides == WallSides::Two || !mode.contacts.is_empty());
        let LiftedMap { matrix, coordinates } = mode.spec.lift().unwrap();
        let steps = scene.schedule().steps_per_pattern() as i64;
        for (column, &from) in coordinates.iter().enumerate() {
            let mut simulation = Simulation::new(scene, wall, 24);
            *simulation.number(from, 0) = 1.0;
            simulation.pattern();
            for (row, &to) in coordinates.iter().enumerate() {
                let expected = *simulation.number(to, steps);
                let difference = (matrix[(row, column)] - expected).abs();
                assert!(
                    difference <= 1e-12 * matrix.column(column).amax().max(1.0),
                    "{from} → {to}: {} and {expected}, off by {difference:e}",
                    matrix[(row, column)]
                );
            }
        }
    }
}

/// Something in every term of the loop.
fn furnished(architecture: Architecture) -> Scene {
    edited(&table_6_1(architecture), |scene| {
        scene.hand.damping_n_s_per_m = 5.0;
        scene.object.damping_n_s_per_m = -0.7;
        scene.governor.damping_n_s_per_m = 0.3;
    })
}

#[test]
fn users_delays_ratios_and_integrators() {
    for architecture in BOTH {
        for users in [2, 3] {
            for n in 0..4 {
                for ratio in [1, 2, 5, 8] {
                    for integrator in [Integrator::ExactHold, Integrator::SemiImplicitEuler] {
                        let scene =
                            edited(&with_ratio(with_users(furnished(architecture), users), ratio), |scene| {
                                scene.link.delay_periods = n;
                                scene.session.integrator = integrator;
                            });
                        assert_columns_agree(&scene);
                    }
                }
            }
        }
    }
}

#[test]
fn rates_that_do_not_divide() {
    for architecture in BOTH {
        for (control, network) in [("1000", "128"), ("5", "3"), ("1000", "999"), ("7", "2")] {
            for n in [0, 2] {
                let scene = edited(&furnished(architecture), |scene| {
                    scene.rates.control_hz = control.parse().unwrap();
                    scene.rates.network_hz = network.parse().unwrap();
                    scene.link.delay_periods = n;
                    if control.len() == 1 {
                        // As slow as the rates.
                        scene.coupling.hand_object = spring(0.3, 0.02);
                        scene.coupling.remote_hand_object = spring(0.04, 0.01);
                        scene.coupling.object_object = spring(0.05, 0.01);
                        scene.hand.damping_n_s_per_m = 0.1;
                    }
                    if control == "1000" && network == "999" {
                        scene.coupling.hand_object = spring(30.0, 1.0);
                    }
                });
                assert_columns_agree(&scene);
            }
        }
    }
}

#[test]
fn hands_walls_and_coordination() {
    for architecture in BOTH {
        for coordination in [Coordination::Pairwise, Coordination::Average] {
            for sides in [WallSides::Two, WallSides::One] {
                let scene = edited(&with_users(furnished(architecture), 3), |scene| {
                    scene.session.coordination = coordination;
                    scene.hand.stiffness_n_per_m = 200.0;
                    scene.wall.stiffness_n_per_m = 3000.0;
                    scene.wall.damping_n_s_per_m = 20.0;
                    scene.wall.position_m = 0.05;
                    scene.wall.sides = sides;
                    scene.users[1].tracking = spring(150.0, 4.0);
                    scene.users[1].script = vec![Action::Hold { duration_s: 1.0 }];
                    scene.users[2].tracking = spring(150.0, 4.0);
                    scene.users[2].script = vec![Action::Relax { duration_s: 1.0 }];
                    scene.link.delay_periods = 1;
                });
                assert_columns_agree(&scene);
            }
        }
    }
}

#[test]
fn round_trips_split_between_the_ways() {
    for n in 0..4 {
        for back in 0..=n {
            let scene = edited(&with_users(furnished(Architecture::Centralized), 3), |scene| {
                scene.link.delay_periods = n;
                scene.link.return_delay_periods = back;
            });
            assert_columns_agree(&scene);
        }
    }
}

#[test]
fn latencies_of_every_direction() {
    let tick_s = 1.0 / 1024.0;
    for architecture in BOTH {
        for play_out in [PlayOut::Scheduled, PlayOut::OnArrival] {
            for latency_ticks in [0.0f64, 0.3, 1.0, 7.5, 8.0, 8.2, 20.0] {
                for ratio in [1, 8] {
                    let scene = edited(&with_ratio(with_users(furnished(architecture), 3), ratio), |scene| {
                        scene.link.play_out = play_out;
                        scene.link.delay_periods = 1;
                        scene.link.impairment = latency(latency_ticks.min(5.0) * tick_s);
                        scene.link.ways =
                            vec![way(1, 0, 3.3 * tick_s / 4.0), way(0, 2, latency_ticks * tick_s)];
                    });
                    assert_columns_agree(&scene);
                }
            }
        }
    }
}

#[test]
fn latencies_with_rates_that_do_not_divide() {
    for architecture in BOTH {
        for play_out in [PlayOut::Scheduled, PlayOut::OnArrival] {
            for latency_s in [0.000_4, 0.003, 0.007_9, 0.008, 0.017] {
                let scene = edited(&furnished(architecture), |scene| {
                    scene.rates.control_hz = "1000".parse().unwrap();
                    scene.link.play_out = play_out;
                    scene.link.impairment = latency(latency_s);
                });
                assert_columns_agree(&scene);
            }
        }
    }
}
