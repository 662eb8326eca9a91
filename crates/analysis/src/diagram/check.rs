//! Whether a diagram makes sense.

use std::collections::BTreeSet;

use nalgebra::DMatrix;

use super::error::DiagramError;
use super::layout::DiagramLayout;
use super::model::{Diagram, DiagramBlock, Element, Law, Sampled, Wire};
use super::order::{Emission, emissions};
use super::timetable::DiagramTimetable;
use crate::plant::Plant;

/// States squared times instants: some seconds of work.
const MAX_WORK: f64 = 1e9;

/// ‖A‖ times the pattern.
const STIFFEST: f64 = 1e6;

/// A diagram whose shapes fit, with the times of all that happens.
pub(crate) struct Checked<'a> {
    pub(crate) diagram: &'a Diagram,
    pub(crate) timetable: DiagramTimetable,
    pub(crate) layout: DiagramLayout,
    pub(crate) emissions: Vec<Emission>,
}

impl<'a> Checked<'a> {
    pub(crate) fn new(diagram: &'a Diagram) -> Result<Self, DiagramError> {
        diagram.blocks.iter().try_for_each(check_block)?;
        diagram.wires.iter().try_for_each(|wire| check_wire(diagram, wire))?;
        let timetable = DiagramTimetable::new(diagram)?;
        check_delays(diagram, &timetable)?;
        check_stiffness(diagram, &timetable)?;
        let ages = |block| timetable.of(block).map_or(0, |instants| instants.used_at(0).unsigned_abs());
        let past: u64 = (0..diagram.blocks.len()).map(ages).fold(0, u64::saturating_add);
        check_work(usize::try_from(past).unwrap_or(usize::MAX), "samples on their way", 1)?;
        let layout = DiagramLayout::new(diagram, &timetable);
        check_names(&layout.names)?;
        let emissions = emissions(diagram, &timetable)?;
        check_work(layout.names.len(), "states", emissions.len())?;
        Ok(Self { diagram, timetable, layout, emissions })
    }

    /// The wires into a block.
    pub(crate) fn wires_into(&self, block: usize) -> impl Iterator<Item = &'a Wire> {
        self.diagram.wires.iter().filter(move |wire| wire.to.0 == block)
    }
}

fn check_work(size: usize, what: &'static str, instants: usize) -> Result<(), DiagramError> {
    if size as f64 * size as f64 * instants as f64 > MAX_WORK {
        return Err(DiagramError::TooLarge { size, what, instants, most: MAX_WORK });
    }
    Ok(())
}

fn check_block(block: &DiagramBlock) -> Result<(), DiagramError> {
    let name = &block.name;
    match &block.element {
        Element::Plant(Plant { a, b, c }) => {
            let n = a.nrows();
            check_matrix(name, "A", a, (n, n))?;
            check_matrix(name, "B", b, (n, b.ncols()))?;
            check_matrix(name, "C", c, (c.nrows(), n))?;
        }
        Element::Sampled(Sampled { law: Law::Linear(linear), .. }) => {
            let (n, outputs, inputs) = (linear.a.nrows(), linear.d.nrows(), linear.d.ncols());
            check_matrix(name, "A", &linear.a, (n, n))?;
            check_matrix(name, "B", &linear.b, (n, inputs))?;
            check_matrix(name, "C", &linear.c, (outputs, n))?;
            check_matrix(name, "D", &linear.d, (outputs, inputs))?;
        }
        Element::Sampled(Sampled { law: Law::FirstOrderHold { .. }, .. }) => {}
    }
    if let Element::Sampled(sampled) = &block.element {
        check_weights(name, sampled)?;
    }
    check_count(name, "states", block.states.len(), block.element.states())?;
    check_count(name, "outputs", block.outputs.len(), block.element.outputs())
}

