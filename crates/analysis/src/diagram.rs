//! Sampled-data block diagrams: any linear loop of plants, computers and the ways between them, at any rational rates.
//!
//! [`crate::loop_spec::LoopSpec`] describes what scenes compile to: bodies, springs and delay lines on one schedule. A
//! [`Diagram`] is more general, and each of those is one ([`crate::loop_spec::LoopSpec::to_diagram`]):
//!
//! ```text
//! plant           ẋ = A·x + B·u,  y = C·x          u(t) is what its sources hold: constant or linear from instant to instant
//! linear block    y_k = C·x_k + D·u_k,  x_{k+1} = A·x_k + B·u_k        at each instant t_k of its clock
//! average         y_k = Σ_i w_i·u(t_{k−1} + i·T/N)                     of the N samples of the period that just ended
//! first-order hold  y(t) = u_{k−1} + (u_k − u_{k−1})·(t − t_k)/T       linear between values, one period late (paper §3.4)
//! wire            u = Σ G·y
//! ```
//!
//! A linear block's output is held until the next one is used; a zero-order hold is the linear block y = u. What a block
//! puts out at t_k is used from t_k + delay on: a computation delay or a way through a network, whole periods or not.
//! At one instant everything is sampled first, then used: a block sees the plants as they are, and what other blocks
//! put out at this very instant. Blocks that pass their input straight through are evaluated in the order in which they
//! depend on each other.
//!
//! [`Diagram::lift`] gives the exact map of the state over one pattern of all clocks, by one of three routes that share
//! nothing but the description and the matrix exponential.
//!
//! # Example
//! A mass under a force that is computed 1000 times a second and arrives 0.4 ms later:
//!
//! ```
//! use cotouch_analysis::diagram::{Clock, Diagram, Plant, Route, Sampled};
//! use nalgebra::dmatrix;
//! let mut diagram = Diagram::new();
//! let mass = diagram.plant("mass", Plant { a: dmatrix![0.0, 1.0; 0.0, 0.0], b: dmatrix![0.0; 10.0], c: dmatrix![1.0, 0.0; 0.0, 1.0] });
//! let clock = Clock::every("1/1000".parse()?);
//! let force = diagram.sampled("force", Sampled::gain(clock, dmatrix![-500.0, -3.0]).after("0.0004".parse()?));
//! diagram.connect(mass, force);
//! diagram.connect(force, mass);
//! let map = diagram.lift(Route::Stepping)?;
//! assert_eq!(map.states, ["mass.x1", "mass.x2", "force.y1.age1"]);
//! assert!(diagram.spectral_radius()? < 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod check;
mod clock;
mod elements;
mod error;
mod hand_on_local_model;
mod held_plant;
mod layout;
mod lower;
mod order;
mod resampling;
mod state_space;
mod stepping;
mod time;
mod timetable;

use nalgebra::DMatrix;

use crate::eigenvalues;
use check::Checked;

pub use clock::Clock;
pub use error::DiagramError;
pub use hand_on_local_model::{hand_on_local_model, hand_on_weighted_local_model};
pub use time::{Time, TimeError};

/// A block of a [`Diagram`], by its place in [`Diagram::blocks`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockId(pub usize);

/// Blocks and the wires between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diagram {
    /// The blocks.
    pub blocks: Vec<Block>,
    /// The wires; several between the same two blocks add up.
    pub wires: Vec<Wire>,
}

/// A block with a name for everything that can become a number of the state.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Used in errors.
    pub name: String,
    /// Its states' names.
    pub states: Vec<String>,
    /// Its outputs' names. What was put out `a` times ago and is still held or on its way is a state called
    /// `<output>.age<a>`, and the slope with which a first-order hold moves `<output>.slope.age<a>`.
    pub outputs: Vec<String>,
    /// What it does.
    pub element: Element,
}

/// What a block does.
#[derive(Clone, Debug, PartialEq)]
pub enum Element {
    /// In continuous time.
    Plant(Plant),
    /// At the instants of a clock.
    Sampled(Sampled),
}

/// `ẋ = A·x + B·u`, `y = C·x`. Its inputs come from sampled blocks, which hold them.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// n × n, 1/s.
    pub a: DMatrix<f64>,
    /// n × inputs.
    pub b: DMatrix<f64>,
    /// Outputs × n.
    pub c: DMatrix<f64>,
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
}

/// How a sampled block makes its output.
#[derive(Clone, Debug, PartialEq)]
pub enum Law {
    /// A linear difference equation.
    Linear(Linear),
    /// The weighted sum of the samples of the period that just ended. The clock has one offset; the samples are taken
    /// at N evenly spaced instants of each of its periods, the first at its start. The states are the sums so far.
    Average {
        /// How many signals.
        channels: usize,
        /// w_0 to w_{N−1}; at least one.
        weights: Vec<f64>,
    },
    /// Moves linearly from the sample of one period ago to the present one. The clock has one offset; the states are the
    /// samples of one period ago.
    FirstOrderHold {
        /// How many signals.
        channels: usize,
    },
}

/// `y_k = C·x_k + D·u_k`, `x_{k+1} = A·x_k + B·u_k`.
#[derive(Clone, Debug, PartialEq)]
pub struct Linear {
    /// n × n.
    pub a: DMatrix<f64>,
    /// n × inputs.
    pub b: DMatrix<f64>,
    /// Outputs × n.
    pub c: DMatrix<f64>,
    /// Outputs × inputs.
    pub d: DMatrix<f64>,
}

