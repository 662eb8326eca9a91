//! Diagrams written by hand, against closed forms; and what is refused.

use cotouch_analysis::diagram::{
    Clock, Diagram, DiagramBlock, DiagramBlockId, DiagramError, Element, Law, LiftRoute, Plant, Sampled, Time,
};
use cotouch_analysis::loop_spec::Estimate;
use cotouch_analysis::{eigenvalues, spectral_radius};
use cotouch_scene::scene::SpringDamper;
use cotouch_world::LinearBlock;
use nalgebra::{DMatrix, dmatrix};
use proptest::prelude::*;

const ROUTES: [LiftRoute; 3] = [LiftRoute::Stepping, LiftRoute::StateSpace, LiftRoute::Resampling];

fn time(text: &str) -> Time {
    text.parse().unwrap()
}

fn double_integrator(mass_kg: f64) -> Plant {
    Plant::mass(mass_kg, SpringDamper { stiffness_n_per_m: 0.0, damping_n_s_per_m: 0.0 })
}

/// A mass whose position and velocity are sampled every millisecond; the force −k·x − b·v acts `delay` later.
fn delayed_pd(mass_kg: f64, k: f64, b: f64, delay: &str) -> Diagram {
    let mut diagram = Diagram::new();
    let mass = diagram.plant("mass", double_integrator(mass_kg));
    let pd = Sampled::gain(Clock::every(time("0.001")), dmatrix![-k, -b]).after(time(delay));
    let pd = diagram.sampled("pd", pd);
    diagram.connect(mass, pd);
    diagram.connect(pd, mass);
    diagram
}

#[test]
fn a_double_integrator_under_a_delayed_pd_obeys_jury() {
    let (mass, period) = (0.1, 1e-3);
    let (mut stable, mut unstable) = (0, 0);
    for k in [1.0, 10.0, 100.0, 1000.0, 10_000.0, 50_000.0] {
        for b in [-1.0, 0.1, 0.5, 3.0, 10.0, 30.0, 60.0, 90.0, 150.0] {
            // z³ − 2z² + (1 + α + β)·z + (α − β)
            let (alpha, beta) = (k * period * period / (2.0 * mass), b * period / mass);
            let (a2, a1, a0) = (-2.0f64, 1.0 + alpha + beta, alpha - beta);
            let jury = 1.0 + a2 + a1 + a0 > 0.0
                && -1.0 + a2 - a1 + a0 < 0.0
                && a0.abs() < 1.0
                && (a0 * a0 - 1.0).abs() > (a0 * a2 - a1).abs();
            let diagram = delayed_pd(mass, k, b, "0.001");
            for route in ROUTES {
                let map = diagram.lift(route).unwrap();
                assert_eq!(map.states, ["mass.x1", "mass.x2", "pd.y1.age1"]);
                let values = eigenvalues(&map.matrix).unwrap();
                assert_eq!(spectral_radius(&values) < 1.0, jury, "{k} {b}");
                for z in values {
                    let polynomial = ((z + a2) * z + a1) * z + a0;
                    let size = 1.0 + a1.abs() + a0.abs() + z.norm().powi(3);
                    assert!(polynomial.norm() < 1e-12 * size, "{k} {b} {z}");
                }
            }
            assert_eq!(diagram.spectral_radius().unwrap() < 1.0, jury);
            *if jury { &mut stable } else { &mut unstable } += 1;
        }
    }
    assert!(stable > 10 && unstable > 10, "{stable} {unstable}");
}

#[test]
fn a_delay_of_part_of_a_period_splits_the_hold() {
    // Franklin, Powell & Workman: x⁺ = Φ·x + Γ_1·u(k − 1) + Γ_0·u(k).
    let (mass, k, b, period) = (0.1, 700.0, 4.0, 1e-3);
    for (delay, tau) in [("0.0004", 4e-4), ("1/3000", 1e-3 / 3.0), ("0.000001", 1e-6)] {
        let rest = period - tau;
        let old = dmatrix![tau * (period - tau / 2.0); tau] / mass;
        let new = dmatrix![rest * rest / 2.0; rest] / mass;
        let gain = dmatrix![-k, -b];
        let mut expected = DMatrix::zeros(3, 3);
        expected.view_mut((0, 0), (2, 2)).copy_from(&(dmatrix![1.0, period; 0.0, 1.0] + new * &gain));
        expected.view_mut((0, 2), (2, 1)).copy_from(&old);
        expected.view_mut((2, 0), (1, 2)).copy_from(&gain);
        let diagram = delayed_pd(mass, k, b, delay);
        for route in [LiftRoute::Stepping, LiftRoute::StateSpace] {
            assert!((diagram.lift(route).unwrap().matrix - &expected).amax() < 1e-12 * expected.amax());
        }
        let refused = diagram.lift(LiftRoute::Resampling).unwrap_err();
        assert!(
            matches!(&refused, DiagramError::NotNested(why) if why == "pd is used a part of a period later"),
            "{refused}"
        );
    }
}

