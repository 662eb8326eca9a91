//! How punctual ticks were, and how long they took.

use hdrhistogram::Histogram;

use crate::record::TickRecord;

/// How a host's ticks went.
#[derive(Clone, Debug)]
pub(crate) struct Timing {
    pub(crate) ticks: u64,
    pub(crate) missed: u64,
    pub(crate) compute_ns: Histogram<u64>,
    pub(crate) lateness_ns: Histogram<u64>,
    /// The largest lateness since displays were last told.
    pub(crate) latest_ns: i64,
}

impl Timing {
    /// Before the first tick.
    pub(crate) fn new() -> Self {
        // From 1 ns to 10 s with three digits; nothing is allocated after this.
        let histogram =
            || Histogram::new_with_bounds(1, 10_000_000_000, 3).expect("constant bounds are sound");
        Self { ticks: 0, missed: 0, compute_ns: histogram(), lateness_ns: histogram(), latest_ns: 0 }
    }

    /// Ticks that began later than by `period_ns`.
    pub(crate) fn late_ticks(&self, period_ns: u64) -> u64 {
        self.lateness_ns.len() - self.lateness_ns.count_between(0, period_ns)
    }

    /// Takes one tick. No allocation.
    pub(crate) fn observe(&mut self, record: &TickRecord) {
        self.ticks += 1;
        self.compute_ns.saturating_record(record.compute_ns.max(1) as u64);
        self.lateness_ns.saturating_record(record.lateness_ns.max(1) as u64);
        self.latest_ns = self.latest_ns.max(record.lateness_ns);
    }
}
