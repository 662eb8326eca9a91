//! Where each number of a diagram's state lies, and what it is called.

use super::model::{Diagram, DiagramBlock, Element, Law, Sampled};
use super::timetable::DiagramTimetable;

/// The state: block by block its states, then what it put out earlier and is still held or on its way.
#[derive(Clone, Debug)]
pub(crate) struct DiagramLayout {
    pub(crate) names: Vec<String>,
    pub(crate) blocks: Vec<PlacedElement>,
}

/// Where a block's numbers lie.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedElement {
    /// Its first state.
    pub(crate) states: usize,
    /// The first number of its latest output.
    pub(crate) outputs: usize,
    /// How many outputs of the past are part of the state.
    pub(crate) ages: i64,
    /// Numbers in one output: levels, then the slopes of a first-order hold.
    pub(crate) width: usize,
}

impl PlacedElement {
    /// Place of the first number of the output that was sampled `age` outputs before time 0.
    pub(crate) fn output(&self, age: i64) -> usize {
        self.outputs + (age - 1) as usize * self.width
    }
}

impl DiagramLayout {
    pub(crate) fn new(diagram: &Diagram, timetable: &DiagramTimetable) -> Self {
        let (mut names, mut blocks) = (Vec::new(), Vec::new());
        for (index, block) in diagram.blocks.iter().enumerate() {
            let states = names.len();
            names.extend_from_slice(&block.states);
            let ages = timetable.of(index).map_or(0, |instants| -instants.used_at(0));
            let placed = PlacedElement { states, outputs: names.len(), ages, width: width(block) };
            for age in 1..=ages {
                match block.past_outputs.get(age as usize - 1) {
                    Some(past) => names.extend_from_slice(past),
                    None => names.extend(block.outputs.iter().map(|output| format!("{output}.age{age}"))),
                }
                if moves(block) {
                    names.extend(block.outputs.iter().map(|output| format!("{output}.slope.age{age}")));
                }
            }
            blocks.push(placed);
        }
        Self { names, blocks }
    }
}

/// Whether outputs have slopes.
pub(crate) const fn moves(block: &DiagramBlock) -> bool {
    matches!(block.element, Element::Sampled(Sampled { law: Law::FirstOrderHold { .. }, .. }))
}

fn width(block: &DiagramBlock) -> usize {
    block.element.outputs() * if moves(block) { 2 } else { 1 }
}
