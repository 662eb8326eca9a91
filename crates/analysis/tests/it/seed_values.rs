//! Figures from the seeds, as exact computation gives them.

use cotouch_analysis::{Switching, analyze_loop, analyze_settled, compile};
use cotouch_scene::scene::{Architecture, SceneValues, WallSides};
use cotouch_testkit::scenes::{chapter_5, edited, spring, table_6_1, with_ratio};

use crate::whole::analyze;

#[test]
fn overdone_compensation_drives_the_drag_pole_past_one() {
    let mut scene = table_6_1(Architecture::Distributed);
    scene = edited(&scene, |scene| scene.object.damping_n_s_per_m = -3.0);
    let verdict = analyze(&scene).unwrap();
    assert_eq!(verdict.rigid_body_poles, 1);
    assert!((verdict.drag_pole.unwrap() - 1.0074).abs() < 5e-5, "{:?}", verdict.drag_pole);
    assert_eq!(verdict.stable, Some(false));
    assert_eq!(verdict.spectral_radius, verdict.drag_pole.unwrap());
    scene = edited(&scene, |scene| scene.object.damping_n_s_per_m = 0.0);
    let verdict = analyze(&scene).unwrap();
    assert!(verdict.stable == Some(true) && verdict.drag_pole.unwrap() < 1.0);
}

#[test]
fn a_second_rigid_body_pole_needs_equal_opposite_forces_at_every_tick() {
    for ratio in [1, 2, 8] {
        for n in 0..4 {
            let distributed =
                edited(&with_ratio(table_6_1(Architecture::Distributed), ratio), |distributed| {
                    distributed.link.delay_periods = n
                });
            let expected = if ratio == 1 && n == 0 { 2 } else { 1 };
            assert_eq!(analyze(&distributed).unwrap().rigid_body_poles, expected, "distributed {ratio} {n}");
            for back in 0..=n {
                let centralized =
                    edited(&with_ratio(table_6_1(Architecture::Centralized), ratio), |centralized| {
                        centralized.link.delay_periods = n;
                        centralized.link.return_delay_periods = back;
                    });
                let verdict = analyze(&centralized).unwrap();
                assert_eq!(
                    verdict.rigid_body_poles,
                    if ratio == 1 { 2 } else { 1 },
                    "centralized {ratio} {n}"
                );
                assert_eq!(verdict.drag_pole.is_none(), ratio == 1);
            }
        }
    }
}

/// The momentum's left eigenvector, found from the map alone, belongs to a defective pole exactly where structure says.
#[test]
fn the_left_eigenvector_of_a_double_pole_ignores_translation() {
    for architecture in [Architecture::Distributed, Architecture::Centralized] {
        for (ratio, n) in [(1, 0), (1, 2), (2, 0), (8, 1)] {
            let scene =
                edited(&with_ratio(table_6_1(architecture), ratio), |scene| scene.link.delay_periods = n);
            let spec = &compile(&scene)[0].spec;
            let map = spec.lift_shared().unwrap();
            let size = map.coordinates.len();
            let shifted = map.matrix.transpose() - nalgebra::DMatrix::identity(size, size);
            let decomposition = shifted.clone().svd(false, true);
            let smallest = decomposition.singular_values.imin();
            let left = decomposition.v_t.unwrap().row(smallest).transpose();
            assert!((shifted * &left).amax() < 1e-9);
            let is_position = |index: usize| map.coordinates[index].to_string().contains(".x");
            let translation = nalgebra::DVector::from_fn(size, |index, _| f64::from(is_position(index)));
            let overlap = left.dot(&translation).abs() / left.amax();
            let double = analyze_loop(spec).unwrap().rigid_body_poles == 2;
            assert_eq!(overlap < 1e-8, double, "{architecture:?} {ratio} {n}: {overlap:e}");
        }
    }
}

#[test]
fn the_ground_takes_the_rigid_body_poles_away() {
    for architecture in [Architecture::Distributed, Architecture::Centralized] {
        let scene = with_ratio(table_6_1(architecture), 1);
        assert_eq!(analyze(&scene).unwrap().rigid_body_poles, 2);
        let poles = |change: &dyn Fn(&mut SceneValues)| {
            let verdict = analyze(&edited(&scene, change)).unwrap();
            (verdict.rigid_body_poles, verdict.drag_pole.is_some())
        };
        assert_eq!(poles(&|scene| scene.hand.stiffness_n_per_m = 50.0), (0, false));
        assert_eq!(poles(&|scene| scene.wall.stiffness_n_per_m = 50.0), (0, false));
        assert_eq!(poles(&|scene| scene.users[1].tracking = spring(50.0, 1.0)), (2, false));
        assert_eq!(poles(&|scene| scene.wall.damping_n_s_per_m = 1.0), (1, true));
        assert_eq!(poles(&|scene| scene.hand.damping_n_s_per_m = 1.0), (1, true));
        assert_eq!(poles(&|scene| scene.object.damping_n_s_per_m = -1e-9), (1, true));
        assert_eq!(poles(&|scene| scene.governor.damping_n_s_per_m = 1.0), (1, true));
    }
}

