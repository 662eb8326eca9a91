//! The tick-by-tick product: one pattern, run on all columns of the identity at once.
//!
//! Each number of the state is a row: its dependence on the state at the start of the pattern. A tick is a handful of
//! sums of rows. Forces from held samples are summed again only when another sample is held.

use std::ops::Range;

use cotouch_scene::time::Schedule;
use nalgebra::DMatrix;

use super::LiftedMap;
use super::layout::Layout;
use crate::discretise::Step;
use crate::loop_spec::{Body, Coupling, Delay, Force, LineId, LoopSpec, Motion, Signal};

/// The map over one pattern.
pub(crate) fn lift(spec: &LoopSpec, layout: &Layout) -> LiftedMap {
    let matrix = Run::default().pattern(&Program::new(spec, layout));
    LiftedMap { matrix, coordinates: layout.coordinates.clone() }
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
    let registers = || layout.registers.iter().map(|register| register.line).enumerate();
    let steps = 0..program.timetable.network_steps;
    let lost = steps
        .flat_map(|step| registers().map(move |(register, line)| (step, register, line)))
        .filter_map(|(step, register, line)| is_lost(step, line).then_some((step, register)));
    let mut run = Run { lost: lost.collect(), ..Run::default() };
    run.pattern(&program)
}

/// `factor` times one row.
#[derive(Clone, Copy, Debug, PartialEq)]
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
#[derive(Clone, Debug, Default, PartialEq)]
struct Sum {
    current: Vec<Weighted<usize>>,
    held: Vec<Weighted<HeldNumber>>,
}

/// What a pattern does, with every name resolved to a place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Program {
    timetable: Timetable,
    delays: Vec<Delay>,
    bodies: Vec<Placed>,
    steps: Vec<Step>,
    /// Every component of the force on each body.
    forces: Vec<Sum>,
    registers: Vec<Samples>,
    states: usize,
    columns: usize,
}

/// When samples are taken and used.
#[derive(Clone, Debug, Default, PartialEq)]
struct Timetable {
    ticks: Vec<Tick>,
    /// Which delay holds another sample, and of which network step.
    changes: Vec<(usize, i64)>,
    network_steps: i64,
}

#[derive(Clone, Debug, PartialEq)]
struct Tick {
    network_step: Option<i64>,
    changes: Range<usize>,
}

impl Timetable {
    fn new(schedule: &Schedule, delays: &[Delay]) -> Self {
        let mut timetable = Self::default();
        // The tick from which the next sample is used.
        let mut until = vec![i64::MIN; delays.len()];
        for tick in 0..schedule.ticks_per_pattern() {
            let first = timetable.changes.len();
            for (index, (delay, until)) in delays.iter().zip(&mut until).enumerate() {
                if *until <= tick as i64 {
                    let step = delay.step_held_at(schedule, tick as i64);
                    *until = delay.tick_of_use(schedule, step + 1);
                    timetable.changes.push((index, step));
                }
            }
            let network_step = schedule.step_at(tick).map(|_| timetable.network_steps);
            timetable.network_steps += i64::from(network_step.is_some());
            timetable.ticks.push(Tick { network_step, changes: first..timetable.changes.len() });
        }
        timetable
    }
}

/// Where a body's numbers lie.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Placed {
    /// Its first state.
    state: usize,
    /// The first component of its force.
    force: usize,
    /// An index into the program's steps.
    step: usize,
}

/// A register: what its numbers are, and where its ring of samples lies.
#[derive(Clone, Debug, PartialEq)]
struct Samples {
    numbers: Vec<Sum>,
    carries_force: bool,
    /// Samples in the ring: one more than in the state, for the newest.
    ring: usize,
    /// The ring's first row among all sample rows.
    first: usize,
    /// Place of its first number in the state.
    place: usize,
}

impl Samples {
    #[inline(always)]
    fn row(&self, step: i64, number: usize) -> usize {
        self.first + step.rem_euclid(self.ring as i64) as usize * self.numbers.len() + number
    }
}

