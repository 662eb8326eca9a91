//! Sampled-data block diagrams: any linear loop of plants, computers and the ways between them, at any rational rates.
//!
//! [`LoopSpec`] describes what scenes compile to, and is what one writes where everything happens at ticks of one clock; a
//! [`Diagram`] is for loops in which something happens between them, at other phases or after delays of any rational
//! length, and is what the independent routes run on: each loop spec is one ([`LoopSpec::to_diagram`]).
//!
//! ```text
//! plant           ẋ = A·x + B·u,  y = C·x          u(t) is what its sources hold: constant or linear from instant to instant
//! linear block    y_k = C·x_k + D·u_k,  x_{k+1} = A·x_k + B·u_k        at each instant t_k of its clock
//! weights         u_k = Σ_i w_i·u(t_k + i·T/N)                         the input of a block, of several samples
//! first-order hold  y(t) = u_{k−1} + (u_k − u_{k−1})·(t − t_k)/T       linear between values, one period late (Barbagli et al. 2003, §3.4)
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
//! nothing but the description, its timetable and the matrix exponential.
//!
//! # Example
//! A mass under a force that is computed 1000 times a second and arrives 0.4 ms later:
//!
//! ```
//! use cotouch_analysis::diagram::{Clock, Diagram, LiftRoute, Plant, Sampled};
//! use nalgebra::dmatrix;
//! let mut diagram = Diagram::new();
//! let mass = diagram.plant("mass", Plant { a: dmatrix![0.0, 1.0; 0.0, 0.0], b: dmatrix![0.0; 10.0], c: dmatrix![1.0, 0.0; 0.0, 1.0] });
//! let clock = Clock::every("1/1000".parse()?);
//! let force = diagram.sampled("force", Sampled::gain(clock, dmatrix![-500.0, -3.0]).after("0.0004".parse()?));
//! diagram.connect(mass, force);
//! diagram.connect(force, mass);
//! let map = diagram.lift(LiftRoute::Stepping)?;
//! assert_eq!(map.states, ["mass.x1", "mass.x2", "force.y1.age1"]);
//! assert!(diagram.spectral_radius()? < 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod check;
mod clock;
mod elements;
mod error;
mod held_plant;
mod layout;
mod lower;
mod model;
mod order;
mod resampling;
mod state_space;
mod stepping;
mod time;
mod timetable;

use nalgebra::DMatrix;

use crate::eigenvalues;
use crate::lift::LiftedMap;
use crate::loop_spec::LoopSpec;
use check::Checked;

pub use crate::plant::Plant;
pub use clock::Clock;
pub use error::{DiagramError, Misfit};
pub use model::{Diagram, DiagramBlock, DiagramBlockId, Element, Law, Sampled, Wire};
pub use time::{Time, TimeError};

/// A way to the map over one pattern. All give the same matrix; they fail for different reasons, if ever.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LiftRoute {
    /// Instant by instant, all columns of the identity at once.
    Stepping,
    /// All samples of all signals over the pattern stacked in one vector, the loop closed once: Fotoohi Ghiam 2006,
    /// (4.12) – (4.30) with appendix A, after Araki & Yamamoto (1986).
    StateSpace,
    /// Each part at its own rate, the faster resampled to the next slower rate and closed there: Fotoohi Ghiam 2006,
    /// (4.1) – (4.11). Only for nested rates without phases, and delays of whole periods.
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

impl LoopSpec {
    /// The map over one pattern by a route of its signal-flow form ([`LoopSpec::to_diagram`]): the same as
    /// [`LoopSpec::lift`], found in another way.
    ///
    /// # Errors
    /// When the description is inconsistent, too large, or the route does not apply.
    pub fn lift_by(&self, route: LiftRoute) -> Result<LiftedMap, DiagramError> {
        let matrix = self.to_diagram()?.lift(route)?.matrix;
        Ok(LiftedMap { matrix, coordinates: self.coordinates()? })
    }
}

impl Diagram {
    /// The names of the map's state.
    ///
    /// # Errors
    /// As [`Self::lift`].
    pub fn states(&self) -> Result<Vec<String>, DiagramError> {
        Ok(Checked::new(self)?.layout.names)
    }

    /// The map over one pattern. An element that outgrows floating point is not finite.
    ///
    /// # Errors
    /// When the description is inconsistent, the pattern is too long, blocks depend on each other in a circle, or the
    /// route does not apply.
    pub fn lift(&self, route: LiftRoute) -> Result<DiagramMap, DiagramError> {
        let checked = Checked::new(self)?;
        let matrix = match route {
            LiftRoute::Stepping => stepping::lift(&checked),
            LiftRoute::StateSpace => state_space::lift(&checked)?,
            LiftRoute::Resampling => resampling::lift(&checked)?,
        };
        let period_s = checked.timetable.seconds(checked.timetable.frame);
        Ok(DiagramMap { matrix, states: checked.layout.names, period_s })
    }

    /// The largest absolute eigenvalue over one pattern: below 1, every motion dies out.
    ///
    /// # Errors
    /// As [`Self::lift`]; and when the map is not finite.
    pub fn spectral_radius(&self) -> Result<f64, DiagramError> {
        let map = self.lift(LiftRoute::Stepping)?;
        Ok(eigenvalues::spectral_radius(&eigenvalues::eigenvalues(&map.matrix)?))
    }
}
