use cotouch_scene::names::{HostIndex, Part};
use cotouch_scene::scene::{LocalModelKind, ReturnedForce, SpringDamper, SurfaceHold};
use cotouch_scene::time::Schedule;
use cotouch_soft::ReducedBody;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use super::*;
use crate::dof::motion_quantities;
use crate::eigenvalues::{eigenvalues, spectral_radius};
use crate::local_model::with_hand::{Hand as ArmOfPaper, hand_spectral_radius};
use crate::local_model::{self, LocalModel, SlowLoop};
use crate::loop_spec::{Dynamics, LINE, Plant, SPACE_POINT};

const KO: f64 = 100.0;
const RETURNED: [(ReturnedForce, local_model::ReturnedForce); 3] = [
    (ReturnedForce::First, local_model::ReturnedForce::First),
    (ReturnedForce::Mean, local_model::ReturnedForce::Mean),
    (ReturnedForce::Last, local_model::ReturnedForce::Last),
];
const HOLDS: [(SurfaceHold, local_model::SurfaceHold); 2] = [
    (SurfaceHold::Zero, local_model::SurfaceHold::Zero),
    (SurfaceHold::First, local_model::SurfaceHold::First),
];

fn schedule(control: &str, other: &str) -> Schedule {
    Schedule::new(control.parse().unwrap(), other.parse().unwrap()).unwrap()
}

fn hand(host: u8, axes: &'static [crate::loop_spec::Dof], plant: Plant) -> Hand {
    let host = HostIndex(host);
    let states = motion_quantities(axes)
        .map(|quantity| cotouch_scene::names::Coordinate::Own { host, part: Part::HAND, quantity })
        .collect();
    let body = Body { states, axes, dynamics: Dynamics::Plant(plant) };
    Hand { user: host, finger: 0, slot: host.0, body, damping_n_s_per_m: 0.0 }
}

/// A hand that forces do not move, and that forgets where it was.
fn still() -> Hand {
    let plant = Plant {
        a: DMatrix::from_diagonal_element(2, 2, -1e6),
        b: DMatrix::zeros(2, 1),
        c: DMatrix::identity(2, 2),
    };
    hand(0, LINE, plant)
}

/// One finger on the paper's spring.
fn one_finger(
    hand: Hand,
    kind: LocalModelKind,
    gains: [f64; 2],
    period: (ReturnedForce, SurfaceHold),
) -> SoftLoop {
    let touch = Touch { hand: 0, way: Way::Own, force_back: None, normal: DVec3::NEG_X };
    let compliance = DMatrix::from_diagonal_element(3, 3, KO.recip());
    let world = World {
        host: HostIndex::FIRST,
        touches: vec![touch],
        body: SlowBody::quasi_static(compliance.clone()),
        kh_n_per_m: vec![gains[0]],
        int_n_per_m: vec![gains[1]],
        compliance: Some(compliance),
    };
    SoftLoop {
        network: schedule("1000", "1000"),
        slow: schedule("1000", "50"),
        kind,
        returned_force: period.0,
        hold: period.1,
        result_delay_periods: 0,
        idle_axes: [false, true, true],
        hands: vec![hand],
        worlds: vec![world],
    }
}

fn radius(of: &SoftLoop) -> f64 {
    spectral_radius(&eigenvalues(&of.lift().matrix).unwrap())
}

