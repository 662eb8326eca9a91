use cotouch_scene::names::{HostIndex, Part};
use cotouch_scene::scene::{LocalModelKind, ReturnedForce, SpringDamper, SurfaceHold};
use cotouch_scene::time::Schedule;
use cotouch_soft::ReducedBody;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use super::closed::closed_loop;
use super::closed_body::ClosedBodies;
use super::local_laws::HostLaw;
use super::slow_body::SlowBody;
use super::touched::{Finger, Touched, touched_body};
use crate::diagram::{DiagramError, LiftRoute};
use crate::dof::motion_quantities;
use crate::local_model::{HandImpedance as ArmOfPaper, PiLocalModel, SimulationLoop, hand_spectral_radius};
use crate::loop_spec::{Delay, Dof, Dynamics, LINE, LoopBody, LoopSpec, Plant, SPACE_POINT};
use cotouch_matrix::{eigenvalues, spectral_radius};

const KO: f64 = 100.0;
const RETURNED: [ReturnedForce; 3] = [ReturnedForce::First, ReturnedForce::Mean, ReturnedForce::Last];
const HOLDS: [SurfaceHold; 2] = [SurfaceHold::Zero, SurfaceHold::First];

fn schedule(control: &str, other: &str) -> Schedule {
    Schedule::new(control.parse().unwrap(), other.parse().unwrap()).unwrap()
}

fn hand(host: u8, axes: &'static [Dof], plant: Plant) -> LoopBody {
    let host = HostIndex(host);
    let states = motion_quantities(axes)
        .map(|quantity| cotouch_scene::names::Coordinate::Own { host, part: Part::HAND, quantity })
        .collect();
    LoopBody { states, axes, dynamics: Dynamics::Plant(plant) }
}

/// A hand that forces do not move, and that forgets where it was.
fn still() -> LoopBody {
    let plant = Plant {
        a: DMatrix::from_diagonal_element(2, 2, -1e6),
        b: DMatrix::zeros(2, 1),
        c: DMatrix::identity(2, 2),
    };
    hand(0, LINE, plant)
}

/// Of which only rates and the local model count.
fn scene(
    [control, network, slow]: [&str; 3],
    kind: LocalModelKind,
    [kh, int]: [f64; 2],
) -> cotouch_scene::Scene {
    cotouch_scene::load("spring", &[]).unwrap().edit_unchecked(|scene| {
        let rates = &mut scene.rates;
        (rates.control_hz, rates.network_hz) = (control.parse().unwrap(), network.parse().unwrap());
        rates.simulation_hz = slow.parse().unwrap();
        scene.local_model.kind = kind;
        (scene.local_model.stiffness_n_per_m, scene.local_model.integral_n_per_m) = (kh, int);
    })
}

fn finger(host: u8) -> Finger {
    Finger { user: HostIndex(host), finger: 0 }
}

/// One finger on Barbagli et al.'s spring.
fn one_finger(
    hand: LoopBody,
    kind: LocalModelKind,
    gains: [f64; 2],
    period: (ReturnedForce, SurfaceHold),
) -> LoopSpec {
    one_finger_after(0, hand, kind, gains, period)
}

/// The same with results that come so many periods later.
fn one_finger_after(
    result_delay_periods: u32,
    hand: LoopBody,
    kind: LocalModelKind,
    [kh, int]: [f64; 2],
    (returned_force, hold): (ReturnedForce, SurfaceHold),
) -> LoopSpec {
    let compliance = DMatrix::from_diagonal_element(3, 3, KO.recip());
    let scene = scene(["1000", "1000", "50"], kind, [kh, int]);
    let mut spec = LoopSpec::new(schedule("1000", "1000"));
    spec.body(hand);
    touched_body(Touched {
        touching: vec![(0, finger(0))],
        hosts: vec![HostIndex::FIRST],
        delay: Box::new(|_, _| Delay::NONE),
        slow: schedule("1000", "50"),
        returned_force,
        hold,
        result_delay_periods,
        body: &SlowBody::quasi_static(compliance.clone()),
        law: HostLaw::new(&scene, &[KO], &[DVec3::NEG_X], &compliance),
        idle_axes: [false, true, true],
        spec,
    })
}

fn radius(of: &LoopSpec) -> f64 {
    spectral_radius(&eigenvalues(&of.lift().unwrap().matrix).unwrap())
}

#[test]
fn a_still_hand_gives_the_papers_loop() {
    for returned in RETURNED {
        for hold in HOLDS {
            let slow = SimulationLoop::new(20, returned, hold).unwrap();
            for [kh, int] in
                [[10.0, 0.0], [90.0, 0.0], [120.0, 0.0], [50.0, 30.0], [20.0, 80.0], [70.0, 150.0]]
            {
                let kind = if int > 0.0 { LocalModelKind::Pi } else { LocalModelKind::P };
                let found = radius(&one_finger(still(), kind, [kh, int], (returned, hold)));
                let expected = slow.spectral_radius(&PiLocalModel::new(kh, int, KO).unwrap());
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{returned:?} {hold:?} {kh} {int}: {found} {expected}"
                );
            }
        }
    }
}

