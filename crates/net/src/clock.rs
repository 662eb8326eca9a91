//! Agreement on one clock, by exchanges of four time stamps as in NTP (RFC 5905 §8).
//!
//! A host sends at `t1` of its own clock, the server receives at `t2` and answers at `t3` of the server's clock, the
//! answer arrives at `t4`. With `S(l)` the server's clock when the local clock shows `l`, the offset `o = S(l) − l` is
//!
//! ```text
//! θ = ((t2 − t1) + (t3 − t4)) / 2,    |o − θ| ≤ δ/2,    δ = (t4 − t1) − (t3 − t2)
//! ```
//!
//! and θ is exact when both ways take equally long. Delay only ever adds to δ, so the exchange with the smallest δ is the
//! best one (Mills). All exchanges of a window bound the offset: each says an interval, which widens by
//! [`MAX_DRIFT`] as it ages; the truth lies in their intersection, which is the [stated bound](ClockMap::error_bound_ns).

use arrayvec::ArrayVec;
use cotouch_scene::time::{LocalTime, SessionTime};
use serde::{Deserialize, Serialize};

/// Two clocks' rates differ by no more than this (quartz: ±50 ppm each). The stated error bound rests on it.
const MAX_DRIFT: f64 = 100e-6;

/// Largest share by which the session clock runs faster or slower to mend an error.
const MAX_SLEW: f64 = 500e-6;

/// Exchanges after which a clock counts as agreed upon.
const EXCHANGES_TO_AGREE: u32 = 8;

const WINDOW: usize = 64;
const EPOCHS: usize = 32;
const EPOCH_NS: i64 = 2_000_000_000;
/// An error is mended within this time, or at `MAX_SLEW` if that takes longer.
const SLEW_SPAN_NS: i64 = 1_000_000_000;
/// What ageing costs an exchange against a newer one with a longer round trip.
const AGEING: f64 = 10e-6;
/// A drift is used once it is known so well.
const DRIFT_KNOWN: f64 = 20e-6;

/// After the start, an exchange that contradicts all before by more than this is not followed, ns. What clocks that drift more than
/// [`MAX_DRIFT`] contradict is less.
const MAX_CONTRADICTION_NS: i64 = 5_000_000;

/// How this host's clock maps to the session's clock: `session = local + offset`, the offset changing linearly.
///
/// A plain value: take it once a tick and use it without asking anyone. It stays continuous and strictly ordered
/// under every update after the start of the session.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClockMap {
    base_local: i64,
    base_session: i64,
    /// Session nanoseconds gained per local nanosecond.
    drift: f64,
    /// Error that is being mended, from the base on, over `slew_span_ns`.
    slew_ns: i64,
    slew_span_ns: i64,
    /// Of the offset at the base.
    error_ns: i64,
    /// Share by which the error grows with time.
    error_growth: f64,
}

impl ClockMap {
    /// The map of the host that keeps the session's clock: tick 0 was at `origin`, exactly.
    #[must_use]
    pub const fn exact(origin: LocalTime) -> Self {
        Self {
            base_local: origin.0,
            base_session: 0,
            drift: 0.0,
            slew_ns: 0,
            slew_span_ns: 1,
            error_ns: 0,
            error_growth: 0.0,
        }
    }

    /// The session time at a local time.
    #[must_use]
    pub fn session(&self, local: LocalTime) -> SessionTime {
        let elapsed = local.0.saturating_sub(self.base_local);
        let linear = self.base_session.saturating_add(elapsed);
        SessionTime(linear.saturating_add(self.correction(elapsed)))
    }

    /// The first local time at which the session time is `session` or later.
    #[must_use]
    pub fn local(&self, session: SessionTime) -> LocalTime {
        let target = session.0.saturating_sub(self.base_session);
        if self.drift == 0.0 && self.slew_ns == 0 {
            return LocalTime(self.base_local.saturating_add(target));
        }
        // A fixed point: the correction changes by less than 0.1 % of what its argument does.
        let mut elapsed = target;
        for _ in 0..6 {
            elapsed = target.saturating_sub(self.correction(elapsed));
        }
        let mut local = LocalTime(self.base_local.saturating_add(elapsed));
        // Roundings make it a few nanoseconds off at most; bounded also where the numbers saturate.
        for _ in 0..8 {
            if self.session(local) < session {
                local = local.plus_ns(1);
            } else if self.session(local.plus_ns(-1)) >= session {
                local = local.plus_ns(-1);
            }
        }
        local
    }