#[test]
fn a_delay_of_several_periods_keeps_as_many_samples() {
    for (delay, samples) in [("0", 0), ("0.001", 1), ("0.0011", 2), ("0.002", 2), ("0.00725", 8)] {
        let diagram = delayed_pd(0.1, 100.0, 1.0, delay);
        let states = diagram.states().unwrap();
        assert_eq!(states.len(), 2 + samples, "{delay}");
        assert_eq!(states.last().unwrap().ends_with(&format!(".age{samples}")), samples > 0);
    }
}

#[test]
fn a_first_order_hold_moves_linearly_one_period_late() {
    let (gain, period) = (300.0, 1e-3);
    let mut diagram = Diagram::new();
    let integrator = Plant { a: dmatrix![0.0], b: dmatrix![1.0], c: dmatrix![1.0] };
    let integrator = diagram.plant("integrator", integrator);
    let hold = diagram.sampled("hold", Sampled::first_order_hold(Clock::every(time("0.001")), 1));
    diagram.connect_scaled(integrator, hold, -gain);
    diagram.connect(hold, integrator);
    // Over a period, the mean of the value of one period ago and the present one.
    let expected = dmatrix![1.0 - gain * period / 2.0, period / 2.0; -gain, 0.0];
    for route in ROUTES {
        let map = diagram.lift(route).unwrap();
        assert_eq!(map.states, ["integrator.x1", "hold.x1"]);
        assert!((map.matrix - &expected).amax() < 1e-12 * gain);
    }
}

#[test]
fn a_velocity_filter_is_the_one_of_scenes() {
    let (period_s, cutoff_rad_per_s) = (1e-3, 200.0);
    let clock = Clock::every(time("0.001"));
    let Sampled { law: Law::Linear(law), .. } =
        Sampled::velocity(clock, 1, Estimate::Filtered { cutoff_rad_per_s })
    else {
        panic!("a velocity filter is linear")
    };
    let share = 1.0 - (-cutoff_rad_per_s * period_s).exp();
    let (mut state, mut told) = (dmatrix![0.02; 0.5], 0.5);
    let mut last = 0.02;
    for position in [0.021, 0.025, 0.02, -0.01] {
        told += share * ((position - last) / period_s - told);
        last = position;
        let output = &law.c * &state + &law.d * position;
        assert!((output[0] - position).abs() < 1e-15 && (output[1] - told).abs() < 1e-12);
        state = &law.a * &state + &law.b * position;
    }
}

#[test]
fn resampling_says_why_it_does_not_apply() {
    let with = |clock| {
        let mut diagram = fine();
        diagram.sampled("odd", Sampled::zero_order_hold(clock, 1));
        diagram.lift(LiftRoute::Resampling).unwrap_err().to_string()
    };
    let (period, half) = (time("0.002"), time("0.001"));
    assert!(with(Clock::with_phase(period, half)).contains("odd has a phase"));
    assert!(
        with(Clock::cyclic(period, vec![Time::ZERO, half])).contains("odd has several instants a period")
    );
    assert!(with(Clock::every(time("0.0015"))).contains("the period of odd is 1.5 times that of pd"));
}

