//! Local models on an elastic object: closed forms against lifts, regions, responses, choices.

use cotouch_analysis::local_model::{
    Compliances, ContactSides, HandStep, LocalModelError, PiLocalModel, Simulation, SimulationLoop,
    SimulationSample, StableGains, StepResponse, Threshold, choose, stable_kh, worst_spectral_radius,
};
use cotouch_analysis::{eigenvalues, spectral_radius};
use cotouch_scene::scene::{ReturnedForce, SurfaceHold};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

const FORCES: [ReturnedForce; 3] = [ReturnedForce::First, ReturnedForce::Mean, ReturnedForce::Last];
const HOLDS: [SurfaceHold; 2] = [SurfaceHold::Zero, SurfaceHold::First];

fn model(kh: f64, int: f64, ko: f64) -> PiLocalModel {
    PiLocalModel::new(kh, int, ko).unwrap()
}

fn slow_loop(ratio: u32, returned: ReturnedForce, hold: SurfaceHold) -> SimulationLoop {
    SimulationLoop::new(ratio, returned, hold).unwrap()
}

fn mean() -> SimulationLoop {
    slow_loop(50, ReturnedForce::Mean, SurfaceHold::Zero)
}

/// Numbers that repeat, spread over 0..1.
fn spread(index: u32, by: f64) -> f64 {
    (f64::from(index) * by).fract()
}

/// Coefficients of the characteristic polynomial of a lifted map, a_0 first: for comparisons that a nearly double
/// root does not blur. By Faddeev and LeVerrier.
pub(crate) fn characteristic_of_map(map: &DMatrix<f64>) -> DVector<f64> {
    let size = map.nrows();
    let mut coefficients = DVector::zeros(size);
    let mut power = DMatrix::zeros(size, size);
    let mut leading = 1.0;
    for step in 1..=size {
        power = map * power + DMatrix::identity(size, size) * leading;
        leading = -(map * &power).trace() / step as f64;
        coefficients[size - step] = leading;
    }
    coefficients
}

/// Any loop: the three forces and uneven weights, both holds.
fn any_loop() -> impl Strategy<Value = SimulationLoop> {
    let weights = prop::collection::vec(0.01..1.0_f64, 1..40).prop_map(|weights| {
        let sum: f64 = weights.iter().sum();
        weights.iter().map(|weight| weight / sum).collect::<Vec<_>>()
    });
    let any_hold = || prop::sample::select(HOLDS.to_vec());
    prop_oneof![
        (1..200_u32, prop::sample::select(FORCES.to_vec()), any_hold())
            .prop_map(|(n, f, h)| slow_loop(n, f, h)),
        (weights, any_hold()).prop_map(|(weights, hold)| SimulationLoop::weighted(weights, hold).unwrap()),
    ]
}