#[test]
fn a_free_hand_gives_the_hand_on_the_local_model() {
    let arm = ArmOfPaper { mass_kg: 0.2, damping_n_s_per_m: 3.0, stiffness_n_per_m: 40.0 };
    let to_ground =
        SpringDamper { stiffness_n_per_m: arm.stiffness_n_per_m, damping_n_s_per_m: arm.damping_n_s_per_m };
    for returned in RETURNED {
        for hold in HOLDS {
            let slow = SimulationLoop::new(20, returned, hold).unwrap();
            for [kh, int] in [[50.0, 0.0], [120.0, 0.0], [50.0, 30.0]] {
                let kind = if int > 0.0 { LocalModelKind::Pi } else { LocalModelKind::P };
                let moving = hand(0, LINE, Plant::mass(arm.mass_kg, to_ground));
                let found = radius(&one_finger(moving, kind, [kh, int], (returned, hold)));
                let expected = hand_spectral_radius(
                    arm,
                    &PiLocalModel::new(kh, int, KO).unwrap(),
                    &slow,
                    "1000".parse().unwrap(),
                )
                .unwrap();
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{returned:?} {hold:?} {kh} {int}: {found} {expected}"
                );
            }
        }
    }
}

#[test]
fn a_result_that_comes_a_period_later_is_a_delay_more() {
    // z^(1 + d) + h
    for delay in 0..4 {
        let period = (ReturnedForce::Mean, SurfaceHold::Zero);
        let of = one_finger_after(delay, still(), LocalModelKind::P, [70.0, 0.0], period);
        let expected = 0.7_f64.powf(1.0 / f64::from(delay + 1));
        assert!((radius(&of) - expected).abs() < 1e-9);
    }
}

#[test]
fn a_held_force_is_a_spring_whose_first_force_counts() {
    for returned in RETURNED {
        let held = one_finger(still(), LocalModelKind::Hold, [70.0, 0.0], (returned, SurfaceHold::Zero));
        assert!((radius(&held) - 0.7).abs() < 1e-9);
    }
}

/// A spring that knows how the surface gives way asks for the force of the whole: no loop is left.
#[test]
fn compliance_ends_in_one_period_where_the_hand_is_still() {
    for returned in RETURNED {
        let kind = LocalModelKind::Compliance;
        let of = one_finger(still(), kind, [500.0, 0.0], (returned, SurfaceHold::Zero));
        // A nilpotent map; its zeros are told to the root of rounding.
        assert!(radius(&of) < 1e-4, "{}", radius(&of));
    }
}

fn three_masses() -> ReducedBody {
    let stiffness =
        DMatrix::from_row_slice(3, 3, &[900.0, -300.0, 0.0, -300.0, 700.0, -250.0, 0.0, -250.0, 400.0]);
    let contacts =
        DMatrix::from_fn(6, 3, |row, column| if row % 3 == 0 && column == row / 2 { 1.0 } else { 0.0 });
    ReducedBody {
        period_s: 1.0 / 60.0,
        quasi_static: false,
        mass_damping_per_s: 0.3,
        stiffness_damping_s: 0.004,
        stiffness,
        contacts,
    }
}

#[test]
fn a_body_steps_as_its_equations_say() {
    let body = three_masses();
    let slow = SlowBody::from_reduced(&body);
    let h = body.period_s;
    let step = DMatrix::identity(3, 3) * (1.0 + h * body.mass_damping_per_s)
        + &body.stiffness * (h * body.stiffness_damping_s + h * h);
    let (mut q, mut v) = (DVector::zeros(3), DVector::zeros(3));
    let mut state = DVector::zeros(6);
    for period in 0..50 {
        let force = DVector::from_fn(6, |row, _| f64::from((period * 7 + row as i32 * 3) % 5) - 2.0);
        v = step
            .clone()
            .lu()
            .solve(&(&v + (body.contacts.transpose() * &force - &body.stiffness * &q) * h))
            .unwrap();
        q += &v * h;
        let shown = &slow.law.c * &state + &slow.law.d * &force;
        state = &slow.law.a * state + &slow.law.b * &force;
        let error = (&shown - &body.contacts * &q).norm();
        assert!(error < 1e-12 && (&shown - slow.shown.as_ref().unwrap() * &state).norm() < 1e-12, "{error}");
    }
    assert!(q.norm() > 1e-6);
}

#[test]
fn balanced_coordinates_show_the_same() {
    let slow = SlowBody::from_reduced(&three_masses());
    for contacts in [vec![0], vec![1], vec![0, 1]] {
        let seen = slow.seen_from(&contacts);
        let balanced = seen.balanced(1e-13);
        assert!(balanced.law.states() <= 6);
        let (one, other) = (seen.impulse_response(200), balanced.impulse_response(200));
        let error = one.iter().zip(&other).map(|(one, other)| (one - other).amax()).fold(0.0, f64::max);
        assert!(error < 1e-13, "{error}");
    }
}

