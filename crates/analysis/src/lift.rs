//! From a loop to the exact map of its state over one pattern of ticks and network steps.

pub(crate) mod layout;
pub(crate) mod program;
pub(crate) mod rows;
pub(crate) mod stepping;
mod timetable;

use cotouch_scene::names::Coordinate;
use nalgebra::DMatrix;

use crate::check::{SpecError, check};
use crate::loop_spec::LoopSpec;
use layout::{Layout, Registers};

/// `z(k+1) = matrix·z(k)`: the state of a loop, from pattern to pattern.
///
/// The state is taken at the instant of a pattern's first network step, before anything is sampled at that instant.
/// One pattern is `p` ticks and `q` network steps ([`cotouch_scene::time::Schedule`]).
#[derive(Clone, Debug, PartialEq)]
pub struct LiftedMap {
    /// n × n; element (i, j) is in the unit of coordinate i over that of coordinate j (m, m/s, N).
    pub matrix: DMatrix<f64>,
    /// The n coordinates' names.
    pub coordinates: Vec<Coordinate>,
}

impl LiftedMap {
    /// The place of a coordinate in the state.
    #[must_use]
    pub fn index_of(&self, coordinate: Coordinate) -> Option<usize> {
        self.coordinates.iter().position(|&name| name == coordinate)
    }
}

impl LoopSpec {
    /// The names of the map's state: every body's states, and each receiver's own copy of every sample that it
    /// holds, has queued or that is in flight to it.
    ///
    /// # Errors
    /// When the description is inconsistent.
    pub fn coordinates(&self) -> Result<Vec<Coordinate>, SpecError> {
        check(self)?;
        Ok(Layout::new(self, Registers::PerReceiver).coordinates)
    }

    /// The map over one pattern, by the product of its ticks. Every receiver has its own copy of each sample, as the
    /// running hosts do.
    ///
    /// # Errors
    /// When the description is inconsistent.
    pub fn lift(&self) -> Result<LiftedMap, SpecError> {
        self.lift_with(Registers::PerReceiver)
    }

    /// The map in which receivers share the samples of a common sender, named after one of them.
    ///
    /// Copies of one sample are equal once they were taken inside the loop, so the difference of two copies dies out
    /// with the delay: this map has the same eigenvalues other than 0, in a state that is up to (users − 1) times
    /// smaller.
    ///
    /// # Errors
    /// When the description is inconsistent.
    pub fn lift_shared(&self) -> Result<LiftedMap, SpecError> {
        self.lift_with(Registers::Shared)
    }

    /// Numbers in the state of [`LoopSpec::lift_shared`].
    pub(crate) fn shared_states(&self) -> usize {
        Layout::new(self, Registers::Shared).coordinates.len()
    }

    fn lift_with(&self, registers: Registers) -> Result<LiftedMap, SpecError> {
        check(self)?;
        let layout = Layout::new(self, registers);
        Ok(LiftedMap { matrix: stepping::lift(self, &layout), coordinates: layout.coordinates })
    }
}
