//! Sums over a stretch of time of what passes an observer's band.

use glam::DVec3;

/// A force above 8 Hz below this is neither shaking nor growth, N rms.
pub(super) const LEAST_RMS_N: f64 = 0.05;

/// Squares, and squares of the change from tick to tick.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub(super) ticks: u64,
    squares: f64,
    changes: f64,
}

impl Sums {
    /// Of one tick: a force and its change since the tick before, N.
    pub(super) fn of_tick(force_n: DVec3, change_n: DVec3) -> Self {
        Self { ticks: 1, squares: force_n.length_squared(), changes: change_n.length_squared() }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.ticks += other.ticks;
        self.squares += other.squares;
        self.changes += other.changes;
    }

    /// Root mean square, N.
    pub(super) fn rms_n(&self) -> f64 {
        if self.ticks == 0 { 0.0 } else { (self.squares / self.ticks as f64).sqrt() }
    }

    /// The frequency of a sinusoid with the same rms and the same rms change from tick to tick, Hz.
    pub(super) fn hz(&self, period_s: f64) -> f64 {
        // Of a sinusoid of frequency f, changes are 4·sin²(π·f·T) times the squares.
        let share = (self.changes / self.squares).sqrt() / 2.0;
        share.min(1.0).asin() / (std::f64::consts::PI * period_s)
    }
}