/// Adds `gain` times one block's output to another's input.
#[derive(Clone, Debug, PartialEq)]
pub struct Wire {
    /// Whose output.
    pub from: BlockId,
    /// Whose input.
    pub to: BlockId,
    /// Inputs of `to` × outputs of `from`.
    pub gain: DMatrix<f64>,
}

/// A way to the map over one pattern. All give the same matrix; they fail for different reasons, if ever.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Route {
    /// Instant by instant, all columns of the identity at once.
    Stepping,
    /// All samples of all signals over the pattern stacked in one vector, the loop closed once: thesis (4.12) – (4.30)
    /// with appendix A, after Araki & Yamamoto (1986).
    StateSpace,
    /// Each part at its own rate, the faster resampled to the next slower rate and closed there: thesis (4.1) – (4.11).
    /// Only for nested rates without phases, and delays of whole periods.
    Resampling,
}

/// `z(k+1) = matrix·z(k)`: the state of a diagram from pattern to pattern, at time 0 of each pattern, before anything is
/// sampled there.
#[derive(Clone, Debug, PartialEq)]
pub struct DiagramMap {
    /// n × n.
    pub matrix: DMatrix<f64>,
    /// The n states' names.
    pub states: Vec<String>,
    /// How long the pattern is: the least common multiple of all clocks' periods.
    pub period_s: f64,
}

impl Diagram {
    /// A diagram without blocks.
    #[must_use]
    pub const fn new() -> Self {
        Self { blocks: Vec::new(), wires: Vec::new() }
    }

    /// Adds a plant; its states are called `<name>.x1`, `<name>.x2` and so on.
    pub fn plant(&mut self, name: impl Into<String>, plant: Plant) -> BlockId {
        self.add(name, Element::Plant(plant))
    }

    /// Adds a sampled block; its states are called `<name>.x1` and so on, its outputs `<name>.y1` and so on.
    pub fn sampled(&mut self, name: impl Into<String>, sampled: Sampled) -> BlockId {
        self.add(name, Element::Sampled(sampled))
    }

    /// Adds a block of either kind, named in the same way.
    pub fn add(&mut self, name: impl Into<String>, element: Element) -> BlockId {
        let name = name.into();
        let numbered =
            |letter: char, count: usize| (1..=count).map(|i| format!("{name}.{letter}{i}")).collect();
        let (states, outputs) = (numbered('x', element.states()), numbered('y', element.outputs()));
        self.push(Block { name, states, outputs, element })
    }

    /// Adds a block whose states and outputs have names of their own.
    pub fn push(&mut self, block: Block) -> BlockId {
        self.blocks.push(block);
        BlockId(self.blocks.len() - 1)
    }

    /// Adds `gain` times the output of `from` to the input of `to`.
    pub fn wire(&mut self, from: BlockId, to: BlockId, gain: DMatrix<f64>) {
        self.wires.push(Wire { from, to, gain });
    }

    /// Adds the output of `from` to the input of `to`, number by number.
    pub fn connect(&mut self, from: BlockId, to: BlockId) {
        self.connect_scaled(from, to, 1.0);
    }

    /// Adds `gain` times the output of `from` to the input of `to`, number by number.
    pub fn connect_scaled(&mut self, from: BlockId, to: BlockId, gain: f64) {
        // Where the two numbers differ, the check says so.
        let outputs = self.blocks.get(from.0).map_or(0, |block| block.element.outputs());
        let gain = DMatrix::from_diagonal_element(outputs, outputs, gain);
        self.wire(from, to, gain);
    }

    /// The names of the map's state.
    ///
    /// # Errors
    /// As [`Self::lift`].
    pub fn states(&self) -> Result<Vec<String>, DiagramError> {
        Ok(Checked::new(self)?.layout.names)
    }

    /// The map over one pattern.
    ///
    /// # Errors
    /// When the description is inconsistent, the pattern is too long, blocks depend on each other in a circle, or the
    /// route does not apply.
    pub fn lift(&self, route: Route) -> Result<DiagramMap, DiagramError> {
        let checked = Checked::new(self)?;
        let matrix = match route {
            Route::Stepping => stepping::lift(&checked),
            Route::StateSpace => state_space::lift(&checked)?,
            Route::Resampling => resampling::lift(&checked)?,
        };
        let period_s = checked.timetable.seconds(checked.timetable.frame);
        Ok(DiagramMap { matrix, states: checked.layout.names, period_s })
    }

    /// The largest absolute eigenvalue over one pattern: below 1, every motion dies out.
    ///
    /// # Errors
    /// As [`Self::lift`]; and when the map is not finite.
    pub fn spectral_radius(&self) -> Result<f64, DiagramError> {
        let map = self.lift(Route::Stepping)?;
        Ok(eigenvalues::spectral_radius(&eigenvalues::eigenvalues(&map.matrix)?))
    }
}

impl Element {
    /// How many states it has, samples on their way not counted.
    #[must_use]
    pub fn states(&self) -> usize {
        match self {
            Self::Plant(plant) => plant.a.nrows(),
            Self::Sampled(Sampled { law: Law::Linear(linear), .. }) => linear.a.nrows(),
            Self::Sampled(Sampled {
                law: Law::Average { channels, .. } | Law::FirstOrderHold { channels },
                ..
            }) => *channels,
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