/// Fig 5.1 with b = 10 N·s/m: at n = 2 and 3 the held damper alone passes its limit.
#[test]
fn the_centralized_region_is_empty_from_two_periods_on() {
    let stiffnesses = [1.0, 10.0, 100.0, 300.0, 1000.0, 3000.0];
    let any_stable = |n| {
        stiffnesses.iter().any(|&k1| {
            let is_stable = |&k2: &f64| {
                analyze(&chapter_5(Architecture::Centralized, [k1, k2, 0.0], n))
                    .unwrap()
                    .each_mode_is_stable()
            };
            stiffnesses.iter().any(is_stable)
        })
    };
    assert_eq!([0, 1, 2, 3].map(any_stable), [true, true, false, false]);
}

/// b·T_t/m_h has the limit 2·sin(π/(4n + 2)): a mass that a held damper brakes n periods late.
#[test]
fn a_late_damper_has_its_closed_form_limit() {
    use cotouch_analysis::loop_spec::{
        Delay, Dynamics, LINE, Line, LoopBody, LoopSpec, Motion, Plant, Signal,
    };
    use cotouch_scene::names::{Coordinate, HostIndex, Part, Quantity};
    for n in 0..4u32 {
        let limit = 2.0 * (std::f64::consts::PI / f64::from(4 * n + 2)).sin();
        let is_stable = |factor: f64| {
            let schedule = table_6_1(Architecture::Centralized).schedule();
            let mut spec = LoopSpec::new(schedule);
            let (host, from) = (HostIndex(0), HostIndex(1));
            let states = [Quantity::X, Quantity::V].map(|quantity| Coordinate::Own {
                host,
                part: Part::HAND,
                quantity,
            });
            let dynamics = Dynamics::Plant(Plant::mass(0.1, spring(0.0, 0.0)));
            let hand = spec.body(LoopBody { states: states.to_vec(), axes: LINE, dynamics });
            let damper = spring(0.0, factor * limit * 0.1 * 128.0);
            let force = spec.spring(Motion::Current(hand), Motion::Ground, damper);
            let delay = Delay::Scheduled { periods: n, transit_ticks: 0 };
            let line = spec.line(Line { host, from, part: Part::FORCE, signal: Signal::Force(force), delay });
            spec.apply_held(hand, line);
            let verdict = analyze_loop(&spec).unwrap();
            assert_eq!(verdict.rigid_body_poles, 1);
            verdict.stable
        };
        assert!(is_stable(1.0 - 1e-9) && !is_stable(1.0 + 1e-9), "{n}");
    }
}

#[test]
fn a_one_sided_wall_gives_two_modes() {
    let mut scene = table_6_1(Architecture::Distributed);
    scene = edited(&scene, |scene| {
        scene.wall.stiffness_n_per_m = 30_000.0;
        scene.wall.damping_n_s_per_m = 20.0;
        scene.wall.sides = WallSides::One;
    });
    let whole = analyze(&scene).unwrap();
    assert_eq!((whole.stable, whole.left_out.len(), whole.switching), (Some(true), 0, Switching::Searched));
    // Of the two copies one alone, and which one is all the same.
    assert!(whole.modes.iter().any(|mode| mode.contacts[..].concat().contains("copy)")));
    assert_eq!(whole.modes.len(), 3);
    let verdict = analyze_settled(&scene).unwrap();
    let contacts: Vec<_> = verdict.modes.iter().map(|mode| mode.contacts.clone()).collect();
    assert_eq!(contacts, [vec![], vec!["wall".to_owned()]]);
    assert!(verdict.warnings.iter().any(|warning| warning.contains("unproven")));
    scene = edited(&scene, |scene| scene.wall.sides = WallSides::Two);
    assert_eq!(analyze(&scene).unwrap().stable, Some(true));
    let two_sided = analyze_settled(&scene).unwrap();
    assert_eq!(two_sided.modes.len(), 1);
    assert_eq!(two_sided.spectral_radius, verdict.modes[1].spectral_radius);
}

#[test]
fn the_document_has_the_agreed_fields() {
    let document = serde_json::to_value(analyze(&table_6_1(Architecture::Distributed)).unwrap()).unwrap();
    for key in ["spectral_radius", "stable", "rigid_body_poles", "drag_pole", "states", "period_s", "modes"] {
        assert!(document.get(key).is_some(), "{key}");
    }
    assert_eq!(document["period_s"], 1.0 / 128.0);
    assert_eq!(document["states"], 8);
    assert_eq!(document["modes"][0]["contacts"], serde_json::json!([]));
}