fn any_gains() -> impl Strategy<Value = PiLocalModel> {
    let int = prop_oneof![Just(0.0), 0.001..5.0_f64];
    (0.0..3.0_f64, int, 0.01..1000.0_f64).prop_map(|(h, i, ko)| model(h * ko, i * ko, ko))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// The tick-by-tick lift and the closed form have the same characteristic polynomial, and hence eigenvalues.
    #[test]
    fn closed_form_and_lift_agree(slow in any_loop(), gains in any_gains()) {
        let map = slow.lifted(&gains);
        let lifted = characteristic_of_map(&map);
        let closed = slow.characteristic(&gains);
        // Under a zero-order hold the lift has one state more, which is forgotten: an eigenvalue of 0.
        let more = lifted.len() - closed.coefficients().len();
        prop_assert!(lifted.iter().take(more).all(|coefficient| coefficient.abs() < 1e-12));
        for (one, other) in lifted.iter().skip(more).zip(closed.coefficients()) {
            prop_assert!((one - other).abs() < 1e-12 * (1.0 + other.abs()), "{one} {other}");
        }
        let values = eigenvalues(&map).unwrap();
        let gap = |index: usize| (0..index).map(|other| (values[index] - values[other]).norm()).fold(1.0, f64::min);
        // A double root moves by the root of rounding.
        if (0..values.len()).map(gap).fold(1.0, f64::min) > 0.05 {
            let (one, other) = (spectral_radius(&values), slow.spectral_radius(&gains));
            prop_assert!((one - other).abs() < 1e-12 * (1.0 + other), "{one} {other}");
        }
    }

    /// Jury's conditions and the eigenvalues give the same verdict.
    #[test]
    fn jury_and_the_radius_agree(slow in any_loop(), gains in any_gains()) {
        let radius = slow.spectral_radius(&gains);
        prop_assume!((radius - 1.0).abs() > 1e-9);
        prop_assert_eq!(slow.is_stable(&gains), radius < 1.0, "{}", radius);
        prop_assert_eq!(spectral_radius(&eigenvalues(&slow.lifted(&gains)).unwrap()) < 1.0, radius < 1.0);
    }

    /// Only ratios to K_o matter: units change nothing.
    #[test]
    fn everything_scales_with_the_object(slow in any_loop(), gains in any_gains(), power in -20..20_i32) {
        let factor = f64::from(power).exp2();
        let scaled = model(gains.kh_n_per_m() * factor, gains.int_n_per_m() * factor, gains.ko_n_per_m() * factor);
        prop_assert_eq!(slow.spectral_radius(&scaled), slow.spectral_radius(&gains));
    }

    /// Weights count by their mean place only, under a zero-order hold: (9) with K_h + m·INT.
    #[test]
    fn a_weighted_mean_is_a_larger_proportional_gain(slow in any_loop(), h in 0.0..2.0_f64, i in 0.001..3.0_f64) {
        prop_assume!(slow.hold() == SurfaceHold::Zero);
        let first = slow_loop(7, ReturnedForce::First, SurfaceHold::Zero);
        let larger = model(h + slow.first_moment() * i, i, 1.0);
        prop_assert!((slow.spectral_radius(&model(h, i, 1.0)) - first.spectral_radius(&larger)).abs() < 1e-7);
    }

    /// The closed-form intervals of K_h are exactly where the loop is stable.
    #[test]
    fn intervals_of_gains_are_those_of_stable_loops(slow in any_loop(), i in 0.0..4.5_f64, h in 0.0..3.0_f64) {
        let intervals = stable_kh(&slow, i * 7.0, 7.0);
        let inside = intervals.iter().any(|&(from, to)| (from..to).contains(&(7.0 * h)));
        let near = intervals.iter().any(|&(from, to)| (from - 7.0 * h).abs().min((to - 7.0 * h).abs()) < 1e-9);
        prop_assert!(near || inside == slow.is_stable(&model(7.0 * h, 7.0 * i, 7.0)), "{intervals:?}");
    }

    /// The tick-by-tick simulation of a hand at rest does what the map says.
    #[test]
    fn the_simulation_follows_the_map(slow in any_loop(), gains in any_gains()) {
        let simulation = Simulation::new(gains, slow.clone(), 1e-3, ContactSides::TwoSided, Threshold::None).unwrap();
        let n = slow.ratio();
        let samples = simulation.run(std::iter::repeat_n(0.01, 6 * n));
        // At the start of each period the zero-order surface is x_now, the first-order one x_before.
        let surface = |period: usize| samples[period * n].surface_m;
        let late = usize::from(slow.hold() == SurfaceHold::First);
        let characteristic = slow.characteristic(&gains);
        let a = characteristic.coefficients();
        // Differences from the steady state obey the characteristic polynomial.
        let away = |period: usize| surface(period + late) - gains.steady_share() * 0.01;
        for start in 0..(5 - late - a.len()) {
            let left = away(start + a.len());
            let terms: Vec<f64> = a.iter().enumerate().map(|(order, a)| a * away(start + order)).collect();
            let size = terms.iter().map(|term| term.abs()).fold(left.abs() + 0.01, f64::max);
            prop_assert!((left + terms.iter().sum::<f64>()).abs() < 1e-11 * size, "{left} {terms:?}");
        }
    }

    /// The worst object of a range lies at one of its ends, whatever the hold.
    #[test]
    fn the_worst_object_is_at_an_end(slow in any_loop(), gains in any_gains(), ratio in 1.0..20.0_f64) {
        prop_assume!(gains.int_n_per_m() > 0.0);
        let range = Compliances { least: 1.0 / ratio, largest: 1.0 };
        let worst = worst_spectral_radius(&slow, &gains, range);
        for step in 0..=200 {
            let compliance = range.least * ratio.powf(f64::from(step) / 200.0);
            let radius = slow.spectral_radius(&gains.on_softer(compliance));
            prop_assert!(radius <= worst + 1e-9, "{compliance}: {radius} {worst}");
        }
    }
}

