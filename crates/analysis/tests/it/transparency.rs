//! What users perceive, against closed forms, a simulation in time, and what must not matter.

use crate::pushed::{Force, Pushed};
use cotouch_analysis::transparency::{
    AddedDamping, Admittance, AdmittanceQuantity, Reduction, TransparencyError, added_damping, admittance,
    closed_forms, equivalent_stiffness,
};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Coordination, PlayOut, Scene, VelocityEstimate};
use cotouch_testkit::scenes::{coordinations, edited, spring, table_6_1, with_ratio, with_users};
use nalgebra::Complex;
use proptest::prelude::*;

const LOCAL: HostIndex = HostIndex(0);
const REMOTE: HostIndex = HostIndex(1);

fn close(one: f64, other: f64, relative: f64) -> bool {
    (one - other).abs() <= relative * other.abs()
}

fn damping(scene: &Scene, user: HostIndex) -> AddedDamping {
    added_damping(scene, user).unwrap()
}

/// Against a wall that may be stiffer than those of scenes.
fn against_wall(scene: &Scene, stiffness: f64) -> Scene {
    scene.edit_unchecked(|scene| {
        scene.wall.stiffness_n_per_m = stiffness;
        scene.wall.damping_n_s_per_m = 20.0;
    })
}

fn slow_rate(admittance: &Admittance, user: usize, index: usize) -> Complex<f64> {
    let user = &admittance.users[user];
    Complex::from_polar(user.magnitude[index], user.phase_rad[index])
}

fn fundamental(admittance: &Admittance, user: usize, index: usize) -> Complex<f64> {
    let user = &admittance.users[user];
    Complex::from_polar(user.fundamental_magnitude[index], user.fundamental_phase_rad[index])
}

#[test]
fn table_6_1_brakes_as_computed_independently() {
    let at = |ratio, n| {
        let scene = edited(&with_ratio(table_6_1(Architecture::Distributed), ratio), |scene| {
            scene.link.delay_periods = n
        });
        damping(&scene, LOCAL)
    };
    let simplified = at(2, 0).simplified_damping_n_s_per_m.unwrap();
    assert!((simplified - 0.148_321_46).abs() < 5e-9, "{simplified}");
    assert!((at(8, 0).damping_n_s_per_m.unwrap() - 2.04).abs() < 5e-3);
    assert!((at(8, 0).simplified_damping_n_s_per_m.unwrap() - 1.07).abs() < 5e-3);
    assert!((at(8, 1).simplified_damping_n_s_per_m.unwrap() - 3.42).abs() < 5e-3);
    let centralized = |ratio| {
        let scene = with_ratio(table_6_1(Architecture::Centralized), ratio);
        assert_eq!(damping(&scene, LOCAL).damping_n_s_per_m, Some(0.0));
        assert_eq!(damping(&scene, REMOTE).simplified_damping_n_s_per_m, Some(0.0));
        damping(&scene, REMOTE).damping_n_s_per_m.unwrap()
    };
    assert!((centralized(2) - 0.0417).abs() < 5e-5);
    assert!((centralized(8) - 0.29).abs() < 5e-3);
}

#[test]
fn compensation_moves_the_drag_pole_and_can_move_it_too_far() {
    let mut scene = table_6_1(Architecture::Distributed);
    let plain = damping(&scene, LOCAL);
    let compensation = plain.compensation_n_s_per_m.unwrap();
    assert_eq!(compensation, -plain.simplified_damping_n_s_per_m.unwrap());
    scene = edited(&scene, |scene| scene.object.damping_n_s_per_m = compensation);
    let compensated = damping(&scene, LOCAL);
    assert_eq!(plain.damping_if_compensated_n_s_per_m, compensated.damping_n_s_per_m);
    assert_eq!(plain.drag_pole_if_compensated, compensated.drag_pole);
    assert!(plain.drag_pole.unwrap() < compensated.drag_pole.unwrap());
    assert!(compensated.drag_pole.unwrap() < 1.0);
    assert!(compensated.damping_n_s_per_m.unwrap() < 0.5 * plain.damping_n_s_per_m.unwrap());
    // Obtained at n = 1, used at n = 0.
    scene = edited(&scene, |scene| scene.object.damping_n_s_per_m = -3.0);
    let overdone = damping(&scene, LOCAL);
    assert!((overdone.drag_pole.unwrap() - 1.0074).abs() < 5e-5);
    assert!(overdone.damping_n_s_per_m.unwrap() < 0.0);
    assert!(!admittance(&scene, &[1.0]).unwrap().users[0].stable);
}

