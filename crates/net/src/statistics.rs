//! What a link did to packets: losses, order, round-trip times.
//!
//! With N round trips `r_i` the mean is `Σ r_i / N` and the rms jitter their standard deviation
//! `√(Σ (r_i − mean)² / N)` (Fotoohi Ghiam 2006, Table 1.1), by Welford's recurrence.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

/// What happened to the numbered packets of one sender, at the receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SequenceCounts {
    /// Packets that arrived for the first time.
    pub received: u64,
    /// Numbers between the first and the newest that have not arrived. One that arrives after a newer one was counted
    /// here until it came.
    pub lost: u64,
    /// Packets that had arrived before.
    pub duplicates: u64,
    /// Packets that arrived after a newer one.
    pub reordered: u64,
}

/// What a packet's number says about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ArrivalOrder {
    /// Newer than all before.
    Newest,
    /// After a newer one, for the first time.
    Reordered,
    /// Not for the first time, or too old to tell (more than [`SequenceTracker::WINDOW`] behind).
    Duplicate,
}

/// Counts packets by their numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct SequenceTracker {
    /// The smallest number so far.
    first: u64,
    newest: Option<u64>,
    /// Bit `n % WINDOW`: number `n` arrived, for the `WINDOW` numbers up to the newest.
    arrived: [u64; WORDS],
    counts: SequenceCounts,
}

const WORDS: usize = 16;

impl SequenceTracker {
    /// How far back a late packet is still recognised.
    pub(crate) const WINDOW: u64 = 64 * WORDS as u64;

    /// The counts so far.
    #[must_use]
    pub(crate) const fn counts(&self) -> SequenceCounts {
        self.counts
    }

    /// Starts again with the next packet, as a sender does that came back; the counts go on.
    pub(crate) fn restart(&mut self) {
        self.newest = None;
        self.arrived = [0; WORDS];
    }

    /// Takes note of a packet. Bounded work, whatever the number.
    pub(crate) fn arrive(&mut self, number: u64) -> ArrivalOrder {
        let Some(newest) = self.newest else {
            (self.first, self.newest) = (number, Some(number));
            self.set(number);
            self.counts.received += 1;
            return ArrivalOrder::Newest;
        };
        if number > newest {
            self.advance(newest, number);
            self.counts.received += 1;
            ArrivalOrder::Newest
        } else if newest - number >= Self::WINDOW || self.bit(number) {
            self.counts.duplicates += 1;
            ArrivalOrder::Duplicate
        } else {
            self.set(number);
            self.counts.received += 1;
            self.counts.reordered += 1;
            if number < self.first {
                self.counts.lost += self.first - number - 1;
                self.first = number;
            } else {
                self.counts.lost -= 1;
            }
            ArrivalOrder::Reordered
        }
    }

    fn advance(&mut self, newest: u64, number: u64) {
        let gap = number - newest - 1;
        self.counts.lost = self.counts.lost.saturating_add(gap);
        if gap >= Self::WINDOW {
            self.arrived = [0; WORDS];
        } else {
            for missing in newest + 1..number {
                self.arrived[Self::word(missing)] &= !Self::mask(missing);
            }
        }
        self.set(number);
        self.newest = Some(number);
    }

    fn bit(&self, number: u64) -> bool {
        self.arrived[Self::word(number)] & Self::mask(number) != 0
    }

    fn set(&mut self, number: u64) {
        self.arrived[Self::word(number)] |= Self::mask(number);
    }

    const fn word(number: u64) -> usize {
        (number % Self::WINDOW / 64) as usize
    }

    const fn mask(number: u64) -> u64 {
        1 << (number % 64)
    }
}

/// Round-trip times in numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RoundTrip {
    /// How many were measured; with none all else is 0.
    pub count: u64,
    /// The mean of all round trips, s.
    pub mean_s: f64,
    /// The standard deviation of all round trips, s.
    pub rms_jitter_s: f64,
    /// The shortest of all round trips, s.
    pub min_s: f64,
    /// Median, to 0.1 %, s.
    pub p50_s: f64,
    /// 99th percentile, to 0.1 %, s.
    pub p99_s: f64,
    /// The longest of all round trips, s.
    pub max_s: f64,
}

/// Collects round-trip times. Allocates when made (about 90 kB), not afterwards.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RoundTripMeter {
    count: u64,
    mean_ns: f64,
    /// Σ (r − mean)².
    squares: f64,
    min_ns: i64,
    max_ns: i64,
    histogram: Histogram<u32>,
}

