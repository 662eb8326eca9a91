//! The tick-by-tick product: one pattern, run on all columns of the identity at once.
//!
//! Each number of the state is a row: its dependence on the state at the start of the pattern. A tick is a handful of
//! sums of rows. Forces from held samples are summed again only when another sample is held.

use cotouch_world::LinearBlock;
use nalgebra::DMatrix;

use super::layout::Layout;
use super::program::{BodyProgram, Program, Sum, Weighted};
use super::rows::Rows;
use super::timetable::{Event, Tick};
use crate::loop_spec::LoopSpec;

/// The map over one pattern.
pub(crate) fn lift(spec: &LoopSpec, layout: &Layout) -> DMatrix<f64> {
    Run::default().pattern(&Program::new(spec, layout))
}

/// A sample that may be lost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fault {
    /// The network step at which it is taken.
    pub(crate) step: i64,
    /// The register that takes it.
    pub(crate) register: usize,
    /// The place of its first number among the inputs and outputs.
    pub(crate) first: usize,
}

/// One pattern as a system: inputs are added to the numbers of the samples in `faults`, and outputs are by how much these numbers,
/// without that, fall short of those of the network step before. So a sample is lost where its inputs are its outputs: the
/// receiver keeps the sample of the step before, lost or not, and plays that out when the lost one would have been due. Every
/// register must remember a sample ([`Layout::with_memory`]).
pub(crate) fn lift_with_faults(spec: &LoopSpec, layout: &Layout, faults: &[Fault]) -> LinearBlock {
    let program = Program::new(spec, layout);
    let inputs = faults.iter().map(|fault| layout.registers[fault.register].numbers).sum();
    let mut run = Run { faults: faults.to_vec(), inputs, ..Run::default() };
    let whole = run.pattern(&program);
    let short = DMatrix::from_row_slice(inputs, program.size + inputs, run.short.data());
    let parts = |of: &DMatrix<f64>| {
        (of.columns(0, program.size).into_owned(), of.columns(program.size, inputs).into_owned())
    };
    let ((a, b), (c, d)) = (parts(&whole), parts(&short));
    LinearBlock { a, b, c, d }
}

/// What acts on many states of a loop at once from outside it. Rows are numbers, columns are states.
pub(crate) trait Outside {
    /// Whether it does anything at all.
    const ACTS: bool = true;

    /// One tick: from what is observed ([`Program::observing`]), all that acts ([`Program::force_on`],
    /// [`Program::sampled_by`]), added to `acting`, which is zero.
    fn act(&mut self, observed: &Rows, acting: &mut Rows);

    /// Whether the sample that a register would take in this tick is lost: then it keeps the one before.
    fn loses(&self, _register: usize) -> bool {
        false
    }

    /// The same tick: the forces on all bodies, before these step. Users may add theirs.
    fn push(&mut self, forces: &mut Rows);
}

/// A loop by itself.
struct Alone;

impl Outside for Alone {
    const ACTS: bool = false;

    fn act(&mut self, _: &Rows, _: &mut Rows) {}

    fn push(&mut self, _: &mut Rows) {}
}

/// The rows, part way through a pattern. Can be used again, which saves the allocations.
#[derive(Debug, Default)]
pub(crate) struct Run {
    states: Rows,
    next_states: Rows,
    samples: Rows,
    /// The components of the force on each body; the part of it that comes from held samples.
    forces: Rows,
    held_forces: Rows,
    /// For what acts from outside.
    observed: Rows,
    acting: Rows,
    block_states: Rows,
    next_block_states: Rows,
    /// What blocks have gathered of their inputs.
    gathered: Rows,
    /// A number that is being taken.
    taken: Vec<f64>,
    /// Samples that have inputs, how many numbers these have, and by how much each falls short of the one before.
    faults: Vec<Fault>,
    inputs: usize,
    short: Rows,
    /// For each way: the step whose sample is held.
    held: Vec<i64>,
    /// For each way with a first-order hold: how far it is from the sample before to the one that is held.
    shares: Vec<f64>,
}

impl Run {
    /// The map over one pattern.
    ///
    /// Compiled for the vector instructions of this processor, which is why a tick's sums are inlined.
    pub(crate) fn pattern(&mut self, program: &Program) -> DMatrix<f64> {
        self.start(program, program.size + self.inputs);
        self.visit(program, false, &mut |place, row| row[place] = 1.0);
        self.ticks(program, &mut Alone);
        self.matrix(program)
    }

    /// One pattern of as many states as there are columns, with what acts on them from outside; the next call goes on.
    pub(crate) fn advance(&mut self, program: &Program, outside: &mut impl Outside) {
        self.ticks(program, outside);
        for ring in &program.rings {
            ring.begin_again(&mut self.samples);
        }
    }

    fn ticks(&mut self, program: &Program, outside: &mut impl Outside) {
        pulp::Arch::new().dispatch(|| {
            for (index, tick) in program.timetable.ticks.iter().enumerate() {
                self.tick(program, index, tick, outside);
            }
        });
    }

