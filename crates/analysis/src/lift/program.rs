//! A pattern's program: every name of a loop resolved to a place.

use cotouch_world::LinearBlock;

use crate::discretise::BodyStep;
use crate::loop_spec::{BodyId, Force, ForceGains, Hold, LineId, LoopBody, LoopSpec, Motion, Signal};

use super::layout::Layout;
use super::rows::Rows;
use super::timetable::{Timetable, Way};

/// `factor` times one row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weighted<Row> {
    pub(super) row: Row,
    pub(super) factor: f64,
}

/// One number of the sample that is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct HeldNumber {
    pub(super) ring: usize,
    pub(super) number: usize,
    /// Which of the program's ways says how old the held sample is.
    pub(super) way: usize,
}

/// A sum over current states, held samples, and samples that move from the one before to the one in use.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Sum {
    pub(super) current: Vec<Weighted<usize>>,
    pub(super) held: Vec<Weighted<HeldNumber>>,
    pub(super) moving: Vec<Weighted<HeldNumber>>,
}

/// What a pattern does, with every name resolved to a place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Program {
    pub(super) timetable: Timetable,
    ways: Vec<Way>,
    pub(super) bodies: Vec<BodyProgram>,
    pub(super) steps: Vec<BodyStep>,
    /// Every component of the force on each body.
    pub(super) forces: Vec<Sum>,
    /// The numbers of each register's samples.
    pub(super) registers: Vec<Vec<Sum>>,
    pub(super) blocks: Vec<BlockProgram>,
    /// Of registers, then of blocks.
    pub(super) rings: Vec<Ring>,
    /// What is read at every tick for forces from outside the loop.
    pub(super) observed: Vec<Sum>,
    /// For each register: the place of its first number among what is sampled from outside, where it samples forces.
    pub(super) from_outside: Vec<Option<usize>>,
    /// How many states the bodies have.
    pub(super) states: usize,
    /// Numbers of the state.
    pub(super) size: usize,
}

/// Where a body's numbers lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BodyProgram {
    /// Its first state.
    pub(super) state: usize,
    /// The first component of its force.
    pub(super) force: usize,
    /// An index into the program's steps.
    pub(super) step: usize,
}

/// Where a ring of samples lies.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ring {
    /// Numbers in a sample.
    numbers: usize,
    /// Samples in the ring: one more than in the state, for the newest.
    length: usize,
    /// The ring's first row among all sample rows.
    first: usize,
    /// Place of its first number in the state.
    place: usize,
    /// Steps of its clock in a pattern.
    steps: i64,
}

impl Ring {
    #[inline(always)]
    pub(super) fn row(&self, step: i64, number: usize) -> usize {
        self.first + step.rem_euclid(self.length as i64) as usize * self.numbers + number
    }

    /// Numbers the steps of the next pattern from its beginning, given the samples' rows.
    pub(super) fn begin_again(&self, samples: &mut Rows) {
        let passed = self.steps.rem_euclid(self.length as i64) as usize;
        samples.rotate(self.first..self.first + self.length * self.numbers, passed * self.numbers);
    }

    /// Place in the state and row of every number in it, at the start or the end of the pattern.
    pub(super) fn places(&self, at_end: bool) -> impl Iterator<Item = (usize, usize)> {
        let next = if at_end { self.steps } else { 0 };
        (1..self.length).flat_map(move |age| {
            let first = self.place + (age - 1) * self.numbers;
            (0..self.numbers).map(move |number| (first + number, self.row(next - age as i64, number)))
        })
    }
}

/// A block: what it gathers, how it steps, and where its numbers lie.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BlockProgram {
    pub(super) inputs: Vec<Sum>,
    pub(super) law: LinearBlock,
    /// Its first row among the rows of all blocks' states, and its first place in the state.
    pub(super) state: usize,
    pub(super) place: usize,
    /// Its first row among all gathered inputs.
    pub(super) input: usize,
    pub(super) ring: usize,
}

impl Program {
    pub(crate) fn new(spec: &LoopSpec, layout: &Layout) -> Self {
        Self::observing(spec, layout, &[])
    }

    /// Also with what is read at every tick for forces from outside the loop: each component of `observed`, in order.
    pub(crate) fn observing(spec: &LoopSpec, layout: &Layout, observed: &[ForceGains]) -> Self {
        let mut program = Self {
            timetable: Timetable::default(),
            ways: Vec::new(),
            bodies: Vec::new(),
            steps: Vec::new(),
            forces: vec![Sum::default(); spec.bodies.iter().map(|body| body.axes.len()).sum()],
            registers: Vec::new(),
            blocks: Vec::new(),
            rings: Vec::new(),
            observed: Vec::new(),
            from_outside: Vec::new(),
            states: spec.bodies.iter().map(|body| body.states.len()).sum(),
            size: layout.coordinates.len(),
        };
        program.add_bodies(spec, layout);
        program.add_forces(spec, layout);
        program.add_registers(spec, layout);
        program.add_blocks(spec, layout);
        for coupling in observed {
            let mut numbers = vec![Sum::default(); coupling.components];
            program.add_coupling(&mut numbers, spec, layout, coupling);
            program.observed.extend(numbers);
        }
        program.timetable = Timetable::new(spec, layout, &program.ways);
        program
    }