#[test]
fn a_still_hand_gives_the_papers_loop() {
    for (returned, of_paper) in RETURNED {
        for (hold, hold_of_paper) in HOLDS {
            let slow = SlowLoop::new(20, of_paper, hold_of_paper).unwrap();
            for [kh, int] in
                [[10.0, 0.0], [90.0, 0.0], [120.0, 0.0], [50.0, 30.0], [20.0, 80.0], [70.0, 150.0]]
            {
                let kind = if int > 0.0 { LocalModelKind::Pi } else { LocalModelKind::P };
                let found = radius(&one_finger(still(), kind, [kh, int], (returned, hold)));
                let expected = slow.spectral_radius(&LocalModel::new(kh, int, KO).unwrap());
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
    for (returned, of_paper) in RETURNED {
        for (hold, hold_of_paper) in HOLDS {
            let slow = SlowLoop::new(20, of_paper, hold_of_paper).unwrap();
            for [kh, int] in [[50.0, 0.0], [120.0, 0.0], [50.0, 30.0]] {
                let kind = if int > 0.0 { LocalModelKind::Pi } else { LocalModelKind::P };
                let moving = hand(0, LINE, Plant::mass(arm.mass_kg, to_ground));
                let found = radius(&one_finger(moving, kind, [kh, int], (returned, hold)));
                let expected =
                    hand_spectral_radius(arm, &LocalModel::new(kh, int, KO).unwrap(), &slow, 1e-3).unwrap();
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
        let mut of =
            one_finger(still(), LocalModelKind::P, [70.0, 0.0], (ReturnedForce::Mean, SurfaceHold::Zero));
        of.result_delay_periods = delay;
        let expected = 0.7_f64.powf(1.0 / f64::from(delay + 1));
        assert!((radius(&of) - expected).abs() < 1e-9);
    }
}

#[test]
fn a_held_force_is_a_spring_whose_first_force_counts() {
    for (returned, _) in RETURNED {
        let held = one_finger(still(), LocalModelKind::Hold, [70.0, 0.0], (returned, SurfaceHold::Zero));
        assert!((radius(&held) - 0.7).abs() < 1e-9);
    }
}

/// A spring that knows how the surface gives way asks for the force of the whole: no loop is left.
#[test]
fn compliance_ends_in_one_period_where_the_hand_is_still() {
    for (returned, _) in RETURNED {
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
    let slow = SlowBody::of_reduced(&body);
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
        let shown = &slow.c * &state + &slow.d * &force;
        state = &slow.a * state + &slow.b * &force;
        let error = (&shown - &body.contacts * &q).norm();
        assert!(error < 1e-12 && (&shown - slow.shown.as_ref().unwrap() * &state).norm() < 1e-12, "{error}");
    }
    assert!(q.norm() > 1e-6);
}

#[test]
fn balanced_coordinates_show_the_same() {
    let slow = SlowBody::of_reduced(&three_masses());
    for contacts in [vec![0], vec![1], vec![0, 1]] {
        let seen = slow.seen_from(&contacts);
        let balanced = seen.balanced();
        assert!(balanced.a.nrows() <= 6);
        let (one, other) = (seen.impulse_response(200), balanced.impulse_response(200));
        let error = one.iter().zip(&other).map(|(one, other)| (one - other).amax()).fold(0.0, f64::max);
        assert!(error < 1e-13, "{error}");
    }
}

/// Two hosts and a network: the state is complete, whatever the rates.
#[test]
fn two_patterns_are_the_square_of_one() {
    for (architecture_is_central, kind) in
        [(false, LocalModelKind::Pi), (true, LocalModelKind::Hold), (true, LocalModelKind::Compliance)]
    {
        let of = two_hosts(architecture_is_central, kind);
        let once = of.lift();
        let layout = Layout::new(&of, Registers::PerReceiver);
        let twice = stepping::lift_over(&of, &layout, 2 * of.ticks_per_pattern());
        let error = (&once.matrix * &once.matrix - &twice).amax();
        assert!(error <= 1e-12 * twice.amax(), "{kind:?}: {error}");
        assert!(
            (radius(&of) - spectral_radius(&eigenvalues(&of.lift_shared().matrix).unwrap())).abs() < 1e-9
        );
    }
}

fn two_hosts(centralized: bool, kind: LocalModelKind) -> SoftLoop {
    let delay = Delay::Scheduled { periods: 1, transit_ticks: 0 };
    let plant = || {
        Plant::endpoint(
            &(glam::DMat3::IDENTITY * 0.1),
            3,
            SpringDamper { stiffness_n_per_m: 30.0, damping_n_s_per_m: 2.0 },
        )
    };
    let hands: Vec<Hand> = (0..2).map(|host| hand(host, SPACE_POINT, plant())).collect();
    let mut body = SlowBody::of_reduced(&three_masses());
    body.d += DMatrix::from_diagonal_element(6, 6, 1e-3);
    body.shown = None;
    let world = |host: u8| World {
        host: HostIndex(host),
        touches: (0..2)
            .map(|other: u8| Touch {
                hand: usize::from(other),
                way: if other == host { Way::Own } else { Way::Samples(delay) },
                force_back: (centralized && other != host).then_some(delay),
                normal: DVec3::new(0.6, 0.0, 0.8),
            })
            .collect(),
        body: body.clone(),
        kh_n_per_m: vec![80.0, 60.0],
        int_n_per_m: vec![20.0, 15.0],
        compliance: Some(DMatrix::from_diagonal_element(6, 6, 3e-3)),
    };
    SoftLoop {
        network: schedule("1024", "100"),
        slow: schedule("1024", "60"),
        kind,
        returned_force: ReturnedForce::Mean,
        hold: SurfaceHold::First,
        result_delay_periods: 1,
        idle_axes: [false; 3],
        worlds: if centralized { vec![world(0)] } else { vec![world(0), world(1)] },
        hands,
    }
}