    /// As many states as columns, all zero.
    pub(crate) fn start(&mut self, program: &Program, columns: usize) {
        self.short.clear(self.inputs, columns);
        self.states.clear(program.states, columns);
        self.next_states.clear(program.states, columns);
        self.samples.clear(program.sample_rows(), columns);
        self.forces.clear(program.forces.len(), columns);
        self.held_forces.clear(program.forces.len(), columns);
        self.observed.clear(program.observed.len(), columns);
        self.acting.clear(program.outside(), columns);
        self.block_states.clear(program.block_states(), columns);
        self.next_block_states.clear(program.block_states(), columns);
        self.gathered.clear(program.gathered(), columns);
        self.taken.clear();
        self.taken.resize(columns, 0.0);
        self.held.clear();
        self.held.resize(program.ways(), i64::MIN);
        self.shares.clear();
        self.shares.resize(program.ways(), 1.0);
    }

    /// Every number of the state with its place, between two patterns.
    pub(crate) fn visit_states(&mut self, program: &Program, act: &mut dyn FnMut(usize, &mut [f64])) {
        self.visit(program, false, act);
    }

    /// Every number of the state with its place, at the start or the end of the pattern.
    fn visit(&mut self, program: &Program, at_end: bool, act: &mut dyn FnMut(usize, &mut [f64])) {
        for state in 0..program.states {
            act(state, self.states.row_mut(state));
        }
        for (place, row) in program.rings.iter().flat_map(|ring| ring.places(at_end)) {
            act(place, self.samples.row_mut(row));
        }
        for block in &program.blocks {
            for state in 0..block.law.states() {
                act(block.place + state, self.block_states.row_mut(block.state + state));
            }
        }
    }

    #[inline(always)]
    fn tick<O: Outside>(&mut self, program: &Program, index: usize, tick: &Tick, outside: &mut O) {
        let changes = &program.timetable.changes[tick.changes.clone()];
        for &(way, step) in changes {
            self.held[way] = step;
        }
        for (share, shares) in self.shares.iter_mut().zip(&program.timetable.shares) {
            *share = shares.get(index).copied().unwrap_or(1.0);
        }
        let mut has_acted = !O::ACTS;
        for event in &program.timetable.events[tick.events.clone()] {
            match *event {
                Event::Sample { register, step } => {
                    if program.from_outside[register].is_some() && !has_acted {
                        self.let_act(program, outside);
                        has_acted = true;
                    }
                    if outside.loses(register) {
                        self.keep(program, register, step);
                    } else {
                        self.sample(program, register, step, O::ACTS);
                    }
                }
                Event::Emit { block, step } => self.emit(program, block, step),
                Event::Gather { block, weight, is_first } => self.gather(program, block, weight, is_first),
                Event::Step { block, step } => self.step_block(program, block, step),
            }
        }
        if !has_acted {
            self.let_act(program, outside);
        }
        if !changes.is_empty() {
            self.sum_held_forces(program);
        }
        self.sum_forces(program);
        if O::ACTS {
            for component in 0..program.forces.len() {
                add(self.forces.row_mut(component), 1.0, self.acting.row(component));
            }
            outside.push(&mut self.forces);
        }
        self.step_bodies(program);
    }

    /// What acts from outside in this tick: after motions were sampled, before forces are.
    #[inline(always)]
    fn let_act(&mut self, program: &Program, outside: &mut impl Outside) {
        self.observed.fill(0.0);
        for (number, sum) in program.observed.iter().enumerate() {
            let row = self.observed.row_mut(number);
            add_current(row, sum, &self.states);
            add_held(row, sum, program, &self.samples, &self.held);
            add_moving(row, sum, program, &self.samples, &self.held, &self.shares);
        }
        self.acting.fill(0.0);
        outside.act(&self.observed, &mut self.acting);
    }

    #[inline(always)]
    fn sample(&mut self, program: &Program, register: usize, step: i64, is_acted_on: bool) {
        let ring = &program.rings[register];
        let is_meant = |fault: &&Fault| (fault.step, fault.register) == (step, register);
        let fault = self.faults.iter().find(is_meant).map(|fault| fault.first);
        for (number, sum) in program.registers[register].iter().enumerate() {
            self.take(program, sum);
            if let Some(first) = program.from_outside[register].filter(|_| is_acted_on) {
                add(&mut self.taken, 1.0, self.acting.row(first + number));
            }
            if let Some(first) = fault {
                let short = self.short.row_mut(first + number);
                add(short, 1.0, self.samples.row(ring.row(step - 1, number)));
                add(short, -1.0, &self.taken);
                self.taken[program.size + first + number] += 1.0;
            }
            self.samples.row_mut(ring.row(step, number)).copy_from_slice(&self.taken);
        }
    }

    /// The sample of a step is that of the step before, which the register must remember ([`Layout::with_memory`]).
    #[inline(always)]
    fn keep(&mut self, program: &Program, register: usize, step: i64) {
        let ring = &program.rings[register];
        for number in 0..program.registers[register].len() {
            self.samples.copy_row(ring.row(step - 1, number), ring.row(step, number));
        }
    }

