//! Every [`LoopSpec`] as a diagram.

use cotouch_scene::time::Schedule;
use cotouch_world::LinearBlock;
use nalgebra::DMatrix;

use super::clock::Clock;
use super::model::{Diagram, DiagramBlock, DiagramBlockId, Element, Sampled};
use super::time::Time;
use crate::check::{SpecError, check};
use crate::discretise::BodyStep;
use crate::loop_spec::{
    self, Delay, Dynamics, Force, ForceGains, Hold, Line, LoopBody, LoopSpec, Motion, Signal, tick_of_step,
};
use crate::plant::Plant;

impl LoopSpec {
    /// The same loop as a diagram, with the same names of states in the same order: [`LoopSpec::coordinates`].
    ///
    /// # Errors
    /// When the description is inconsistent.
    pub fn to_diagram(&self) -> Result<Diagram, SpecError> {
        check(self)?;
        Ok(Lowering::new(self).diagram)
    }
}

struct Lowering<'a> {
    spec: &'a LoopSpec,
    ticks: Clock,
    diagram: Diagram,
    /// What puts out each body's positions and velocities.
    motions: Vec<DiagramBlockId>,
    /// What sums up and holds the force on each body.
    forces: Vec<DiagramBlockId>,
    lines: Vec<DiagramBlockId>,
    blocks: Vec<DiagramBlockId>,
    /// What is used of each block: the sum of what these put out.
    used: Vec<Vec<DiagramBlockId>>,
}

impl<'a> Lowering<'a> {
    fn new(spec: &'a LoopSpec) -> Self {
        let ticks = Clock::every(Time::period(spec.schedule.control()));
        let mut lowering = Self {
            spec,
            ticks,
            diagram: Diagram::new(),
            motions: Vec::new(),
            forces: Vec::new(),
            lines: Vec::new(),
            blocks: Vec::new(),
            used: Vec::new(),
        };
        let bodies: Vec<_> =
            spec.bodies.iter().enumerate().map(|(index, body)| lowering.body(index, body)).collect();
        for (index, (body, moved)) in spec.bodies.iter().zip(bodies).enumerate() {
            let force = Sampled::zero_order_hold(lowering.ticks.clone(), body.axes.len());
            let force = lowering.diagram.sampled(format!("force on body {index}"), force);
            lowering.diagram.connect(force, moved);
            lowering.forces.push(force);
        }
        for (index, line) in spec.lines.iter().enumerate() {
            let block = lowering.line(index, line);
            lowering.lines.push(block);
        }
        if lowering.lines.is_empty() {
            // The pattern is that of the schedule, whether anything uses the network or not.
            let pattern = Clock::every(Time::period(spec.schedule.control()).times(spec.ticks_per_pattern()));
            lowering.diagram.sampled("network", Sampled::zero_order_hold(pattern, 0));
        }
        for (index, block) in spec.blocks.iter().enumerate() {
            lowering.block(index, block);
        }
        lowering.wire_lines();
        for (block, id) in spec.blocks.iter().zip(lowering.blocks.clone()) {
            lowering.wire_coupling(&block.input, id);
        }
        lowering.wire_forces();
        lowering
    }

    /// Adds a body; gives what the force acts on.
    fn body(&mut self, index: usize, body: &LoopBody) -> DiagramBlockId {
        let name = format!("body {index}");
        let named = |element: Element, states: &[_]| DiagramBlock {
            states: states.iter().map(ToString::to_string).collect(),
            outputs: (1..=element.outputs()).map(|output| format!("{name}.y{output}")).collect(),
            past_outputs: Vec::new(),
            name: name.clone(),
            element,
        };
        match &body.dynamics {
            Dynamics::Plant(plant) => {
                let block = self.diagram.push(named(Element::Plant(plant.clone()), &body.states));
                self.motions.push(block);
                block
            }
            Dynamics::Sensed { plant, estimate } => {
                let read = Plant { c: plant.c.rows(0, body.axes.len()).into_owned(), ..plant.clone() };
                let (moving, remembered) = body.states.split_at(plant.a.nrows());
                let moved = self.diagram.push(named(Element::Plant(read), moving));
                let sensor = Sampled::velocity(self.ticks.clone(), body.axes.len(), *estimate);
                let sensor = self.diagram.push(DiagramBlock {
                    name: format!("sensor of {name}"),
                    ..named(Element::Sampled(sensor), remembered)
                });
                self.diagram.connect(moved, sensor);
                self.motions.push(sensor);
                moved
            }
            Dynamics::Mass { .. } | Dynamics::Rigid { .. } => {
                let BodyStep { a, b, c } = BodyStep::new(body, self.spec.schedule.control().period_s());
                let d = DMatrix::zeros(c.nrows(), b.ncols());
                let software = Sampled::linear(self.ticks.clone(), LinearBlock { a, b, c, d });
                let block = self.diagram.push(named(Element::Sampled(software), &body.states));
                self.motions.push(block);
                block
            }
        }
    }

