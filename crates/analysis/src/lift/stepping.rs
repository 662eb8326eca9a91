//! The tick-by-tick product: one pattern, run on all columns of the identity at once.
//!
//! Each number of the state is a row: its dependence on the state at the start of the pattern. A tick is a handful of
//! sums of rows. Forces from held samples are summed again only when another sample is held.

use cotouch_scene::time::Schedule;
use nalgebra::DMatrix;

use super::LiftedMap;
use super::layout::{Layout, Register};
use crate::discretise::Step;
use crate::loop_spec::{Body, Coupling, Delay, Force, LineId, LoopSpec, Motion, Signal};

/// The map over one pattern.
pub(crate) fn lift(spec: &LoopSpec, layout: &Layout) -> LiftedMap {
    LiftedMap {
        matrix: lift_with_losses(spec, layout, &|_, _| false),
        coordinates: layout.coordinates.clone(),
    }
}

/// The map over one pattern in which the samples of some network steps are lost: `is_lost` is asked with the step and
/// the line. Instead of a lost sample the receiver keeps the one of the step before, lost or not, and plays that out
/// when the lost one would have been due. Every register must remember a sample ([`Layout::with_memory`]).
pub(crate) fn lift_with_losses(
    spec: &LoopSpec,
    layout: &Layout,
    is_lost: &dyn Fn(i64, LineId) -> bool,
) -> DMatrix<f64> {
    let program = Program::new(spec, layout);
    let mut run = Run::new(&program, layout);
    let is_lost = |step: i64, register: usize| is_lost(step, layout.registers[register].line);
    for tick in 0..spec.schedule.ticks_per_pattern() {
        run.tick(&program, tick as i64, &is_lost);
    }
    run.matrix(&program, layout)
}

/// `factor` times one row.
#[derive(Clone, Copy, Debug)]
struct Weighted<Row> {
    row: Row,
    factor: f64,
}

/// One number of the sample that is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct HeldNumber {
    register: usize,
    number: usize,
    /// Which of the program's delays says how old the held sample is.
    delay: usize,
}

/// A sum over current states and held samples.
#[derive(Clone, Debug, Default)]
struct Sum {
    current: Vec<Weighted<usize>>,
    held: Vec<Weighted<HeldNumber>>,
}

/// What a tick does, with every name resolved to a place.
struct Program<'a> {
    schedule: &'a Schedule,
    delays: Vec<Delay>,
    bodies: Vec<Placed>,
    steps: Vec<Step>,
    /// Every component of the force on each body.
    forces: Vec<Sum>,
    registers: Vec<Samples>,
    states: usize,
    columns: usize,
}

/// Where a body's numbers lie.
#[derive(Clone, Copy)]
struct Placed {
    /// Its first state.
    state: usize,
    /// The first component of its force.
    force: usize,
    /// An index into the program's steps.
    step: usize,
}

/// A register: what its numbers are, and where its ring of samples lies.
struct Samples {
    numbers: Vec<Sum>,
    carries_force: bool,
    /// Samples in the ring: one more than in the state, for the newest.
    ring: usize,
    /// The ring's first row among all sample rows.
    first: usize,
}

impl Samples {
    fn row(&self, step: i64, number: usize) -> usize {
        self.first + step.rem_euclid(self.ring as i64) as usize * self.numbers.len() + number
    }
}

impl<'a> Program<'a> {
    fn new(spec: &'a LoopSpec, layout: &Layout) -> Self {
        let mut program = Self {
            schedule: &spec.schedule,
            delays: Vec::new(),
            bodies: Vec::new(),
            steps: Vec::new(),
            forces: vec![Sum::default(); spec.bodies.iter().map(|body| body.axes.len()).sum()],
            registers: Vec::new(),
            states: layout
                .bodies
                .last()
                .map_or(0, |last| last + spec.bodies[spec.bodies.len() - 1].states.len()),
            columns: layout.coordinates.len(),
        };
        program.add_bodies(spec, layout);
        program.add_forces(spec, layout);
        program.add_registers(spec, layout);
        program
    }

    fn add_bodies(&mut self, spec: &LoopSpec, layout: &Layout) {
        let period_s = spec.schedule.control().period_s();
        let mut force = 0;
        for (index, body) in spec.bodies.iter().enumerate() {
            // Users mostly have equal hands: each kind of body is discretised once.
            let is_same = |other: &Body| other.dynamics == body.dynamics && other.axes == body.axes;
            let known = spec.bodies[..index].iter().position(is_same);
            let step = known.map_or_else(
                || {
                    self.steps.push(Step::new(body, period_s));
                    self.steps.len() - 1
                },
                |other| self.bodies[other].step,
            );
            self.bodies.push(Placed { state: layout.bodies[index], force, step });
            force += body.axes.len();
        }
    }

