//! Blocks and wires.

use cotouch_world::LinearBlock;
use nalgebra::DMatrix;

use super::clock::Clock;
use super::time::Time;
use crate::plant::Plant;

/// A block of a [`Diagram`], by its place in [`Diagram::blocks`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DiagramBlockId(pub usize);

/// Blocks and the wires between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diagram {
    /// The blocks.
    pub blocks: Vec<DiagramBlock>,
    /// The wires; several between the same two blocks add up.
    pub wires: Vec<Wire>,
}

/// A block with a name for everything that can become a number of the state.
#[derive(Clone, Debug, PartialEq)]
pub struct DiagramBlock {
    /// Used in errors.
    pub name: String,
    /// Its states' names.
    pub states: Vec<String>,
    /// Its outputs' names. What was put out `a` times ago and is still held or on its way is a state called
    /// `<output>.age<a>`, and the slope with which a first-order hold moves `<output>.slope.age<a>`.
    pub outputs: Vec<String>,
    /// Other names for what it put out in the past, by age, where outputs do not name it.
    pub past_outputs: Vec<Vec<String>>,
    /// What it does.
    pub element: Element,
}

/// What a block does.
#[derive(Clone, Debug, PartialEq)]
pub enum Element {
    /// In continuous time; its inputs come from sampled blocks, which hold them.
    Plant(Plant),
    /// At the instants of a clock.
    Sampled(Sampled),
}

/// Something that acts at the instants of a clock and holds its output in between.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampled {
    /// When it samples its input.
    pub clock: Clock,
    /// For each offset of the clock: how long after sampling the output is used. What was sampled later may not be used
    /// earlier.
    pub delays: Vec<Time>,
    /// From input to output.
    pub law: Law,
    /// For each offset of the clock: the weights of the samples of which the input is the sum, at least one. The first is
    /// taken at the offset, all before the next offset; an output that depends on several is used after the last.
    pub weights: Vec<Vec<f64>>,
    /// From one of these samples to the next.
    pub spacing: Time,
}

/// How a sampled block makes its output.
#[derive(Clone, Debug, PartialEq)]
pub enum Law {
    /// A linear difference equation.
    Linear(LinearBlock),
    /// Moves linearly from the sample of one period ago to the present one. The clock has one offset; the states are the
    /// samples of one period ago.
    FirstOrderHold {
        /// How many signals.
        channels: usize,
    },
}

/// Adds `gain` times one block's output to another's input.
#[derive(Clone, Debug, PartialEq)]
pub struct Wire {
    /// Whose output.
    pub from: DiagramBlockId,
    /// Whose input.
    pub to: DiagramBlockId,
    /// Inputs of `to` × outputs of `from`.
    pub gain: DMatrix<f64>,
}

impl Diagram {
    /// A diagram without blocks.
    #[must_use]
    pub const fn new() -> Self {
        Self { blocks: Vec::new(), wires: Vec::new() }
    }

    /// Adds a plant; its states are called `<name>.x1`, `<name>.x2` and so on.
    pub fn plant(&mut self, name: impl Into<String>, plant: Plant) -> DiagramBlockId {
        self.add(name, Element::Plant(plant))
    }

    /// Adds a sampled block; its states are called `<name>.x1` and so on, its outputs `<name>.y1` and so on.
    pub fn sampled(&mut self, name: impl Into<String>, sampled: Sampled) -> DiagramBlockId {
        self.add(name, Element::Sampled(sampled))
    }

    /// Adds a block of either kind, named in the same way.
    pub fn add(&mut self, name: impl Into<String>, element: Element) -> DiagramBlockId {
        let name = name.into();
        let numbered =
            |letter: char, count: usize| (1..=count).map(|i| format!("{name}.{letter}{i}")).collect();
        let (states, outputs) = (numbered('x', element.states()), numbered('y', element.outputs()));
        self.push(DiagramBlock { name, states, outputs, past_outputs: Vec::new(), element })
    }

    /// Adds a block whose states and outputs have names of their own.
    pub fn push(&mut self, block: DiagramBlock) -> DiagramBlockId {
        self.blocks.push(block);
        DiagramBlockId(self.blocks.len() - 1)
    }

    /// Adds `gain` times the output of `from` to the input of `to`.
    pub fn wire(&mut self, from: DiagramBlockId, to: DiagramBlockId, gain: DMatrix<f64>) {
        self.wires.push(Wire { from, to, gain });
    }

    /// Adds the output of `from` to the input of `to`, number by number.
    pub fn connect(&mut self, from: DiagramBlockId, to: DiagramBlockId) {
        self.connect_scaled(from, to, 1.0);
    }

    /// Adds `gain` times the output of `from` to the input of `to`, number by number.
    pub fn connect_scaled(&mut self, from: DiagramBlockId, to: DiagramBlockId, gain: f64) {
        // Where the two numbers differ, the check says so.
        let outputs = self.blocks.get(from.0).map_or(0, |block| block.element.outputs());
        let gain = DMatrix::from_diagonal_element(outputs, outputs, gain);
        self.wire(from, to, gain);
    }
}

impl Element {
    /// How many states it has, samples on their way not counted.
    #[must_use]
    pub fn states(&self) -> usize {
        match self {
            Self::Plant(plant) => plant.a.nrows(),
            Self::Sampled(Sampled { law: Law::Linear(linear), .. }) => linear.a.nrows(),
            Self::Sampled(Sampled { law: Law::FirstOrderHold { channels }, .. }) => *channels,
        }
    }

    /// How many inputs it has.
    #[must_use]
    pub fn inputs(&self) -> usize {
        match self {
            Self::Plant(plant) => plant.b.ncols(),
            Self::Sampled(Sampled { law: Law::Linear(linear), .. }) => linear.d.ncols(),
            Self::Sampled(_) => self.states(),
        }
    }

    /// How many outputs it has.
    #[must_use]
    pub fn outputs(&self) -> usize {
        match self {
            Self::Plant(plant) => plant.c.nrows(),
            Self::Sampled(Sampled { law: Law::Linear(linear), .. }) => linear.d.nrows(),
            Self::Sampled(_) => self.states(),
        }
    }
}