#[test]
fn p_is_stable_up_to_the_object_whatever_is_returned() {
    for returned in FORCES {
        for ratio in [1, 2, 50] {
            let slow = slow_loop(ratio, returned, SurfaceHold::Zero);
            assert_eq!(slow.spectral_radius(&model(300.0, 0.0, 400.0)), 0.75);
            assert_eq!(stable_kh(&slow, 0.0, 400.0), vec![(0.0, 400.0)]);
            assert!(!slow.is_stable(&model(400.0, 0.0, 400.0)), "(4) is strict");
        }
    }
}

#[test]
fn the_first_order_hold_raises_ps_limit_with_the_mean_only() {
    let limit = |returned| stable_kh(&slow_loop(50, returned, SurfaceHold::First), 0.0, 1.0)[0].1;
    // K_h·(1 − m) < K_o with m = (N − 1)/2N.
    assert!((limit(ReturnedForce::Mean) - 100.0 / 51.0).abs() < 1e-12);
    assert!((limit(ReturnedForce::First) - 1.0).abs() < 1e-12);
    // Here −1 is crossed instead: 1 − h·m + h·(1 − m) > 0.
    assert!((limit(ReturnedForce::Last) - 1.0 / 0.96).abs() < 1e-12);
}

/// (9) as printed, on a grid.
#[test]
fn printed_conditions_hold_for_the_first_force_and_not_for_the_mean() {
    let printed = |h: f64, i: f64| (i - h).abs() < 1.0 && i - h > (1.0 - h) - 1.0 && i - h > (h - 1.0) - 1.0;
    let count = |returned| {
        let slow = slow_loop(50, returned, SurfaceHold::Zero);
        let grid = (0..3200).map(|index| [index % 40, index / 40]);
        grid.filter(|&[column, row]| {
            let (h, i) = (0.0513 + 0.0771 * f64::from(column), 0.0511 + 0.0513 * f64::from(row));
            printed(h, i) != (slow.spectral_radius(&model(h, i, 1.0)) < 1.0)
        })
        .count()
    };
    assert_eq!(count(ReturnedForce::First), 0);
    assert!(count(ReturnedForce::Mean) > 100);
    assert!(count(ReturnedForce::Last) > 100);
}

#[test]
fn regions_have_the_corners_of_the_closed_form() {
    let corners = |returned| StableGains::new(&slow_loop(50, returned, SurfaceHold::Zero), 2.0).boundary;
    let expect = |returned, expected: &[[f64; 2]]| {
        let found = corners(returned);
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for corner in expected {
            let near =
                |other: &&[f64; 2]| (0..2).all(|axis| (other[axis] - 2.0 * corner[axis]).abs() < 1e-12);
            assert!(found.iter().any(|other| near(&other)), "{corner:?} in {found:?}");
        }
    };
    expect(ReturnedForce::First, &[[0.0, 0.0], [1.0, 0.0], [3.0, 4.0], [0.0, 1.0]]);
    expect(ReturnedForce::Mean, &[[0.0, 0.0], [1.0, 0.0], [1.04, 4.0], [0.0, 1.0 / 0.51]]);
    expect(ReturnedForce::Last, &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0 / 0.48]]);
}