    fn add_forces(&mut self, spec: &LoopSpec, layout: &Layout) {
        let mut forces = std::mem::take(&mut self.forces);
        for action in &spec.actions {
            let first = self.bodies[action.body.0].force;
            let sums = &mut forces[first..first + spec.bodies[action.body.0].axes.len()];
            match &action.force {
                Force::Coupling(coupling) => self.add_coupling(sums, spec, layout, coupling),
                Force::Held(line) => {
                    for (component, sum) in sums.iter_mut().enumerate() {
                        let row = self.held_number(spec, layout, line.0, component);
                        sum.held.push(Weighted { row, factor: 1.0 });
                    }
                }
            }
        }
        for sum in &mut forces {
            merge(&mut sum.current);
            merge(&mut sum.held);
        }
        self.forces = forces;
    }

    fn add_registers(&mut self, spec: &LoopSpec, layout: &Layout) {
        let mut first = 0;
        for register in &layout.registers {
            let signal = &spec.lines[register.line.0].signal;
            let mut numbers = vec![Sum::default(); register.numbers];
            match signal {
                Signal::Motion(body) => {
                    for (output, sum) in numbers.iter_mut().enumerate() {
                        self.add_output(&mut sum.current, body.0, output, 1.0);
                    }
                }
                Signal::Force(coupling) => self.add_coupling(&mut numbers, spec, layout, coupling),
            }
            let carries_force = matches!(signal, Signal::Force(_));
            let samples = Samples { numbers, carries_force, ring: register.length as usize + 1, first };
            first += samples.ring * samples.numbers.len();
            self.registers.push(samples);
        }
    }

    fn add_coupling(&mut self, sums: &mut [Sum], spec: &LoopSpec, layout: &Layout, coupling: &Coupling) {
        for term in coupling.terms.iter().filter(|term| term.gain != 0.0) {
            let sum = &mut sums[term.component];
            match term.motion {
                Motion::Ground => {}
                Motion::Current(body) => self.add_output(&mut sum.current, body.0, term.number, term.gain),
                Motion::Held(line) => {
                    let row = self.held_number(spec, layout, line.0, term.number);
                    sum.held.push(Weighted { row, factor: term.gain });
                }
            }
        }
    }

    /// `factor` times one of a body's positions or velocities, in its states.
    fn add_output(&self, sum: &mut Vec<Weighted<usize>>, body: usize, output: usize, factor: f64) {
        let Placed { state: first, step, .. } = self.bodies[body];
        for (state, &element) in self.steps[step].c.row(output).iter().enumerate() {
            if element != 0.0 {
                sum.push(Weighted { row: first + state, factor: factor * element });
            }
        }
    }