    pub(super) fn sample_rows(&self) -> usize {
        self.rings.last().map_or(0, |ring| ring.first + ring.length * ring.numbers)
    }

    pub(super) fn block_states(&self) -> usize {
        self.blocks.last().map_or(0, |block| block.state + block.law.states())
    }

    pub(super) fn gathered(&self) -> usize {
        self.blocks.last().map_or(0, |block| block.input + block.law.inputs())
    }

    pub(super) fn ways(&self) -> usize {
        self.ways.len()
    }

    /// Where the forces on a body begin among what acts from outside: on all bodies first.
    pub(crate) fn force_on(&self, BodyId(body): BodyId) -> usize {
        self.bodies[body].force
    }

    /// Where the numbers that a line samples from outside begin there: after the forces on bodies. None where it samples
    /// motions.
    pub(crate) fn sampled_by(&self, layout: &Layout, LineId(line): LineId) -> Option<usize> {
        self.from_outside[layout.register_of_line[line]]
    }

    /// Numbers that may act from outside.
    pub(super) fn outside(&self) -> usize {
        let sampled = self.registers.iter().zip(&self.from_outside).filter(|(_, outside)| outside.is_some());
        self.forces.len() + sampled.map(|(numbers, _)| numbers.len()).sum::<usize>()
    }

    /// Multiplications and additions of a tick, for each state that is stepped.
    pub(crate) fn work(&self) -> usize {
        let terms = |sum: &Sum| sum.current.len() + sum.held.len() + 2 * sum.moving.len();
        let sums = self.forces.iter().chain(&self.observed).map(terms).sum::<usize>();
        let steps =
            self.bodies.iter().map(|body| self.steps[body.step].a.len() + self.steps[body.step].b.len());
        sums + steps.sum::<usize>()
    }

    /// Every factor in a sum, in an order that depends on nothing but which there are.
    pub(crate) fn factors(&mut self) -> impl Iterator<Item = &mut f64> {
        let of_registers = self.registers.iter_mut().flatten();
        self.forces.iter_mut().chain(of_registers).flat_map(|sum| {
            let current = sum.current.iter_mut().map(|term| &mut term.factor);
            current.chain(sum.held.iter_mut().map(|term| &mut term.factor))
        })
    }

    /// Sets factors by their places; `values` are given by theirs.
    pub(crate) fn set_factors(&mut self, places: &[(usize, usize)], values: &[f64]) {
        let mut places = places.iter();
        let Some(&first) = places.next() else { return };
        let mut next = first;
        for (place, factor) in self.factors().enumerate() {
            if place == next.0 {
                *factor = values[next.1];
                let Some(&after) = places.next() else { return };
                next = after;
            }
        }
    }

    /// Whether two programs differ in nothing but factors and steps.
    pub(crate) fn has_the_places_of(&self, other: &Self) -> bool {
        let blank = |program: &Self| {
            let mut program = program.clone();
            program.factors().for_each(|factor| *factor = 1.0);
            program.steps.clear();
            program
        };
        self.steps.len() == other.steps.len() && blank(self) == blank(other)
    }

    /// How each kind of body steps, for the first body of the kind.
    pub(crate) fn steps(&mut self) -> impl Iterator<Item = (usize, &mut BodyStep)> {
        let bodies = &self.bodies;
        self.steps.iter_mut().enumerate().filter_map(|(kind, step)| {
            bodies.iter().position(|body| body.step == kind).map(|body| (body, step))
        })
    }

    fn add_bodies(&mut self, spec: &LoopSpec, layout: &Layout) {
        let period_s = spec.schedule.control().period_s();
        let mut force = 0;
        for (index, body) in spec.bodies.iter().enumerate() {
            // Users mostly have equal hands: each kind of body is discretised once.
            let is_same = |other: &LoopBody| other.dynamics == body.dynamics && other.axes == body.axes;
            let known = spec.bodies[..index].iter().position(is_same);
            let step = known.map_or_else(
                || {
                    self.steps.push(BodyStep::new(body, period_s));
                    self.steps.len() - 1
                },
                |other| self.bodies[other].step,
            );
            self.bodies.push(BodyProgram { state: layout.bodies[index], force, step });
            force += body.axes.len();
        }
    }