/// The boundary is one: a step inwards is stable, a step outwards is not. Areas grow with K_o², volumes with K_o³.
#[test]
fn boundaries_separate_and_scale() {
    for returned in FORCES {
        for hold in HOLDS {
            let slow = slow_loop(50, returned, hold);
            let region = StableGains::new(&slow, 1.0);
            let middle = [0, 1].map(|axis| {
                region.boundary.iter().map(|corner| corner[axis]).sum::<f64>() / region.boundary.len() as f64
            });
            let is_stable = |corner: &[f64; 2], share: f64| {
                let [h, i] = [0, 1].map(|axis| middle[axis] + share * (corner[axis] - middle[axis]));
                h >= 0.0 && i > 0.0 && slow.is_stable(&model(h, i, 1.0))
            };
            for corner in &region.boundary {
                assert!(is_stable(corner, 1.0 - 1e-4), "{returned:?} {hold:?} {corner:?}");
                assert!(!is_stable(corner, 1.0 + 1e-4), "{returned:?} {hold:?} {corner:?}");
            }
            let large = StableGains::new(&slow, 10.0);
            assert!((large.area() - 100.0 * region.area()).abs() < 1e-9 * large.area());
            assert!((large.volume_below(10.0) - 1000.0 * region.volume_below(1.0)).abs() < 1e-6);
        }
    }
}

/// A finer haptic tick approaches a continuous one: the mean's region differs from its limit by a term in 1/N.
#[test]
fn refining_the_haptic_tick_converges() {
    let gains = model(0.4, 0.5, 1.0);
    for (returned, hold) in FORCES.into_iter().flat_map(|force| HOLDS.map(|hold| (force, hold))) {
        let radius = |ratio| slow_loop(ratio, returned, hold).spectral_radius(&gains);
        let limit = radius(10_000);
        let errors = [25, 50, 100].map(|ratio| (radius(ratio) - limit).abs());
        assert!(errors[2] < 0.02 && errors[1] <= errors[0] && errors[2] <= errors[1], "{errors:?}");
        if errors[0] > 1e-3 {
            assert!((1.6..2.6).contains(&(errors[0] / errors[1])), "first order: {errors:?}");
        }
    }
}

fn respond(kh: f64, int: f64, ko: f64, input_m: f64, one_sided: bool) -> StepResponse {
    let slow_loop = slow_loop(50, ReturnedForce::First, SurfaceHold::Zero);
    HandStep { model: model(kh, int, ko), slow_loop, period_s: 1e-3, input_m, one_sided }
        .response(None)
        .unwrap()
}

#[test]
fn figure_7_settles_at_once_a_tenth_of_the_way() {
    let settling = respond(100.0, 0.0, 900.0, 0.1, false).settling;
    assert!((settling.steady_state_m - 0.01).abs() < 1e-15);
    assert_eq!(settling.to_5_percent_s.zip(settling.to_2_percent_s), Some((0.1, 0.1)));
    assert!((settling.overshoot.unwrap() - 1.0 / 9.0).abs() < 1e-6);
}

#[test]
fn figure_8_rings_for_three_seconds() {
    let response = respond(190.0, 0.0, 200.0, 0.025, false);
    let settling = response.settling;
    assert!((settling.to_5_percent_s.unwrap() - 2.95).abs() < 1e-9);
    assert!((settling.to_2_percent_s.unwrap() - 3.85).abs() < 1e-9);
    assert!((settling.overshoot.unwrap() - 0.95).abs() < 1e-6);
    assert!((settling.steady_state_m - 0.012_179).abs() < 1e-6);
    let within = |share: f64| {
        let outside = response
            .samples
            .iter()
            .rposition(|sample| (sample.surface_m / settling.steady_state_m - 1.0).abs() > share);
        (outside.unwrap() + 1) as f64 * 1e-3
    };
    assert!((within(0.135) - 2.0).abs() < 1e-9, "{}", within(0.135));
    // Steady force over the surface's travel is K_o, says §3.2.
    let last = response.samples.last().unwrap();
    assert!((last.force_n / last.surface_m / 200.0 - 1.0).abs() < 0.05);
}