    fn held_number(&mut self, spec: &LoopSpec, layout: &Layout, line: usize, number: usize) -> HeldNumber {
        let wanted = spec.lines[line].delay;
        let delay = self.delays.iter().position(|&delay| delay == wanted).unwrap_or_else(|| {
            self.delays.push(wanted);
            self.delays.len() - 1
        });
        HeldNumber { register: layout.register_of_line[line], number, delay }
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

/// Rows of equal length.
struct Rows {
    data: Vec<f64>,
    columns: usize,
}

impl Rows {
    fn zeros(rows: usize, columns: usize) -> Self {
        Self { data: vec![0.0; rows * columns], columns }
    }

    fn row(&self, index: usize) -> &[f64] {
        &self.data[index * self.columns..(index + 1) * self.columns]
    }

    fn row_mut(&mut self, index: usize) -> &mut [f64] {
        &mut self.data[index * self.columns..(index + 1) * self.columns]
    }
}

/// The rows, part way through a pattern.
struct Run {
    states: Rows,
    next_states: Rows,
    samples: Rows,
    /// The components of the force on each body; the part of it that comes from held samples.
    forces: Rows,
    held_forces: Rows,
    /// For each delay: the step whose sample is held, and the tick from which the next one is.
    held: Vec<(i64, i64)>,
    next_step: i64,
}

impl Run {
    fn new(program: &Program<'_>, layout: &Layout) -> Self {
        let columns = program.columns;
        let sample_rows = program.registers.iter().map(|samples| samples.ring * samples.numbers.len()).sum();
        let mut run = Self {
            states: Rows::zeros(program.states, columns),
            next_states: Rows::zeros(program.states, columns),
            samples: Rows::zeros(sample_rows, columns),
            forces: Rows::zeros(program.forces.len(), columns),
            held_forces: Rows::zeros(program.forces.len(), columns),
            held: program.delays.iter().map(|_| (i64::MIN, i64::MIN)).collect(),
            next_step: 0,
        };
        for state in 0..program.states {
            run.states.row_mut(state)[state] = 1.0;
        }
        for (samples, register) in program.registers.iter().zip(&layout.registers) {
            for (place, row) in numbers_of_state(samples, register, 0) {
                run.samples.row_mut(row)[place] = 1.0;
            }
        }
        run
    }

    fn tick(&mut self, program: &Program<'_>, tick: i64, is_lost: &dyn Fn(i64, usize) -> bool) {
        let network_step = program.schedule.step_at(tick as u64).map(|_| self.next_step);
        let another_is_held = self.play_out(program, tick);
        if let Some(step) = network_step {
            // Forces are sampled from the motions that are held now.
            self.sample(program, step, false, is_lost);
            self.sample(program, step, true, is_lost);
            self.next_step += 1;
        }
        if another_is_held {
            self.sum_held_forces(program);
        }
        self.step_bodies(program);
    }

    /// Whether any delay now holds another sample.
    fn play_out(&mut self, program: &Program<'_>, tick: i64) -> bool {
        let mut changed = false;
        for (held, delay) in self.held.iter_mut().zip(&program.delays) {
            if held.1 <= tick {
                let step = delay.step_held_at(program.schedule, tick);
                *held = (step, delay.tick_of_use(program.schedule, step + 1));
                changed = true;
            }
        }
        changed
    }

    fn sample(
        &mut self,
        program: &Program<'_>,
        step: i64,
        forces: bool,
        is_lost: &dyn Fn(i64, usize) -> bool,
    ) {
        let registers = program.registers.iter().enumerate();
        for (register, samples) in registers.filter(|(_, samples)| samples.carries_force == forces) {
            let lost = is_lost(step, register);
            for (number, sum) in samples.numbers.iter().enumerate() {
                let row = samples.row(step, number);
                if lost {
                    let kept = self.samples.row(samples.row(step - 1, number)).to_vec();
                    self.samples.row_mut(row).copy_from_slice(&kept);
                    continue;
                }
                let mut value = vec![0.0; program.columns];
                add_current(&mut value, sum, &self.states);
                add_held(&mut value, sum, program, &self.samples, &self.held);
                self.samples.row_mut(row).copy_from_slice(&value);
            }
        }
    }

    fn sum_held_forces(&mut self, program: &Program<'_>) {
        for (component, sum) in program.forces.iter().enumerate() {
            let force = self.held_forces.row_mut(component);
            force.fill(0.0);
            add_held(force, sum, program, &self.samples, &self.held);
        }
    }

    fn step_bodies(&mut self, program: &Program<'_>) {
        self.forces.data.copy_from_slice(&self.held_forces.data);
        for (component, sum) in program.forces.iter().enumerate() {
            add_current(self.forces.row_mut(component), sum, &self.states);
        }
        self.next_states.data.fill(0.0);
        for &Placed { state: first, force, step } in &program.bodies {
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

    fn matrix(&self, program: &Program<'_>, layout: &Layout) -> DMatrix<f64> {
        let columns = program.columns;
        let mut matrix = DMatrix::zeros(columns, columns);
        let mut set = |place: usize, row: &[f64]| {
            for (column, &value) in row.iter().enumerate() {
                matrix[(place, column)] = value;
            }
        };
        for state in 0..program.states {
            set(state, self.states.row(state));
        }
        for (samples, register) in program.registers.iter().zip(&layout.registers) {
            for (place, row) in numbers_of_state(samples, register, self.next_step) {
                set(place, self.samples.row(row));
            }
        }
        matrix
    }
}

/// Place in the state and row in the ring of every number of a register, just before network step `step`.
fn numbers_of_state<'a>(
    samples: &'a Samples,
    register: &'a Register,
    step: i64,
) -> impl Iterator<Item = (usize, usize)> + 'a {
    (1..=register.length).flat_map(move |age| {
        let numbers = 0..samples.numbers.len();
        numbers.map(move |number| (register.place(age) + number, samples.row(step - i64::from(age), number)))
    })
}

fn add_current(target: &mut [f64], sum: &Sum, states: &Rows) {
    for term in &sum.current {
        add(target, term.factor, states.row(term.row));
    }
}

fn add_held(target: &mut [f64], sum: &Sum, program: &Program<'_>, samples: &Rows, held: &[(i64, i64)]) {
    for Weighted { row, factor } in &sum.held {
        let (step, _) = held[row.delay];
        add(target, *factor, samples.row(program.registers[row.register].row(step, row.number)));
    }
}

fn add(target: &mut [f64], factor: f64, row: &[f64]) {
    if factor == 0.0 {
        return;
    }
    for (sum, &value) in target.iter_mut().zip(row) {
        *sum += factor * value;
    }
}