    fn add_forces(&mut self, spec: &LoopSpec, layout: &Layout) {
        let mut forces = std::mem::take(&mut self.forces);
        for action in &spec.actions {
            let first = self.bodies[action.body.0].force;
            let sums = &mut forces[first..first + spec.bodies[action.body.0].axes.len()];
            match &action.force {
                Force::Gains(coupling) => self.add_coupling(sums, spec, layout, coupling),
                Force::Held(line) => {
                    for (component, sum) in sums.iter_mut().enumerate() {
                        let row = self.held_line(spec, layout, line.0, component);
                        sum.held.push(Weighted { row, factor: 1.0 });
                    }
                }
            }
        }
        for sum in &mut forces {
            merge(&mut sum.current);
            merge(&mut sum.held);
            merge(&mut sum.moving);
        }
        self.forces = forces;
    }

    fn add_registers(&mut self, spec: &LoopSpec, layout: &Layout) {
        for register in &layout.registers {
            let signal = &spec.lines[register.line.0].signal;
            let mut numbers = vec![Sum::default(); register.numbers];
            match signal {
                Signal::Motion(body) | Signal::Position(body) => {
                    for (output, sum) in numbers.iter_mut().enumerate() {
                        self.add_output(&mut sum.current, body.0, output, 1.0);
                    }
                }
                Signal::Force(coupling) => self.add_coupling(&mut numbers, spec, layout, coupling),
            }
            let outside = self.outside();
            self.from_outside.push(signal.force().map(|_| outside));
            self.registers.push(numbers);
            self.add_ring(register.numbers, register.length, register.first, spec.network_steps() as i64);
        }
    }

    fn add_blocks(&mut self, spec: &LoopSpec, layout: &Layout) {
        for (block, placed) in spec.blocks.iter().zip(&layout.blocks) {
            let mut inputs = vec![Sum::default(); block.law.inputs()];
            self.add_coupling(&mut inputs, spec, layout, &block.input);
            self.blocks.push(BlockProgram {
                inputs,
                law: block.law.clone(),
                state: self.block_states(),
                place: placed.states,
                input: self.gathered(),
                ring: self.rings.len(),
            });
            let steps = spec.ticks_per_pattern() / block.clock.ticks_per_pattern();
            let steps = (steps * block.clock.steps_per_pattern()) as i64;
            self.add_ring(block.law.outputs(), block.past_outputs(), placed.outputs, steps);
        }
    }

    fn add_ring(&mut self, numbers: usize, kept: u32, place: usize, steps: i64) {
        let first = self.sample_rows();
        self.rings.push(Ring { numbers, length: kept as usize + 1, first, place, steps });
    }

    fn add_coupling(&mut self, sums: &mut [Sum], spec: &LoopSpec, layout: &Layout, coupling: &ForceGains) {
        for term in coupling.terms.iter().filter(|term| term.gain != 0.0) {
            let sum = &mut sums[term.component];
            match term.motion {
                Motion::Ground => {}
                Motion::Current(body) => self.add_output(&mut sum.current, body.0, term.number, term.gain),
                Motion::Held(line) => {
                    let row = self.held_line(spec, layout, line.0, term.number);
                    sum.held.push(Weighted { row, factor: term.gain });
                }
                Motion::Output(block) => {
                    let (ring, block) = (layout.registers.len() + block.0, &spec.blocks[block.0]);
                    let way = self.way(Way { clock: block.clock, delay: block.delay, hold: block.hold });
                    let row = HeldNumber { ring, number: term.number, way };
                    let terms = if block.hold == Hold::First { &mut sum.moving } else { &mut sum.held };
                    terms.push(Weighted { row, factor: term.gain });
                }
            }
        }
    }

    /// `factor` times one of a body's positions or velocities, in its states.
    fn add_output(&self, sum: &mut Vec<Weighted<usize>>, body: usize, output: usize, factor: f64) {
        let BodyProgram { state: first, step, .. } = self.bodies[body];
        for (state, &element) in self.steps[step].c.row(output).iter().enumerate() {
            if element != 0.0 {
                sum.push(Weighted { row: first + state, factor: factor * element });
            }
        }
    }

    fn held_line(&mut self, spec: &LoopSpec, layout: &Layout, line: usize, number: usize) -> HeldNumber {
        let (clock, delay) = (spec.schedule, spec.lines[line].delay);
        let way = self.way(Way { clock, delay, hold: Hold::Zero });
        HeldNumber { ring: layout.register_of_line[line], number, way }
    }

    fn way(&mut self, wanted: Way) -> usize {
        self.ways.iter().position(|&way| way == wanted).unwrap_or_else(|| {
            self.ways.push(wanted);
            self.ways.len() - 1
        })
    }
}

/// Adds up the factors of equal rows.
fn merge<Row: Ord + Copy>(terms: &mut Vec<Weighted<Row>>) {
    terms.sort_by_key(|term| term.row);
    terms.dedup_by(|next, kept| {
        let same = next.row == kept.row;
        if same {
            kept.factor += next.factor;
        }
        same
    });
}
