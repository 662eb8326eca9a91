//! Margins are where the verdict turns.

use cotouch_analysis::{Margins, analyze_settled, margins};
use cotouch_scene::scene::{Architecture, PlayOut, WallSides};
use cotouch_scene::time::Rate;
use cotouch_scene::{Scene, with_override};
use cotouch_testkit::scenes::{edited, grasp, spring, table_6_1, with_users};

fn of(scene: &Scene) -> Margins {
    margins(scene, &[], &|_| true).unwrap()
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

/// The scene with so many times its rates; their ratio is that of the smallest whole numbers within 2e-4 of it.
fn with_rates(scene: &Scene, control: f64, network: f64) -> Scene {
    let ratio = scene.rates.control_hz.hz() * control / (scene.rates.network_hz.hz() * network);
    let nearest = |q: u64| ((ratio * q as f64).round() as u64, q);
    let is_near = |&(p, q): &(u64, u64)| (p as f64 / q as f64 / ratio - 1.0).abs() < 2e-4;
    let (p, q) = (1..).map(nearest).find(is_near).unwrap();
    let micro_hz = (1e6 * scene.rates.control_hz.hz() * control).round() as u64;
    edited(scene, |scene| {
        scene.rates.control_hz = Rate::new(micro_hz, 1_000_000).unwrap();
        scene.rates.network_hz = Rate::new(micro_hz * q, 1_000_000 * p).unwrap();
    })
}

/// Which rates a limit is of: how much of each is left where `factor` is left.
type Lowered = fn(f64) -> (f64, f64);

fn limits(margins: &Margins) -> Vec<(Option<f64>, Lowered)> {
    let [network, control] = &margins.rates[..] else { panic!("{margins:?}") };
    assert_eq!([&network.key[..], &control.key[..]], ["rates.network_hz", "rates.control_hz"]);
    vec![
        (network.factor, |factor| (1.0, factor)),
        (control.factor, |factor| (factor, 1.0)),
        (margins.rates_together_factor, |factor| (factor, factor)),
    ]
}

#[test]
fn rates_may_sink_so_far() {
    let mut found = 0;
    for scene in scenes() {
        let margins = of(&scene);
        let [network, control] = &margins.rates[..] else { panic!("{margins:?}") };
        for (margin, present) in [(network, 128.0), (control, 1024.0)] {
            assert_eq!(margin.hz, margin.factor.map(|factor| factor * present));
        }
        assert_eq!(margins.rates_together_hz, margins.rates_together_factor.map(|factor| factor * 1024.0));
        for (factor, lowered) in limits(&margins) {
            let Some(factor) = factor else { continue };
            let verdict = |factor: f64| {
                let (control, network) = lowered(factor);
                is_stable(&with_rates(&scene, control, network))
            };
            assert!(verdict(1.001 * factor) && !verdict(0.999 * factor), "{factor} {margins:?}");
            // Stable all the way.
            for step in 1..20 {
                assert!(verdict((1.001 * factor).powf(f64::from(step) / 20.0)), "{step} {margins:?}");
            }
            found += 1;
        }
    }
    assert!(found >= 6, "{found}");
}

#[test]
fn a_mass_on_a_sampled_spring_and_damper_may_be_sampled_as_slowly_as_the_closed_form_says() {
    // Under hold, it settles iff T·k < 2·b and T·b < 2·m.
    for (stiffness, damping, mass, limit_hz) in [(1000.0, 1.0, 0.2, 500.0), (100.0, 20.0, 0.05, 200.0)] {
        let scene = edited(&table_6_1(Architecture::Distributed), |scene| {
            scene.hand.stiffness_n_per_m = 100.0;
            scene.hand.damping_n_s_per_m = 1.0;
            scene.object.mass_kg = mass;
            scene.object.damping_n_s_per_m = 0.0;
            scene.wall.stiffness_n_per_m = stiffness;
            scene.wall.damping_n_s_per_m = damping;
            scene.wall.sides = WallSides::Two;
            scene.coupling.hand_object = spring(0.0, 0.0);
            scene.coupling.remote_hand_object = spring(0.0, 0.0);
            scene.coupling.object_object = spring(0.0, 0.0);
        });
        let margins = of(&scene);
        let near = |hz: Option<f64>| hz.is_some_and(|hz| (hz / limit_hz - 1.0).abs() < 5e-4);
        assert!(near(margins.rates[1].hz) && near(margins.rates_together_hz), "{limit_hz} {margins:?}");
        assert_eq!(margins.rates[0].hz, None, "nothing is read over the network");
        assert!(
            margins.notes.iter().any(|note| note.contains("rates.network_hz") && note.contains("2.000 Hz"))
        );
    }
}

fn parsed(text: &str) -> Scene {
    cotouch_scene::parse(text, "test", None, &[]).unwrap()
}

/// A leader's hand and a follower on one bus, with one spring and damper between them.
const BUS: &str = r#"
space = "line"
session = { architecture = "centralized", users = 2 }
rates = { control_hz = 1000, network_hz = 1000 }
link = { delay_periods = 1 }
hand = { mass_kg = 0.05, damping_n_s_per_m = 0.5 }
object = { mass_kg = 0.05, damping_n_s_per_m = 0.5 }
[coupling]
hand_object = { stiffness_n_per_m = 0, damping_n_s_per_m = 0 }
remote_hand_object = { stiffness_n_per_m = 300, damping_n_s_per_m = 4 }
"#;

/// A hand on a heavy object, and a second one that is tied to nothing.
const HAND: &str = r#"
space = "line"
session = { users = 2 }
rates = { control_hz = 1000, network_hz = 100 }
link = { delay_periods = 0 }
hand = { mass_kg = 0.1, damping_n_s_per_m = 1 }
object = { mass_kg = 1000 }
[coupling]
hand_object = { stiffness_n_per_m = 1500, damping_n_s_per_m = 0.2 }
remote_hand_object = { stiffness_n_per_m = 0, damping_n_s_per_m = 0 }
object_object = { stiffness_n_per_m = 0, damping_n_s_per_m = 0 }
"#;

#[test]
fn rates_of_one_bus_sink_together() {
    let margins = of(&parsed(BUS));
    let together = margins.rates_together_hz.unwrap();
    // From the eigenvalues of the six states written out by hand, the object's damper held between ticks as in a session.
    assert!((together - 123.844).abs() < 0.01, "{together}");
    let factor = |margins: &Margins| {
        let gain =
            margins.gains.iter().find(|gain| gain.key.starts_with("coupling.remote_hand_object.stiff"));
        gain.unwrap().factor.unwrap()
    };
    assert!((factor(&margins) - 13.637).abs() < 1e-3);
    let at_500_hz = with_rates(&parsed(BUS), 0.5, 0.5);
    assert!((factor(&of(&at_500_hz)) - 6.529).abs() < 1e-3);
    // The haptic rate alone cannot be lower than the bus's.
    assert_eq!(margins.rates[1].hz, None);
    assert!(margins.notes.iter().any(|note| note.contains("cannot be lower than rates.network_hz")));
}

#[test]
fn a_limit_lies_between_whole_ratios_of_rates() {
    let margins = of(&parsed(HAND));
    let control = margins.rates[1].hz.unwrap();
    assert!((control - 623.43).abs() < 0.05, "{control}");
    let single_axis = cotouch_scene::load("single-axis", &[]).unwrap();
    assert!(is_stable(&with_rates(&single_axis, 140.0 / 1024.0, 1.0)));
    assert!(of(&single_axis).rates[1].hz.is_none_or(|hz| hz < 140.0));
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

/// Every cure makes every mode stable, a gain's limit lies where the verdict turns, and nearer values of it cure nothing.
fn assert_cures(scene: &Scene, margins: &Margins) {
    assert!(!margins.stable && !margins.cures.is_empty(), "{margins:?}");
    for cure in &margins.cures {
        assert_eq!(scene.number(&cure.key), Some(cure.value));
        assert!(is_stable(&with(scene, &cure.key, cure.to)), "{cure:?}");
        let Some(limit) = cure.limit else { continue };
        let outward = (limit / cure.value - 1.0).signum();
        assert!((cure.to / limit - 1.0) * outward > 5e-3, "safely inside: {cure:?}");
        assert!(!is_stable(&with(scene, &cure.key, limit * (1.0 - outward * 1e-3))), "{cure:?}");
        assert!(is_stable(&with(scene, &cure.key, limit * (1.0 + outward * 1e-3))), "{cure:?}");
    }
}

#[test]
fn an_unstable_scene_is_told_what_cures_it() {
    let scene = edited(&table_6_1(Architecture::Distributed), |scene| {
        scene.coupling.remote_hand_object = spring(5000.0, 2.0);
        scene.link.delay_periods = 1;
    });
    let margins = of(&scene);
    assert_cures(&scene, &margins);
    let remote = margins.cures.iter().find(|cure| cure.key.starts_with("coupling.remote_hand_object.stiff"));
    assert!(remote.is_some_and(|cure| cure.to < 5000.0), "{margins:?}");
    let sizes = margins.cures.iter().filter(|cure| cure.limit.is_some());
    let sizes: Vec<f64> = sizes.map(|cure| (cure.limit.unwrap() / cure.value).ln().abs()).collect();
    assert!(sizes.is_sorted(), "{margins:?}");
}

#[test]
fn a_grasp_with_longer_delays_is_cured_by_turning_its_copies_less_firmly() {
    let grasp = with(&cotouch_scene::load("grasp", &[]).unwrap(), "link.delay_periods", 2.0);
    let grasp = with(&grasp, "object.mass_kg", 0.3);
    let margins = of(&grasp);
    assert_cures(&grasp, &margins);
    let key = "coupling.object_object_rotational.stiffness_n_m_per_rad";
    let cure = margins.cures.iter().find(|cure| cure.key == key).unwrap();
    assert!((cure.limit.unwrap() - 6.2).abs() < 0.01 && cure.to < 6.2, "{cure:?}");
    assert!(margins.cures.iter().any(|cure| cure.key == "link.delay_periods" && cure.to == 1.0));
}

#[test]
fn what_no_single_change_cures_is_said_plainly() {
    // Two dampers below zero, each enough to make a hand or the object grow.
    let scene = edited(&table_6_1(Architecture::Centralized), |scene| {
        scene.object.damping_n_s_per_m = -200.0;
        scene.coupling.hand_object = spring(9e5, 900.0);
        scene.coupling.remote_hand_object = spring(9e5, 900.0);
    });
    let margins = of(&scene);
    assert!(!margins.stable && margins.cures.is_empty(), "{margins:?}");
    assert!(margins.notes.iter().any(|note| note.starts_with("No change of a single gain")), "{margins:?}");
}

#[test]
fn loss_is_told_for_every_delay_that_is_allowed() {
    let scene = &scenes()[1];
    let margins = of(scene);
    let rows = &margins.delay_and_loss;
    let delays: Vec<u32> = rows.iter().map(|row| row.delay_periods).collect();
    let last = margins.delay_periods.unwrap().floor() as u32;
    assert_eq!(delays, (1..=last).collect::<Vec<u32>>());
    for row in rows {
        let later = with(scene, "link.delay_periods", f64::from(row.delay_periods));
        assert_eq!(row.loss_rate, of(&later).loss_rate);
    }
}

#[test]
fn who_does_not_want_to_know_any_more_gets_no_margins() {
    let scene = cotouch_scene::load("single-axis", &[]).unwrap();
    let shares = std::sync::Mutex::new(Vec::new());
    let until = |limit: f64| {
        cotouch_analysis::margins(&scene, &[], &|share| {
            shares.lock().unwrap().push(share);
            share < limit
        })
    };
    assert!(matches!(until(0.3), Err(cotouch_analysis::SweepError::GivenUp)));
    assert!(shares.lock().unwrap().iter().all(|&share| share < 0.7), "the rest was not begun");
    until(2.0).unwrap();
}
