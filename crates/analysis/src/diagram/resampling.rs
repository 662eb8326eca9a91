//! Subsystem resampling: Fotoohi Ghiam 2006, (4.1) – (4.11), for any number of nested rates.
//!
//! From the fastest rate to the slowest: the blocks of a rate join what was made of the faster ones, their loop is
//! closed, and the whole is resampled to the next rate, over which the outputs of slower blocks are held:
//!
//! ```text
//! x(k+1) = A·x(k) + B·v + S·s              v, s: values and slopes of what slower blocks put out
//! A_t = A^N,  B_t = Σ_i A^(N−1−i)·B,  C_t = C,  D_t = D                                     (4.4)
//! S_t = Σ_i A^(N−1−i)·(S + i·T·B)          because v grows by s·T from one fast period to the next
//! ```
//!
//! Samples on their way are states (4.6). An input that is gathered over a slow period is one more functional of x, v
//! and s, that is summed up in the same way; the block that gathers it takes it at the start of that period, for its output is
//! used after the end.

use cotouch_world::LinearBlock;
use nalgebra::DMatrix;

use super::check::Checked;
use super::error::DiagramError;
use super::held_plant::HeldPlant;
use super::layout::moves;
use super::model::{Element, Law, Sampled};
use super::timetable::Instants;

/// The map over one pattern.
pub(crate) fn lift(checked: &Checked<'_>) -> Result<DMatrix<f64>, DiagramError> {
    let rates = nested_periods(checked)?;
    let mut part = Resampled::new(checked);
    for (place, &period) in rates.iter().enumerate() {
        part.join(period);
        part.close(period);
        if let Some(slower) = rates.get(place + 1) {
            part.resample(slower / period, checked.timetable.seconds(period));
        }
    }
    Ok(part.next.columns(0, checked.layout.names.len()).into_owned())
}

/// All periods in ticks, rising, each a whole multiple of the one before.
fn nested_periods(checked: &Checked<'_>) -> Result<Vec<i64>, DiagramError> {
    let mut periods: Vec<(i64, &str)> = Vec::new();
    for (index, block) in checked.diagram.blocks.iter().enumerate() {
        let Some(instants) = checked.timetable.of(index) else { continue };
        if let Some(misalignment) = instants.misalignment() {
            return Err(DiagramError::NotNested(format!("{} {misalignment}", block.name)));
        }
        periods.extend([(instants.period, block.name.as_str()), (instants.spacing, block.name.as_str())]);
    }
    periods.sort_unstable();
    periods.dedup_by_key(|(period, _)| *period);
    if let Some(pair) = periods.windows(2).find(|pair| pair[1].0 % pair[0].0 != 0) {
        let why = format!(
            "the period of {} is {} times that of {}, not a whole multiple",
            pair[1].1,
            pair[1].0 as f64 / pair[0].0 as f64,
            pair[0].1
        );
        return Err(DiagramError::NotNested(why));
    }
    Ok(periods.into_iter().map(|(period, _)| period).collect())
}

/// All blocks of the present rate and of faster ones, as one discrete system at the present rate.
///
/// Rows are over the columns [x | v | s]: all states, then the values at the start of the period and the slopes of all
/// signals.
struct Resampled<'a> {
    checked: &'a Checked<'a>,
    /// States in z.
    states: usize,
    /// All blocks' outputs.
    signals: usize,
    /// The first signal of each block.
    first: Vec<usize>,
    joined: Vec<bool>,
    /// The states one period later.
    next: DMatrix<f64>,
    /// The signals of the joined blocks at the start of a period.
    values: DMatrix<f64>,
    /// The slopes of what moves.
    slopes: DMatrix<f64>,
    /// For each block that gathers its input: its sums over the periods of the present rate.
    sums: Vec<Vec<DMatrix<f64>>>,
}

impl<'a> Resampled<'a> {
    fn new(checked: &'a Checked<'a>) -> Self {
        let states = checked.layout.names.len();
        let mut signals = 0;
        let mut first = Vec::new();
        for block in &checked.diagram.blocks {
            first.push(signals);
            signals += block.element.outputs();
        }
        let columns = states + 2 * signals;
        let blocks = checked.diagram.blocks.len();
        Self {
            checked,
            states,
            signals,
            first,
            joined: vec![false; blocks],
            next: DMatrix::zeros(states, columns),
            values: DMatrix::zeros(signals, columns),
            slopes: DMatrix::zeros(signals, columns),
            sums: vec![Vec::new(); blocks],
        }
    }

    fn columns(&self) -> usize {
        self.states + 2 * self.signals
    }

    fn value_column(&self, block: usize) -> usize {
        self.states + self.first[block]
    }

