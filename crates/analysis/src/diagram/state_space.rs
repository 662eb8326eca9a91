//! The direct state-space representation: Fotoohi Ghiam 2006, (4.12) – (4.30) with appendix A, after Araki & Yamamoto
//! (1986).
//!
//! Every output that a sampled block puts out within one pattern is a number of the stacked vector y (4.16). Plants,
//! from the start of the pattern to any instant of it, follow in closed form from the state z at its start and from y
//! ((A.2), (A.5), here with ramps too); sampled blocks are lifted; outputs of the past are states (4.21). So
//!
//! ```text
//! y = N·z + M·y        what blocks put out, from what they sample
//! z⁺ = P·z + Q·y       the state one pattern later
//! z⁺ = (P + Q·(I − M)⁻¹·N)·z                                         (4.30)
//! ```
//!
//! In [`DiagramError::TooLarge`], samples stand for the numbers of y.

use std::collections::HashMap;

use cotouch_world::LinearBlock;
use nalgebra::DMatrix;

use super::check::Checked;
use super::error::DiagramError;
use super::held_plant::HeldPlant;
use super::layout::moves;
use super::model::{Element, Law, Sampled};
use crate::plant::Plant;

/// Numbers of y, squared, times those of y and z: some seconds of work, and less than a gigabyte.
const MAX_WORK: f64 = 1e11;

/// The map over one pattern.
pub(crate) fn lift(checked: &Checked<'_>) -> Result<DMatrix<f64>, DiagramError> {
    let mut stack = Stack::new(checked);
    let (states, unknowns) = (checked.layout.names.len(), stack.unknowns());
    if (unknowns as f64).powi(2) * (states + unknowns) as f64 > MAX_WORK {
        let instants = checked.emissions.len();
        return Err(DiagramError::TooLarge { size: unknowns, what: "samples", instants, most: MAX_WORK });
    }
    let Open { outputs, next } = stack.open_loop();
    let (n, m) = outputs.columns_range_pair(..states, states..);
    let (p, q) = next.columns_range_pair(..states, states..);
    let all = || checked.diagram.blocks.iter().map(|block| block.name.clone()).collect();
    let closed = close(&n.into_owned(), &m.into_owned()).ok_or_else(|| DiagramError::AlgebraicLoop(all()))?;
    Ok(p + q * closed)
}

/// (I − M)⁻¹·N. No output depends on itself, so M is triangular once its rows are in the order of dependence: that is
/// found from its zeros, and substitution keeps digits that pivoting would lose where gains are large. `None` where
/// there is no such order.
fn close(n: &DMatrix<f64>, m: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let size = m.nrows();
    let needed: Vec<Vec<usize>> =
        (0..size).map(|row| (0..size).filter(|&column| m[(row, column)] != 0.0).collect()).collect();
    let mut needed_by = vec![Vec::new(); size];
    for (row, columns) in needed.iter().enumerate() {
        columns.iter().for_each(|&column| needed_by[column].push(row));
    }
    let mut missing: Vec<usize> = needed.iter().map(Vec::len).collect();
    let mut ready: Vec<usize> = (0..size).filter(|&row| missing[row] == 0).collect();
    let mut closed = n.transpose();
    let mut done = 0;
    while let Some(row) = ready.pop() {
        for &column in &needed[row] {
            let known = closed.column(column).into_owned();
            closed.column_mut(row).axpy(m[(row, column)], &known, 1.0);
        }
        done += 1;
        for &waiting in &needed_by[row] {
            missing[waiting] -= 1;
            if missing[waiting] == 0 {
                ready.push(waiting);
            }
        }
    }
    (done == size).then(|| closed.transpose())
}

/// Rows over the columns [z | y].
struct Open {
    /// [N | M].
    outputs: DMatrix<f64>,
    /// [P | Q].
    next: DMatrix<f64>,
}

struct Stack<'a> {
    checked: &'a Checked<'a>,
    columns: usize,
    /// For each block: the column of the first number that it puts out in the pattern.
    first: Vec<usize>,
    /// For each plant and duration.
    held: HashMap<(usize, i64), HeldPlant>,
    /// For each plant and instant.
    plants: HashMap<(usize, i64), DMatrix<f64>>,
}

