//! The governor against everything that can come in.

use cotouch_device::{
    Acted, DeviceLimits, Governor, GovernorFault, GovernorInput, GovernorOutput, GovernorPhase, GovernorState,
};
use cotouch_scene::geometry::{Reading, Wrench};
use cotouch_scene::scene::{GovernorLimits, Rates, SceneValues};
use glam::DVec3;
use proptest::prelude::*;

const LIMITS: GovernorLimits = GovernorLimits {
    max_force_n: 8.0,
    max_slew_n_per_s: 8192.0,
    watchdog_s: 0.02,
    soft_start_s: 0.05,
    release_s: 0.03,
    damping_n_s_per_m: 0.0,
    passivity_control: false,
};

fn governor(limits: &GovernorLimits) -> Governor {
    governor_of(limits, DeviceLimits { max_force_n: f64::INFINITY, max_torque_n_m: 0.5 })
}

fn governor_of(limits: &GovernorLimits, device: DeviceLimits) -> Governor {
    let rates = Rates { control_hz: "1024".parse().unwrap(), ..Rates::default() };
    Governor::new(&SceneValues { governor: limits.clone(), rates, ..SceneValues::default() }, device)
}

fn opened(governor: &Governor) -> GovernorState {
    let mut state = governor.start();
    while state.phase != GovernorPhase::Open {
        govern(governor, &mut state, 0.0);
    }
    state
}

fn request(force: f64) -> GovernorInput {
    GovernorInput::healthy(Wrench::force(DVec3::X * force), Reading::default())
}

fn govern(governor: &Governor, state: &mut GovernorState, force: f64) -> (f64, Acted) {
    let output = governor.govern(state, &request(force));
    (output.commanded.force.x, output.acted)
}

#[test]
fn zero_to_largest_force_passes_within_one_tick() {
    let governor = governor(&LIMITS);
    let mut state = opened(&governor);
    assert_eq!(govern(&governor, &mut state, 8.0), (8.0, Acted::empty()));
    assert_eq!(govern(&governor, &mut state, 0.0), (0.0, Acted::empty()));
    assert_eq!(govern(&governor, &mut state, -8.0), (-8.0, Acted::empty()));
    let (force, acted) = govern(&governor, &mut state, 8.0);
    assert!(force.abs() < 1e-10 && acted == Acted::SLEW_LIMIT, "{force}");
    assert_eq!(govern(&governor, &mut state, 9.0), (8.0, Acted::FORCE_LIMIT));
}

#[test]
fn a_clamped_force_keeps_its_direction() {
    let governor = governor(&LIMITS);
    let direction = DVec3::new(1.0, -2.0, 0.5).normalize();
    for size in [8.1, 1e6, 1e200, 1e307] {
        let mut state = opened(&governor);
        let output = governor
            .govern(&mut state, &GovernorInput::healthy(Wrench::force(direction * size), Reading::default()));
        assert!((output.commanded.force - direction * 8.0).length() < 1e-14, "{size}");
        assert_eq!(output.acted, Acted::FORCE_LIMIT);
    }
}

#[test]
fn own_damping_is_no_limit() {
    let governor = governor(&GovernorLimits { damping_n_s_per_m: 2.0, ..LIMITS });
    let mut state = opened(&governor);
    let reading = Reading::point(DVec3::ZERO, DVec3::X * 0.5);
    let output = governor.govern(&mut state, &GovernorInput::healthy(Wrench::force(DVec3::X * 3.0), reading));
    assert_eq!((output.commanded.force.x, output.acted), (2.0, Acted::empty()));
}

#[test]
fn soft_start_fades_in_without_a_kink() {
    let governor = governor(&LIMITS);
    let mut state = governor.start();
    let forces: Vec<f64> = (0..60).map(|_| govern(&governor, &mut state, 4.0).0).collect();
    assert_eq!(forces[0], 0.0);
    assert_eq!(forces[52..], [4.0; 8], "0.05 s are 51.2 ticks");
    let slopes: Vec<f64> = forces.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(slopes.iter().all(|&slope| (0.0..=1.5 * 4.0 / 52.0).contains(&slope)));
    assert!(slopes.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 6.1 * 4.0 / (52.0 * 52.0)));
}

