//! Whether a hand-written [`LoopSpec`] makes sense.

use std::collections::BTreeSet;

use cotouch_scene::names::Coordinate;

use crate::discretise::per_inertia;
use crate::loop_spec::{
    Block, Dynamics, Estimate, Force, ForceGains, Hold, Line, LineId, LoopBody, LoopSpec, Motion, Plant,
    Signal, tick_of_step,
};
use crate::order::direct_blocks;

/// Why a [`LoopSpec`] cannot be analysed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// A place that is not in the list.
    #[error("{what} {index} does not exist; there are {count}")]
    Missing {
        /// "body", "line", "component" or "number".
        what: &'static str,
        /// What was asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A line of the wrong kind.
    #[error("line {0} carries a motion, and is used as a force")]
    WrongSignal(usize),
    /// A force that is read at the instant at which it is sampled.
    #[error(
        "line {0} carries a force that a block or another line reads at the instant of sampling; it needs a delay"
    )]
    FreshForce(usize),
    /// Matrices that do not fit each other.
    #[error(
        "{body} has {axes} degrees of freedom: its plant needs A n×n, B n×{axes} and C {}×n, n at least 1, and the body {states} states; found A {}×{}, B {}×{}, C {}×{} and {names} names",
        2 * axes, a.0, a.1, b.0, b.1, c.0, c.1
    )]
    Shape {
        /// The body's first state.
        body: String,
        /// d.
        axes: usize,
        /// Rows and columns.
        a: (usize, usize),
        /// Rows and columns.
        b: (usize, usize),
        /// Rows and columns.
        c: (usize, usize),
        /// How many states it needs.
        states: usize,
        /// How many names there are.
        names: usize,
    },
    /// A line whose samples have another number of components than the force on the body that they act on.
    #[error("a force of {found} components acts on a body with {allowed} degrees of freedom")]
    Components {
        /// Of the force.
        found: usize,
        /// Of the body.
        allowed: usize,
    },
    /// A number out of range.
    #[error("{what} must be {allowed}; found {found}")]
    Number {
        /// Whose number.
        what: String,
        /// The range.
        allowed: &'static str,
        /// The number.
        found: f64,
    },
    /// A block that does not fit together.
    #[error("block {block}: {problem}")]
    Block {
        /// Its place.
        block: usize,
        /// What is wrong, and what is needed.
        problem: String,
    },
    /// Blocks whose outputs depend on themselves at one instant.
    #[error("blocks {0:?} depend on each other at one instant; one of them needs a delay")]
    Circle(Vec<usize>),
    /// Two states of one name.
    #[error("two states are called {0}; every state needs its own name")]
    Duplicate(Coordinate),
}

/// Checks that every reference exists, shapes fit, numbers are finite and names are unique.
pub(crate) fn check(spec: &LoopSpec) -> Result<(), SpecError> {
    spec.bodies.iter().try_for_each(check_body)?;
    for (index, line) in spec.lines.iter().enumerate() {
        match &line.signal {
            Signal::Motion(body) | Signal::Position(body) => check_index("body", body.0, spec.bodies.len())?,
            Signal::Force(coupling) => {
                // Along x, y, z.
                check_components(coupling.components, coupling.components.clamp(1, 3))?;
                check_coupling(spec, coupling, || format!("the force of line {index}"))?;
                check_no_fresh_force(spec, coupling)?;
            }
        }
    }
    for action in &spec.actions {
        check_index("body", action.body.0, spec.bodies.len())?;
        let components = match &action.force {
            Force::Gains(coupling) => {
                check_coupling(spec, coupling, || format!("a force on body {}", action.body.0))?;
                coupling.components
            }
            &Force::Held(line) => {
                check_force_line(spec, line)?;
                spec.lines[line.0].signal.force().map_or(0, |coupling| coupling.components)
            }
        };
        check_components(components, spec.bodies[action.body.0].axes.len())?;
    }
    for (index, block) in spec.blocks.iter().enumerate() {
        check_block(spec, block).map_err(|problem| SpecError::Block { block: index, problem })?;
        check_coupling(spec, &block.input, || format!("the input of block {index}"))?;
        check_no_fresh_force(spec, &block.input)?;
    }
    direct_blocks(spec).map_err(|circle| SpecError::Circle(circle.iter().map(|block| block.0).collect()))?;
    check_names(spec)
}

