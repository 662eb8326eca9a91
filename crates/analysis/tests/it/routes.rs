//! Three routes, one map.

use cotouch_analysis::compile;
use cotouch_analysis::diagram::{
    Clock, Diagram, DiagramBlockId, DiagramError, DiagramMap, Element, Law, LiftRoute, Plant, Sampled, Time,
};
use cotouch_analysis::loop_spec::{
    Block, Delay, Dynamics, Estimate, ForceGains, LINE, LoopBody, LoopSpec, Motion, Term,
};
use cotouch_scene::scene::{Architecture, PlayOut, Scene, VelocityEstimate};
use cotouch_scene::time::Schedule;
use cotouch_testkit::scenes::{any_scene, edited, grasp, spring, with_ratio};
use cotouch_world::LinearBlock;
use nalgebra::DMatrix;
use proptest::prelude::*;

fn assert_close(found: &DMatrix<f64>, expected: &DMatrix<f64>) -> Result<(), TestCaseError> {
    prop_assert_eq!(found.shape(), expected.shape());
    let (error, size) = ((found - expected).amax(), expected.amax());
    prop_assert!(error <= 1e-10 * size, "{:e} of {:e}", error, size);
    Ok(())
}

const VELOCITIES: [VelocityEstimate; 3] =
    [VelocityEstimate::Exact, VelocityEstimate::Difference, VelocityEstimate::Filtered];

/// With sensors of every kind, and rates whose ratio is not always whole.
fn any_session() -> impl Strategy<Value = Scene> {
    (any_scene(), any::<bool>(), 0usize..3).prop_map(|(mut scene, uneven, velocity)| {
        if uneven {
            let ratio = scene.schedule().ticks_per_pattern();
            scene = edited(&scene, |scene| {
                scene.rates.network_hz = format!("{}/{}", 1024 * 2, 2 * ratio + 1).parse().unwrap()
            });
        }
        scene = edited(&scene, |scene| scene.device.velocity = VELOCITIES[velocity]);
        scene
    })
}

/// Whether subsystem resampling must apply: nested rates, and samples that are used at network steps.
fn is_nested(scene: &Scene, spec: &LoopSpec) -> bool {
    scene.link.play_out == PlayOut::Scheduled && spec.schedule.steps_per_pattern() == 1
}

fn assert_routes_agree(spec: &LoopSpec, is_nested: bool) -> Result<(), TestCaseError> {
    let expected = spec.lift().unwrap();
    let diagram = spec.to_diagram().unwrap();
    let names: Vec<_> = expected.coordinates.iter().map(ToString::to_string).collect();
    prop_assert_eq!(diagram.states().unwrap(), names);
    for route in [LiftRoute::Stepping, LiftRoute::StateSpace, LiftRoute::Resampling] {
        match diagram.lift(route) {
            Ok(map) => assert_close(&map.matrix, &expected.matrix)?,
            Err(error) => {
                let is_allowed =
                    matches!((route, &error), (LiftRoute::Resampling, DiagramError::NotNested(_)))
                        && !is_nested;
                prop_assert!(is_allowed, "{}", error);
            }
        }
    }
    Ok(())
}

#[test]
fn the_routes_agree_on_grasps() {
    for (architecture, velocity) in
        [Architecture::Distributed, Architecture::Centralized].into_iter().zip(VELOCITIES)
    {
        let scene = edited(&with_ratio(grasp(architecture), 4), |scene| {
            scene.device.velocity = velocity;
            scene.device.velocity_cutoff_hz = 60.0;
        });
        let modes = compile(&scene);
        for mode in [&modes[0], &modes[modes.len() - 1]] {
            assert_routes_agree(&mode.spec, is_nested(&scene, &mode.spec)).unwrap();
        }
    }
}

/// What a random block is made of.
#[derive(Clone, Debug)]
struct Node {
    kind: u8,
    rate: usize,
    phase: u64,
    delay: u64,
    numbers: [f64; 6],
}

/// A diagram to be.
#[derive(Clone, Debug)]
struct Recipe {
    /// Nested rates, no phases, delays of whole periods.
    nested: bool,
    nodes: Vec<Node>,
    wires: Vec<(usize, usize, [f64; 6])>,
}

fn any_recipe(nested: impl Strategy<Value = bool>) -> impl Strategy<Value = Recipe> {
    let numbers = || prop::array::uniform6(-1.0..1.0f64);
    let node = (0u8..12, 0usize..4, 0u64..6, 0u64..9, numbers())
        .prop_map(|(kind, rate, phase, delay, numbers)| Node { kind, rate, phase, delay, numbers });
    let wires = prop::collection::vec((0usize..12, 0usize..12, numbers()), 10..30);
    (nested, prop::collection::vec(node, 4..10), wires).prop_map(|(nested, nodes, wires)| Recipe {
        nested,
        nodes,
        wires,
    })
}

