//! A hand that is free to move on a local model: one loop, against closed forms, the loop written out, and simulation.

use cotouch_analysis::diagram::LiftRoute;
use cotouch_analysis::local_model::{
    ContactSides, HandImpedance, LocalModelError, PiLocalModel, Simulation, SimulationLoop, SimulationState,
    Threshold, hand_on_local_model, hand_spectral_radius,
};
use cotouch_analysis::loop_spec::LoopSpec;
use cotouch_analysis::{eigenvalues, spectral_radius};
use cotouch_scene::names::{Coordinate, Quantity};
use cotouch_scene::scene::{ReturnedForce, SurfaceHold};
use cotouch_scene::time::Rate;
use nalgebra::{Complex, DMatrix, DVector};

use crate::local_models::characteristic_of_map;

const ROUTES: [LiftRoute; 3] = [LiftRoute::Stepping, LiftRoute::StateSpace, LiftRoute::Resampling];
const FORCES: [ReturnedForce; 3] = [ReturnedForce::First, ReturnedForce::Mean, ReturnedForce::Last];
const HOLDS: [SurfaceHold; 2] = [SurfaceHold::Zero, SurfaceHold::First];
const STILL: HandImpedance = HandImpedance { mass_kg: 1e12, damping_n_s_per_m: 0.0, stiffness_n_per_m: 0.0 };

fn model(kh: f64, int: f64, ko: f64) -> PiLocalModel {
    PiLocalModel::new(kh, int, ko).unwrap()
}

fn slow_loop(ratio: u32, returned: ReturnedForce, hold: SurfaceHold) -> SimulationLoop {
    SimulationLoop::new(ratio, returned, hold).unwrap()
}

fn mean() -> SimulationLoop {
    slow_loop(50, ReturnedForce::Mean, SurfaceHold::Zero)
}

fn rate(text: &str) -> Rate {
    text.parse().unwrap()
}

fn at_1_khz(hand: HandImpedance, model: &PiLocalModel, slow: &SimulationLoop) -> LoopSpec {
    hand_on_local_model(hand, model, slow, rate("1000")).unwrap()
}

fn lifted(hand: HandImpedance, model: &PiLocalModel, slow: &SimulationLoop) -> DMatrix<f64> {
    at_1_khz(hand, model, slow).lift().unwrap().matrix
}

/// By the product of its ticks and by each route of its diagram.
fn lifted_by_all(spec: &LoopSpec) -> Vec<DMatrix<f64>> {
    let routes = ROUTES.into_iter().map(|route| spec.lift_by(route).unwrap().matrix);
    routes.chain([spec.lift().unwrap().matrix]).collect()
}

/// Roots of z² + p·z + q.
fn roots(p: f64, q: f64) -> [Complex<f64>; 2] {
    let root = Complex::new(p * p / 4.0 - q, 0.0).sqrt();
    [root - p / 2.0, -root - p / 2.0]
}

/// Each of the wanted values is an eigenvalue.
fn assert_has(matrix: &DMatrix<f64>, wanted: &[Complex<f64>], tolerance: f64) {
    let mut left = eigenvalues(matrix).unwrap();
    for value in wanted {
        let distance = |other: &Complex<f64>| (other - value).norm();
        let nearest =
            (0..left.len()).min_by(|&a, &b| distance(&left[a]).total_cmp(&distance(&left[b]))).unwrap();
        assert!(distance(&left[nearest]) < tolerance, "{value} is not among {left:?}");
        left.swap_remove(nearest);
    }
}

#[test]
fn a_hand_held_still_leaves_the_simulation_loop_of_the_paper() {
    let (kh, int, ko) = (0.5, 0.3, 1.0);
    for ratio in [1, 2, 5, 50] {
        let n = f64::from(ratio);
        let cases = [
            (ReturnedForce::First, 0.0),
            (ReturnedForce::Mean, (n - 1.0) / (2.0 * n)),
            (ReturnedForce::Last, (n - 1.0) / n),
        ];
        for (returned, share) in cases {
            let (h, i) = ((kh + share * int) / ko, int / ko);
            let spec = at_1_khz(STILL, &model(kh, int, ko), &slow_loop(ratio, returned, SurfaceHold::Zero));
            assert!((spec.pattern_s() - 1e-3 * n).abs() < 1e-15);
            for map in lifted_by_all(&spec) {
                assert_has(&map, &roots(h - 1.0, i - h), 1e-9);
            }
        }
    }
}