#[test]
fn figure_9_grows_or_cycles_at_ten_hertz() {
    let grows = respond(220.0, 0.0, 200.0, 0.025, false);
    assert_eq!((grows.settling.to_5_percent_s, grows.settling.overshoot), (None, None));
    let peak =
        |samples: &[SimulationSample]| samples.iter().map(|sample| sample.surface_m).fold(0.0, f64::max);
    let half = grows.samples.len() / 2;
    assert!(peak(&grows.samples[half..]) > 5.0 * peak(&grows.samples[..half]));
    let cycles = respond(220.0, 0.0, 200.0, 0.025, true);
    assert_eq!(cycles.settling.to_5_percent_s, None);
    assert!(
        (cycles.settling.overshoot.unwrap() - (1.1 * 0.025 / cycles.settling.steady_state_m - 1.0)).abs()
            < 1e-9
    );
    for pair in cycles.samples[100..].windows(101) {
        assert!((pair[0].surface_m - pair[100].surface_m).abs() < 1e-12, "a period of 0.1 s");
    }
    assert!(cycles.samples.iter().all(|sample| sample.force_n >= 0.0));
}

#[test]
fn an_integral_removes_the_error_and_deadbeat_takes_two_periods() {
    let settling = respond(100.0, 60.0, 200.0, 0.01, false).settling;
    assert_eq!(settling.steady_state_m, 0.01);
    assert!(settling.to_2_percent_s.is_some());
    let deadbeat = respond(200.0, 200.0, 200.0, 0.01, false);
    assert_eq!(
        deadbeat.settling.to_2_percent_s,
        Some(0.05),
        "first force: one period for the force, one to see it"
    );
    assert!(deadbeat.samples[100..].iter().all(|sample| (sample.surface_m - 0.01).abs() < 1e-14));
}

/// Press for two seconds, hold for four, leave within 10 ms.
fn press_hold_leave() -> impl Iterator<Item = f64> {
    let hand = |time_s: f64| match time_s {
        t if t < 2.0 => 0.005 * t,
        t if t < 6.0 => 0.01,
        t if t < 6.01 => 0.01 - 3.0 * (t - 6.0),
        _ => -0.02,
    };
    (0..7000).map(move |tick| hand(f64::from(tick) * 1e-3))
}

fn simulate(threshold: Threshold, interval_s: f64) -> Vec<SimulationSample> {
    let contact = ContactSides::Drained { interval_s };
    let simulation = Simulation::new(model(40.0, 60.0, 200.0), mean(), 1e-3, contact, threshold).unwrap();
    simulation.run(press_hold_leave())
}

#[test]
fn the_threshold_is_what_remains_while_holding() {
    let error = |threshold| {
        let held = simulate(threshold, 0.1)[5990];
        held.hand_m - held.surface_m
    };
    for threshold_m in [0.0002, 0.001] {
        assert!((error(Threshold::Constant(threshold_m)) - threshold_m).abs() < 1e-8);
        let directional =
            Threshold::Directional { leaving_m: 5.0 * threshold_m, entering_m: threshold_m, full_at_n: 0.5 };
        assert!((error(directional) - threshold_m).abs() < 1e-8);
    }
    assert!(error(Threshold::None).abs() < 1e-8, "no threshold, no error");
}

/// While the integral is below Ī_tot, the threshold is in proportion to it.
#[test]
fn a_light_touch_still_integrates() {
    let threshold = Threshold::Directional { leaving_m: 0.0, entering_m: 0.001, full_at_n: 0.4 };
    let contact = ContactSides::Drained { interval_s: 0.1 };
    let simulation = Simulation::new(model(40.0, 60.0, 200.0), mean(), 1e-3, contact, threshold).unwrap();
    // The hand is in by less than the threshold: a constant one would let nothing be integrated.
    let last = *simulation.run(std::iter::repeat_n(0.0009, 6000)).last().unwrap();
    let error = last.hand_m - last.surface_m;
    // e = θ̄₂·I_tot/Ī_tot, and K_h·e + I_tot = K_o·(x_h − e).
    let expected = 0.0009 * 200.0 / (200.0 + 40.0 + 0.4 / 0.001);
    assert!((error - expected).abs() < 1e-8, "{error} {expected}");
}

