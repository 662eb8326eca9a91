//! A user's force as part of a loop: its states then follow from the loop's map, and no map needs an input of its own.
//!
//! The oscillator `ċ = −ω·s, ṡ = ω·c` goes along with `(c, s) = (1, −j)·e^(jωt)`, so that `c = e^(jωt)`; with ω = 0 it is
//! a constant.

use cotouch_scene::names::{Axis, Coordinate, HostIndex, Part, Quantity};
use nalgebra::{Complex, DMatrix, DVector, dmatrix};

use super::alone::Held;
use crate::loop_spec::{BodyId, Delay, Dynamics, LINE, Line, LoopBody, Motion, Plant, Signal};

/// States of the source.
pub(super) const STATES: usize = 2;

/// What the states are in steady state, at time 0.
pub(super) const AMPLITUDES: [Complex<f64>; STATES] = [Complex::new(1.0, 0.0), Complex::new(0.0, -1.0)];

/// No host of a session.
const NOWHERE: HostIndex = HostIndex(u8::MAX);

/// Names that no session uses.
pub(super) fn names(part: Part) -> [Coordinate; STATES] {
    [Axis::X, Axis::Y].map(|axis| Coordinate::Own { host: NOWHERE, part, quantity: Quantity::Force(axis) })
}

/// Adds a force of `cos(ω·t)`, sampled and held at every tick.
pub(super) fn at_ticks(held: &mut Held, frequency_rad_s: f64) -> BodyId {
    let source = add(held, frequency_rad_s);
    held.push_with(Motion::Current(source));
    source
}

/// Adds a force of `cos(ω·t)`, sampled at every network instant and held until the next.
pub(super) fn at_network_instants(held: &mut Held, frequency_rad_s: f64) -> BodyId {
    let source = add(held, frequency_rad_s);
    let line = held.spec.line(Line {
        host: NOWHERE,
        from: NOWHERE,
        part: Part::FORCE,
        signal: Signal::Motion(source),
        delay: Delay::OnArrival { transit_ticks: 0 },
    });
    held.push_with(Motion::Held(line));
    source
}

fn add(held: &mut Held, frequency_rad_s: f64) -> BodyId {
    let plant = Plant {
        a: dmatrix![0.0, -frequency_rad_s; frequency_rad_s, 0.0],
        b: DMatrix::zeros(STATES, 1),
        c: DMatrix::identity(2, STATES),
    };
    let states = names(Part::FORCE).to_vec();
    held.spec.body(LoopBody { states, axes: LINE, dynamics: Dynamics::Plant(plant) })
}

/// A map's matrix, cut into the rows and columns of the loop and those of the source.
pub(super) struct Cut {
    /// Of the loop alone.
    pub(super) map: DMatrix<f64>,
    /// Places of the loop's states in the whole.
    pub(super) places: Vec<usize>,
}

impl Cut {
    /// Without the rows and columns in `removed`.
    pub(super) fn new(matrix: &DMatrix<f64>, removed: &[usize]) -> Self {
        let places: Vec<usize> = (0..matrix.nrows()).filter(|place| !removed.contains(place)).collect();
        Self { map: matrix.select_rows(&places).select_columns(&places), places }
    }

    /// The loop's rows of one column.
    pub(super) fn column(&self, matrix: &DMatrix<f64>, column: usize) -> DVector<f64> {
        DVector::from_iterator(self.places.len(), self.places.iter().map(|&row| matrix[(row, column)]))
    }

    /// The loop's columns of one row, times a state of the loop.
    pub(super) fn row_times(
        &self,
        matrix: &DMatrix<f64>,
        row: usize,
        state: &DVector<Complex<f64>>,
    ) -> Complex<f64> {
        self.places.iter().zip(state.iter()).map(|(&column, &value)| value * matrix[(row, column)]).sum()
    }

    /// `x` with `e^(jωP)·x = map·x + input`: the state in the rhythm of the source. `None` where the loop itself swings
    /// at exactly that frequency.
    pub(super) fn steady(
        &self,
        turn: Complex<f64>,
        input: &DVector<Complex<f64>>,
    ) -> Option<DVector<Complex<f64>>> {
        let mut shifted = self.map.map(|value| Complex::new(-value, 0.0));
        for index in 0..shifted.nrows() {
            shifted[(index, index)] += turn;
        }
        shifted.lu().solve(input)
    }
}