fn check_weights(name: &str, sampled: &Sampled) -> Result<(), DiagramError> {
    let (found, needed) = (sampled.weights.len(), sampled.clock.offsets.len());
    if found != needed {
        let what = format!("the lists of weights of {name}");
        return Err(DiagramError::Shape { what, needed: needed.to_string(), found: found.to_string() });
    }
    for weights in &sampled.weights {
        if weights.is_empty() {
            let what = format!("the list of weights of {name}");
            return Err(DiagramError::Shape { what, needed: "at least one".into(), found: "none".into() });
        }
        if let Some((place, &found)) = weights.iter().enumerate().find(|(_, weight)| !weight.is_finite()) {
            return Err(DiagramError::NotFinite { what: format!("weight {place} of {name}"), found });
        }
    }
    Ok(())
}

fn check_matrix(
    block: &str,
    which: &str,
    matrix: &DMatrix<f64>,
    needed: (usize, usize),
) -> Result<(), DiagramError> {
    if matrix.shape() != needed {
        let shape = |(rows, columns): (usize, usize)| format!("{rows}×{columns}");
        let what = format!("{which} of {block}");
        return Err(DiagramError::Shape { what, needed: shape(needed), found: shape(matrix.shape()) });
    }
    match matrix.iter().position(|element| !element.is_finite()) {
        Some(place) => {
            let (row, column) = (place % matrix.nrows(), place / matrix.nrows());
            let what = format!("{which} of {block}, row {row}, column {column},");
            Err(DiagramError::NotFinite { what, found: matrix[place] })
        }
        None => Ok(()),
    }
}

fn check_count(block: &str, what: &str, found: usize, needed: usize) -> Result<(), DiagramError> {
    if found == needed {
        return Ok(());
    }
    let what = format!("the list of names of {what} of {block}");
    Err(DiagramError::Shape { what, needed: format!("{needed} long"), found: found.to_string() })
}

fn check_wire(diagram: &Diagram, wire: &Wire) -> Result<(), DiagramError> {
    let block = |index: usize| {
        let count = diagram.blocks.len();
        diagram.blocks.get(index).ok_or(DiagramError::UnknownBlock { index, count })
    };
    let (from, to) = (block(wire.from.0)?, block(wire.to.0)?);
    let name = format!("the wire from {} to {}", from.name, to.name);
    check_matrix(&name, "the gain", &wire.gain, (to.element.inputs(), from.element.outputs()))?;
    match (&from.element, &to.element) {
        (Element::Plant(_), Element::Plant(_)) => {
            Err(DiagramError::NotHeld { from: from.name.clone(), to: to.name.clone() })
        }
        _ => Ok(()),
    }
}

fn check_delays(diagram: &Diagram, timetable: &DiagramTimetable) -> Result<(), DiagramError> {
    for (index, block) in diagram.blocks.iter().enumerate() {
        if let Some(instants) = timetable.of(index) {
            let count = instants.count(instants.period);
            if (0..count).any(|output| instants.use_of(output) > instants.use_of(output + 1)) {
                return Err(DiagramError::Overtaking { block: block.name.clone() });
            }
            let is_late = |output: i64| {
                let last = instants.samples(output).last().map_or(i64::MIN, |(tick, _)| tick);
                let gathers = last > instants.of(output);
                gathers && (last >= instants.of(output + 1) || last >= instants.use_of(output))
            };
            if (0..count).any(is_late) {
                let problem =
                    "samples its input until its next instant, or its output is used before".to_owned();
                return Err(DiagramError::Clock { block: block.name.clone(), problem });
            }
        }
    }
    Ok(())
}

fn check_stiffness(diagram: &Diagram, timetable: &DiagramTimetable) -> Result<(), DiagramError> {
    let pattern_s = timetable.seconds(timetable.frame);
    for block in &diagram.blocks {
        if let Element::Plant(plant) = &block.element {
            let rows = plant.a.row_iter().map(|row| row.iter().map(|element| element.abs()).sum::<f64>());
            let found = rows.fold(0.0, f64::max) * pattern_s;
            if found > STIFFEST {
                let plant = block.name.clone();
                return Err(DiagramError::TooStiff { plant, pattern_s, most: STIFFEST, found });
            }
        }
    }
    Ok(())
}

fn check_names(names: &[String]) -> Result<(), DiagramError> {
    let mut seen = BTreeSet::new();
    match names.iter().find(|&name| !seen.insert(name)) {
        Some(name) => Err(DiagramError::Duplicate(name.clone())),
        None => Ok(()),
    }
}