impl Program {
    pub(crate) fn new(spec: &LoopSpec, layout: &Layout) -> Self {
        let mut program = Self {
            timetable: Timetable::default(),
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
        program.timetable = Timetable::new(&spec.schedule, &program.delays);
        program
    }

    /// Every factor in a sum, in an order that depends on nothing but which there are.
    pub(crate) fn factors(&mut self) -> impl Iterator<Item = &mut f64> {
        let of_registers = self.registers.iter_mut().flat_map(|samples| &mut samples.numbers);
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
    pub(crate) fn steps(&mut self) -> impl Iterator<Item = (usize, &mut Step)> {
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
            let (ring, place) = (register.length as usize + 1, register.first);
            let samples = Samples { numbers, carries_force, ring, first, place };
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
#[derive(Debug, Default)]
struct Rows {
    data: Vec<f64>,
    columns: usize,
}

impl Rows {
    fn clear(&mut self, rows: usize, columns: usize) {
        self.columns = columns;
        self.data.clear();
        self.data.resize(rows * columns, 0.0);
    }

    #[inline(always)]
    fn row(&self, index: usize) -> &[f64] {
        &self.data[index * self.columns..(index + 1) * self.columns]
    }

    #[inline(always)]
    fn row_mut(&mut self, index: usize) -> &mut [f64] {
        &mut self.data[index * self.columns..(index + 1) * self.columns]
    }
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
    /// A sample that is being taken.
    taken: Vec<f64>,
    /// Network steps and registers whose samples are lost.
    lost: Vec<(i64, usize)>,
    /// For each delay: the step whose sample is held.
    held: Vec<i64>,
}

impl Run {
    /// The map over one pattern.
    ///
    /// Compiled for the vector instructions of this processor, which is why a tick's sums are inlined.
    pub(crate) fn pattern(&mut self, program: &Program) -> DMatrix<f64> {
        self.start(program);
        pulp::Arch::new().dispatch(|| {
            for tick in &program.timetable.ticks {
                self.tick(program, tick);
            }
        });
        self.matrix(program)
    }

    fn start(&mut self, program: &Program) {
        let columns = program.columns;
        let sample_rows = program.registers.iter().map(|samples| samples.ring * samples.numbers.len()).sum();
        self.states.clear(program.states, columns);
        self.next_states.clear(program.states, columns);
        self.samples.clear(sample_rows, columns);
        self.forces.clear(program.forces.len(), columns);
        self.held_forces.clear(program.forces.len(), columns);
        self.held.clear();
        self.held.resize(program.delays.len(), i64::MIN);
        for state in 0..program.states {
            self.states.row_mut(state)[state] = 1.0;
        }
        for samples in &program.registers {
            for (place, row) in numbers_of_state(samples, 0) {
                self.samples.row_mut(row)[place] = 1.0;
            }
        }
    }

    #[inline(always)]
    fn tick(&mut self, program: &Program, tick: &Tick) {
        let changes = &program.timetable.changes[tick.changes.clone()];
        for &(delay, step) in changes {
            self.held[delay] = step;
        }
        if let Some(step) = tick.network_step {
            // Forces are sampled from the motions that are held now.
            self.sample(program, step, false);
            self.sample(program, step, true);
        }
        if !changes.is_empty() {
            self.sum_held_forces(program);
        }
        self.step_bodies(program);
    }

    #[inline(always)]
    fn sample(&mut self, program: &Program, step: i64, forces: bool) {
        let registers = program.registers.iter().enumerate();
        for (register, samples) in registers.filter(|(_, samples)| samples.carries_force == forces) {
            let is_lost = self.lost.contains(&(step, register));
            for (number, sum) in samples.numbers.iter().enumerate() {
                self.taken.clear();
                if is_lost {
                    self.taken.extend_from_slice(self.samples.row(samples.row(step - 1, number)));
                    self.samples.row_mut(samples.row(step, number)).copy_from_slice(&self.taken);
                    continue;
                }
                self.taken.resize(program.columns, 0.0);
                add_current(&mut self.taken, sum, &self.states);
                add_held(&mut self.taken, sum, program, &self.samples, &self.held);
                self.samples.row_mut(samples.row(step, number)).copy_from_slice(&self.taken);
            }
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
    fn step_bodies(&mut self, program: &Program) {
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

    fn matrix(&self, program: &Program) -> DMatrix<f64> {
        let columns = program.columns;
        let mut matrix = DMatrix::zeros(columns, columns);
        let mut set = |place: usize, row: &[f64]| {
            for (element, &value) in matrix.as_mut_slice()[place..].iter_mut().step_by(columns).zip(row) {
                *element = value;
            }
        };
        for state in 0..program.states {
            set(state, self.states.row(state));
        }
        for samples in &program.registers {
            for (place, row) in numbers_of_state(samples, program.timetable.network_steps) {
                set(place, self.samples.row(row));
            }
        }
        matrix
    }
}

/// Place in the state and row in the ring of every number of a register, just before network step `step`.
fn numbers_of_state(samples: &Samples, step: i64) -> impl Iterator<Item = (usize, usize)> {
    (1..samples.ring).flat_map(move |age| {
        let first = samples.place + (age - 1) * samples.numbers.len();
        let numbers = 0..samples.numbers.len();
        numbers.map(move |number| (first + number, samples.row(step - age as i64, number)))
    })
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
        add(target, *factor, samples.row(program.registers[row.register].row(held[row.delay], row.number)));
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
