//! Where each number of a loop's state lies.

use cotouch_scene::names::Coordinate;

use crate::loop_spec::{LineId, LoopSpec};

/// Who keeps samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Registers {
    /// Every line, for itself.
    PerReceiver,
    /// All lines that sample the same signal, together.
    Shared,
}

/// A shift register of samples.
#[derive(Clone, Debug)]
pub(crate) struct Register {
    /// The line with the longest delay, which names the samples.
    pub(crate) line: LineId,
    /// Samples of ages 1 to this number are part of the state.
    pub(crate) length: u32,
    /// How many numbers a sample has.
    pub(crate) numbers: usize,
    /// Place of the first number of age 1; the numbers of one sample lie together, then the next age follows.
    pub(crate) first: usize,
}

impl Register {
    /// Place of the first number of the sample of age `age`.
    pub(crate) fn place(&self, age: u32) -> usize {
        self.first + (age as usize - 1) * self.numbers
    }
}

/// Where a block's numbers lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PlacedBlock {
    /// Its first state.
    pub(crate) states: usize,
    /// The first number of its output of age 1; older ones follow.
    pub(crate) outputs: usize,
}

/// Where each number of the state lies: the bodies' states, then the registers, then each block's states and past outputs.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pub(crate) coordinates: Vec<Coordinate>,
    /// Place of each body's first state.
    pub(crate) bodies: Vec<usize>,
    pub(crate) registers: Vec<Register>,
    /// The register of each line.
    pub(crate) register_of_line: Vec<usize>,
    pub(crate) blocks: Vec<PlacedBlock>,
}

impl Layout {
    pub(crate) fn new(spec: &LoopSpec, kind: Registers) -> Self {
        Self::with_ages(spec, kind, 0)
    }

    /// Every line for itself, with at least the sample of the last network step in the state, so that a receiver can go
    /// on with it.
    pub(crate) fn with_memory(spec: &LoopSpec) -> Self {
        Self::with_ages(spec, Registers::PerReceiver, 1)
    }

    /// With samples of ages up to `least` at least.
    fn with_ages(spec: &LoopSpec, kind: Registers, least: u32) -> Self {
        let mut coordinates = Vec::new();
        let mut bodies = Vec::new();
        for body in &spec.bodies {
            bodies.push(coordinates.len());
            coordinates.extend_from_slice(&body.states);
        }
        let (mut registers, register_of_line) = registers(spec, kind);
        for register in &mut registers {
            register.first = coordinates.len();
            register.length = register.length.max(least);
            let line = &spec.lines[register.line.0];
            let quantities = spec.quantities(line);
            for age in 1..=register.length {
                coordinates.extend(quantities.iter().map(|&quantity| line.coordinate(quantity, age)));
            }
        }
        let mut blocks = Vec::new();
        for block in &spec.blocks {
            let states = coordinates.len();
            coordinates.extend_from_slice(&block.states);
            blocks.push(PlacedBlock { states, outputs: coordinates.len() });
            for earlier in 0..block.past_outputs() {
                coordinates.extend(block.outputs.iter().map(|output| output.earlier(earlier)));
            }
        }
        Self { coordinates, bodies, registers, register_of_line, blocks }
    }
}

fn registers(spec: &LoopSpec, kind: Registers) -> (Vec<Register>, Vec<usize>) {
    let mut registers: Vec<Register> = Vec::new();
    let mut register_of_line = Vec::new();
    for (index, line) in spec.lines.iter().enumerate() {
        let (id, length) = (LineId(index), line.delay.samples(&spec.schedule));
        let shared = registers
            .iter_mut()
            .enumerate()
            .find(|(_, other)| kind == Registers::Shared && spec.lines[other.line.0].signal == line.signal);
        if let Some((place, register)) = shared {
            if length > register.length {
                (register.line, register.length) = (id, length);
            }
            register_of_line.push(place);
        } else {
            register_of_line.push(registers.len());
            let numbers = spec.quantities(line).len();
            registers.push(Register { line: id, length, numbers, first: 0 });
        }
    }
    (registers, register_of_line)
}