fn any_scene(architecture: Architecture) -> impl Strategy<Value = Scene> {
    let springs = prop::array::uniform3((50.0..3000.0, 0.0..15.0));
    (springs, 0.05..0.5, 0.2..1.5, 500.0_f64..2000.0).prop_map(move |(springs, m_h, m_o, rate)| {
        let mut scene = table_6_1(architecture);
        let [local, remote, copies] = springs.map(|(k, b)| spring(k, b));
        scene = edited(&scene, |scene| {
            scene.coupling.hand_object = local;
            scene.coupling.remote_hand_object = remote;
            scene.coupling.object_object = copies;
            scene.hand.mass_kg = m_h;
            scene.object.mass_kg = m_o;
        });
        let rate = rate.round() as u64;
        scene = edited(&scene, |scene| {
            scene.rates.control_hz = format!("{rate}").parse().unwrap();
            scene.rates.network_hz = format!("{rate}/2").parse().unwrap();
        });
        scene
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn equation_6_3_holds(scene in any_scene(Architecture::Distributed)) {
        let exact = damping(&scene, LOCAL).simplified_damping_n_s_per_m.unwrap();
        let closed = closed_forms::simplified_damping(&scene);
        prop_assert!(close(exact, closed, 1e-9), "{} {}", exact, closed);
    }

    #[test]
    fn equation_b_10_holds(scene in any_scene(Architecture::Centralized)) {
        let exact = damping(&scene, REMOTE).damping_n_s_per_m.unwrap();
        let closed = closed_forms::centralized_remote_damping(&scene);
        prop_assert!(close(exact, closed, 1e-9), "{} {}", exact, closed);
    }

    /// Without dampers (B.11) is the exact value for samples that are used one tick after they were taken.
    #[test]
    fn equation_b_11_is_of_older_data(mut scene in any_scene(Architecture::Distributed)) {
        scene = edited(&scene, |scene| {
            for spring in [
                &mut scene.coupling.hand_object,
                &mut scene.coupling.remote_hand_object,
                &mut scene.coupling.object_object,
            ] {
                spring.damping_n_s_per_m = 0.0;
            }
        });
        let printed = closed_forms::distributed_damping_as_printed(&scene);
        let exact = damping(&scene, LOCAL).damping_n_s_per_m.unwrap();
        prop_assert!((2.8..3.2).contains(&(printed / exact)), "{} {}", printed, exact);
        scene = edited(&scene, |scene| {
            scene.link.play_out = PlayOut::OnArrival;
            scene.link.impairment.latency_s = scene.rates.control_hz.period_s();
        });
        let older = damping(&scene, LOCAL).damping_n_s_per_m.unwrap();
        prop_assert!(close(older, printed, 1e-8), "{} {}", older, printed);
    }

    #[test]
    fn equation_6_4_holds(scene in any_scene(Architecture::Distributed), wall in 100.0..50_000.0) {
        let scene = against_wall(&scene, wall);
        let distributed = equivalent_stiffness(&scene).unwrap();
        for user in &distributed.users {
            prop_assert!(close(user.stiffness_n_per_m, closed_forms::distributed_stiffness(&scene), 1e-10));
        }
        let centralized = edited(&scene, |centralized| centralized.session.architecture = Architecture::Centralized);
        let users = equivalent_stiffness(&centralized).unwrap().users;
        for (user, remote) in users.iter().zip([false, true]) {
            prop_assert!(close(user.stiffness_n_per_m, closed_forms::centralized_stiffness(&scene, remote), 1e-10));
        }
        let rigid = equivalent_stiffness(&against_wall(&scene, 1e9)).unwrap();
        let limit = closed_forms::stiffness_at_rigid_wall(&scene, false);
        prop_assert!(close(rigid.users[0].stiffness_n_per_m, limit, 1e-4));
    }

    /// Masses, springs and dampers in another unit of mass; and all of it in another unit of time.
    #[test]
    fn units_change_nothing(scene in any_scene(Architecture::Distributed), n in 0u32..3, by in 0.2..5.0, faster in 2u64..5) {
        let scene = edited(&scene, |scene| scene.link.delay_periods = n);
        let scaled = |mass: f64, time: f64| {
            edited(&scene, |scaled| {
                scaled.hand.mass_kg *= mass;
                scaled.object.mass_kg *= mass;
                let coupling = &mut scaled.coupling;
                for spring in [&mut coupling.hand_object, &mut coupling.remote_hand_object, &mut coupling.object_object] {
                    spring.stiffness_n_per_m *= mass * time * time;
                    spring.damping_n_s_per_m *= mass * time;
                }
            })
        };
        let plain = damping(&scene, LOCAL);
        let heavy = damping(&scaled(by, 1.0), LOCAL);
        let mut fast = scaled(1.0, faster as f64);
        let rate = scene.rates.control_hz.numerator() * faster;
        fast = edited(&fast, |fast| {
            fast.rates.control_hz = format!("{rate}").parse().unwrap();
            fast.rates.network_hz = format!("{rate}/2").parse().unwrap();
        });
        let at_plain = admittance(&scene, &[40.0]).unwrap();
        let at_fast = admittance(&fast, &[40.0 * faster as f64]).unwrap();
        let fast = damping(&fast, LOCAL);
        for of in [
            |damping: &AddedDamping| damping.damping_n_s_per_m.unwrap(),
            |damping: &AddedDamping| damping.simplified_damping_n_s_per_m.unwrap(),
            |damping: &AddedDamping| damping.mean_damping_n_s_per_m.unwrap(),
        ] {
            prop_assert!(close(of(&heavy), by * of(&plain), 1e-8));
            prop_assert!(close(of(&fast), faster as f64 * of(&plain), 1e-8));
        }
        for of in [slow_rate, fundamental] {
            let (one, other) = (of(&at_plain, 0, 0), of(&at_fast, 0, 0) * faster as f64);
            prop_assert!((one - other).norm() <= 1e-7 * one.norm(), "{} {}", one, other);
        }
    }
}

#[test]
fn the_printed_stiffness_is_wrong_by_much() {
    let scene = against_wall(&table_6_1(Architecture::Distributed), 300.0);
    assert!((closed_forms::distributed_stiffness(&scene) - 333.333).abs() < 1e-3);
    assert!((closed_forms::distributed_stiffness_as_printed(&scene) - 463.4).abs() < 0.05);
    assert_eq!(closed_forms::ideal_stiffness(&scene), equivalent_stiffness(&scene).unwrap().ideal_n_per_m);
}

#[test]
fn nothing_resists_in_free_motion() {
    for architecture in [Architecture::Distributed, Architecture::Centralized] {
        for user in equivalent_stiffness(&table_6_1(architecture)).unwrap().users {
            assert_eq!(user.stiffness_n_per_m, 0.0, "{architecture:?} {}", user.name);
        }
    }
}

/// A constant force, for a long time, in a simulation that shares nothing with the analysis.
#[test]
fn a_constant_force_ends_in_the_predicted_drift() {
    for (architecture, user) in [(Architecture::Distributed, LOCAL), (Architecture::Centralized, REMOTE)] {
        for (ratio, n) in [(2, 0), (8, 0), (8, 1), (5, 2)] {
            let scene = edited(&with_ratio(table_6_1(architecture), ratio), |scene| {
                scene.link.delay_periods = n;
                scene.object.damping_n_s_per_m = 0.3;
            });
            let mut pushed = Pushed::new(&scene, 1);
            pushed.run(40.0, &Force::Constant);
            let predicted = damping(&scene, user);
            let at_instants = pushed.velocity_at_last_instant().recip();
            assert!(close(predicted.damping_n_s_per_m.unwrap(), at_instants, 1e-9), "{at_instants}");
            let mean = pushed.mean_velocity_of_last_period().recip();
            assert!(close(predicted.mean_damping_n_s_per_m.unwrap(), mean, 1e-9), "{mean}");
        }
    }
}

/// Sinusoidal forces, in small steps, projected onto the frequency.
#[test]
fn sinusoidal_forces_meet_the_predicted_response() {
    for (architecture, user) in [(Architecture::Distributed, 0), (Architecture::Centralized, 1)] {
        for (n, network_periods) in [(0, 16), (1, 3), (1, 40)] {
            let scene = edited(&table_6_1(architecture), |scene| {
                scene.link.delay_periods = n;
                scene.object.damping_n_s_per_m = 1.0;
            });
            let frequency = std::f64::consts::TAU * 128.0 / f64::from(network_periods);
            let predicted = admittance(&scene, &[frequency]).unwrap();
            assert!(predicted.users[user].stable);
            let mut pushed = Pushed::new(&scene, 60);
            pushed.run(12.0, &Force::Sinusoidal(frequency));
            let simulated = pushed.fundamental(frequency, network_periods);
            let exact = fundamental(&predicted, user, 0);
            assert!((simulated - exact).norm() < 2e-5 * exact.norm(), "{simulated} {exact}");
            let mut pushed = Pushed::new(&scene, 1);
            pushed.run(12.0, &Force::HeldSinusoidal(frequency));
            let simulated = pushed.fundamental_at_instants(frequency, network_periods);
            let exact = slow_rate(&predicted, user, 0);
            assert!((simulated - exact).norm() < 1e-9 * exact.norm(), "{simulated} {exact}");
        }
    }
}

/// Hand, coupler, object, continuous in time; both responses come to it as the tick shrinks, at first order.
#[test]
fn fast_ticks_approach_the_continuous_admittance() {
    let scene = table_6_1(Architecture::Centralized);
    let frequency = 60.0;
    let s = Complex::new(0.0, frequency);
    let local = scene.coupling.hand_object;
    let coupler = s.inv() * local.stiffness_n_per_m + local.damping_n_s_per_m;
    let object = s * scene.object.mass_kg;
    let continuous = (s * scene.hand.mass_kg + coupler * object / (coupler + object)).inv();
    let errors = [1 << 13, 1 << 14, 1 << 15].map(|rate| {
        let scene = scene.edit_unchecked(|scene| {
            scene.rates.control_hz = format!("{rate}").parse().unwrap();
            scene.rates.network_hz = scene.rates.control_hz;
        });
        let response = admittance(&scene, &[frequency]).unwrap();
        assert!(fundamental(&response, 0, 0).re > 0.0);
        [slow_rate, fundamental].map(|of| (of(&response, 0, 0) - continuous).norm() / continuous.norm())
    });
    for (coarse, fine) in errors.iter().zip(&errors[1..]) {
        for (coarse, fine) in coarse.iter().zip(fine) {
            assert!((1.9..2.1).contains(&(coarse / fine)), "{errors:?}");
        }
    }
    assert!(errors[2].iter().all(|&error| error < 2e-3), "{errors:?}");
}

#[test]
fn slow_forces_meet_the_added_damping_and_the_stiffness() {
    for (architecture, user) in [(Architecture::Distributed, 0), (Architecture::Centralized, 1)] {
        for ratio in ["1024/8", "400"] {
            let mut scene = table_6_1(architecture);
            scene = edited(&scene, |scene| scene.rates.network_hz = ratio.parse().unwrap());
            let viscous = damping(&scene, HostIndex(user as u8));
            let free = admittance(&scene, &[1e-4]).unwrap();
            assert_eq!(free.quantity, AdmittanceQuantity::Velocity);
            let slow = slow_rate(&free, user, 0).norm().recip();
            assert!(close(slow, viscous.damping_n_s_per_m.unwrap(), 1e-5), "{slow} {viscous:?}");
            let slow = fundamental(&free, user, 0).norm().recip();
            assert!(close(slow, viscous.mean_damping_n_s_per_m.unwrap(), 1e-5), "{slow} {viscous:?}");
            let scene = against_wall(&scene, 3000.0);
            let stiffness = equivalent_stiffness(&scene).unwrap().users[user].stiffness_n_per_m;
            let held = admittance(&scene, &[1e-4]).unwrap();
            assert_eq!(held.quantity, AdmittanceQuantity::Position);
            for of in [slow_rate, fundamental] {
                assert!(close(of(&held, user, 0).norm().recip(), stiffness, 1e-6));
            }
            let impedance = held.users[user].impedance_magnitude[0];
            assert!(close(impedance, stiffness / 1e-4, 1e-6));
        }
    }
}

#[test]
fn a_whole_number_of_ticks_is_no_special_case() {
    let at = |network: &str| {
        let scene = edited(&table_6_1(Architecture::Distributed), |scene| {
            scene.rates.network_hz = network.parse().unwrap()
        });
        damping(&scene, LOCAL)
    };
    let [slower, between, faster] = ["1024/3", "2048/5", "1024/2"].map(at);
    for of in [
        |damping: &AddedDamping| damping.mean_damping_n_s_per_m.unwrap(),
        |damping: &AddedDamping| damping.simplified_damping_n_s_per_m.unwrap(),
    ] {
        assert!(of(&faster) < of(&between) && of(&between) < of(&slower));
    }
}

#[test]
fn names_and_numbers_of_users_do_not_matter() {
    for coordination in coordinations() {
        let scene = edited(&with_users(table_6_1(Architecture::Distributed), 4), |scene| {
            scene.session.coordination = coordination;
            scene.link.delay_periods = 1;
        });
        let all = admittance(&scene, &[0.1, 20.0, 900.0]).unwrap();
        for user in 1..4 {
            for of in [slow_rate, fundamental] {
                for index in 0..3 {
                    let (one, other) = (of(&all, 0, index), of(&all, user, index));
                    assert!((one - other).norm() <= 1e-9 * one.norm(), "{user} {index}");
                }
            }
            let (one, other) = (damping(&scene, LOCAL), damping(&scene, HostIndex(user as u8)));
            assert!(close(one.damping_n_s_per_m.unwrap(), other.damping_n_s_per_m.unwrap(), 1e-9));
        }
    }
    // Averaging couples each pair with k_o/U.
    let mut pairwise = with_users(table_6_1(Architecture::Distributed), 3);
    let average = edited(&pairwise, |average| average.session.coordination = Coordination::Average);
    pairwise = edited(&pairwise, |pairwise| pairwise.coupling.object_object = spring(100.0, 10.0 / 3.0));
    let [pairwise, average] = [&pairwise, &average].map(|scene| damping(scene, LOCAL));
    assert!(close(pairwise.damping_n_s_per_m.unwrap(), average.damping_n_s_per_m.unwrap(), 1e-10));
}

#[test]
fn dampers_to_the_ground_count() {
    let scene = edited(&with_ratio(table_6_1(Architecture::Centralized), 2), |scene| {
        scene.object.damping_n_s_per_m = 1.5;
        scene.hand.damping_n_s_per_m = 0.5;
    });
    let local = damping(&scene, LOCAL);
    assert!(close(local.mean_damping_n_s_per_m.unwrap(), 2.0, 1e-9), "{local:?}");
    assert!(close(local.simplified_damping_n_s_per_m.unwrap(), 1.5, 1e-9), "{local:?}");
    assert_eq!(local.dampers_of_scene_n_s_per_m, 2.0);
    assert_eq!(local.damping_if_compensated_n_s_per_m.map(|damping| (damping * 1e9).round()), Some(5e8));
}

#[test]
fn a_spring_to_the_ground_leaves_no_damping() {
    let scene = edited(&table_6_1(Architecture::Distributed), |scene| scene.hand.stiffness_n_per_m = 80.0);
    let grounded = damping(&scene, LOCAL);
    assert_eq!((grounded.damping_n_s_per_m, grounded.damping_if_compensated_n_s_per_m), (None, None));
    assert!(grounded.simplified_damping_n_s_per_m.is_some());
    assert!(grounded.notes.iter().any(|note| note.contains("spring")), "{:?}", grounded.notes);
    let stiffness = equivalent_stiffness(&scene).unwrap().users[0].stiffness_n_per_m;
    assert!(close(stiffness, 80.0, 1e-10));
}

#[test]
fn a_loop_that_outgrows_everything_has_no_numbers() {
    let scene = table_6_1(Architecture::Distributed)
        .edit_unchecked(|scene| scene.coupling.hand_object = spring(1e7, 0.0));
    let wild = damping(&scene, LOCAL);
    assert_eq!(wild.damping_n_s_per_m, None);
    assert!(wild.notes.iter().any(|note| note.contains("unstable")), "{:?}", wild.notes);
    let response = admittance(&scene, &[1.0]).unwrap();
    assert!(!response.users[0].stable);
    serde_json::to_string(&response).unwrap();
}

#[test]
fn a_told_velocity_changes_the_loop_and_not_what_is_measured() {
    let mut scene = table_6_1(Architecture::Centralized);
    let exact = admittance(&scene, &[1.0, 50.0]).unwrap();
    scene = edited(&scene, |scene| scene.device.velocity = VelocityEstimate::Difference);
    let told = admittance(&scene, &[1.0, 50.0]).unwrap();
    for index in 0..2 {
        for of in [slow_rate, fundamental] {
            let change = (of(&told, 0, index) - of(&exact, 0, index)).norm() / of(&exact, 0, index).norm();
            assert!(change > 1e-9 && change < 0.05, "{change}");
        }
    }
    assert_eq!(damping(&scene, LOCAL).damping_n_s_per_m, Some(0.0));
}

#[test]
fn scenes_with_several_directions_are_brought_to_one_line() {
    let scene = cotouch_scene::load("grasp", &[]).unwrap();
    let viscous = damping(&scene, LOCAL);
    assert_eq!(viscous.reduction, Reduction::AlongNormal);
    assert!(viscous.damping_n_s_per_m.unwrap() > 2.0 * scene.hand.damping_n_s_per_m);
    assert!(viscous.notes.iter().any(|note| note.contains("wall")), "{:?}", viscous.notes);
    let at_wall = admittance(&scene, &[5.0]).unwrap();
    assert_eq!((at_wall.quantity, at_wall.reduction), (AdmittanceQuantity::Position, Reduction::AlongNormal));
    // Two fingers in parallel, and two of the box's corners at the wall.
    assert!(close(at_wall.ideal.mass_kg, 2.0 * 0.1 + 0.4, 1e-12));
    let stiffness = equivalent_stiffness(&scene).unwrap();
    assert_eq!(stiffness.ideal_n_per_m, 2.0 * scene.wall.stiffness_n_per_m);
    let one = edited(&table_6_1(Architecture::Distributed), |one| {
        one.coupling = scene.coupling.clone();
        one.coupling.hand_object.stiffness_n_per_m *= 2.0;
        one.coupling.remote_hand_object.stiffness_n_per_m *= 2.0;
    });
    let expected = closed_forms::distributed_stiffness(&against_wall(&one, stiffness.ideal_n_per_m));
    assert!(close(stiffness.users[0].stiffness_n_per_m, expected, 1e-9), "{stiffness:?} {expected}");
}

/// (6.3) with J for m_o and the rotational coupler for k_o, b_o.
#[test]
fn turning_brakes_like_moving() {
    for (name, axes) in [("grasp", 1), ("four-hands", 3)] {
        let settings = [
            "rates.network_hz=512",
            "link.delay_periods=0",
            "session.users=2",
            "session.coordination=pairwise",
        ];
        let settings: Vec<_> = settings.map(|text| text.parse().unwrap()).to_vec();
        let scene = cotouch_scene::load(name, &settings).unwrap();
        let turning = damping(&scene, LOCAL).turning;
        assert_eq!(turning.len(), axes);
        for about in turning {
            let coupler = scene.coupling.object_object_rotational;
            let line = table_6_1(Architecture::Distributed).edit_unchecked(|line| {
                line.object.mass_kg = about.inertia_kg_m2;
                line.coupling.object_object =
                    spring(coupler.stiffness_n_m_per_rad, coupler.damping_n_m_s_per_rad);
            });
            let expected = closed_forms::simplified_damping(&line);
            assert!(close(about.simplified_damping_n_m_s_per_rad.unwrap(), expected, 1e-9), "{about:?}");
            assert!(about.drag_pole.unwrap() < 1.0);
        }
    }
    assert!(damping(&table_6_1(Architecture::Distributed), LOCAL).turning.is_empty());
}

#[test]
fn what_cannot_be_is_said() {
    let scene = table_6_1(Architecture::Distributed);
    for frequency in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = admittance(&scene, &[1.0, frequency]).unwrap_err();
        assert!(matches!(error, TransparencyError::Frequency(_)), "{error}");
        assert!(error.to_string().contains("positive"));
    }
    let error = added_damping(&scene, HostIndex(2)).unwrap_err().to_string();
    assert!(error.contains("no user 3") && error.contains("1 to 2"), "{error}");
    assert!(admittance(&scene, &[]).unwrap().frequency_rad_s.is_empty());
}

#[test]
fn documents_have_the_agreed_fields() {
    let scene = table_6_1(Architecture::Distributed);
    let document = serde_json::to_value(admittance(&scene, &[1.0, 10.0]).unwrap()).unwrap();
    assert_eq!(document["frequency_rad_s"], serde_json::json!([1.0, 10.0]));
    assert_eq!(document["quantity"], "velocity");
    for key in ["magnitude", "phase_rad", "fundamental_magnitude", "fundamental_phase_rad"] {
        assert_eq!(document["users"][1][key].as_array().unwrap().len(), 2, "{key}");
    }
    let document = serde_json::to_value(damping(&scene, LOCAL)).unwrap();
    for key in ["damping_n_s_per_m", "simplified_damping_n_s_per_m", "drag_pole", "drag_pole_if_compensated"]
    {
        assert!(document[key].is_f64(), "{key}");
    }
    let document = serde_json::to_value(equivalent_stiffness(&scene).unwrap()).unwrap();
    assert_eq!(document["users"][0]["stiffness_n_per_m"], 0.0);
}