#[test]
fn on_leaving_the_force_is_drained_linearly_to_exactly_zero() {
    let samples = simulate(Threshold::Constant(0.0002), 0.1);
    let left = samples.iter().rposition(|sample| sample.hand_m > sample.surface_m).unwrap() + 1;
    let before = samples[left - 1];
    let at_leaving = samples[left].force_n;
    assert!(left > 6000 && at_leaving > 0.5, "{left} {at_leaving}");
    // Continuous but for what the hand moves in one tick.
    let moved = 40.0 * (before.hand_m - before.surface_m) + 0.01;
    assert!((before.force_n - at_leaving).abs() <= moved, "{} {at_leaving}", before.force_n);
    for (since, sample) in samples[left..].iter().enumerate() {
        let share = if since < 100 { 1.0 - since as f64 / 100.0 } else { 0.0 };
        assert!((sample.force_n - at_leaving * share).abs() < 1e-12, "{since}");
    }
    assert_eq!(samples[left + 100].force_n, 0.0);
    assert_eq!(samples.last().unwrap().surface_m, 0.0);
    // At once, where that is asked for.
    let samples = simulate(Threshold::Constant(0.0002), 0.0);
    assert_eq!(samples[left + 1].force_n, 0.0);
}

#[test]
fn eight_coupled_contacts_need_smaller_gains() {
    let range = Compliances::correlated(8, 0.6).unwrap();
    let gains = model(0.5, 0.3, 1.0);
    assert!((mean().spectral_radius(&gains) - 0.7914).abs() < 5e-5);
    assert!((worst_spectral_radius(&mean(), &gains, range) - 2.9716).abs() < 5e-5);
    let chosen = choose(&mean(), 1.0, range).unwrap();
    assert!(chosen.worst_spectral_radius < 1.0 && chosen.model.int_n_per_m() > 0.0, "{chosen:?}");
    // The same from the matrix, and with four of the contacts lifted.
    let matrix = |n: usize| DMatrix::from_fn(n, n, |i, j| if i == j { 0.02 } else { 0.012 });
    let of_matrix = Compliances::of_matrix(&matrix(8), 50.0).unwrap();
    assert!(
        (of_matrix.least - range.least).abs() < 1e-12 && (of_matrix.largest - range.largest).abs() < 1e-12
    );
    let fewer = Compliances::of_matrix(&matrix(4), 50.0).unwrap();
    assert!(fewer.least >= range.least - 1e-12 && fewer.largest <= range.largest);
}

/// The joint loop of all contacts, written out, has the radius of the worst way in which they move together.
#[test]
fn the_joint_loop_falls_apart_into_its_ways_of_moving() {
    let compliance = DMatrix::from_row_slice(3, 3, &[1.0, 0.5, 0.2, 0.5, 1.3, 0.1, 0.2, 0.1, 0.7]);
    let gains = model(0.3, 0.4, 1.0);
    let range = Compliances::of_matrix(&compliance, 1.0).unwrap();
    // x⁺ = C·(−(K_h + m·INT)·x + integral), integral⁺ = integral − INT·x.
    let g = 0.3 + mean().first_moment() * 0.4;
    let mut map = DMatrix::zeros(6, 6);
    map.view_mut((0, 0), (3, 3)).copy_from(&(&compliance * -g));
    map.view_mut((0, 3), (3, 3)).copy_from(&compliance);
    map.view_mut((3, 0), (3, 3)).copy_from(&(DMatrix::identity(3, 3) * -0.4));
    map.view_mut((3, 3), (3, 3)).copy_from(&DMatrix::identity(3, 3));
    let joint = spectral_radius(&eigenvalues(&map).unwrap());
    assert!((joint - worst_spectral_radius(&mean(), &gains, range)).abs() < 1e-12);
}

#[test]
fn a_single_known_object_gets_deadbeat_gains() {
    for returned in FORCES {
        let slow = slow_loop(50, returned, SurfaceHold::Zero);
        let chosen = choose(&slow, 800.0, Compliances::ONE).unwrap();
        assert!(chosen.worst_spectral_radius < 1e-7, "{chosen:?}");
        assert!((chosen.model.int_n_per_m() - 800.0).abs() < 1e-9);
    }
}