/// One slow period of the hand on the local model, written out: hand of mass only, gains K_h and INT, N ticks of T.
fn written_out_period(
    state: &[f64],
    [mass, kh, int, ko, period]: [f64; 5],
    ratio: usize,
    returned: ReturnedForce,
    hold: SurfaceHold,
) -> Vec<f64> {
    let [mut x, mut v, result] = [state[0], state[1], state[2]];
    let mut integral = state[state.len() - 1];
    let mut forces = Vec::new();
    for tick in 0..ratio {
        let surface = match hold {
            SurfaceHold::Zero => result,
            SurfaceHold::First => state[3] + (result - state[3]) * tick as f64 / ratio as f64,
        };
        let error = x - surface;
        let force = kh * error + integral;
        integral += int / ratio as f64 * error;
        x += period * v - period * period / (2.0 * mass) * force;
        v -= period / mass * force;
        forces.push(force);
    }
    let force = match returned {
        ReturnedForce::First => forces[0],
        ReturnedForce::Mean => forces.iter().sum::<f64>() / ratio as f64,
        ReturnedForce::Last => forces[ratio - 1],
    };
    let mut next = vec![x, v, force / ko];
    next.extend((hold == SurfaceHold::First).then_some(result));
    next.push(integral);
    next
}

#[test]
fn the_hand_on_a_local_model_is_the_loop_written_out() {
    let [mass_kg, kh, int, ko] = [0.08, 450.0, 200.0, 600.0];
    let hand = HandImpedance { mass_kg, damping_n_s_per_m: 0.0, stiffness_n_per_m: 0.0 };
    for returned in FORCES {
        for hold in HOLDS {
            let spec = at_1_khz(hand, &model(kh, int, ko), &slow_loop(20, returned, hold));
            let names = spec.coordinates().unwrap().iter().map(ToString::to_string).collect::<Vec<_>>();
            let mut expected = vec!["host1.hand.x", "host1.hand.v", "host1.surface1.x.age1"];
            expected.extend((hold == SurfaceHold::First).then_some("host1.surface1.x.age2"));
            expected.push("host1.integral1");
            assert_eq!(names, expected);
            for map in lifted_by_all(&spec) {
                for column in 0..names.len() {
                    let mut unit = vec![0.0; names.len()];
                    unit[column] = 1.0;
                    let next = written_out_period(&unit, [mass_kg, kh, int, ko, 1e-3], 20, returned, hold);
                    let error = map.column(column) - DVector::from_vec(next);
                    assert!(error.amax() < 1e-11 * map.amax(), "{returned:?} {hold:?} {column}");
                }
            }
        }
    }
}

#[test]
fn a_surface_that_moves_linearly_under_the_mean_force_raises_the_limit() {
    let spec = |kh, ratio, returned| {
        at_1_khz(STILL, &model(kh, 0.0, 1.0), &slow_loop(ratio, returned, SurfaceHold::First))
    };
    for ratio in [2, 10, 50] {
        // z² + h·γ·z + h·(1 − γ), γ = (N − 1)/(2N): the mean of a straight line from one surface to the next.
        let (h, gamma) = (1.3, (f64::from(ratio) - 1.0) / (2.0 * f64::from(ratio)));
        for mean in lifted_by_all(&spec(h, ratio, ReturnedForce::Mean)) {
            assert_has(&mean, &roots(h * gamma, h * (1.0 - gamma)), 1e-9);
        }
        for first in lifted_by_all(&spec(h, ratio, ReturnedForce::First)) {
            assert_has(&first, &roots(0.0, h), 1e-9);
        }
        let moves = |kh| {
            let map = spec(kh, ratio, ReturnedForce::Mean).lift().unwrap().matrix;
            // The hand, held still by its mass, stays at 1.
            spectral_radius(&eigenvalues(&map).unwrap()) > 1.0 + 1e-4
        };
        let limit = 1.0 / (1.0 - gamma);
        assert!(!moves(0.99 * limit) && moves(1.01 * limit));
    }
}