    /// The session's clock and this map differ by no more than this at `local`, ns, provided that the clocks' rates
    /// differ by no more than 100 ppm.
    #[must_use]
    pub fn error_bound_ns(&self, local: LocalTime) -> i64 {
        let age = local.0.saturating_sub(self.base_local).saturating_abs();
        self.error_ns.saturating_add((age as f64 * self.error_growth).ceil() as i64)
    }

    /// Share by which the session's clock is faster than the local one, as estimated.
    #[must_use]
    pub const fn drift(&self) -> f64 {
        self.drift
    }

    fn correction(&self, elapsed: i64) -> i64 {
        let mended = (elapsed as f64 / self.slew_span_ns as f64).clamp(0.0, 1.0);
        (elapsed as f64 * self.drift + self.slew_ns as f64 * mended).round() as i64
    }

    /// The same map with the session's clock set back by `origin_ns`.
    pub(crate) const fn with_origin(mut self, origin_ns: i64) -> Self {
        self.base_session = self.base_session.saturating_sub(origin_ns);
        self
    }
}

/// One exchange of four time stamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Exchange {
    /// t1: when the question was sent.
    pub sent: LocalTime,
    /// t2: when the server received it, on the server's clock.
    pub received_ns: i64,
    /// t3: when the server answered, on the server's clock.
    pub answered_ns: i64,
    /// t4: when the answer arrived.
    pub returned: LocalTime,
}

impl Exchange {
    /// δ: the round trip without the server's own time, ns; `None` when the time stamps contradict each other.
    #[must_use]
    pub(crate) fn round_trip_ns(&self) -> Option<i64> {
        let outside = self.returned.0.checked_sub(self.sent.0)?;
        let inside = self.answered_ns.checked_sub(self.received_ns)?;
        let drift_allowance = (outside.max(0) as f64 * MAX_DRIFT).ceil() as i64;
        let round_trip = outside.checked_sub(inside)?;
        (inside >= 0 && round_trip >= -drift_allowance).then_some(round_trip.max(0))
    }

    fn sample(&self) -> Option<OffsetSample> {
        let round_trip_ns = self.round_trip_ns()?;
        let out = self.received_ns.checked_sub(self.sent.0)?;
        let back = self.answered_ns.checked_sub(self.returned.0)?;
        let offset_ns = ((i128::from(out) + i128::from(back)) / 2) as i64;
        let lasted = self.returned.since(self.sent) as f64;
        let half_width_ns = round_trip_ns / 2 + 1 + (lasted * MAX_DRIFT).ceil() as i64;
        Some(OffsetSample { at: self.returned.0, offset_ns, half_width_ns })
    }
}

/// An offset, and how far it can be off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct OffsetSample {
    at: i64,
    offset_ns: i64,
    half_width_ns: i64,
}

impl OffsetSample {
    /// In which the offset lies at `now`, ns.
    fn interval(&self, now: i64) -> (i64, i64) {
        let half = self.half_width_at(now, MAX_DRIFT);
        (self.offset_ns.saturating_sub(half), self.offset_ns.saturating_add(half))
    }

    fn half_width_at(&self, now: i64, ageing: f64) -> i64 {
        self.half_width_ns.saturating_add((now.saturating_sub(self.at) as f64 * ageing).ceil() as i64)
    }
}

/// Turns exchanges into a [`ClockMap`]. No allocation; bounded work an exchange.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ClockFilter {
    /// The latest exchanges, oldest first.
    window: ArrayVec<OffsetSample, WINDOW>,
    /// The best exchange of each of the last two-second epochs, oldest first: the baseline of the drift.
    epochs: ArrayVec<OffsetSample, EPOCHS>,
    exchanges: u32,
    map: Option<ClockMap>,
    steady: bool,
    /// Whether the newest exchange was not followed.
    is_contradicted: bool,
}

