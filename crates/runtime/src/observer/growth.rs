//! Whether a finger's force above 8 Hz grows.

use super::sums::{LEAST_RMS_N, Sums};

/// Blocks in a quarter of a second.
const QUARTER: u32 = 16;
/// From one quarter of a second to the next, where the force grows.
const GROWTH: f64 = 1.2;
/// So many times on end.
const TIMES: u32 = 4;
/// Growth is not looked for below this, N rms.
const FLOOR_N: f64 = 1e-3;
/// Within growth no eighth of a second is weaker than this share of the one before: a touch is strongest when it begins.
const STEADY: f64 = 0.95;
/// After so many quarters without growth, and without a limit, what grew has levelled off.
const LEVEL_QUARTERS: u32 = 4;

/// Looks for growth from quarter to quarter of a second.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct GrowthWatch {
    quarter: Sums,
    eighth: Sums,
    blocks: u32,
    /// Of the quarter and of the eighth of a second before, N.
    last_quarter_n: f64,
    last_eighth_n: f64,
    /// Whether no eighth of this quarter is weaker than the one before.
    is_steady: bool,
    /// Quarters on end in which the force grew, and in which it did not.
    grown: u32,
    level: u32,
    /// Whether a limit acts in this quarter.
    pub(super) limited: bool,
    /// Since when it has been known to grow: until it levels off by itself, or for good where a limit acted on it.
    pub(super) grew_at: Option<u64>,
    /// The last tick at which it was growing.
    pub(super) grows_at: Option<u64>,
    met_limits: bool,
}

impl GrowthWatch {
    pub(super) fn observe(&mut self, tick: u64, block: &Sums) {
        self.quarter.add(block);
        self.eighth.add(block);
        self.blocks += 1;
        if self.blocks.is_multiple_of(QUARTER / 2) {
            let eighth_n = std::mem::take(&mut self.eighth).rms_n();
            self.is_steady &= eighth_n >= STEADY * self.last_eighth_n;
            self.last_eighth_n = eighth_n;
        }
        if self.blocks == QUARTER {
            let quarter_n = std::mem::take(&mut self.quarter).rms_n();
            self.end_quarter(tick, quarter_n);
        }
    }

    fn end_quarter(&mut self, tick: u64, quarter_n: f64) {
        let grows =
            self.is_steady && self.last_quarter_n > FLOOR_N && quarter_n >= GROWTH * self.last_quarter_n;
        (self.grown, self.level) = if grows { (self.grown + 1, 0) } else { (0, self.level + 1) };
        if self.grown >= TIMES && quarter_n > LEAST_RMS_N {
            (self.grew_at, self.grows_at) = (self.grew_at.or(Some(tick)), Some(tick));
        }
        self.met_limits |= self.grew_at.is_some() && self.limited;
        if self.level >= LEVEL_QUARTERS && !self.met_limits {
            self.grew_at = None;
        }
        (self.last_quarter_n, self.is_steady, self.blocks, self.limited) = (quarter_n, true, 0, false);
    }
}