    fn slope_column(&self, block: usize) -> usize {
        self.states + self.signals + self.first[block]
    }

    /// Takes in the blocks of one period.
    fn join(&mut self, period: i64) {
        let checked = self.checked;
        for (index, block) in checked.diagram.blocks.iter().enumerate() {
            match (&block.element, checked.timetable.of(index)) {
                (Element::Plant(_), _) if self.period_of_plant(index) == period => {
                    self.join_plant(index, period)
                }
                (Element::Sampled(sampled), Some(instants)) => {
                    if instants.gathers() && instants.spacing == period {
                        let input = self.input(index);
                        let samples =
                            instants.samples(0).map(|(_, weight)| weight).chain(std::iter::repeat(0.0));
                        let all = (instants.period / instants.spacing) as usize;
                        self.sums[index] = samples.take(all).map(|weight| &input * weight).collect();
                    }
                    if instants.period == period {
                        self.join_sampled(index, sampled, instants);
                    }
                }
                _ => {}
            }
        }
    }

    /// A plant's own rate is the fastest at which anything acts on it or looks at it.
    fn period_of_plant(&self, plant: usize) -> i64 {
        let timetable = &self.checked.timetable;
        let readers = self.checked.diagram.wires.iter().filter(|wire| wire.from.0 == plant);
        let read = readers.filter_map(|wire| timetable.of(wire.to.0)).map(|instants| instants.spacing);
        let sources = self.checked.wires_into(plant);
        let driven = sources.filter_map(|wire| timetable.of(wire.from.0)).map(|instants| instants.period);
        read.chain(driven).min().unwrap_or(timetable.frame)
    }

    fn join_plant(&mut self, index: usize, period: i64) {
        let checked = self.checked;
        let Element::Plant(plant) = &checked.diagram.blocks[index].element else { return };
        let held = HeldPlant::new(plant, checked.timetable.seconds(period));
        let own = checked.layout.blocks[index].states;
        let mut next = DMatrix::zeros(plant.a.nrows(), self.columns());
        next.columns_mut(own, plant.a.nrows()).copy_from(&held.a);
        for wire in checked.wires_into(index) {
            let source = wire.from.0;
            let mut level = next.columns_mut(self.value_column(source), wire.gain.ncols());
            level += &held.level * &wire.gain;
            if moves(&checked.diagram.blocks[source]) {
                let mut slope = next.columns_mut(self.slope_column(source), wire.gain.ncols());
                slope += &held.slope * &wire.gain;
            }
        }
        self.next.rows_mut(own, plant.a.nrows()).copy_from(&next);
        let mut values = self.values.view_mut((self.first[index], own), plant.c.shape());
        values.copy_from(&plant.c);
        self.joined[index] = true;
    }

    fn join_sampled(&mut self, index: usize, sampled: &Sampled, instants: &Instants) {
        let (own, count) = (self.own_states(index), self.checked.diagram.blocks[index].element.outputs());
        let weight: f64 = instants.samples(0).map(|(_, weight)| weight).sum();
        let input = self.sums[index].pop().unwrap_or_else(|| self.input(index) * weight);
        let (next, output) = match &sampled.law {
            Law::Linear(LinearBlock { a, b, c, d }) => (a * &own + b * &input, c * &own + d * &input),
            Law::FirstOrderHold { .. } => {
                let slope = (&input - &own) / sampled.clock.period.seconds();
                (input, stacked(&own, &slope))
            }
        };
        let placed = self.checked.layout.blocks[index];
        self.next.rows_mut(placed.states, next.nrows()).copy_from(&next);
        // (4.6), once for each period of delay.
        let mut used = output;
        for age in 1..=placed.ages {
            self.next.rows_mut(placed.output(age), placed.width).copy_from(&used);
            used = self.unit(placed.output(age), placed.width);
        }
        debug_assert_eq!(placed.ages, -instants.used_at(0));
        self.values.rows_mut(self.first[index], count).copy_from(&used.rows(0, count));
        if used.nrows() > count {
            self.slopes.rows_mut(self.first[index], count).copy_from(&used.rows(count, count));
        }
        self.joined[index] = true;
    }

    fn unit(&self, column: usize, rows: usize) -> DMatrix<f64> {
        let mut unit = DMatrix::zeros(rows, self.columns());
        unit.columns_mut(column, rows).fill_with_identity();
        unit
    }

    fn own_states(&self, index: usize) -> DMatrix<f64> {
        let states = self.checked.diagram.blocks[index].element.states();
        self.unit(self.checked.layout.blocks[index].states, states)
    }

