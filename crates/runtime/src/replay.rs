//! Whether a replay gives again what was recorded, bit for bit.
//!
//! [`replay`] feeds every station of a recording what it consumed then, and compares what comes of every tick, and
//! once a second the whole state; a [`Comparison`] says what differed.

mod comparison;
mod resimulate;

pub use comparison::{Comparison, Difference, TickDifference};
pub use resimulate::{ReplayError, Replayed, replay};