impl ClockFilter {
    /// Takes one exchange; contradictory time stamps are ignored, and so is, once the map is to be steady, an exchange that contradicts those
    /// before it. By how much it does, ns, where it is the first that is not followed.
    pub(crate) fn observe(&mut self, exchange: &Exchange) -> Option<i64> {
        let sample = exchange.sample()?;
        if self.window.last().is_some_and(|last| sample.at < last.at) {
            return None;
        }
        let contradiction_ns = self.contradiction_ns(&sample);
        let is_followed = !self.steady || contradiction_ns <= MAX_CONTRADICTION_NS;
        let was_contradicted = std::mem::replace(&mut self.is_contradicted, !is_followed);
        if !is_followed {
            return (!was_contradicted).then_some(contradiction_ns);
        }
        if self.window.is_full() {
            self.window.remove(0);
        }
        self.window.push(sample);
        self.exchanges = self.exchanges.saturating_add(1);
        self.note_epoch(sample);
        self.update(LocalTime(sample.at));
        None
    }

    /// How far the offset by an exchange lies outside of what those of the window allow, ns; 0 within.
    fn contradiction_ns(&self, sample: &OffsetSample) -> i64 {
        let (low, high) = self.window_bounds(sample.at);
        let (first, last) = sample.interval(sample.at);
        low.saturating_sub(last).max(first.saturating_sub(high)).max(0)
    }

    /// The map from local time to the *server's* time, once there was an exchange.
    #[must_use]
    pub(crate) const fn map(&self) -> Option<ClockMap> {
        self.map
    }

    /// Whether there were enough exchanges to rely on the map.
    #[must_use]
    pub(crate) fn is_agreed(&self) -> bool {
        self.exchanges >= EXCHANGES_TO_AGREE
    }

    /// From now on the map never jumps: errors are mended by running faster or slower, by [`MAX_SLEW`] at most.
    pub(crate) fn keep_steady(&mut self) {
        self.steady = true;
    }

    fn note_epoch(&mut self, sample: OffsetSample) {
        let same_epoch =
            |other: &&mut OffsetSample| other.at.div_euclid(EPOCH_NS) == sample.at.div_euclid(EPOCH_NS);
        match self.epochs.last_mut().filter(same_epoch) {
            Some(best) if best.half_width_ns <= sample.half_width_ns => {}
            Some(best) => *best = sample,
            None => {
                if self.epochs.is_full() {
                    self.epochs.remove(0);
                }
                self.epochs.push(sample);
            }
        }
    }

    fn update(&mut self, now: LocalTime) {
        let (low, high) = self.bounds(now.0);
        let drift = self.drift();
        let estimate = self.estimate(now.0, drift).clamp(low, high);
        let current = match self.map {
            Some(map) if self.steady => map.session(now).0.saturating_sub(now.0),
            _ => estimate,
        };
        let error = |offset: i64| high.saturating_sub(offset).max(offset.saturating_sub(low));
        let slew_ns = estimate.saturating_sub(current);
        let needed_ns = (slew_ns.unsigned_abs() as f64 / MAX_SLEW).ceil() as i64;
        self.map = Some(ClockMap {
            base_local: now.0,
            base_session: now.0.saturating_add(current),
            drift,
            slew_ns,
            slew_span_ns: needed_ns.max(SLEW_SPAN_NS),
            error_ns: error(current).max(error(estimate)).saturating_add(1),
            error_growth: 2.0 * MAX_DRIFT,
        });
    }

    /// The interval in which the offset lies at `now`, by all exchanges of the window.
    fn bounds(&mut self, now: i64) -> (i64, i64) {
        let (low, high) = self.window_bounds(now);
        if low <= high {
            return (low, high);
        }
        // The exchanges contradict each other: a clock was set, or a computer slept. Only the newest counts, and as the first.
        self.exchanges = 1;
        let newest = *self.window.last().expect("called after a push");
        self.window.clear();
        self.window.push(newest);
        self.epochs.clear();
        self.epochs.push(newest);
        newest.interval(now)
    }