/// What is wrong with a block by itself.
fn check_block(spec: &LoopSpec, block: &Block) -> Result<(), String> {
    let (states, inputs, outputs) = (block.law.states(), block.law.inputs(), block.law.outputs());
    for (which, matrix, needed) in [
        ("A", &block.law.a, (states, states)),
        ("B", &block.law.b, (states, inputs)),
        ("C", &block.law.c, (outputs, states)),
        ("D", &block.law.d, (outputs, inputs)),
    ] {
        if matrix.shape() != needed {
            let (found, (rows, columns)) = (matrix.shape(), needed);
            return Err(format!("{which} must be {rows}×{columns}; found {}×{}", found.0, found.1));
        }
        if let Some(found) = matrix.iter().find(|value| !value.is_finite()) {
            return Err(format!("numbers of {which} must be finite; found {found}"));
        }
    }
    for (what, found, needed) in [
        ("components of the input", block.input.components, inputs),
        ("names of states", block.states.len(), states),
        (
            "names of outputs",
            block.outputs.len(),
            if block.past_outputs() > 0 || !block.outputs.is_empty() { outputs } else { 0 },
        ),
    ] {
        if found != needed {
            return Err(format!("{needed} {what} are needed; found {found}"));
        }
    }
    if block.clock.control() != spec.schedule.control() {
        return Err("its clock must count the ticks of the loop".to_owned());
    }
    check_timing(block)
}

fn check_timing(block: &Block) -> Result<(), String> {
    if block.weights.iter().any(Vec::is_empty) || block.weights.is_empty() {
        return Err("every step needs at least one weight".to_owned());
    }
    if let Some(found) = block.weights.iter().flatten().find(|weight| !weight.is_finite()) {
        return Err(format!("weights must be finite; found {found}"));
    }
    let steps = block.clock.steps_per_pattern().max(block.weights.len() as u64);
    for step in 0..steps as i64 {
        let [from, next] = [step, step + 1].map(|step| tick_of_step(&block.clock, step));
        let last = from + block.weights_of_step(step).len() as i64 - 1;
        if last >= next {
            return Err("a step must have gathered its input before the next one begins".to_owned());
        }
        let [used, used_next] = [step, step + 1].map(|step| block.delay.tick_of_use(&block.clock, step));
        let follows_input = block.law.d.iter().any(|&gain| gain != 0.0);
        if follows_input && (used < last || used == last && last > from) {
            return Err("its output must be used after its input was gathered".to_owned());
        }
        if block.hold == Hold::First && used == used_next {
            return Err("outputs of a first-order hold must be used one after the other".to_owned());
        }
    }
    Ok(())
}

fn check_components(found: usize, allowed: usize) -> Result<(), SpecError> {
    if found == allowed { Ok(()) } else { Err(SpecError::Components { found, allowed }) }
}

fn check_body(body: &LoopBody) -> Result<(), SpecError> {
    let (name, axes) =
        (|| body.states.first().map_or_else(|| "a body".to_owned(), ToString::to_string), body.axes.len());
    let (shapes, states) = match &body.dynamics {
        &Dynamics::Mass { mass_kg, .. } | &Dynamics::Rigid { mass_kg, .. } => {
            if !(mass_kg.is_finite() && mass_kg > 0.0) {
                let what = format!("the mass of {}", name());
                return Err(SpecError::Number { what, allowed: "positive and finite", found: mass_kg });
            }
            let whole = 2 * axes;
            (((whole, whole), (whole, axes), (whole, whole)), whole)
        }
        Dynamics::Plant(plant) => (shapes(plant), plant.a.nrows()),
        Dynamics::Sensed { plant, estimate: Estimate::Difference } => (shapes(plant), plant.a.nrows() + axes),
        Dynamics::Sensed { plant, estimate: Estimate::Filtered { .. } } => {
            (shapes(plant), plant.a.nrows() + 2 * axes)
        }
    };
    let (a, b, c) = shapes;
    if a.0 == 0
        || axes == 0
        || (a.1, b, c) != (a.0, (a.0, axes), (2 * axes, a.0))
        || body.states.len() != states
    {
        return Err(SpecError::Shape { body: name(), axes, a, b, c, states, names: body.states.len() });
    }
    let what = || format!("the plant of {}", name());
    match &body.dynamics {
        Dynamics::Mass { .. } => Ok(()),
        Dynamics::Rigid { .. } => per_inertia(body)
            .iter()
            .try_for_each(|&found| check_finite(found, || format!("the inverse inertia of {}", name()))),
        Dynamics::Plant(plant) => check_plant(plant, &what),
        Dynamics::Sensed { plant, estimate } => {
            if let &Estimate::Filtered { cutoff_rad_per_s } = estimate {
                check_finite(cutoff_rad_per_s, || format!("the velocity filter's corner of {}", name()))?;
            }
            check_plant(plant, &what)
        }
    }
}

type Shapes = ((usize, usize), (usize, usize), (usize, usize));

fn shapes(plant: &Plant) -> Shapes {
    (plant.a.shape(), plant.b.shape(), plant.c.shape())
}

fn check_plant(plant: &Plant, what: &impl Fn() -> String) -> Result<(), SpecError> {
    let numbers = plant.a.iter().chain(plant.b.iter()).chain(plant.c.iter());
    numbers.into_iter().try_for_each(|&found| check_finite(found, what))
}