impl<'a> Stack<'a> {
    fn new(checked: &'a Checked<'a>) -> Self {
        let mut columns = checked.layout.names.len();
        let mut first = Vec::new();
        for (index, placed) in checked.layout.blocks.iter().enumerate() {
            first.push(columns);
            let count =
                checked.timetable.of(index).map_or(0, |instants| instants.count(checked.timetable.frame));
            columns += count as usize * placed.width;
        }
        Self { checked, columns, first, held: HashMap::new(), plants: HashMap::new() }
    }

    fn unknowns(&self) -> usize {
        self.columns - self.checked.layout.names.len()
    }

    fn open_loop(&mut self) -> Open {
        let checked = self.checked;
        let states = checked.layout.names.len();
        let mut outputs = DMatrix::zeros(self.unknowns(), self.columns);
        let mut next = DMatrix::zeros(states, self.columns);
        for (index, block) in checked.diagram.blocks.iter().enumerate() {
            let placed = checked.layout.blocks[index];
            let last = match &block.element {
                Element::Plant(plant) => self.plant(index, plant, checked.timetable.frame),
                Element::Sampled(sampled) => {
                    let lifted = self.lifted(index, sampled);
                    for (place, rows) in lifted.outputs.iter().enumerate() {
                        let row = self.first[index] - states + place * placed.width;
                        outputs.rows_mut(row, placed.width).copy_from(rows);
                    }
                    lifted.states
                }
            };
            next.rows_mut(placed.states, last.nrows()).copy_from(&last);
            let count =
                checked.timetable.of(index).map_or(0, |instants| instants.count(checked.timetable.frame));
            for age in 1..=placed.ages {
                let rows = self.output(index, count - age);
                next.rows_mut(placed.output(age), placed.width).copy_from(&rows);
            }
        }
        Open { outputs, next }
    }

    /// Rows that pick numbers from `column` on.
    fn unit(&self, column: usize, rows: usize) -> DMatrix<f64> {
        let mut unit = DMatrix::zeros(rows, self.columns);
        unit.columns_mut(column, rows).fill_with_identity();
        unit
    }

    /// Where output `index` of a block stands: in z for those of the past, in y for those of this pattern.
    fn column_of(&self, block: usize, index: i64) -> usize {
        let placed = self.checked.layout.blocks[block];
        if index < 0 { placed.output(-index) } else { self.first[block] + index as usize * placed.width }
    }

    /// Output `index` of a block: levels, then slopes. What was put out before the pattern may lack samples of its input.
    fn output(&mut self, block: usize, index: i64) -> DMatrix<f64> {
        let checked = self.checked;
        let width = checked.layout.blocks[block].width;
        let mut rows = self.unit(self.column_of(block, index), width);
        if index == -1
            && let Some(instants) = checked.timetable.of(block)
            && let Element::Sampled(Sampled { law: Law::Linear(law), .. }) =
                &checked.diagram.blocks[block].element
        {
            for (tick, weight) in instants.samples(index).filter(|(tick, _)| *tick >= 0) {
                rows += &law.d * self.input(block, tick) * weight;
            }
        }
        rows
    }

    /// A block's output at an instant.
    fn signal(&mut self, block: usize, tick: i64) -> DMatrix<f64> {
        let checked = self.checked;
        let Some(instants) = checked.timetable.of(block) else {
            return match &checked.diagram.blocks[block].element {
                Element::Plant(plant) => &plant.c * self.plant(block, plant, tick),
                Element::Sampled(_) => DMatrix::zeros(0, self.columns),
            };
        };
        let (index, outputs) = (instants.used_at(tick), checked.diagram.blocks[block].element.outputs());
        let both = self.output(block, index);
        let rows = both.rows(0, outputs).into_owned();
        if moves(&checked.diagram.blocks[block]) {
            let age_s = checked.timetable.seconds(tick - instants.use_of(index));
            return rows + both.rows(outputs, outputs) * age_s;
        }
        rows
    }

    fn input(&mut self, block: usize, tick: i64) -> DMatrix<f64> {
        let checked = self.checked;
        let mut input = DMatrix::zeros(checked.diagram.blocks[block].element.inputs(), self.columns);
        for wire in checked.wires_into(block) {
            input += &wire.gain * self.signal(wire.from.0, tick);
        }
        input
    }

