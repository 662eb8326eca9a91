//! How a hand answers to a sinusoidal force.

use cotouch_scene::names::{Axis, Coordinate, Part, Quantity};
use nalgebra::{Complex, DMatrix, DVector};

use super::alone::{End, Held};
use super::source::{self, AMPLITUDES, Cut, STATES};
use crate::check::SpecError;
use crate::lift::LiftedMap;
use crate::loop_spec::{Dynamics, LoopSpec, Plant};

/// A response that does not exist, because the loop itself swings at that frequency.
const NONE: Complex<f64> = Complex::new(f64::INFINITY, 0.0);

/// (6.1) at `z = e^(jωT_t)`: the force is sampled at every network instant and held until the next; position (`order` 0,
/// m/N) or velocity (1, m/s/N) is read at the first network instant of each pattern, before anything else happens there.
///
/// With a whole number of ticks a network period, every network instant is the first of a pattern, and this is
/// `C·(zI − A)⁻¹·B` of Fotoohi Ghiam 2006.
pub(super) fn slow_rate(held: &Held, order: usize, frequency_rad_s: f64) -> Result<Complex<f64>, SpecError> {
    let mut held = held.clone();
    let source = source::at_network_instants(&mut held, frequency_rad_s);
    let map = held.spec.lift_shared()?;
    let source = first_state(&map, &held.spec, source.0);
    let cut = Cut::new(&map.matrix, &[source, source + 1]);
    let mut input = DVector::zeros(cut.places.len());
    for (state, amplitude) in AMPLITUDES.into_iter().enumerate() {
        let column = cut.column(&map.matrix, source + state);
        input += column.map(|value| amplitude * value);
    }
    let turn = Complex::from_polar(1.0, frequency_rad_s * held.spec.pattern_s());
    let Some(state) = cut.steady(turn, &input) else { return Ok(NONE) };
    let value = |place: usize| cut.places.iter().position(|&kept| kept == place).map(|index| state[index]);
    let answer = held.answer(order).into_iter().filter_map(|(body, state, factor)| {
        Some(value(first_state(&map, &held.spec, body.0) + state)? * factor)
    });
    Ok(answer.sum())
}

/// The exact fundamental of the velocity (m/s/N) under the force `e^(jωt)`, continuous in time.
///
/// In steady state the velocity is `e^(jωt)` times something that repeats with every pattern of duration P. Its mean,
/// `1/P·∫ v(t)·e^(−jωt) dt`, is e^(−jωP)/P times what the filter `ẇ = jω·w + v` shows after one pattern that it began with
/// w = 0. Source and filter are part of each finger's plant, so that both are exact.
pub(super) fn fundamental(held: &Held, frequency_rad_s: f64) -> Result<Complex<f64>, SpecError> {
    let mut held = held.clone();
    let mut extra = Vec::new();
    for (index, End { body: finger, shares }) in held.pushed.iter().enumerate() {
        let body = &mut held.spec.bodies[finger.0];
        let plant = match &mut body.dynamics {
            Dynamics::Plant(plant) | Dynamics::Sensed { plant, .. } => plant,
            Dynamics::Mass { .. } | Dynamics::Rigid { .. } => continue,
        };
        let first = plant.a.nrows();
        *plant = driven(plant, shares, frequency_rad_s);
        let states = source::names(Part::Force(index as u8)).into_iter().chain(filter_names(index as u8));
        body.states.splice(first..first, states);
        extra.push((finger.0, first));
    }
    let map = held.spec.lift_shared()?;
    let places: Vec<usize> =
        extra.iter().map(|&(finger, first)| first_state(&map, &held.spec, finger) + first).collect();
    let removed: Vec<usize> = places.iter().flat_map(|&first| first..first + 2 * STATES).collect();
    let cut = Cut::new(&map.matrix, &removed);
    let mut input = DVector::zeros(cut.places.len());
    for &first in &places {
        for (state, amplitude) in AMPLITUDES.into_iter().enumerate() {
            let column = cut.column(&map.matrix, first + state);
            input += column.map(|value| amplitude * value);
        }
    }
    let period_s = held.spec.pattern_s();
    let turn = Complex::from_polar(1.0, frequency_rad_s * period_s);
    let Some(state) = cut.steady(turn, &input) else { return Ok(NONE) };
    let shown = |row: usize| {
        let of_sources = places.iter().flat_map(|&first| {
            AMPLITUDES.into_iter().enumerate().map(move |(state, amplitude)| (first + state, amplitude))
        });
        let direct: Complex<f64> =
            of_sources.map(|(column, amplitude)| amplitude * map.matrix[(row, column)]).sum();
        cut.row_times(&map.matrix, row, &state) + direct
    };
    let filtered = places.iter().map(|&first| shown(first + 2) + Complex::new(0.0, 1.0) * shown(first + 3));
    let sum: Complex<f64> = filtered.sum();
    Ok(sum / turn / period_s)
}

/// A plant with states c and s of a source, whose c acts on it by `shares`, and the real and imaginary part of the filter of
/// its velocity by the same shares.
fn driven(plant: &Plant, shares: &[f64], frequency_rad_s: f64) -> Plant {
    let (states, axes) = plant.b.shape();
    let shares = DVector::from_column_slice(shares);
    let size = states + 2 * STATES;
    let mut a = DMatrix::zeros(size, size);
    a.view_mut((0, 0), (states, states)).copy_from(&plant.a);
    a.view_mut((0, states), (states, 1)).copy_from(&(&plant.b * &shares));
    let velocity = shares.transpose() * plant.c.rows(axes, axes);
    a.view_mut((states + 2, 0), (1, states)).copy_from(&velocity);
    for oscillator in [states, states + 2] {
        a[(oscillator, oscillator + 1)] = -frequency_rad_s;
        a[(oscillator + 1, oscillator)] = frequency_rad_s;
    }
    let mut b = DMatrix::zeros(size, axes);
    b.rows_mut(0, states).copy_from(&plant.b);
    let mut c = DMatrix::zeros(2 * axes, size);
    c.columns_mut(0, states).copy_from(&plant.c);
    Plant { a, b, c }
}

fn filter_names(finger: u8) -> impl Iterator<Item = Coordinate> {
    source::names(Part::Force(finger)).into_iter().zip([Axis::X, Axis::Y]).filter_map(move |(name, axis)| {
        let Coordinate::Own { host, .. } = name else { return None };
        Some(Coordinate::Own { host, part: Part::Sensor(finger), quantity: Quantity::Force(axis) })
    })
}

/// Where the states of a body begin in the map.
fn first_state(map: &LiftedMap, spec: &LoopSpec, body: usize) -> usize {
    let name = spec.bodies[body].states.first();
    name.and_then(|&name| map.index_of(name)).unwrap_or_default()
}
