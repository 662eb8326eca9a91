//! The product of all instants of a pattern, run on all columns of the identity at once.

use std::collections::{BTreeMap, HashMap, VecDeque};

use nalgebra::DMatrix;

use super::check::Checked;
use super::held_plant::HeldPlant;
use super::model::{Element, Law};

/// The map over one pattern.
pub(crate) fn lift(checked: &Checked<'_>) -> DMatrix<f64> {
    let mut run = DiagramRun::new(checked);
    for (tick, acting) in agenda(checked) {
        run.advance_to(tick);
        run.act(&acting);
    }
    run.advance_to(checked.timetable.frame);
    run.state()
}

/// What happens at an instant.
#[derive(Default)]
struct Acting {
    /// What puts something out, in the order of dependence.
    emitting: Vec<usize>,
    /// What takes a sample.
    sampling: Vec<usize>,
}

fn agenda(checked: &Checked<'_>) -> BTreeMap<i64, Acting> {
    let (timetable, mut agenda) = (&checked.timetable, BTreeMap::<i64, Acting>::new());
    for emission in &checked.emissions {
        let acting = agenda.entry(emission.tick).or_default();
        acting.emitting.clone_from(&emission.blocks);
        acting.sampling.clone_from(&emission.blocks);
    }
    for index in 0..checked.diagram.blocks.len() {
        let Some(instants) = timetable.of(index) else { continue };
        // Plants are stepped from one change of their inputs to the next.
        let first = instants.used_at(0);
        for output in (first..).take_while(|&output| instants.use_of(output) < timetable.frame) {
            if instants.use_of(output) >= 0 {
                agenda.entry(instants.use_of(output)).or_default();
            }
        }
        let later = (-1..instants.count(timetable.frame)).flat_map(|output| instants.samples(output).skip(1));
        for (tick, _) in later.filter(|(tick, _)| (0..timetable.frame).contains(tick)) {
            agenda.entry(tick).or_default().sampling.push(index);
        }
    }
    agenda
}

/// Something that a block put out.
struct Output {
    index: i64,
    level: DMatrix<f64>,
    /// Of a first-order hold.
    slope: Option<DMatrix<f64>>,
}

/// Every number as a row: its dependence on the state at the start of the pattern.
struct DiagramRun<'a> {
    checked: &'a Checked<'a>,
    now: i64,
    /// The states of each block.
    states: Vec<DMatrix<f64>>,
    /// What each block put out and is used now or later.
    outputs: Vec<VecDeque<Output>>,
    /// For each plant and duration.
    steps: HashMap<(usize, i64), HeldPlant>,
}

impl<'a> DiagramRun<'a> {
    fn new(checked: &'a Checked<'a>) -> Self {
        let columns = checked.layout.names.len();
        let unit = |first: usize, rows: usize| {
            DMatrix::from_fn(rows, columns, |row, column| f64::from(u8::from(column == first + row)))
        };
        let mut run =
            Self { checked, now: 0, states: Vec::new(), outputs: Vec::new(), steps: HashMap::new() };
        for (block, placed) in checked.diagram.blocks.iter().zip(&checked.layout.blocks) {
            let count = block.element.outputs();
            run.states.push(unit(placed.states, block.element.states()));
            let output = |age: i64| Output {
                index: -age,
                level: unit(placed.output(age), count),
                slope: (placed.width > count).then(|| unit(placed.output(age) + count, count)),
            };
            run.outputs.push((1..=placed.ages).rev().map(output).collect());
        }
        run
    }

    fn advance_to(&mut self, tick: i64) {
        let duration = tick - self.now;
        if duration > 0 {
            for index in 0..self.states.len() {
                if matches!(self.checked.diagram.blocks[index].element, Element::Plant(_)) {
                    self.states[index] = self.step_plant(index, duration);
                }
            }
        }
        self.now = tick;
    }

    fn step_plant(&mut self, index: usize, duration: i64) -> DMatrix<f64> {
        let Element::Plant(plant) = &self.checked.diagram.blocks[index].element else {
            return self.states[index].clone();
        };
        let timetable = &self.checked.timetable;
        self.steps
            .entry((index, duration))
            .or_insert_with(|| HeldPlant::new(plant, timetable.seconds(duration)));
        let step = &self.steps[&(index, duration)];
        let mut next = &step.a * &self.states[index];
        for wire in self.checked.wires_into(index) {
            next += &step.level * &wire.gain * self.signal(wire.from.0);
            if let Some(slope) = self.output(wire.from.0).and_then(|output| output.slope.as_ref()) {
                next += &step.slope * &wire.gain * slope;
            }
        }
        next
    }