/// Two hosts and a network, whatever the rates: the state is complete, and routes that share nothing but the description
/// find the same map.
#[test]
fn the_routes_agree_on_soft_bodies() {
    for centralized in [false, true] {
        for &kind in LocalModelKind::ALL {
            for returned in RETURNED {
                for hold in HOLDS {
                    for rates in [["1200", "200", "100"], ["300", "100", "80"]] {
                        let nested = rates[0] == "1200";
                        let label = format!("{centralized} {kind:?} {returned:?} {hold:?}");
                        let of = two_hosts(centralized, kind, (returned, hold), rates, nested, touched_body);
                        assert_routes_agree(&of, nested, &label);
                        let shared = of.lift_shared().unwrap().matrix;
                        let shared = spectral_radius(&eigenvalues(&shared).unwrap());
                        assert!((radius(&of) - shared).abs() < 1e-9, "{kind:?}");
                    }
                }
            }
        }
    }
}

fn assert_routes_agree(of: &LoopSpec, nested: bool, label: &str) {
    let expected = of.lift().unwrap();
    for route in [LiftRoute::Stepping, LiftRoute::StateSpace, LiftRoute::Resampling] {
        match of.lift_by(route) {
            Ok(map) => {
                assert_eq!(map.coordinates, expected.coordinates);
                let error = (&map.matrix - &expected.matrix).amax();
                assert!(error <= 1e-10 * expected.matrix.amax(), "{label} {route:?}: {error}");
            }
            Err(DiagramError::NotNested(_)) if route == LiftRoute::Resampling && !nested => {}
            Err(error) => panic!("{label} {route:?}: {error}"),
        }
    }
    let names: Vec<_> = expected.coordinates.iter().map(ToString::to_string).collect();
    assert_eq!(of.to_diagram().unwrap().states().unwrap(), names, "{label}");
}

/// Bodies of which only what fingers observe is in the loop have its verdict, and are understood by all routes.
#[test]
fn what_fingers_observe_has_the_verdict_of_the_whole() {
    let closed = |of: Touched<'_>| closed_loop(&ClosedBodies::new(&of).unwrap(), of);
    for kind in [LocalModelKind::Hold, LocalModelKind::P, LocalModelKind::Compliance] {
        for (returned, hold) in RETURNED.into_iter().flat_map(|returned| HOLDS.map(|hold| (returned, hold))) {
            for rates in [["1200", "200", "100"], ["300", "100", "80"]] {
                let nested = rates[0] == "1200";
                if hold == SurfaceHold::First && !nested {
                    continue;
                }
                let label = format!("{kind:?} {returned:?} {hold:?}");
                let whole = two_hosts(false, kind, (returned, hold), rates, nested, touched_body);
                let observed = two_hosts(false, kind, (returned, hold), rates, nested, closed);
                assert_routes_agree(&observed, nested, &label);
                let (expected, found) = (radius(&whole), radius(&observed));
                assert!((found / expected - 1.0).abs() < 1e-11, "{label}: {found} {expected}");
            }
        }
    }
}

fn two_hosts(
    centralized: bool,
    kind: LocalModelKind,
    (returned_force, hold): (ReturnedForce, SurfaceHold),
    [control, network, slow]: [&str; 3],
    shows: bool,
    loop_of: fn(Touched<'_>) -> LoopSpec,
) -> LoopSpec {
    let plant = || {
        Plant::endpoint(
            &(glam::DMat3::IDENTITY * 0.1),
            3,
            SpringDamper { stiffness_n_per_m: 30.0, damping_n_s_per_m: 2.0 },
        )
    };
    let mut spec = LoopSpec::new(schedule(control, network));
    (0..2).for_each(|host| {
        spec.body(hand(host, SPACE_POINT, plant()));
    });
    let mut body = SlowBody::from_reduced(&three_masses());
    if !shows {
        body.law.d += DMatrix::from_diagonal_element(6, 6, 1e-3);
        body.shown = None;
    }
    let normal = DVec3::new(0.6, 0.0, 0.8);
    // Gains are shares of K_o here, so that the two contacts differ.
    let scene = scene([control, network, slow], kind, [0.0, 0.0]).edit_unchecked(|scene| {
        (scene.local_model.stiffness_ratio, scene.local_model.integral_ratio) = (1.0, 0.25);
    });
    loop_of(Touched {
        touching: (0..2).map(|host| (usize::from(host), finger(host))).collect(),
        hosts: (0..if centralized { 1 } else { 2 }).map(HostIndex).collect(),
        delay: Box::new(|_, _| Delay::periods(1)),
        slow: schedule(control, slow),
        returned_force,
        hold,
        result_delay_periods: 1,
        body: &body,
        law: HostLaw::new(
            &scene,
            &[80.0, 60.0],
            &[normal, normal],
            &DMatrix::from_diagonal_element(6, 6, 3e-3),
        ),
        idle_axes: [false; 3],
        spec,
    })
}