#[test]
fn weights_are_taken_as_they_are() {
    let hand = HandImpedance { mass_kg: 0.2, damping_n_s_per_m: 1.0, stiffness_n_per_m: 50.0 };
    let spec = |slow: &SimulationLoop| at_1_khz(hand, &model(300.0, 100.0, 500.0), slow);
    let weighted =
        |weights: &[f64]| spec(&SimulationLoop::weighted(weights.to_vec(), SurfaceHold::Zero).unwrap());
    let named = |returned| spec(&slow_loop(4, returned, SurfaceHold::Zero));
    assert_eq!(weighted(&[1.0, 0.0, 0.0, 0.0]), named(ReturnedForce::First));
    assert_eq!(weighted(&[0.25; 4]), named(ReturnedForce::Mean));
    assert_eq!(weighted(&[0.0, 0.0, 0.0, 1.0]), named(ReturnedForce::Last));
    let map = |weights: &[f64]| weighted(weights).lift_by(LiftRoute::Resampling).unwrap().matrix;
    // The map is linear in the weights.
    let blend = map(&[0.5, 0.125, 0.125, 0.25]);
    let sum = map(&[1.0, 0.0, 0.0, 0.0]) * 0.375 + map(&[0.25; 4]) * 0.5 + map(&[0.0, 0.0, 0.0, 1.0]) * 0.125;
    assert!((blend - sum).amax() < 1e-12 * map(&[0.25; 4]).amax());
}

#[test]
fn units_change_nothing() {
    for (returned, hold) in FORCES.into_iter().flat_map(|force| HOLDS.map(|hold| (force, hold))) {
        let slow = slow_loop(5, returned, hold);
        let map = |[length, force, time]: [f64; 3], fast| {
            let stiffness = force / length;
            let hand = HandImpedance {
                mass_kg: 0.15 * stiffness * time * time,
                damping_n_s_per_m: 2.0 * stiffness * time,
                stiffness_n_per_m: 300.0 * stiffness,
            };
            let gains = model(400.0 * stiffness, 250.0 * stiffness, 700.0 * stiffness);
            let map = hand_on_local_model(hand, &gains, &slow, rate(fast)).unwrap().lift().unwrap();
            let scale = |name: &Coordinate| match name {
                Coordinate::Own { quantity: Quantity::Velocity(_), .. } => length / time,
                Coordinate::Own { .. } | Coordinate::Surface { .. } => length,
                Coordinate::Integral { .. } => force,
                _ => panic!("{name} is not expected"),
            };
            let scales: Vec<f64> = map.coordinates.iter().map(scale).collect();
            DMatrix::from_fn(scales.len(), scales.len(), |i, j| map.matrix[(i, j)] * scales[j] / scales[i])
        };
        let si = map([1.0; 3], "1000");
        // Millimetres, kilonewtons, milliseconds.
        for (units, fast) in [
            ([1e3, 1.0, 1.0], "1000"),
            ([1.0, 1e-3, 1.0], "1000"),
            ([1.0, 1.0, 1e3], "1"),
            ([1e3, 1e-3, 1e3], "1"),
        ] {
            assert!((map(units, fast) - &si).amax() < 1e-10 * si.amax(), "{units:?} {returned:?} {hold:?}");
        }
    }
}

/// A hand that nothing can move leaves the slow loop alone.
#[test]
fn a_heavy_hand_is_a_hand_held_still() {
    let gains = model(500.0, 300.0, 1000.0);
    let radius = |mass_kg| {
        let hand = HandImpedance { mass_kg, damping_n_s_per_m: 5.0, stiffness_n_per_m: 0.0 };
        let map = lifted(hand, &gains, &mean());
        let mut norms: Vec<f64> = eigenvalues(&map).unwrap().iter().map(|value| value.norm()).collect();
        norms.sort_by(f64::total_cmp);
        norms
    };
    let heavy = radius(1e9);
    // The hand's own two eigenvalues are near 1; the next is the slow loop's.
    assert!((heavy[1] - mean().spectral_radius(&gains)).abs() < 1e-4, "{heavy:?}");
    assert!((heavy[3] - 1.0).abs() < 1e-3);
}

