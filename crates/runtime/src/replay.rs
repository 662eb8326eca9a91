//! Whether a replay gives again what was recorded, bit for bit.
//!
//! [`replay`] feeds every station of a recording what it consumed then, and compares what comes of every tick, and
//! once a second the whole state. [`compare_tick`] is the comparison.

mod comparison;
mod resimulate;

pub use comparison::{Comparison, Difference, TickDifference, compare_tick};
pub use resimulate::{ReplayError, Replayed, replay};