/// A message that names everything in `parts`.
fn assert_refused(diagram: &Diagram, parts: &[&str]) {
    for route in ROUTES {
        let message = diagram.lift(route).unwrap_err().to_string();
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
}

fn fine() -> Diagram {
    delayed_pd(0.1, 100.0, 1.0, "0")
}

#[test]
fn clocks_without_a_common_pattern_are_refused() {
    let mut diagram = fine();
    diagram.sampled("network", Sampled::zero_order_hold(Clock::every(time("1/128.00001")), 1));
    diagram.sampled("other", Sampled::zero_order_hold(Clock::every(time("1/125")), 1));
    assert_refused(
        &diagram,
        &["network", "every 100000/12800001 s", "pd", "1/1000 s", "1/125 s would fit pd"],
    );
    let mut diagram = fine();
    for digits in ["0.999999999989", "0.999999999961", "0.999999999937"] {
        diagram.sampled(digits, Sampled::zero_order_hold(Clock::every(time(digits)), 1));
    }
    assert_refused(&diagram, &["do not fit", "0.9999999999"]);
}

#[test]
fn too_many_instants_are_refused() {
    let mut diagram = fine();
    diagram.sampled("slow", Sampled::zero_order_hold(Clock::every(time("2000")), 1));
    assert_refused(&diagram, &["pd", "1000000 instants within 2000 s"]);
    let mut alone = Diagram::new();
    alone.sampled("mean", Sampled::mean(Clock::every(time("1")), 1, 1_500_000));
    assert_refused(&alone, &["mean", "1000000 instants within 1 s"]);
    let mut diagram = fine();
    diagram.sampled("way", Sampled::delay(Clock::every(time("0.001")), 1, time("1/999999999989")));
    assert!(diagram.lift(LiftRoute::StateSpace).is_ok());
    diagram.sampled("other way", Sampled::delay(Clock::every(time("0.001")), 1, time("1/999999999961")));
    assert_refused(&diagram, &["other way", "simpler fractions"]);
    let mut diagram = fine();
    diagram.sampled("way", Sampled::delay(Clock::every(time("0.001")), 1, time("1000")));
    assert_refused(&diagram, &["1000000 samples on their way"]);
}

#[test]
fn clocks_must_make_sense() {
    let with = |clock| {
        let mut diagram = fine();
        diagram.sampled("odd", Sampled::zero_order_hold(clock, 1));
        diagram
    };
    let period = time("0.002");
    assert_refused(&with(Clock::every(Time::ZERO)), &["odd", "0 s", "above 0"]);
    assert_refused(&with(Clock::with_phase(period, period)), &["odd", "below its period of 1/500 s"]);
    assert_refused(&with(Clock::cyclic(period, vec![])), &["odd", "at least one offset"]);
    let twice = vec![time("0.001"), time("0.001")];
    assert_refused(&with(Clock::cyclic(period, twice)), &["odd", "rising"]);
    assert_refused(&with(Clock::every(time("1000000000000").times(u64::MAX))), &["odd", "at most 1e18"]);
    let mut diagram = fine();
    let hold = Sampled::first_order_hold(Clock::cyclic(period, vec![Time::ZERO, time("0.001")]), 1);
    diagram.sampled("odd", hold);
    assert_refused(&diagram, &["odd", "one offset", "found 2"]);
    let mut diagram = fine();
    let mut way = Sampled::zero_order_hold(Clock::cyclic(period, vec![Time::ZERO, time("0.001")]), 1);
    way.delays = vec![time("0.0015"), Time::ZERO];
    diagram.sampled("way", way.clone());
    assert_refused(&diagram, &["way", "later sample"]);
    way.delays.pop();
    diagram.blocks[2].element = Element::Sampled(way);
    assert_refused(&diagram, &["way", "2 offsets", "found 1"]);
    let mut plants = Diagram::new();
    plants.plant("mass", double_integrator(1.0));
    assert_refused(&plants, &["clock"]);
    assert!("-0.001".parse::<Time>().unwrap_err().to_string().contains("0 or more"));
    assert!(Time::new(1, 0).is_err());
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let mut diagram = fine();
    diagram.wire(DiagramBlockId(7), DiagramBlockId(0), dmatrix![1.0]);
    assert_refused(&diagram, &["block 7", "there are 2"]);
    let mut diagram = fine();
    diagram.wire(DiagramBlockId(0), DiagramBlockId(1), dmatrix![1.0]);
    assert_refused(&diagram, &["wire from mass to pd", "2×2", "1×1"]);
    let mut diagram = fine();
    diagram.connect(DiagramBlockId(1), DiagramBlockId(1));
    assert_refused(&diagram, &["wire from pd to pd", "2×1"]);
    let mut diagram = fine();
    diagram.wires[0].gain[(1, 0)] = f64::NAN;
    assert_refused(&diagram, &["wire from mass to pd", "row 1, column 0", "finite", "NaN"]);
    let mut diagram = fine();
    diagram.wire(DiagramBlockId(0), DiagramBlockId(0), dmatrix![1.0, 0.0]);
    assert_refused(&diagram, &["mass drives mass", "hold"]);
    let mut diagram = fine();
    let law = LinearBlock { a: dmatrix![1.0], b: dmatrix![1.0], c: dmatrix![1.0, 2.0], d: dmatrix![1.0] };
    diagram.sampled("software", Sampled::linear(Clock::every(time("0.001")), law));
    assert_refused(&diagram, &["C of software", "1×1", "1×2"]);
    let mut diagram = fine();
    diagram.sampled("mean", Sampled::mean(Clock::every(time("0.001")), 1, 0));
    assert_refused(&diagram, &["weights of mean", "at least one"]);
    let mut diagram = fine();
    diagram.sampled("sum", Sampled::average(Clock::every(time("0.001")), 1, vec![1.0, f64::INFINITY]));
    assert_refused(&diagram, &["weight 1 of sum", "inf"]);
    let mut diagram = fine();
    diagram.blocks[0].states.pop();
    assert_refused(&diagram, &["names of states of mass", "2 long", "found 1"]);
    let mut diagram = fine();
    diagram.plant("mass", double_integrator(1.0));
    assert_refused(&diagram, &["mass.x1"]);
    let mut diagram = fine();
    let plant = Plant { a: dmatrix![-1e12], b: dmatrix![1.0], c: dmatrix![1.0] };
    diagram.push(DiagramBlock {
        name: "stiff".into(),
        states: vec!["s".into()],
        outputs: vec!["y".into()],
        past_outputs: vec![],
        element: Element::Plant(plant),
    });
    assert_refused(&diagram, &["stiff", "too fast"]);
}

#[test]
fn what_outgrows_floating_point_has_no_radius() {
    let mut diagram = fine();
    diagram.plant("explosion", Plant { a: dmatrix![9e8], b: dmatrix![1.0], c: dmatrix![1.0] });
    assert_eq!(diagram.lift(LiftRoute::Stepping).unwrap().states.len(), 3);
    assert!(matches!(diagram.spectral_radius(), Err(DiagramError::Eigenvalues(_))));
}

fn any_time() -> impl Strategy<Value = Time> {
    let small = (0u64..9, 1u64..9);
    let large = (0..u64::MAX, 1..u64::MAX);
    let any = prop_oneof![4 => small, 1 => large];
    any.prop_map(|(numerator, denominator)| Time::new(numerator, denominator).unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_times_have_a_map_or_an_error_that_names_a_block(
        times in prop::collection::vec([any_time(), any_time(), any_time()], 1..4),
    ) {
        let mut diagram = Diagram::new();
        for (index, [period, phase, delay]) in times.into_iter().enumerate() {
            let way = Sampled::delay(Clock::with_phase(period, phase), 1, delay);
            diagram.sampled(format!("way{index}"), way);
        }
        match diagram.states() {
            Ok(states) => prop_assert!(states.iter().all(|state| state.starts_with("way"))),
            Err(error) => {
                let message = error.to_string();
                prop_assert!(message.contains("way"), "{}", message);
            }
        }
    }
}

/// Two gains in a circle, the second `phase` and `delay` later.
fn circle(phase: &str, delay: &str) -> Diagram {
    let mut diagram = Diagram::new();
    let period = time("0.001");
    let one = diagram.sampled("one", Sampled::gain(Clock::every(period), dmatrix![0.5]));
    let other = Sampled::gain(Clock::with_phase(period, time(phase)), dmatrix![-3.0]).after(time(delay));
    let other = diagram.sampled("other", other);
    let bystander = diagram.sampled("bystander", Sampled::zero_order_hold(Clock::every(period), 1));
    diagram.connect(one, other);
    diagram.connect(other, one);
    diagram.connect(other, bystander);
    diagram
}

#[test]
fn an_algebraic_loop_is_refused_by_name() {
    let diagram = circle("0", "0");
    assert_refused(&diagram, &["algebraic loop", "one", "other"]);
    assert!(!diagram.spectral_radius().unwrap_err().to_string().contains("bystander"));
    // What acts at another instant, or later, closes no circle.
    for (phase, delay) in [("0.0005", "0"), ("0", "0.001"), ("0", "0.0001"), ("0.0009", "0.00005")] {
        let diagram = circle(phase, delay);
        assert!((diagram.spectral_radius().unwrap() - 1.5).abs() < 1e-12, "{phase} {delay}");
    }
}