/// A stable slow loop is neither enough nor needed for one given hand.
#[test]
fn a_free_hand_has_a_verdict_of_its_own() {
    let radius = |kh, mass_kg, damping_n_s_per_m| {
        let hand = HandImpedance { mass_kg, damping_n_s_per_m, stiffness_n_per_m: 0.0 };
        hand_spectral_radius(hand, &model(kh, 0.0, 1000.0), &mean(), rate("1000")).unwrap()
    };
    assert!(mean().is_stable(&model(900.0, 0.0, 1000.0)) && radius(900.0, 0.5, 1.0) > 1.3);
    assert!(!mean().is_stable(&model(1200.0, 0.0, 1000.0)) && radius(1200.0, 0.2, 5.0) < 0.9);
}

/// The lift with a hand against the same loop stepped by the simulation, one unit of each state at a time.
#[test]
fn the_lift_with_a_hand_is_what_the_loop_does() {
    for (returned, hold) in FORCES.into_iter().flat_map(|force| HOLDS.map(|hold| (force, hold))) {
        let slow = slow_loop(20, returned, hold);
        let gains = model(150.0, 60.0, 400.0);
        let hand = HandImpedance { mass_kg: 0.2, damping_n_s_per_m: 4.0, stiffness_n_per_m: 30.0 };
        let map = lifted(hand, &gains, &slow);
        let simulation =
            Simulation::new(gains, slow.clone(), 1e-3, ContactSides::TwoSided, Threshold::None).unwrap();
        let trace: Vec<f64> = released(&simulation, hand, 20 * 60);
        // The positions at the starts of periods obey the map's characteristic polynomial.
        let at: Vec<f64> = trace.iter().step_by(20).copied().collect();
        let a = characteristic_of_map(&map);
        let largest = at.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for start in 0..at.len() - a.len() {
            let sum: f64 = a.iter().enumerate().map(|(order, a)| a * at[start + order]).sum::<f64>();
            assert!((sum + at[start + a.len()]).abs() < 1e-8 * largest, "{returned:?} {hold:?} {sum}");
        }
        let radius = hand_spectral_radius(hand, &gains, &slow, rate("1000")).unwrap();
        assert_eq!(radius < 1.0, at.last().unwrap().abs() < at[0]);
    }
}

/// The hand's positions after it starts 10 mm inside: a fine Runge–Kutta of the hand between ticks.
fn released(simulation: &Simulation, hand: HandImpedance, ticks: usize) -> Vec<f64> {
    const FINE: usize = 8;
    let mut state = SimulationState::default();
    let (mut x, mut v) = (0.01, 0.0);
    let mut trace = Vec::new();
    for _ in 0..ticks {
        trace.push(x);
        let force = simulation.tick(&mut state, x).force_n;
        let step = simulation.period_s() / FINE as f64;
        let rate = |x: f64, v: f64| {
            (v, -(force + hand.damping_n_s_per_m * v + hand.stiffness_n_per_m * x) / hand.mass_kg)
        };
        for _ in 0..FINE {
            let one = rate(x, v);
            let two = rate(x + 0.5 * step * one.0, v + 0.5 * step * one.1);
            let three = rate(x + 0.5 * step * two.0, v + 0.5 * step * two.1);
            let four = rate(x + step * three.0, v + step * three.1);
            x += step / 6.0 * (one.0 + 2.0 * two.0 + 2.0 * three.0 + four.0);
            v += step / 6.0 * (one.1 + 2.0 * two.1 + 2.0 * three.1 + four.1);
        }
    }
    trace
}

#[test]
fn a_hand_without_mass_is_refused() {
    let hand = HandImpedance { mass_kg: 0.0, damping_n_s_per_m: 1.0, stiffness_n_per_m: 0.0 };
    let error: LocalModelError =
        hand_on_local_model(hand, &model(1.0, 0.0, 2.0), &mean(), rate("1000")).unwrap_err();
    assert_eq!(error.to_string(), "the hand's mass, kg, must be above 0; found 0");
}