    /// What a block samples, from the values of signals.
    fn input(&self, index: usize) -> DMatrix<f64> {
        let inputs = self.checked.diagram.blocks[index].element.inputs();
        let mut input = DMatrix::zeros(inputs, self.columns());
        for wire in self.checked.wires_into(index) {
            let mut part = input.columns_mut(self.value_column(wire.from.0), wire.gain.ncols());
            part += &wire.gain;
        }
        input
    }

    /// Closes the loop among the joined blocks (4.7): their signals are replaced by what they are.
    fn close(&mut self, period: i64) {
        let inner: Vec<usize> = (0..self.joined.len())
            .filter(|&index| self.joined[index])
            .flat_map(|index| {
                let outputs = self.checked.diagram.blocks[index].element.outputs();
                self.first[index]..self.first[index] + outputs
            })
            .collect();
        let columns: Vec<usize> = inner.iter().map(|signal| self.states + signal).collect();
        let values = self.values.select_rows(&inner);
        let loops = DMatrix::identity(inner.len(), inner.len()) - values.select_columns(&columns);
        let mut open = values;
        columns.iter().for_each(|&column| open.column_mut(column).fill(0.0));
        // Blocks were found not to depend on themselves: the determinant is 1.
        let closed = loops.lu().solve(&open).unwrap_or(open);
        for (row, &signal) in inner.iter().enumerate() {
            self.values.row_mut(signal).copy_from(&closed.row(row));
        }
        let known = Known { columns: &columns, rows: &closed };
        known.insert_into(&mut self.slopes);
        known.insert_into(&mut self.next);
        self.sums.iter_mut().flatten().for_each(|sum| known.insert_into(sum));
        self.close_slopes(period);
    }

    /// The same for the slopes of the first-order holds that have just joined.
    fn close_slopes(&mut self, period: i64) {
        let checked = self.checked;
        let is_new = |index: &usize| {
            let own = checked.timetable.of(*index).map(|instants| instants.period);
            moves(&checked.diagram.blocks[*index]) && own == Some(period)
        };
        let moving: Vec<usize> = (0..self.joined.len())
            .filter(is_new)
            .flat_map(|index| {
                self.first[index]..self.first[index] + checked.diagram.blocks[index].element.outputs()
            })
            .collect();
        let columns: Vec<usize> = moving.iter().map(|signal| self.states + self.signals + signal).collect();
        let rows = self.slopes.select_rows(&moving);
        let known = Known { columns: &columns, rows: &rows };
        known.insert_into(&mut self.next);
        self.sums.iter_mut().flatten().for_each(|sum| known.insert_into(sum));
    }

    /// (4.4): `ratio` periods of `period_s` as one.
    fn resample(&mut self, ratio: i64, period_s: f64) {
        let (states, signals) = (self.states, self.signals);
        let moved = |rows: &DMatrix<f64>, periods: i64| {
            let mut input = rows.clone();
            input.columns_mut(0, states).fill(0.0);
            let growth = rows.columns(states, signals) * (periods as f64 * period_s);
            let mut slopes = input.columns_mut(states + signals, signals);
            slopes += growth;
            input
        };
        let step = self.next.columns(0, states).into_owned();
        let mut reached = DMatrix::identity(states, self.columns());
        let mut sums: Vec<Vec<DMatrix<f64>>> = vec![Vec::new(); self.sums.len()];
        for period in 0..ratio {
            for (sums, segments) in sums.iter_mut().zip(&self.sums) {
                let of_period = segments.iter().skip(period as usize).step_by(ratio as usize);
                for (place, segment) in of_period.enumerate() {
                    let part = segment.columns(0, states) * &reached + moved(segment, period);
                    match sums.get_mut(place) {
                        Some(sum) => *sum += part,
                        None => sums.push(part),
                    }
                }
            }
            reached = &step * reached + moved(&self.next, period);
        }
        self.next = reached;
        self.sums = sums;
    }
}

/// Signals of which rows tell what they are.
struct Known<'a> {
    columns: &'a [usize],
    rows: &'a DMatrix<f64>,
}

impl Known<'_> {
    /// Replaces the signals in `target` by what they are.
    fn insert_into(&self, target: &mut DMatrix<f64>) {
        let gains = target.select_columns(self.columns);
        self.columns.iter().for_each(|&column| target.column_mut(column).fill(0.0));
        *target += gains * self.rows;
    }
}

fn stacked(above: &DMatrix<f64>, below: &DMatrix<f64>) -> DMatrix<f64> {
    let mut stacked = DMatrix::zeros(above.nrows() + below.nrows(), above.ncols());
    stacked.rows_mut(0, above.nrows()).copy_from(above);
    stacked.rows_mut(above.nrows(), below.nrows()).copy_from(below);
    stacked
}