/// Nothing on a fine grid or near the answer is better than the answer; where the radius is known from outside, it is met.
#[test]
fn nothing_better_than_the_choice_is_found() {
    for (returned, hold) in FORCES.into_iter().flat_map(|force| HOLDS.map(|hold| (force, hold))) {
        let slow = slow_loop(50, returned, hold);
        for range in [
            Compliances::ONE.with_error(0.3).unwrap(),
            Compliances::correlated(8, 0.6).unwrap(),
            Compliances::correlated(4, 0.5).unwrap().with_error(0.3).unwrap(),
        ] {
            let chosen = choose(&slow, 1.0, range).unwrap();
            let worst = chosen.worst_spectral_radius;
            assert!(worst < 1.0 && chosen.model.int_n_per_m() > 0.0, "{chosen:?}");
            for index in 0..20_000 {
                let (x, y) = (spread(index, 0.618_033_988_749), spread(index, 0.754_877_666_247));
                let (h, i) = if index % 2 == 0 {
                    (2.5 * x / range.largest, (4.5 * y + 1e-3) / range.largest)
                } else {
                    let near = |gain: f64, share: f64| gain * (0.9 + 0.2 * share);
                    (near(chosen.model.kh_n_per_m(), x), near(chosen.model.int_n_per_m(), y))
                };
                let other = worst_spectral_radius(&slow, &model(h, i, 1.0), range);
                assert!(
                    other > worst - 1e-6,
                    "{returned:?} {hold:?} {range:?}: {h} {i} has {other}, not {worst}"
                );
            }
        }
    }
}

/// Choices scale with the object.
#[test]
fn choices_scale() {
    let range = Compliances::correlated(3, 0.4).unwrap().with_error(0.2).unwrap();
    let (small, large) = (choose(&mean(), 1.0, range).unwrap(), choose(&mean(), 640.0, range).unwrap());
    assert!((large.model.kh_n_per_m() - 640.0 * small.model.kh_n_per_m()).abs() < 1e-9);
    assert!((large.worst_spectral_radius - small.worst_spectral_radius).abs() < 1e-12);
}

#[test]
fn what_makes_no_sense_is_refused_with_what_is_allowed() {
    for (kh, int, ko) in [(-1.0, 0.0, 1.0), (0.0, f64::NAN, 1.0), (1.0, 0.0, 0.0), (1e13, 0.0, 1.0)] {
        assert!(PiLocalModel::new(kh, int, ko).is_err());
    }
    let refused = |error: LocalModelError, word: &str| assert!(error.to_string().contains(word), "{error}");
    refused(SimulationLoop::new(0, ReturnedForce::First, SurfaceHold::Zero).unwrap_err(), "1 to 10000");
    refused(SimulationLoop::weighted(vec![0.5, 0.6], SurfaceHold::Zero).unwrap_err(), "sum to 1");
    refused(SimulationLoop::weighted(vec![f64::NAN], SurfaceHold::Zero).unwrap_err(), "sum to 1");
    refused(Compliances::correlated(4, 1.0).unwrap_err(), "below 1");
    refused(Compliances::of_matrix(&DMatrix::from_element(2, 2, 1.0), 1.0).unwrap_err(), "positive definite");
    refused(Compliances::of_matrix(&DMatrix::zeros(2, 3), 1.0).unwrap_err(), "2×3");
    let step = |input_m, period_s| HandStep {
        model: model(1.0, 0.0, 2.0),
        slow_loop: mean(),
        period_s,
        input_m,
        one_sided: false,
    };
    refused(step(0.0, 1e-3).response(None).unwrap_err(), "above 0");
    refused(step(1.0, 0.0).response(None).unwrap_err(), "haptic period");
    refused(step(1.0, 1e-3).response(Some(1e6)).unwrap_err(), "at most");
    refused(step(1.0, 1e-3).response(Some(f64::NAN)).unwrap_err(), "at most");
}