    fn line(&mut self, index: usize, line: &Line) -> DiagramBlockId {
        let schedule = &self.spec.schedule;
        let quantities = self.spec.quantities(line);
        let name_of =
            |quantity| line.coordinate(quantity, 1).to_string().trim_end_matches(".age1").to_owned();
        let mut way = Sampled::zero_order_hold(clock(schedule, 1), quantities.len());
        way.delays = delays(schedule, line.delay, 1);
        self.diagram.push(DiagramBlock {
            name: format!("line {index}"),
            states: Vec::new(),
            outputs: quantities.into_iter().map(name_of).collect(),
            past_outputs: Vec::new(),
            element: Element::Sampled(way),
        })
    }

    fn block(&mut self, index: usize, block: &loop_spec::Block) {
        let patterns = block.ticks_per_pattern() / block.clock.ticks_per_pattern();
        let mut sampled = Sampled::linear(clock(&block.clock, patterns), block.law.clone());
        sampled.delays = delays(&block.clock, block.delay, patterns);
        sampled.spacing = Time::period(block.clock.control());
        let steps = 0..sampled.clock.offsets.len() as i64;
        sampled.weights = steps.map(|step| block.weights_of_step(step).to_vec()).collect();
        let name = format!("block {index}");
        let kept = block.delay.samples(&block.clock);
        let outputs = (1..=block.law.outputs()).map(|output| format!("{name}.y{output}")).collect();
        let past = |age: u32| block.outputs.iter().map(move |output| output.earlier(age).to_string());
        let id = self.diagram.push(DiagramBlock {
            states: block.states.iter().map(ToString::to_string).collect(),
            outputs,
            past_outputs: (0..kept).map(|age| past(age).collect()).collect(),
            name,
            element: Element::Sampled(sampled),
        });
        self.blocks.push(id);
        let used = match block.hold {
            Hold::Zero => vec![id],
            Hold::First => self.first_order_hold(index, block, id, past(kept).collect()),
        };
        self.used.push(used);
    }

    /// Between a block's outputs; `states` name the one before the one that is used at the start of the pattern.
    fn first_order_hold(
        &mut self,
        index: usize,
        block: &loop_spec::Block,
        id: DiagramBlockId,
        states: Vec<String>,
    ) -> Vec<DiagramBlockId> {
        let (name, channels) = (format!("hold of block {index}"), block.law.outputs());
        let outputs = |name: &str| (1..=channels).map(|output| format!("{name}.y{output}")).collect();
        if block.clock.steps_per_pattern() == 1 {
            let hold = Sampled::first_order_hold(clock(&block.clock, 1), channels);
            let outputs = outputs(&name);
            let element = Element::Sampled(hold);
            let hold =
                self.diagram.push(DiagramBlock { name, states, outputs, past_outputs: Vec::new(), element });
            self.diagram.connect(id, hold);
            return vec![hold];
        }
        // Periods of different lengths: at each tick shares of the output before and of the one in use.
        let mut before = Sampled::zero_order_hold(clock(&block.clock, 1), channels);
        before.delays = delays(&block.clock, Delay::periods(1), 1);
        let before = self.diagram.push(DiagramBlock {
            outputs: outputs(&name),
            name,
            states: Vec::new(),
            past_outputs: vec![states],
            element: Element::Sampled(before),
        });
        self.diagram.connect(id, before);
        let tick = Time::period(block.clock.control());
        let ticks = 0..block.clock.ticks_per_pattern();
        let shares: Vec<f64> = ticks.clone().map(|tick| share_of_period(&block.clock, tick)).collect();
        let offsets: Vec<Time> = ticks.map(|index| tick.times(index)).collect();
        let every_tick = Clock::cyclic(tick.times(block.clock.ticks_per_pattern()), offsets);
        let mut share = |source: DiagramBlockId, shares: Vec<f64>, what: &str| {
            let mut gain = Sampled::zero_order_hold(every_tick.clone(), channels);
            gain.weights = shares.into_iter().map(|share| vec![share]).collect();
            let gain = self.diagram.sampled(format!("{what} of block {index}"), gain);
            self.diagram.connect(source, gain);
            gain
        };
        let fading = share(before, shares.iter().map(|share| 1.0 - share).collect(), "fading output");
        vec![fading, share(id, shares, "rising output")]
    }