const MIN_NS: u64 = 100;
const MAX_NS: u64 = 60_000_000_000;

impl Default for RoundTripMeter {
    fn default() -> Self {
        let histogram = Histogram::new_with_bounds(MIN_NS, MAX_NS, 3).expect("the bounds are valid");
        Self { count: 0, mean_ns: 0.0, squares: 0.0, min_ns: 0, max_ns: 0, histogram }
    }
}

impl RoundTripMeter {
    /// Takes one round trip; a negative one is no measurement and is ignored.
    pub(crate) fn record(&mut self, round_trip_ns: i64) {
        if round_trip_ns < 0 {
            return;
        }
        self.min_ns = if self.count == 0 { round_trip_ns } else { self.min_ns.min(round_trip_ns) };
        self.max_ns = self.max_ns.max(round_trip_ns);
        self.count += 1;
        let deviation = round_trip_ns as f64 - self.mean_ns;
        self.mean_ns += deviation / self.count as f64;
        self.squares += deviation * (round_trip_ns as f64 - self.mean_ns);
        self.histogram.saturating_record(round_trip_ns as u64);
    }

    /// What was measured so far.
    #[must_use]
    pub(crate) fn summary(&self) -> RoundTrip {
        if self.count == 0 {
            return RoundTrip::default();
        }
        let (min_s, max_s) = (self.min_ns as f64 / 1e9, self.max_ns as f64 / 1e9);
        // A histogram's cell may reach beyond what was measured.
        let quantile = |q| (self.histogram.value_at_quantile(q) as f64 / 1e9).clamp(min_s, max_s);
        RoundTrip {
            count: self.count,
            mean_s: self.mean_ns / 1e9,
            rms_jitter_s: (self.squares / self.count as f64).sqrt() / 1e9,
            min_s,
            p50_s: quantile(0.5),
            p99_s: quantile(0.99),
            max_s,
        }
    }
}

/// What is known about the link to one peer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkStatistics {
    /// State packets sent to the peer.
    pub sent: u64,
    /// State packets that came from the peer. Their numbers are network steps, so a step that the peer skipped counts
    /// as lost: data that was due did not come.
    pub sequence: SequenceCounts,
    /// State packets that came too late for their scheduled play-out.
    pub late: u64,
    /// State packets that were older than the peer time-out when they came, and were not used.
    pub stale: u64,
    /// State packets that were not used because they cannot be what they say.
    pub implausible: u64,
    /// Round trips of pings.
    pub round_trip: RoundTrip,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_duplicates_and_order_are_told_apart() {
        let mut tracker = SequenceTracker::default();
        let arrivals: Vec<_> =
            [10, 11, 14, 13, 13, 9, 14, 15].into_iter().map(|n| tracker.arrive(n)).collect();
        use ArrivalOrder::{Duplicate, Newest, Reordered};
        assert_eq!(arrivals, [Newest, Newest, Newest, Reordered, Duplicate, Reordered, Duplicate, Newest]);
        let counts = SequenceCounts { received: 6, lost: 1, duplicates: 2, reordered: 2 };
        assert_eq!(tracker.counts(), counts);
    }

    #[test]
    fn a_jump_over_the_whole_window_is_bounded_and_forgets() {
        let mut tracker = SequenceTracker::default();
        tracker.arrive(0);
        tracker.arrive(u64::MAX);
        assert_eq!(tracker.counts().lost, u64::MAX - 1);
        assert_eq!(tracker.arrive(u64::MAX - 5), ArrivalOrder::Reordered);
        assert_eq!(tracker.arrive(5), ArrivalOrder::Duplicate);
    }

    #[test]
    fn jitter_is_the_standard_deviation() {
        let mut meter = RoundTripMeter::default();
        for ns in [2_000_000, 4_000_000, 4_000_000, 4_000_000, 5_000_000, 5_000_000, 7_000_000, 9_000_000] {
            meter.record(ns);
        }
        let summary = meter.summary();
        assert!((summary.mean_s - 5e-3).abs() < 1e-12 && (summary.rms_jitter_s - 2e-3).abs() < 1e-12);
        assert_eq!((summary.min_s, summary.max_s), (2e-3, 9e-3));
        assert!((summary.p50_s / 4e-3 - 1.0).abs() < 1e-3);
        assert_eq!(RoundTripMeter::default().summary(), RoundTrip::default());
    }
}