    /// What all exchanges of the window say together; the lower bound is above the upper one where they contradict each other.
    fn window_bounds(&self, now: i64) -> (i64, i64) {
        let intervals = self.window.iter().map(|sample| sample.interval(now));
        intervals.fold((i64::MIN, i64::MAX), |(low, high), (a, b)| (low.max(a), high.min(b)))
    }

    /// The offset at `now` by the best exchange of the window.
    fn estimate(&self, now: i64, drift: f64) -> i64 {
        let best = self.window.iter().min_by_key(|sample| sample.half_width_at(now, AGEING));
        let best = best.expect("called after a push");
        let gained = (now.saturating_sub(best.at) as f64 * drift).round() as i64;
        best.offset_ns.saturating_add(gained)
    }

    /// Weighted least squares through the best exchange of every epoch; 0 while that is worse than knowing nothing.
    fn drift(&self) -> f64 {
        let Some(first) = self.epochs.first() else { return 0.0 };
        let shortest = self.epochs.iter().map(|sample| sample.half_width_ns).min().unwrap_or(0);
        // What an exchange's offset is typically off by: a part of what its round trip has beyond the shortest, s.
        let deviation = |sample: &OffsetSample| (sample.half_width_ns - shortest) as f64 * 1e-9 + 10e-6;
        let points = self.epochs.iter().map(|sample| {
            let t = sample.at.saturating_sub(first.at) as f64 * 1e-9;
            let offset = sample.offset_ns.saturating_sub(first.offset_ns) as f64 * 1e-9;
            (deviation(sample).powi(-2), t, offset)
        });
        let sums = points.clone().fold([0.0; 3], |[w, wt, wo], (weight, t, offset)| {
            [w + weight, wt + weight * t, wo + weight * offset]
        });
        let (t_mean, offset_mean) = (sums[1] / sums[0], sums[2] / sums[0]);
        let (spread, slope) = points.fold((0.0, 0.0), |(tt, to), (weight, t, offset)| {
            let t = t - t_mean;
            (tt + weight * t * t, to + weight * t * (offset - offset_mean))
        });
        let uncertainty = spread.sqrt().recip();
        if uncertainty <= DRIFT_KNOWN { (slope / spread).clamp(-MAX_DRIFT, MAX_DRIFT) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// The truth: the server's clock when the local one shows `local`.
    fn server(local: i64, offset: i64, drift: f64) -> i64 {
        local + offset + (local as f64 * drift).round() as i64
    }

    fn exchange(sent: i64, out: i64, back: i64, offset: i64, drift: f64) -> Exchange {
        let received_ns = server(sent + out, offset, drift);
        Exchange {
            sent: LocalTime(sent),
            received_ns,
            answered_ns: received_ns,
            returned: LocalTime(sent + out + back),
        }
    }

    #[test]
    fn symmetric_delay_and_equal_rates_give_the_exact_offset() {
        let mut filter = ClockFilter::default();
        for k in 0..200 {
            filter.observe(&exchange(k * 125_000_000, 3_141_593, 3_141_593, -77_777_777_777, 0.0));
            let map = filter.map().unwrap();
            let local = LocalTime(k * 125_000_000 + 999_999_999);
            assert_eq!(map.session(local).0, local.0 - 77_777_777_777);
            assert_eq!(map.local(map.session(local)), local);
            assert_eq!(map.drift(), 0.0);
            filter.keep_steady();
        }
    }

    #[test]
    fn the_bound_holds_and_time_never_goes_back() {
        for seed in 0..20 {
            let mut random = Pcg64Mcg::seed_from_u64(seed);
            let drift = random.random_range(-1.0..1.0) * 0.99 * MAX_DRIFT;
            let offset = random.random_range(-1_000_000_000_000..1_000_000_000_000);
            let mut filter = ClockFilter::default();
            let mut last = i64::MIN;
            for k in 0..800i64 {
                let sent = k * 125_000_000;
                let mut delay = || 500_000 + (-random.random::<f64>().max(1e-9).ln() * 3e6) as i64;
                let (out, back) = (delay(), delay());
                filter.observe(&exchange(sent, out, back, offset, drift));
                if k == 8 {
                    filter.keep_steady();
                    last = filter.map().unwrap().session(LocalTime(sent)).0 - 1;
                }
                let map = filter.map().unwrap();
                for later in [out + back, 60_000_000, 125_000_000] {
                    let local = LocalTime(sent + later);
                    let error = map.session(local).0 - server(local.0, offset, drift);
                    assert!(error.abs() <= map.error_bound_ns(local), "{error} at exchange {k}, seed {seed}");
                    if k >= 8 && later >= out + back {
                        assert!(map.session(local).0 > last);
                        last = map.session(LocalTime(sent + later.min(100_000_000))).0.max(last);
                    }
                }
            }
            let map = filter.map().unwrap();
            assert!((map.drift() - drift).abs() < 10e-6, "drift {} instead of {drift}", map.drift());
            let end = LocalTime(800 * 125_000_000);
            let error = map.session(end).0 - server(end.0, offset, drift);
            assert!(error.abs() < 1_000_000, "{error} ns after 100 s, seed {seed}");
        }
    }

    #[test]
    fn an_update_is_continuous_and_slews() {
        let mut filter = ClockFilter::default();
        filter.observe(&exchange(0, 40_000_000, 0, 0, 0.0));
        filter.keep_steady();
        let before = filter.map().unwrap();
        filter.observe(&exchange(100_000_000, 1_000_000, 1_000_000, 0, 0.0));
        let after = filter.map().unwrap();
        let joint = LocalTime(102_000_000);
        assert_eq!(before.session(joint), after.session(joint));
        assert_eq!(before.session(joint).0, joint.0 + 20_000_000);
        // 20 ms at 500 ppm take 40 s.
        assert_eq!(after.session(joint.plus_ns(40_000_000_000)).0, joint.0 + 40_000_000_000);
    }

    #[test]
    fn a_clock_that_jumps_after_the_start_is_not_followed_and_one_that_jumps_before_it_is_not_agreed_upon() {
        for jump in [50_000_000, -50_000_000, 5_000_000_000, 1 << 62, -(1 << 62)] {
            let mut filter = ClockFilter::default();
            for k in 0..10 {
                assert_eq!(filter.observe(&exchange(k * 125_000_000, 1_000_000, 1_000_000, 77, 0.0)), None);
            }
            assert!(filter.is_agreed());
            let mut early = filter.clone();
            filter.keep_steady();
            let lie = |k: i64| exchange(k * 125_000_000, 1_000_000, 1_000_000, 77 + jump, 0.0);
            let by_ns = filter.observe(&lie(10)).unwrap();
            assert!((by_ns - jump.abs()).abs() < 5_000_000, "{by_ns} told of {jump}");
            for k in 11..400 {
                assert_eq!(filter.observe(&lie(k)), None, "told once");
            }
            let later = LocalTime(400 * 125_000_000);
            let error = filter.map().unwrap().session(later).0 - (later.0 + 77);
            assert_eq!(error, 0, "after {jump}");

            assert_eq!(early.observe(&lie(10)), None);
            assert!(!early.is_agreed(), "{jump}");
        }
    }

    #[test]
    fn contradictory_stamps_are_ignored() {
        let mut filter = ClockFilter::default();
        let at = LocalTime;
        filter.observe(&Exchange { sent: at(100), received_ns: 10, answered_ns: 5, returned: at(200) });
        filter.observe(&Exchange { sent: at(100), received_ns: 0, answered_ns: 500, returned: at(200) });
        filter.observe(&Exchange {
            sent: at(i64::MIN),
            received_ns: i64::MAX,
            answered_ns: i64::MAX,
            returned: at(i64::MAX),
        });
        assert_eq!(filter.map(), None);
    }
}