/// Milliseconds.
const NESTED: [u64; 4] = [1, 2, 6, 12];
const ANY: [u64; 4] = [2, 3, 4, 10];

fn milliseconds(numerator: u64, denominator: u64) -> Time {
    Time::new(numerator, 1000 * denominator).unwrap()
}

fn matrix(rows: usize, columns: usize, numbers: &[f64; 6]) -> DMatrix<f64> {
    DMatrix::from_fn(rows, columns, |row, column| numbers[(row * columns + 2 * column + row) % 6])
}

impl Node {
    fn period(&self, nested: bool) -> u64 {
        if nested { NESTED[self.rate] } else { ANY[self.rate] }
    }

    fn clock(&self, nested: bool) -> Clock {
        let period = self.period(nested);
        let phase = |sixths: u64| milliseconds(period * sixths, 6);
        match (nested, self.phase) {
            (true, _) => Clock::every(milliseconds(period, 1)),
            (false, 4) if self.kind < 6 => {
                Clock::cyclic(milliseconds(period, 1), vec![Time::ZERO, phase(1), phase(4)])
            }
            (false, sixths) => Clock::with_phase(milliseconds(period, 1), phase(sixths)),
        }
    }

    fn delay(&self, nested: bool) -> Time {
        let period = self.period(nested);
        if nested {
            milliseconds(period * self.delay.saturating_sub(5), 1)
        } else {
            milliseconds(period * self.delay, 4)
        }
    }

    fn weights(&self, nested: bool) -> Vec<f64> {
        let samples = if nested {
            NESTED[self.rate] / NESTED[self.phase as usize % (self.rate + 1)]
        } else {
            self.phase + 1
        };
        (0..samples as usize).map(|sample| self.numbers[sample % 6]).collect()
    }

    fn element(&self, nested: bool) -> Element {
        let (clock, numbers) = (self.clock(nested), &self.numbers);
        let linear = |a, b, c, d| Sampled::linear(clock.clone(), LinearBlock { a, b, c, d });
        let sampled = match self.kind {
            0 | 1 => return Element::Plant(self.plant()),
            2 => Sampled::zero_order_hold(clock, 2),
            3 => Sampled::coupler(clock, 1, spring(1.5 * numbers[0].abs(), numbers[1].abs())),
            4 => linear(
                matrix(2, 2, numbers) * 0.5,
                matrix(2, 1, numbers),
                matrix(2, 2, numbers).transpose(),
                DMatrix::zeros(2, 1),
            ),
            5 => linear(
                matrix(2, 2, numbers) * 0.5,
                matrix(2, 2, numbers),
                matrix(1, 2, numbers),
                matrix(1, 2, numbers),
            ),
            6 | 10 => Sampled::average(clock, 2, self.weights(nested)),
            7 | 11 => Sampled::first_order_hold(clock, 2),
            8 => Sampled::velocity(clock, 1, Estimate::Difference),
            _ => Sampled::velocity(clock, 1, Estimate::Filtered { cutoff_rad_per_s: 100.0 }),
        };
        Element::Sampled(sampled.after(self.delay(nested)))
    }

    fn plant(&self) -> Plant {
        let numbers = &self.numbers;
        if self.kind == 0 {
            return Plant::mass(0.3 + numbers[0].abs(), spring(200.0 * numbers[1].abs(), 3.0 * numbers[2]));
        }
        Plant { a: matrix(3, 3, numbers) * 40.0, b: matrix(3, 2, numbers) * 20.0, c: matrix(2, 3, numbers) }
    }
}

impl Recipe {
    /// Wires that make an algebraic loop or join plants are left out. Gains are such that the state grows little enough
    /// within a pattern (some 10⁴-fold) for ten digits to mean something.
    fn diagram(&self) -> Diagram {
        let mut diagram = Diagram::new();
        let mass = diagram.plant("mass", Plant::mass(0.2, spring(20.0, 1.0)));
        let control = diagram.sampled(
            "control",
            Sampled::gain(Clock::every(milliseconds(1, 1)), DMatrix::from_row_slice(1, 2, &[-300.0, -2.0])),
        );
        diagram.connect(mass, control);
        diagram.connect(control, mass);
        for (index, node) in self.nodes.iter().enumerate() {
            let kind = if matches!(node.kind, 8 | 9) { "velocity" } else { "node" };
            diagram.add(format!("{kind}{index}"), node.element(self.nested));
        }
        let count = diagram.blocks.len();
        for &(from, to, numbers) in &self.wires {
            let (from, to) = (DiagramBlockId(from % count), DiagramBlockId(to % count));
            let shape = (diagram.blocks[to.0].element.inputs(), diagram.blocks[from.0].element.outputs());
            let mut gain = matrix(shape.0, shape.1, &numbers) * 0.5;
            if diagram.blocks[from.0].name.starts_with("velocity") {
                gain.column_mut(1).scale_mut(1e-3);
            }
            diagram.wire(from, to, gain);
            match diagram.states() {
                Ok(_) => {}
                Err(DiagramError::AlgebraicLoop(_) | DiagramError::NotHeld { .. }) => {
                    diagram.wires.pop();
                }
                Err(error) => panic!("{error}"),
            }
        }
        diagram
    }
}