    /// The present value of a sum.
    #[inline(always)]
    fn take(&mut self, program: &Program, sum: &Sum) {
        self.taken.fill(0.0);
        add_current(&mut self.taken, sum, &self.states);
        add_held(&mut self.taken, sum, program, &self.samples, &self.held);
        add_moving(&mut self.taken, sum, program, &self.samples, &self.held, &self.shares);
    }

    #[inline(always)]
    fn emit(&mut self, program: &Program, block: usize, step: i64) {
        let block = &program.blocks[block];
        for output in 0..block.law.outputs() {
            let row = self.samples.row_mut(program.rings[block.ring].row(step, output));
            row.fill(0.0);
            for state in 0..block.law.states() {
                add(row, block.law.c[(output, state)], self.block_states.row(block.state + state));
            }
        }
    }

    #[inline(always)]
    fn gather(&mut self, program: &Program, block: usize, weight: f64, is_first: bool) {
        let block = &program.blocks[block];
        for (input, sum) in block.inputs.iter().enumerate() {
            self.take(program, sum);
            let gathered = self.gathered.row_mut(block.input + input);
            if is_first {
                gathered.fill(0.0);
            }
            add(gathered, weight, &self.taken);
        }
    }

    #[inline(always)]
    fn step_block(&mut self, program: &Program, block: usize, step: i64) {
        let block = &program.blocks[block];
        let (states, inputs) = (block.law.states(), block.law.inputs());
        for output in 0..block.law.outputs() {
            let row = self.samples.row_mut(program.rings[block.ring].row(step, output));
            for input in 0..inputs {
                add(row, block.law.d[(output, input)], self.gathered.row(block.input + input));
            }
        }
        for state in 0..states {
            let next = self.next_block_states.row_mut(block.state + state);
            next.fill(0.0);
            for other in 0..states {
                add(next, block.law.a[(state, other)], self.block_states.row(block.state + other));
            }
            for input in 0..inputs {
                add(next, block.law.b[(state, input)], self.gathered.row(block.input + input));
            }
        }
        for state in block.state..block.state + states {
            self.block_states.row_mut(state).copy_from_slice(self.next_block_states.row(state));
        }
    }

    #[inline(always)]
    fn sum_held_forces(&mut self, program: &Program) {
        for (component, sum) in program.forces.iter().enumerate() {
            let force = self.held_forces.row_mut(component);
            force.fill(0.0);
            add_held(force, sum, program, &self.samples, &self.held);
        }
    }

    #[inline(always)]
    fn sum_forces(&mut self, program: &Program) {
        self.forces.copy_from(&self.held_forces);
        for (component, sum) in program.forces.iter().enumerate() {
            let force = self.forces.row_mut(component);
            add_current(force, sum, &self.states);
            add_moving(force, sum, program, &self.samples, &self.held, &self.shares);
        }
    }

    #[inline(always)]
    fn step_bodies(&mut self, program: &Program) {
        self.next_states.fill(0.0);
        for &BodyProgram { state: first, force, step } in &program.bodies {
            let step = &program.steps[step];
            let (states, components) = step.b.shape();
            for state in 0..states {
                let next = self.next_states.row_mut(first + state);
                for component in 0..components {
                    add(next, step.b[(state, component)], self.forces.row(force + component));
                }
                for other in 0..states {
                    add(next, step.a[(state, other)], self.states.row(first + other));
                }
            }
        }
        std::mem::swap(&mut self.states, &mut self.next_states);
    }

    fn matrix(&mut self, program: &Program) -> DMatrix<f64> {
        let rows = program.size;
        let mut matrix = DMatrix::zeros(rows, rows + self.inputs);
        self.visit(program, true, &mut |place, row| {
            for (element, &value) in matrix.as_mut_slice()[place..].iter_mut().step_by(rows).zip(&*row) {
                *element = value;
            }
        });
        matrix
    }
}

#[inline(always)]
fn add_current(target: &mut [f64], sum: &Sum, states: &Rows) {
    for term in &sum.current {
        add(target, term.factor, states.row(term.row));
    }
}

#[inline(always)]
fn add_held(target: &mut [f64], sum: &Sum, program: &Program, samples: &Rows, held: &[i64]) {
    for Weighted { row, factor } in &sum.held {
        add(target, *factor, samples.row(program.rings[row.ring].row(held[row.way], row.number)));
    }
}

#[inline(always)]
fn add_moving(
    target: &mut [f64],
    sum: &Sum,
    program: &Program,
    samples: &Rows,
    held: &[i64],
    shares: &[f64],
) {
    for Weighted { row, factor } in &sum.moving {
        let (ring, step, share) = (&program.rings[row.ring], held[row.way], shares[row.way]);
        add(target, factor * share, samples.row(ring.row(step, row.number)));
        add(target, factor * (1.0 - share), samples.row(ring.row(step - 1, row.number)));
    }
}

#[inline(always)]
fn add(target: &mut [f64], factor: f64, row: &[f64]) {
    if factor == 0.0 {
        return;
    }
    for (sum, &value) in target.iter_mut().zip(row) {
        *sum += factor * value;
    }
}