    fn wire_lines(&mut self) {
        let spec = self.spec;
        for (line, block) in spec.lines.iter().zip(self.lines.clone()) {
            match &line.signal {
                Signal::Motion(body) => self.diagram.connect(self.motions[body.0], block),
                Signal::Position(body) => {
                    let axes = spec.bodies[body.0].axes.len();
                    let gain = DMatrix::identity(axes, 2 * axes);
                    self.diagram.wire(self.motions[body.0], block, gain);
                }
                Signal::Force(coupling) => self.wire_coupling(coupling, block),
            }
        }
    }

    fn wire_forces(&mut self) {
        let spec = self.spec;
        for action in &spec.actions {
            let force = self.forces[action.body.0];
            match &action.force {
                Force::Gains(coupling) => self.wire_coupling(coupling, force),
                Force::Held(line) => self.diagram.connect(self.lines[line.0], force),
            }
        }
    }

    fn wire_coupling(&mut self, coupling: &ForceGains, to: DiagramBlockId) {
        let mut sources: Vec<(DiagramBlockId, DMatrix<f64>)> = Vec::new();
        for term in &coupling.terms {
            let of_term = match term.motion {
                Motion::Ground => &[],
                Motion::Current(body) => std::slice::from_ref(&self.motions[body.0]),
                Motion::Held(line) => std::slice::from_ref(&self.lines[line.0]),
                Motion::Output(block) => self.used[block.0].as_slice(),
            };
            for &source in of_term {
                let place = sources.iter().position(|(known, _)| *known == source).unwrap_or_else(|| {
                    let numbers = self.spec.numbers_of(term.motion);
                    sources.push((source, DMatrix::zeros(coupling.components, numbers)));
                    sources.len() - 1
                });
                sources[place].1[(term.component, term.number)] += term.gain;
            }
        }
        for (source, gain) in sources {
            self.diagram.wire(source, to, gain);
        }
    }
}

/// The steps of so many patterns of a schedule.
fn clock(schedule: &Schedule, patterns: u64) -> Clock {
    let tick = Time::period(schedule.control());
    let steps = 0..schedule.steps_per_pattern() * patterns;
    Clock::cyclic(
        tick.times(schedule.ticks_per_pattern() * patterns),
        steps.map(|step| tick.times(schedule.tick_of_step(step))).collect(),
    )
}

/// From each of these steps to the use of its sample.
fn delays(schedule: &Schedule, delay: Delay, patterns: u64) -> Vec<Time> {
    let tick = Time::period(schedule.control());
    let steps = 0..(schedule.steps_per_pattern() * patterns) as i64;
    let ticks = |step: i64| delay.tick_of_use(schedule, step) - tick_of_step(schedule, step);
    steps.map(|step| tick.times(ticks(step) as u64)).collect()
}

/// How far a tick lies in its period.
fn share_of_period(schedule: &Schedule, tick: u64) -> f64 {
    let period = schedule.last_step_at(tick);
    let (first, next) = (schedule.tick_of_step(period), schedule.tick_of_step(period + 1));
    (tick - first) as f64 / (next - first) as f64
}