/// The map with its states in another order.
fn in_order(map: &DiagramMap, states: &[String]) -> DMatrix<f64> {
    let place = |name: &String| map.states.iter().position(|other| other == name).unwrap();
    let places: Vec<usize> = states.iter().map(place).collect();
    DMatrix::from_fn(places.len(), places.len(), |i, j| map.matrix[(places[i], places[j])])
}

/// A block that samples late in its period is a clock with a phase.
#[test]
fn a_phase_is_written_as_weights_that_begin_with_zeros() {
    let [control, slow] = ["1000", "250"].map(|rate| rate.parse().unwrap());
    let plant = Plant::mass(0.2, spring(50.0, 2.0));
    let law = LinearBlock {
        a: DMatrix::from_element(1, 1, 0.6),
        b: DMatrix::from_row_slice(1, 2, &[0.3, 0.01]),
        c: DMatrix::from_element(1, 1, 40.0),
        d: DMatrix::from_row_slice(1, 2, &[-200.0, -3.0]),
    };
    let mut spec = LoopSpec::new(Schedule::new(control, control).unwrap());
    let states = ["host1.hand.x", "host1.hand.v"].map(|name| name.parse().unwrap()).to_vec();
    let hand = spec.body(LoopBody { states, axes: LINE, dynamics: Dynamics::Plant(plant.clone()) });
    let read = |number| Term { component: number, motion: Motion::Current(hand), number, gain: 1.0 };
    let input = ForceGains { components: 2, terms: vec![read(0), read(1)] };
    let ticks = Schedule::new(control, slow).unwrap();
    let late = spec.block(Block {
        states: vec!["host1.integral1".parse().unwrap()],
        outputs: vec!["host1.surface1.x.age1".parse().unwrap()],
        weights: vec![vec![0.0, 0.0, 1.0]],
        ..Block::sampled(ticks, input, law.clone(), Delay::periods(1))
    });
    let force = Term { component: 0, motion: Motion::Output(late), number: 0, gain: 1.0 };
    spec.act(hand, ForceGains { components: 1, terms: vec![force] });

    let mut diagram = Diagram::new();
    let hand = diagram.plant("hand", plant);
    let clock = Clock::with_phase(milliseconds(4, 1), milliseconds(2, 1));
    let late = diagram.sampled("late", Sampled::linear(clock, law).after(milliseconds(2, 1)));
    diagram.connect(hand, late);
    diagram.connect(late, hand);

    let expected = diagram.lift(LiftRoute::Stepping).unwrap().matrix;
    assert_eq!(expected.nrows(), 4);
    let by_route = |route| spec.lift_by(route).unwrap().matrix;
    for found in [LiftRoute::Stepping, LiftRoute::StateSpace, LiftRoute::Resampling].map(by_route) {
        assert_close(&found, &expected).unwrap();
    }
    assert_close(&spec.lift().unwrap().matrix, &expected).unwrap();
    assert_close(&diagram.lift(LiftRoute::StateSpace).unwrap().matrix, &expected).unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_routes_agree_on_scenes(scene in any_session()) {
        let spec = &compile(&scene)[0].spec;
        assert_routes_agree(spec, is_nested(&scene, spec))?;
    }

    #[test]
    fn the_routes_agree_on_nested_diagrams(recipe in any_recipe(Just(true))) {
        let diagram = recipe.diagram();
        let expected = diagram.lift(LiftRoute::Stepping).unwrap();
        for route in [LiftRoute::StateSpace, LiftRoute::Resampling] {
            assert_close(&diagram.lift(route).unwrap().matrix, &expected.matrix)?;
        }
    }

    #[test]
    fn the_routes_agree_on_any_diagram(recipe in any_recipe(Just(false))) {
        let diagram = recipe.diagram();
        let expected = diagram.lift(LiftRoute::Stepping).unwrap();
        assert_close(&diagram.lift(LiftRoute::StateSpace).unwrap().matrix, &expected.matrix)?;
        match diagram.lift(LiftRoute::Resampling) {
            Ok(map) => assert_close(&map.matrix, &expected.matrix)?,
            Err(error) => prop_assert!(matches!(error, DiagramError::NotNested(_)), "{}", error),
        }
    }

    #[test]
    fn refining_the_base_tick_changes_nothing(recipe in any_recipe(any::<bool>())) {
        let diagram = recipe.diagram();
        let mut refined = diagram.clone();
        refined.sampled("idle", Sampled::zero_order_hold(Clock::every(milliseconds(1, 7)), 1));
        for route in [LiftRoute::Stepping, LiftRoute::StateSpace] {
            let expected = diagram.lift(route).unwrap();
            let found = refined.lift(route).unwrap();
            prop_assert_eq!(&found.states, &expected.states);
            assert_close(&found.matrix, &expected.matrix)?;
        }
    }

    #[test]
    fn a_clock_may_be_told_by_two_of_its_periods(recipe in any_recipe(any::<bool>())) {
        let diagram = recipe.diagram();
        let mut doubled = diagram.clone();
        for block in &mut doubled.blocks {
            if let Element::Sampled(Sampled { clock, delays, weights, law: Law::Linear(_), .. }) =
                &mut block.element
            {
                let period = clock.period;
                let later = clock.offsets.iter().map(|offset| offset.plus(period)).collect::<Vec<_>>();
                clock.offsets.extend(later);
                clock.period = period.times(2);
                delays.extend(delays.clone());
                weights.extend(weights.clone());
            }
        }
        for route in [LiftRoute::Stepping, LiftRoute::StateSpace] {
            let (once, found) = (diagram.lift(route).unwrap(), doubled.lift(route).unwrap());
            prop_assert_eq!(&found.states, &once.states);
            let is_longer = found.period_s > 1.5 * once.period_s;
            let expected = if is_longer { &once.matrix * &once.matrix } else { once.matrix };
            assert_close(&found.matrix, &expected)?;
        }
    }

    #[test]
    fn the_unit_of_time_changes_nothing(recipe in any_recipe(any::<bool>())) {
        const FACTOR: u64 = 3;
        let diagram = recipe.diagram();
        let mut slower = diagram.clone();
        for block in &mut slower.blocks {
            match &mut block.element {
                Element::Plant(plant) => {
                    plant.a /= FACTOR as f64;
                    plant.b /= FACTOR as f64;
                }
                Element::Sampled(Sampled { clock, delays, spacing, .. }) => {
                    *spacing = spacing.times(FACTOR);
                    clock.period = clock.period.times(FACTOR);
                    clock.offsets.iter_mut().chain(delays).for_each(|time| *time = time.times(FACTOR));
                }
            }
        }
        for route in [LiftRoute::Stepping, LiftRoute::StateSpace, LiftRoute::Resampling] {
            let (Ok(expected), found) = (diagram.lift(route), slower.lift(route)) else { continue };
            let found = found.unwrap();
            prop_assert!((found.period_s - expected.period_s * FACTOR as f64).abs() < 1e-12);
            let scale = |name: &String| if name.contains(".slope.") { 1.0 / FACTOR as f64 } else { 1.0 };
            let scales: Vec<f64> = found.states.iter().map(scale).collect();
            let matrix = DMatrix::from_fn(scales.len(), scales.len(), |i, j| {
                found.matrix[(i, j)] * scales[j] / scales[i]
            });
            assert_close(&matrix, &expected.matrix)?;
        }
    }

    #[test]
    fn the_order_of_blocks_changes_only_the_order(recipe in any_recipe(any::<bool>()), by in 1usize..6) {
        let diagram = recipe.diagram();
        let count = diagram.blocks.len();
        let moved = |DiagramBlockId(index): DiagramBlockId| DiagramBlockId(count - 1 - (index + by) % count);
        let mut reordered = diagram.clone();
        for (index, block) in diagram.blocks.iter().enumerate() {
            reordered.blocks[moved(DiagramBlockId(index)).0] = block.clone();
        }
        for wire in &mut reordered.wires {
            (wire.from, wire.to) = (moved(wire.from), moved(wire.to));
        }
        reordered.wires.reverse();
        for route in [LiftRoute::Stepping, LiftRoute::StateSpace, LiftRoute::Resampling] {
            let (Ok(expected), found) = (diagram.lift(route), reordered.lift(route)) else { continue };
            assert_close(&in_order(&found.unwrap(), &expected.states), &expected.matrix)?;
        }
    }
}
