//! Every [`LoopSpec`] as a diagram.

use nalgebra::DMatrix;

use super::{Block, BlockId, Clock, Diagram, Element, Linear, Plant, Sampled, Time};
use crate::check::{SpecError, check};
use crate::discretise::Step;
use crate::lift::layout::quantities;
use crate::loop_spec::{Body, Coupling, Dynamics, Force, Line, LoopSpec, Motion, Signal, tick_of_step};

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
    motions: Vec<BlockId>,
    /// What sums up and holds the force on each body.
    forces: Vec<BlockId>,
    lines: Vec<BlockId>,
}

impl<'a> Lowering<'a> {
    fn new(spec: &'a LoopSpec) -> Self {
        let ticks = Clock::at_rate(spec.schedule.control());
        let (motions, forces, lines) = (Vec::new(), Vec::new(), Vec::new());
        let mut lowering = Self { spec, ticks, diagram: Diagram::new(), motions, forces, lines };
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
        lowering.wire_lines();
        lowering.wire_forces();
        lowering
    }

    /// Adds a body; gives what the force acts on.
    fn body(&mut self, index: usize, body: &Body) -> BlockId {
        let name = format!("body {index}");
        let named = |element: Element, states: &[_]| Block {
            states: states.iter().map(ToString::to_string).collect(),
            outputs: (1..=element.outputs()).map(|output| format!("{name}.y{output}")).collect(),
            name: name.clone(),
            element,
        };
        match &body.dynamics {
            Dynamics::Plant(plant) => {
                let block = self.diagram.push(named(Element::Plant(Plant::from(plant)), &body.states));
                self.motions.push(block);
                block
            }
            Dynamics::Sensed { plant, estimate } => {
                let read = Plant { c: plant.c.rows(0, body.axes.len()).into_owned(), ..Plant::from(plant) };
                let (moving, remembered) = body.states.split_at(plant.a.nrows());
                let moved = self.diagram.push(named(Element::Plant(read), moving));
                let sensor = Sampled::velocity(self.ticks.clone(), body.axes.len(), *estimate);
                let sensor = self.diagram.push(Block {
                    name: format!("sensor of {name}"),
                    ..named(Element::Sampled(sensor), remembered)
                });
                self.diagram.connect(moved, sensor);
                self.motions.push(sensor);
                moved
            }
            Dynamics::Mass { .. } | Dynamics::Rigid { .. } => {
                let Step { a, b, c } = Step::new(body, self.spec.schedule.control().period_s());
                let d = DMatrix::zeros(c.nrows(), b.ncols());
                let software = Sampled::linear(self.ticks.clone(), Linear { a, b, c, d });
                let block = self.diagram.push(named(Element::Sampled(software), &body.states));
                self.motions.push(block);
                block
            }
        }
    }

    fn line(&mut self, index: usize, line: &Line) -> BlockId {
        let schedule = &self.spec.schedule;
        let tick = Time::period(schedule.control());
        let steps = 0..schedule.steps_per_pattern() as i64;
        let ticks = |step: i64| tick_of_step(schedule, step);
        let clock = Clock::cyclic(
            tick.times(schedule.ticks_per_pattern()),
            steps.clone().map(|step| tick.times(ticks(step) as u64)).collect(),
        );
        let delay = |step: i64| line.delay.tick_of_use(schedule, step) - ticks(step);
        let quantities = quantities(self.spec, line);
        let name_of =
            |quantity| line.coordinate(quantity, 1).to_string().trim_end_matches(".age1").to_owned();
        let mut way = Sampled::zero_order_hold(clock, quantities.len());
        way.delays = steps.map(|step| tick.times(delay(step) as u64)).collect();
        self.diagram.push(Block {
            name: format!("line {index}"),
            states: Vec::new(),
            outputs: quantities.into_iter().map(name_of).collect(),
            element: Element::Sampled(way),
        })
    }

    fn wire_lines(&mut self) {
        let spec = self.spec;
        for (line, block) in spec.lines.iter().zip(self.lines.clone()) {
            match &line.signal {
                Signal::Motion(body) => self.diagram.connect(self.motions[body.0], block),
                Signal::Force(coupling) => self.wire_coupling(coupling, block),
            }
        }
    }

    fn wire_forces(&mut self) {
        let spec = self.spec;
        for action in &spec.actions {
            let force = self.forces[action.body.0];
            match &action.force {
                Force::Coupling(coupling) => self.wire_coupling(coupling, force),
                Force::Held(line) => self.diagram.connect(self.lines[line.0], force),
            }
        }
    }

    fn wire_coupling(&mut self, coupling: &Coupling, to: BlockId) {
        let mut sources: Vec<(BlockId, DMatrix<f64>)> = Vec::new();
        for term in &coupling.terms {
            let source = match term.motion {
                Motion::Ground => continue,
                Motion::Current(body) => self.motions[body.0],
                Motion::Held(line) => self.lines[line.0],
            };
            let place = sources.iter().position(|(known, _)| *known == source).unwrap_or_else(|| {
                let numbers = 2 * self.spec.axes_of(term.motion).len();
                sources.push((source, DMatrix::zeros(coupling.components, numbers)));
                sources.len() - 1
            });
            sources[place].1[(term.component, term.number)] += term.gain;
        }
        for (source, gain) in sources {
            self.diagram.wire(source, to, gain);
        }
    }
}