#[test]
fn a_stop_fades_out_from_the_present_force_whatever_is_requested() {
    let governor = governor(&LIMITS);
    let mut state = opened(&governor);
    govern(&governor, &mut state, 6.0);
    let mut last = 6.0;
    for tick in 0..31 {
        assert!(!state.is_released());
        let wild = [1e9, f64::NAN, -8.0, f64::INFINITY][tick % 4];
        let output = governor.govern(&mut state, &GovernorInput { stop: true, ..request(wild) });
        let force = output.commanded.force.x;
        assert!(output.acted.contains(Acted::RELEASE | Acted::STOP));
        assert!(force <= last && last - force <= 1.51 * 6.0 / 31.0, "{tick}: {last} {force}");
        last = force;
    }
    assert_eq!(last, 0.0);
    assert!(state.is_released());
    assert_eq!(state.fault, Some(GovernorFault::RequestNotFinite), "garbage is noticed in a release too");
}

#[test]
fn a_lost_link_comes_back_through_a_soft_start() {
    let governor = governor(&LIMITS);
    let mut state = opened(&governor);
    govern(&governor, &mut state, 6.0);
    let lost = GovernorInput { link_ok: false, ..request(6.0) };
    for _ in 0..10 {
        assert!(governor.govern(&mut state, &lost).acted.contains(Acted::LINK_LOSS));
    }
    // Back in the middle of the release: no jump anywhere.
    let mut last = state.commanded.force.x;
    for _ in 0..100 {
        let (force, _) = govern(&governor, &mut state, 6.0);
        assert!((force - last).abs() < 1.51 * 6.0 / 31.0);
        last = force;
    }
    assert_eq!((last, state.phase), (6.0, GovernorPhase::Open));
}

#[test]
fn a_fault_stays_until_it_is_cleared() {
    let governor = governor(&LIMITS);
    let mut state = opened(&governor);
    let bad = GovernorInput::healthy(Wrench::default(), Reading::point(DVec3::NAN, DVec3::ZERO));
    assert!(governor.govern(&mut state, &bad).acted.contains(Acted::FAULT));
    for _ in 0..1000 {
        govern(&governor, &mut state, 5.0);
    }
    assert!(state.is_released() && state.fault == Some(GovernorFault::ReadingNotFinite));
    state.clear_fault();
    for _ in 0..60 {
        govern(&governor, &mut state, 5.0);
    }
    assert_eq!(state.commanded.force.x, 5.0);
}

#[test]
fn stale_requests_trip_the_watchdog() {
    let governor = governor(&LIMITS);
    let mut state = opened(&governor);
    let stale = GovernorInput { fresh: false, ..request(5.0) };
    for _ in 0..21 {
        assert_eq!(governor.govern(&mut state, &stale).acted, Acted::empty(), "0.02 s are 20.5 ticks");
    }
    assert!(governor.govern(&mut state, &stale).acted.contains(Acted::WATCHDOG | Acted::RELEASE));
}

#[test]
fn limits_that_are_no_numbers_admit_nothing() {
    let limits = GovernorLimits { max_force_n: f64::NAN, ..LIMITS };
    let governor = governor_of(&limits, DeviceLimits { max_force_n: f64::NAN, max_torque_n_m: -1.0 });
    let mut state = opened(&governor);
    assert_eq!(govern(&governor, &mut state, 5.0), (0.0, Acted::FORCE_LIMIT));
}

/// Numbers of every kind: ordinary, huge, tiny, denormal, zero of either sign, infinite, NaN.
fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -20.0..20.0,
        1 => any::<f64>(),
        1 => proptest::sample::select(vec![
            f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 5e-324, -1e-310, 0.0, -0.0,
        ]),
    ]
}

fn finite_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -20.0..20.0,
        1 => any::<f64>().prop_filter("finite", |x| x.is_finite()),
        1 => proptest::sample::select(vec![f64::MAX, f64::MIN, 5e-324, -1e-310, 0.0, -0.0]),
    ]
}

fn vector(number: impl Strategy<Value = f64> + Clone) -> impl Strategy<Value = DVec3> {
    (number.clone(), number.clone(), number).prop_map(DVec3::from)
}

