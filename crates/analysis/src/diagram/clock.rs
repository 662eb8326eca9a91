//! When a block acts.

use super::time::Time;

/// Instants that repeat: `m·period + offset`, for every whole m and every offset.
///
/// Most clocks have one offset, their phase.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Clock {
    /// After which the instants repeat; above 0.
    pub period: Time,
    /// In rising order, each at least 0 and below the period; at least one.
    pub offsets: Vec<Time>,
}

impl Clock {
    /// One instant a period, the first at time 0.
    #[must_use]
    pub fn every(period: Time) -> Self {
        Self { period, offsets: vec![Time::ZERO] }
    }

    /// One instant a period, `phase` after each whole multiple of it.
    #[must_use]
    pub fn with_phase(period: Time, phase: Time) -> Self {
        Self { period, offsets: vec![phase] }
    }

    /// Several instants a period, not necessarily evenly spaced.
    #[must_use]
    pub const fn cyclic(period: Time, offsets: Vec<Time>) -> Self {
        Self { period, offsets }
    }
}
