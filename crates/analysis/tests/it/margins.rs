//! Margins are where the verdict turns.

use cotouch_analysis::{Margins, analyze_settled, margins};
use cotouch_scene::scene::{Architecture, PlayOut, WallSides};
use cotouch_scene::time::Rate;
use cotouch_scene::{Scene, with_override};
use cotouch_testkit::scenes::{edited, grasp, spring, table_6_1, with_users};

fn of(scene: &Scene) -> Margins {
    margins(scene, &|_| true).unwrap()
}

fn is_stable(scene: &Scene) -> bool {
    analyze_settled(scene).unwrap().each_mode_is_stable()
}

fn with(scene: &Scene, key: &str, value: f64) -> Scene {
    with_override(scene, key, value).unwrap()
}

/// Scenes of both kinds; one whose wall is touched or not.
fn scenes() -> Vec<Scene> {
    let mut scenes = vec![table_6_1(Architecture::Distributed), table_6_1(Architecture::Centralized)];
    for scene in &mut scenes {
        *scene = edited(scene, |scene| {
            scene.link.delay_periods = 1;
            scene.hand.damping_n_s_per_m = 2.0;
        });
    }
    let walled = edited(&scenes[0].clone(), |walled| {
        walled.wall.stiffness_n_per_m = 800.0;
        walled.wall.sides = WallSides::One;
        walled.object.damping_n_s_per_m = 0.5;
    });
    scenes.push(walled);
    scenes
}

#[test]
fn a_gain_may_grow_or_shrink_so_far() {
    for scene in scenes() {
        let margins = of(&scene);
        assert!(margins.stable);
        let mut limits = 0;
        for gain in &margins.gains {
            for (factor, outward) in [(gain.factor, 1.0), (gain.lower_factor, -1.0)] {
                let Some(factor) = factor else { continue };
                let verdict = |by: f64| is_stable(&with(&scene, &gain.key, gain.value * factor * by));
                let inside = factor == 0.0 || verdict(1.0 - outward * 1e-6);
                assert!(inside && !verdict(1.0 + outward * 1e-6), "{gain:?}");
                limits += 1;
            }
        }
        assert!(limits >= 5, "{margins:?}");
    }
}

#[test]
fn gains_that_do_not_act_are_not_listed() {
    let keys = |scene: &Scene| of(scene).gains.into_iter().map(|gain| gain.key).collect::<Vec<_>>();
    let centralized = keys(&scenes()[1]);
    assert!(!centralized.iter().any(|key| key.contains("object_object") || key.contains("tangential")));
    assert!(!centralized.iter().any(|key| key.starts_with("wall")), "{centralized:?}");
    assert!(keys(&scenes()[2]).contains(&"wall.stiffness_n_per_m".to_owned()));
}

#[test]
fn the_delay_may_grow_so_far() {
    for scene in scenes() {
        let delay = of(&scene).delay_periods.unwrap();
        let verdict = |periods: f64| is_stable(&with(&scene, "link.delay_periods", periods));
        assert!(delay >= 1.0 && (8.0 * delay).fract() == 0.0, "{delay}");
        assert!(verdict(delay.floor()) && !verdict(delay.floor() + 1.0), "{delay}");
        // On arrival, with the same age of samples, both ways: as many ticks, where the link has no round trip in one.
        if scene.session.architecture == Architecture::Distributed {
            let mut on_arrival = scene.clone();
            on_arrival = edited(&on_arrival, |on_arrival| {
                on_arrival.link.play_out = PlayOut::OnArrival;
                on_arrival.link.impairment.latency_s = 1.0 / 128.0;
            });
            assert_eq!(of(&on_arrival).delay_periods, Some(delay));
            let verdict = |ticks: f64| {
                on_arrival =
                    edited(&on_arrival, |on_arrival| on_arrival.link.impairment.latency_s = ticks / 1024.0);
                is_stable(&on_arrival)
            };
            let turns = [8.0 * delay, 8.0 * delay + 1.0].map(verdict);
            assert_eq!(turns, [true, false], "{delay}");
        }
    }
}

#[test]
fn rates_may_sink_so_far() {
    for scene in scenes() {
        for margin in of(&scene).rates {
            let present = scene.number(&margin.key).unwrap();
            let (Some(hz), Some(factor)) = (margin.hz, margin.factor) else { continue };
            assert!((hz - factor * present).abs() < 1e-9 && hz <= present);
            let verdict = |ratio: u64| {
                let scene = edited(&scene, |scene| {
                    if margin.key == "rates.network_hz" {
                        scene.rates.network_hz = Rate::new(1024, ratio).unwrap();
                    } else {
                        scene.rates.control_hz = Rate::new(128 * ratio, 1).unwrap();
                    }
                });
                is_stable(&scene)
            };
            let (at, beyond) = if margin.key == "rates.network_hz" {
                let ratio = (1024.0 / hz).round() as u64;
                (ratio, ratio + 1)
            } else {
                let ratio = (hz / 128.0).round() as u64;
                (ratio, ratio - 1)
            };
            assert!(verdict(at) && !verdict(beyond), "{margin:?}");
        }
    }
}

#[test]
fn some_packets_may_be_lost() {
    let [distributed, centralized, _] = &scenes()[..] else { panic!("three scenes") };
    let rate = of(centralized).loss_rate.unwrap();
    assert!(rate > 0.0 && rate < 1.0, "{rate}");
    // A later round trip bears fewer losses.
    assert!(of(&with(centralized, "link.delay_periods", 0.0)).loss_rate.is_none_or(|without| without > rate));
    // Every copy settles while nothing arrives, and each sample that does arrive moves it towards the others.
    let without_limit = of(distributed);
    assert_eq!(without_limit.loss_rate, Some(1.0));
    assert!(without_limit.notes.iter().any(|note| note.contains("99.99 %")), "{:?}", without_limit.notes);
    // Forces and motions of many clients.
    let crowd = of(&with_users(centralized.clone(), 6));
    assert!(crowd.stable && crowd.loss_rate.is_some_and(|rate| rate > 0.0 && rate < 1.0), "{crowd:?}");
}

#[test]
fn an_unstable_scene_has_no_margins() {
    let scene = edited(&table_6_1(Architecture::Distributed), |scene| {
        scene.coupling.remote_hand_object = spring(5000.0, 2.0)
    });
    let margins = of(&scene);
    assert!(!margins.stable && margins.gains.is_empty() && margins.rates.is_empty());
    assert!(margins.delay_periods.is_none() && margins.loss_rate.is_none());
    assert!(margins.notes[0].contains("unstable"), "{margins:?}");
    let grasp =
        of(&with(&grasp(Architecture::Centralized), "coupling.remote_hand_object.stiffness_n_per_m", 3000.0));
    assert!(!grasp.stable && grasp.notes[0].contains("contact"), "{grasp:?}");
}

#[test]
fn who_does_not_want_to_know_any_more_gets_no_margins() {
    let scene = cotouch_scene::load("single-axis", &[]).unwrap();
    let shares = std::sync::Mutex::new(Vec::new());
    let until = |limit: f64| {
        cotouch_analysis::margins(&scene, &|share| {
            shares.lock().unwrap().push(share);
            share < limit
        })
    };
    assert!(matches!(until(0.3), Err(cotouch_analysis::SweepError::GivenUp)));
    assert!(shares.lock().unwrap().iter().all(|&share| share < 0.7), "the rest was not begun");
    until(2.0).unwrap();
}