    /// A plant's states at an instant: (A.2) on its states at the start, (A.5) on what its sources put out.
    fn plant(&mut self, block: usize, plant: &Plant, tick: i64) -> DMatrix<f64> {
        if let Some(known) = self.plants.get(&(block, tick)) {
            return known.clone();
        }
        let checked = self.checked;
        let mut rows = DMatrix::zeros(plant.a.nrows(), self.columns);
        let own = checked.layout.blocks[block].states;
        rows.columns_mut(own, plant.a.nrows()).copy_from(&self.held(block, plant, tick).a);
        for wire in checked.wires_into(block) {
            let Some(instants) = checked.timetable.of(wire.from.0) else { continue };
            let (outputs, moving) = (wire.gain.ncols(), moves(&checked.diagram.blocks[wire.from.0]));
            for index in (instants.used_at(0)..).take_while(|&index| instants.use_of(index) < tick) {
                let (from, to) = (instants.use_of(index).max(0), instants.use_of(index + 1).min(tick));
                if to <= from {
                    continue;
                }
                let rest = self.held(block, plant, tick - to).a.clone();
                let held = self.held(block, plant, to - from);
                let level = &rest * &held.level * &wire.gain;
                let slope = &rest * &held.slope * &wire.gain;
                let output = self.output(wire.from.0, index);
                if moving {
                    let age_s = checked.timetable.seconds(from - instants.use_of(index));
                    rows += (slope + &level * age_s) * output.rows(outputs, outputs);
                }
                rows += level * output.rows(0, outputs);
            }
        }
        self.plants.insert((block, tick), rows.clone());
        rows
    }

    fn held(&mut self, block: usize, plant: &Plant, duration: i64) -> &HeldPlant {
        let seconds = self.checked.timetable.seconds(duration);
        self.held.entry((block, duration)).or_insert_with(|| HeldPlant::new(plant, seconds))
    }

    fn lifted(&mut self, block: usize, sampled: &Sampled) -> Lifted {
        match &sampled.law {
            Law::Linear(linear) => self.lifted_linear(block, linear),
            Law::FirstOrderHold { .. } => self.lifted_first_order_hold(block, sampled.clock.period.seconds()),
        }
    }

    fn own_states(&self, block: usize) -> DMatrix<f64> {
        let states = self.checked.diagram.blocks[block].element.states();
        self.unit(self.checked.layout.blocks[block].states, states)
    }

    /// The instants of a block within the pattern.
    fn instants(&self, block: usize) -> Vec<i64> {
        let timetable = &self.checked.timetable;
        timetable.of(block).map_or_else(Vec::new, |instants| {
            (0..instants.count(timetable.frame)).map(|index| instants.of(index)).collect()
        })
    }

    fn lifted_linear(&mut self, block: usize, law: &LinearBlock) -> Lifted {
        let timetable = &self.checked.timetable;
        let mut states = self.own_states(block);
        let mut outputs = Vec::new();
        let Some(instants) = timetable.of(block) else { return Lifted { outputs, states } };
        for index in -1..instants.count(timetable.frame) {
            let mut input = DMatrix::zeros(law.inputs(), self.columns);
            for (tick, weight) in
                instants.samples(index).filter(|(tick, _)| (0..timetable.frame).contains(tick))
            {
                input += self.input(block, tick) * weight;
            }
            if index >= 0 {
                outputs.push(&law.c * &states + &law.d * &input);
                states = &law.a * states;
            }
            states += &law.b * &input;
        }
        Lifted { outputs, states }
    }

    fn lifted_first_order_hold(&mut self, block: usize, period_s: f64) -> Lifted {
        let mut values = vec![self.own_states(block)];
        for tick in self.instants(block) {
            let input = self.input(block, tick);
            values.push(input);
        }
        let channels = self.checked.diagram.blocks[block].element.states();
        let moving = |pair: &[DMatrix<f64>]| {
            let mut rows = DMatrix::zeros(2 * channels, self.columns);
            rows.rows_mut(0, channels).copy_from(&pair[0]);
            rows.rows_mut(channels, channels).copy_from(&((&pair[1] - &pair[0]) / period_s));
            rows
        };
        let outputs = values.windows(2).map(moving).collect();
        let states = values.pop().unwrap_or_else(|| DMatrix::zeros(channels, self.columns));
        Lifted { outputs, states }
    }
}

/// A sampled block over the pattern, in rows.
struct Lifted {
    /// What it puts out, instant by instant.
    outputs: Vec<DMatrix<f64>>,
    /// Its states at the end.
    states: DMatrix<f64>,
}