fn check_coupling(
    spec: &LoopSpec,
    coupling: &ForceGains,
    what: impl Fn() -> String,
) -> Result<(), SpecError> {
    for term in &coupling.terms {
        check_finite(term.gain, || format!("a gain of {}", what()))?;
        check_index("component", term.component, coupling.components)?;
        match term.motion {
            Motion::Ground => {}
            Motion::Current(body) => check_index("body", body.0, spec.bodies.len())?,
            Motion::Held(line) => check_index("line", line.0, spec.lines.len())?,
            Motion::Output(block) => check_index("block", block.0, spec.blocks.len())?,
        }
        if term.motion != Motion::Ground {
            check_index("number", term.number, spec.numbers_of(term.motion))?;
        }
    }
    Ok(())
}

/// Forces are sampled after blocks have read the samples that are held: none of these may be a force of the same instant.
fn check_no_fresh_force(spec: &LoopSpec, coupling: &ForceGains) -> Result<(), SpecError> {
    let fresh = coupling.terms.iter().find_map(|term| match term.motion {
        Motion::Held(LineId(line)) => {
            let Line { signal, delay, .. } = &spec.lines[line];
            (signal.body().is_none() && delay.is_at_once()).then_some(line)
        }
        Motion::Ground | Motion::Current(_) | Motion::Output(_) => None,
    });
    fresh.map_or(Ok(()), |line| Err(SpecError::FreshForce(line)))
}

/// A line whose sample is used as a force.
fn check_force_line(spec: &LoopSpec, line: LineId) -> Result<(), SpecError> {
    check_index("line", line.0, spec.lines.len())?;
    match spec.lines[line.0].signal.body() {
        None => Ok(()),
        Some(_) => Err(SpecError::WrongSignal(line.0)),
    }
}

fn check_index(what: &'static str, index: usize, count: usize) -> Result<(), SpecError> {
    if index < count { Ok(()) } else { Err(SpecError::Missing { what, index, count }) }
}

fn check_finite(found: f64, what: impl FnOnce() -> String) -> Result<(), SpecError> {
    if found.is_finite() { Ok(()) } else { Err(SpecError::Number { what: what(), allowed: "finite", found }) }
}

/// Names of states, and of lines (by their first quantity: ages follow) and past outputs.
fn check_names(spec: &LoopSpec) -> Result<(), SpecError> {
    let states = spec.bodies.iter().flat_map(|body| body.states.iter().copied());
    let first = |line| spec.quantities(line).first().map(|&quantity| line.coordinate(quantity, 1));
    let lines = spec.lines.iter().filter_map(first);
    let of_blocks = spec.blocks.iter().flat_map(|block| {
        let outputs = block.outputs.iter().filter(|_| block.past_outputs() > 0);
        block.states.iter().chain(outputs).copied()
    });
    let mut seen = BTreeSet::new();
    match states.chain(lines).chain(of_blocks).find(|&name| !seen.insert(name)) {
        Some(name) => Err(SpecError::Duplicate(name)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use cotouch_scene::names::{HostIndex, Part};
    use cotouch_scene::scene::SpringDamper;
    use cotouch_scene::time::Schedule;
    use nalgebra::DMatrix;

    use super::*;
    use crate::loop_spec::{Block, Delay, LINE, Signal, Term};
    use cotouch_world::LinearBlock;

    /// A block that reads a force which was sampled `periods` network steps ago.
    fn block_on_force(periods: u32) -> LoopSpec {
        let (ticks, steps) = ("1000".parse().unwrap(), "500".parse().unwrap());
        let schedule = Schedule::new(ticks, steps).unwrap();
        let mut spec = LoopSpec::new(schedule);
        let states = ["host1.hand.x", "host1.hand.v"].map(|name| name.parse().unwrap()).to_vec();
        let soft = SpringDamper { stiffness_n_per_m: 100.0, damping_n_s_per_m: 5.0 };
        let dynamics = Dynamics::Plant(Plant::mass(0.1, soft));
        let hand = spec.body(LoopBody { states, axes: LINE, dynamics });
        let pull = spec.spring(Motion::Current(hand), Motion::Ground, soft);
        let (host, part) = (HostIndex::FIRST, Part::Force(0));
        let delay = Delay::Scheduled { periods, transit_ticks: 0 };
        let line = spec.line(Line { host, from: host, part, signal: Signal::Force(pull), delay });
        let read = Term { component: 0, motion: Motion::Held(line), number: 0, gain: 1.0 };
        let input = ForceGains { components: 1, terms: vec![read] };
        let law = LinearBlock::gain(DMatrix::from_element(1, 1, 1.0));
        let at_once = Delay::OnArrival { transit_ticks: 0 };
        spec.block(Block::sampled(spec.schedule, input, law, at_once));
        spec
    }

    #[test]
    fn a_block_reads_forces_that_were_sampled_before_not_at_the_same_instant() {
        assert_eq!(check(&block_on_force(0)), Err(SpecError::FreshForce(0)));
        assert_eq!(check(&block_on_force(1)), Ok(()));
    }
}