    /// What a sampled block's readers use now.
    fn output(&self, block: usize) -> Option<&Output> {
        let index = self.checked.timetable.of(block)?.used_at(self.now);
        let outputs = &self.outputs[block];
        outputs.get((index - outputs.front()?.index) as usize)
    }

    /// A block's output as it is now.
    fn signal(&self, block: usize) -> DMatrix<f64> {
        if let Element::Plant(plant) = &self.checked.diagram.blocks[block].element {
            return &plant.c * &self.states[block];
        }
        let Some((output, instants)) = self.output(block).zip(self.checked.timetable.of(block)) else {
            return DMatrix::zeros(self.checked.diagram.blocks[block].element.outputs(), self.columns());
        };
        let age_s = self.checked.timetable.seconds(self.now - instants.use_of(output.index));
        match &output.slope {
            Some(slope) if age_s > 0.0 => &output.level + slope * age_s,
            _ => output.level.clone(),
        }
    }

    fn input(&self, block: usize) -> DMatrix<f64> {
        let inputs = self.checked.diagram.blocks[block].element.inputs();
        let mut input = DMatrix::zeros(inputs, self.columns());
        for wire in self.checked.wires_into(block) {
            input += &wire.gain * self.signal(wire.from.0);
        }
        input
    }

    fn act(&mut self, acting: &Acting) {
        acting.emitting.iter().for_each(|&block| self.emit(block));
        acting.sampling.iter().for_each(|&block| self.sample(block));
    }

    /// Levels; the slope of a first-order hold follows when everything is there to be sampled.
    fn emit(&mut self, block: usize) {
        let Element::Sampled(sampled) = &self.checked.diagram.blocks[block].element else { return };
        let next = self.outputs[block].back().map_or(0, |last| last.index + 1);
        let level = match &sampled.law {
            Law::Linear(linear) => {
                &linear.c * &self.states[block] + &linear.d * self.input(block) * self.weight(block, next)
            }
            Law::FirstOrderHold { .. } => self.states[block].clone(),
        };
        self.outputs[block].push_back(Output { index: next, level, slope: None });
        if let Some(instants) = self.checked.timetable.of(block) {
            let used = instants.used_at(self.now);
            while self.outputs[block].front().is_some_and(|front| front.index < used) {
                self.outputs[block].pop_front();
            }
        }
    }

    fn sample(&mut self, block: usize) {
        let Element::Sampled(sampled) = &self.checked.diagram.blocks[block].element else { return };
        let input = self.input(block);
        let state = &self.states[block];
        let next = match &sampled.law {
            Law::Linear(linear) => {
                let last = self.outputs[block].back().map_or(-1, |last| last.index);
                let input = input * self.weight(block, last);
                let begins = self.checked.timetable.of(block).is_some_and(|all| all.of(last) == self.now);
                if begins {
                    &linear.a * state + &linear.b * input
                } else {
                    let next = state + &linear.b * &input;
                    if let Some(output) = self.outputs[block].back_mut() {
                        output.level += &linear.d * input;
                    }
                    next
                }
            }
            Law::FirstOrderHold { .. } => {
                let slope = (&input - state) / sampled.clock.period.seconds();
                if let Some(output) = self.outputs[block].back_mut() {
                    output.slope = Some(slope);
                }
                input
            }
        };
        self.states[block] = next;
    }

    /// Of the sample that is taken now for an output.
    fn weight(&self, block: usize, output: i64) -> f64 {
        let samples = self.checked.timetable.of(block).map(|instants| instants.samples(output));
        samples.into_iter().flatten().find(|(tick, _)| *tick == self.now).map_or(0.0, |(_, weight)| weight)
    }

    fn columns(&self) -> usize {
        self.checked.layout.names.len()
    }

    fn state(&self) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.columns(), self.columns());
        for (index, placed) in self.checked.layout.blocks.iter().enumerate() {
            matrix.rows_mut(placed.states, self.states[index].nrows()).copy_from(&self.states[index]);
            let Some(instants) = self.checked.timetable.of(index) else { continue };
            let end = instants.count(self.checked.timetable.frame);
            for output in self.outputs[index].iter().filter(|output| end - output.index <= placed.ages) {
                let place = placed.output(end - output.index);
                let rows = output.level.nrows();
                matrix.rows_mut(place, rows).copy_from(&output.level);
                if let Some(slope) = &output.slope {
                    matrix.rows_mut(place + rows, rows).copy_from(slope);
                }
            }
        }
        matrix
    }
}