/// Mostly good input with everything bad now and then, so that all phases are met.
fn any_input() -> impl Strategy<Value = GovernorInput> {
    let wrench = |finite: bool| {
        if finite {
            (vector(finite_number().boxed()), vector(finite_number().boxed())).boxed()
        } else {
            (vector(any_number().boxed()), vector(any_number().boxed())).boxed()
        }
    };
    let requested = prop_oneof![20 => wrench(true), 1 => wrench(false)];
    let velocity = prop_oneof![60 => vector((-2.0..2.0).boxed()), 1 => vector(any_number().boxed())];
    let flags = (prop::bool::weighted(0.03), prop::bool::weighted(0.97), prop::bool::weighted(0.9));
    let deficit = prop_oneof![Just(0.0), 0.0..1e-3, Just(f64::MAX)];
    (requested, velocity, flags, deficit).prop_map(|((force, torque), velocity, flags, deficit_j)| {
        let (stop, link_ok, fresh) = flags;
        GovernorInput {
            requested: Wrench { force, torque },
            reading: Reading::point(DVec3::ZERO, velocity),
            from_start: DVec3::ZERO,
            stop,
            link_ok,
            fresh,
            deficit_j,
        }
    })
}

fn any_limits() -> impl Strategy<Value = GovernorLimits> {
    let fades = (0.0..0.02, 0.0..0.02, 0.001..0.01);
    let damping = (prop_oneof![Just(0.0), 0.0..5.0], any::<bool>());
    (0.1..30.0, 1.0..50_000.0, fades, damping).prop_map(
        |(max_force_n, max_slew_n_per_s, (soft_start_s, release_s, watchdog_s), damping)| {
            let (damping_n_s_per_m, passivity_control) = damping;
            GovernorLimits {
                max_force_n,
                max_slew_n_per_s,
                watchdog_s,
                soft_start_s,
                release_s,
                damping_n_s_per_m,
                passivity_control,
            }
        },
    )
}

fn bits(wrench: Wrench) -> [[u64; 3]; 2] {
    [wrench.force, wrench.torque].map(|v| v.to_array().map(f64::to_bits))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn what_comes_out_is_finite_bounded_and_slow_enough(
        limits in any_limits(),
        inputs in prop::collection::vec((any_input(), prop::bool::weighted(0.05)), 1..300),
    ) {
        let governor = governor(&limits);
        let (mut state, mut again) = (governor.start(), governor.start());
        let mut last = Wrench::default();
        let step = limits.max_slew_n_per_s / 1024.0;
        for (input, clear) in inputs {
            if clear {
                state.clear_fault();
                again.clear_fault();
            }
            let GovernorOutput { commanded, acted } = governor.govern(&mut state, &input);
            prop_assert!(commanded.is_finite());
            prop_assert!(commanded.force.length() <= limits.max_force_n);
            prop_assert!(commanded.torque.length() <= 0.5);
            let rounding = 1e-15 * limits.max_force_n;
            prop_assert!((commanded.force - last.force).length() <= step * (1.0 + 2e-12) + rounding);
            if acted.is_empty() && limits.damping_n_s_per_m == 0.0 {
                prop_assert_eq!(bits(commanded), bits(input.requested));
            }
            if state.is_released() {
                prop_assert_eq!(commanded, Wrench::default());
            }
            let repeated = governor.govern(&mut again, &input);
            prop_assert_eq!((bits(repeated.commanded), repeated.acted), (bits(commanded), acted));
            prop_assert_eq!(&again, &state);
            last = commanded;
        }
    }

    #[test]
    fn within_its_limits_it_is_transparent(forces in prop::collection::vec(vector((-2.3..2.3).boxed()), 1..200)) {
        let governor = governor(&LIMITS);
        let mut state = opened(&governor);
        for force in forces {
            let input = GovernorInput::healthy(Wrench::force(force), Reading::point(force, force));
            let output = governor.govern(&mut state, &input);
            prop_assert_eq!(bits(output.commanded), bits(input.requested));
            prop_assert!(output.acted.is_empty());
        }
    }
}
