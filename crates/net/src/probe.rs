//! Measuring a link, as Fotoohi Ghiam 2006, Table 1.1, does: numbered packets with the time of sending go out at a rate and are sent
//! back at once.
//!
//! With `r_i` the round trips: mean and standard deviation (the rms jitter), percentiles, share lost; by [`RateSweep`] the largest
//! rate with less than 0.1 % lost; and by [`ProbeReport::impairment`] the simulated link that resembles the measured one.

use cotouch_scene::scene::Impairment;
use cotouch_scene::time::{LocalTime, Rate};
use serde::{Deserialize, Serialize};

use crate::route::Route;
use crate::statistics::{RoundTrip, RoundTripMeter};
use crate::wire::{DatagramBytes, DatagramKind, HEADER_BYTES, Header, MAX_DATAGRAM, Transmit, open, seal};

/// Shortest probe, bytes: header, number, time.
const MIN_PROBE_BYTES: usize = HEADER_BYTES + 16;

/// Most packets of one measurement (19 hours at 1 kHz); it bounds the memory to 8 MB.
const MAX_PACKETS: u64 = 1 << 26;

/// A rate counts as achieved with less than this share lost.
const TOLERATED_LOSS: f64 = 0.001;

/// A rate counts as achieved when the sender kept up to this share of it.
const KEPT_UP: f64 = 0.98;
/// A sweep ends when the bounds are this close.
const SWEEP_RESOLUTION: f64 = 1.1;

/// What to measure with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeConfig {
    /// Packets a second.
    pub rate_hz: Rate,
    /// For so long, s.
    pub duration_s: f64,
    /// Size of every datagram without UDP and IP headers; clamped to what is possible.
    pub datagram_bytes: usize,
    /// How long to wait for stragglers after the last packet, s.
    pub linger_s: f64,
    /// Random; tells the echoes of this measurement from others.
    pub id: u64,
}

/// The measuring side. Its memory is reserved when it is made.
#[derive(Clone, Debug)]
pub struct Prober {
    config: ProbeConfig,
    target: Route,
    start: LocalTime,
    total: u64,
    sent: u64,
    last_sent: LocalTime,
    /// Bit n: the echo of packet n came.
    arrived: Vec<u64>,
    received: u64,
    duplicates: u64,
    reordered: u64,
    newest: Option<u64>,
    round_trip: RoundTripMeter,
}

/// What a measurement found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProbeReport {
    /// Packets sent.
    pub sent: u64,
    /// Different packets that came back.
    pub received: u64,
    /// Packets that did not (yet).
    pub lost: u64,
    /// Packets that came back after one that was sent later.
    pub reordered: u64,
    /// Extra copies that came back.
    pub duplicates: u64,
    /// Mean number of packets lost in a row; 0 without loss.
    pub loss_burst_packets: f64,
    /// Packets a second as really sent.
    pub sent_rate_hz: f64,
    /// Round-trip times.
    pub round_trip: RoundTrip,
}

impl Prober {
    /// Sends to `target` from `now` on.
    #[must_use]
    pub fn new(config: ProbeConfig, target: Route, now: LocalTime) -> Self {
        let wanted = (config.rate_hz.hz() * config.duration_s.max(0.0)).round() as u64;
        let total = wanted.clamp(1, MAX_PACKETS);
        Self {
            config,
            target,
            start: now,
            total,
            sent: 0,
            last_sent: now,
            arrived: vec![0; total.div_ceil(64) as usize],
            received: 0,
            duplicates: 0,
            reordered: 0,
            newest: None,
            round_trip: RoundTripMeter::default(),
        }
    }

    /// The next packet that is due, stamped with `now`. A caller who is late gets all that are due, one a call.
    pub fn poll_transmit(&mut self, now: LocalTime) -> Option<Transmit> {
        if self.sent == self.total || now < self.due(self.sent) {
            return None;
        }
        let mut bytes = DatagramBytes::from([0; MAX_DATAGRAM]);
        bytes.truncate(self.config.datagram_bytes.clamp(MIN_PROBE_BYTES, MAX_DATAGRAM));
        bytes[HEADER_BYTES..][..8].copy_from_slice(&self.sent.to_le_bytes());
        bytes[HEADER_BYTES + 8..][..8].copy_from_slice(&now.0.to_le_bytes());
        seal(Header { kind: DatagramKind::Probe, sender: None, session: self.config.id }, &mut bytes);
        self.sent += 1;
        self.last_sent = now;
        Some(Transmit { to: self.target, bytes })
    }

    /// When to poll again at the latest; `None` when all were sent and came back.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<LocalTime> {
        if self.sent < self.total {
            Some(self.due(self.sent))
        } else {
            (self.received < self.total).then(|| self.end())
        }
    }

    /// Takes a datagram; what is not an echo of this measurement is ignored.
    pub fn handle_datagram(&mut self, now: LocalTime, from: Route, bytes: &[u8]) {
        let Some((id, number, sent)) = read(bytes, DatagramKind::Echo) else { return };
        if id != self.config.id || from != self.target || number >= self.sent {
            return;
        }
        let (word, mask) = ((number / 64) as usize, 1 << (number % 64));
        if self.arrived[word] & mask != 0 {
            self.duplicates += 1;
            return;
        }
        self.arrived[word] |= mask;
        self.received += 1;
        self.reordered += u64::from(self.newest.is_some_and(|newest| number < newest));
        self.newest = self.newest.max(Some(number));
        self.round_trip.record(now.since(sent));
    }

    /// Whether there is nothing more to wait for.
    #[must_use]
    pub fn is_finished(&self, now: LocalTime) -> bool {
        self.sent == self.total && (self.received == self.total || now >= self.end())
    }

    /// What was found so far. Before the end, packets on their way count as lost.
    #[must_use]
    pub fn report(&self) -> ProbeReport {
        let lost = self.sent - self.received;
        let runs = self.loss_runs();
        let spacings = self.sent.saturating_sub(1) as f64;
        let sending_s = self.last_sent.since(self.start) as f64 * 1e-9;
        ProbeReport {
            sent: self.sent,
            received: self.received,
            lost,
            reordered: self.reordered,
            duplicates: self.duplicates,
            loss_burst_packets: if runs > 0 { lost as f64 / runs as f64 } else { 0.0 },
            sent_rate_hz: if sending_s > 0.0 { spacings / sending_s } else { 0.0 },
            round_trip: self.round_trip.summary(),
        }
    }

    /// Runs of packets that did not come back.
    fn loss_runs(&self) -> u64 {
        let has_arrived = |n: u64| self.arrived[(n / 64) as usize] >> (n % 64) & 1 == 1;
        (0..self.sent).filter(|&n| !has_arrived(n) && (n == 0 || has_arrived(n - 1))).count() as u64
    }

    fn due(&self, number: u64) -> LocalTime {
        self.start.plus_ns(self.config.rate_hz.instant(number).0)
    }

    fn end(&self) -> LocalTime {
        self.last_sent.plus_ns((self.config.linger_s * 1e9) as i64)
    }
}

/// The reflecting side: the echo of a probe, as long as the probe and to be sent to where that came from; `None` for anything
/// else, an echo included, so that two reflectors never keep each other busy.
#[must_use]
pub fn reflect_probe(bytes: &[u8]) -> Option<DatagramBytes> {
    let (id, _, _) = read(bytes, DatagramKind::Probe)?;
    let mut echo = DatagramBytes::try_from(bytes).ok()?;
    seal(Header { kind: DatagramKind::Echo, sender: None, session: id }, &mut echo);
    Some(echo)
}

/// Id, number and time of sending.
fn read(bytes: &[u8], kind: DatagramKind) -> Option<(u64, u64, LocalTime)> {
    let (header, body) = open(bytes).ok().filter(|(header, _)| header.kind == kind)?;
    let (number, rest) = body.split_first_chunk()?;
    let (sent, _) = rest.split_first_chunk()?;
    Some((header.session, u64::from_le_bytes(*number), LocalTime(i64::from_le_bytes(*sent))))
}

impl ProbeReport {
    /// Share lost of what was sent.
    #[must_use]
    pub fn loss_rate(&self) -> f64 {
        if self.sent == 0 { 0.0 } else { self.lost as f64 / self.sent as f64 }
    }

    /// The impairment of one way that, on both ways, resembles what was measured; both ways are taken as alike.
    ///
    /// - Latency: half the shortest round trip.
    /// - Jitter: half the mean of what round trips have beyond the shortest.
    /// - Loss p: a packet comes back with probability `(1 − p)²`; bursts as long as those measured.
    /// - Overtaking and duplication: half of what was counted; a rough guess.
    #[must_use]
    pub fn impairment(&self) -> Impairment {
        let half_share = |count: u64| match self.received {
            0 => 0.0,
            received => (0.5 * count as f64 / received as f64).min(0.99),
        };
        Impairment {
            latency_s: 0.5 * self.round_trip.min_s,
            jitter_s: 0.5 * (self.round_trip.mean_s - self.round_trip.min_s).max(0.0),
            loss_rate: (1.0 - (1.0 - self.loss_rate()).sqrt()).clamp(0.0, 0.99),
            loss_burst_packets: self.loss_burst_packets.max(1.0),
            reorder_rate: half_share(self.reordered),
            duplicate_rate: half_share(self.duplicates),
            rate_limit_bytes_per_s: 0.0,
            ..Impairment::NONE
        }
    }
}

/// The search for the largest rate with less than 0.1 % lost: doubling until a rate fails, then halving the interval (of the
/// logarithm) to within 10 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateSweep {
    lowest_hz: f64,
    highest_hz: f64,
    achieved_hz: Option<f64>,
    failed_hz: Option<f64>,
}

impl RateSweep {
    /// Between two rates, Hz; `highest_hz` is raised to `lowest_hz` if need be.
    #[must_use]
    pub fn new(lowest_hz: f64, highest_hz: f64) -> Self {
        Self { lowest_hz, highest_hz: highest_hz.max(lowest_hz), achieved_hz: None, failed_hz: None }
    }

    /// The next rate to measure, Hz; `None` when the answer is known.
    #[must_use]
    pub fn next_rate(&self) -> Option<f64> {
        match (self.achieved_hz, self.failed_hz) {
            (None, None) => Some(self.lowest_hz),
            (None, Some(_)) => None,
            (Some(good), None) => (good < self.highest_hz).then(|| (2.0 * good).min(self.highest_hz)),
            (Some(good), Some(bad)) => (bad > SWEEP_RESOLUTION * good).then(|| (good * bad).sqrt()),
        }
    }

    /// Takes what was found at `rate_hz`.
    pub fn record(&mut self, rate_hz: f64, report: &ProbeReport) {
        if report.loss_rate() < TOLERATED_LOSS && report.sent_rate_hz >= KEPT_UP * rate_hz {
            self.achieved_hz = Some(self.achieved_hz.map_or(rate_hz, |best| best.max(rate_hz)));
        } else {
            self.failed_hz = Some(self.failed_hz.map_or(rate_hz, |worst| worst.min(rate_hz)));
        }
    }

    /// The largest rate that was achieved, Hz; `None` when not even the lowest was.
    #[must_use]
    pub const fn achievable_rate_hz(&self) -> Option<f64> {
        self.achieved_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::SimulatedLink;
    use cotouch_scene::names::HostIndex;

    fn route(address: &str) -> Route {
        address.parse::<std::net::SocketAddr>().unwrap().into()
    }

    fn target() -> Route {
        route("192.0.2.1:7701")
    }

    fn measure(impairment: &Impairment, rate: &str, duration_s: f64) -> ProbeReport {
        let rate_hz = rate.parse().unwrap();
        let config = ProbeConfig { rate_hz, duration_s, datagram_bytes: 128, linger_s: 2.0, id: 42 };
        let mut prober = Prober::new(config, target(), LocalTime(1_000));
        let mut out = SimulatedLink::new(impairment, 1, HostIndex(0), HostIndex(1));
        let mut back = SimulatedLink::new(impairment, 1, HostIndex(1), HostIndex(0));
        let mut now = LocalTime(1_000);
        while !prober.is_finished(now) {
            while let Some(transmit) = prober.poll_transmit(now) {
                out.send(now.0, &transmit.bytes);
            }
            while let Some((arrival, bytes)) = out.poll_delivery(now.0) {
                let echo = reflect_probe(bytes).expect("a probe is reflected");
                assert_eq!(reflect_probe(&echo), None);
                assert_eq!(echo.len(), bytes.len());
                back.send(arrival, &echo);
            }
            while let Some((arrival, bytes)) = back.poll_delivery(now.0) {
                prober.handle_datagram(LocalTime(arrival), target(), bytes);
            }
            let next = [out.next_delivery(), back.next_delivery(), prober.poll_timeout().map(|t| t.0)];
            now = LocalTime(next.into_iter().flatten().min().unwrap_or(now.0).max(now.0));
        }
        prober.report()
    }

    #[test]
    fn a_perfect_link_is_measured_exactly() {
        let report = measure(&Impairment { latency_s: 0.001, ..Impairment::NONE }, "1000", 3.0);
        assert_eq!((report.sent, report.received, report.lost, report.reordered), (3000, 3000, 0, 0));
        assert!((report.round_trip.mean_s - 0.002).abs() < 1e-12 && report.round_trip.rms_jitter_s < 1e-12);
        assert!((report.sent_rate_hz - 1000.0).abs() < 1e-6);
        assert_eq!(report.impairment(), Impairment { latency_s: 0.001, ..Impairment::NONE });
    }

    #[test]
    fn the_estimate_resembles_the_link() {
        let link = Impairment {
            latency_s: 0.004,
            jitter_s: 0.0002,
            loss_rate: 0.05,
            loss_burst_packets: 3.0,
            ..Impairment::NONE
        };
        let estimate = measure(&link, "500", 200.0).impairment();
        let near = |found: f64, truth: f64| (found / truth - 1.0).abs() < 0.1;
        assert!(near(estimate.latency_s, link.latency_s), "{estimate:?}");
        assert!(near(estimate.jitter_s, link.jitter_s), "{estimate:?}");
        assert!(near(estimate.loss_rate, link.loss_rate), "{estimate:?}");
        assert!(near(estimate.loss_burst_packets, link.loss_burst_packets), "{estimate:?}");
        assert_eq!(estimate.reorder_rate, 0.0);
    }

    #[test]
    fn copies_and_overtaking_are_counted_apart_from_loss() {
        let link = Impairment { jitter_s: 0.01, reorder_rate: 0.1, duplicate_rate: 0.1, ..Impairment::NONE };
        let report = measure(&link, "1000", 5.0);
        assert_eq!((report.lost, report.received), (0, 5000));
        assert!(report.reordered > 100 && report.duplicates > 300, "{report:?}");
    }

    #[test]
    fn a_sweep_finds_the_rate_limit() {
        // 128-byte packets through 256 kB/s: 2000 a second.
        let link = Impairment { rate_limit_bytes_per_s: 256_000.0, ..Impairment::NONE };
        let mut sweep = RateSweep::new(125.0, 64_000.0);
        while let Some(rate) = sweep.next_rate() {
            let report = measure(&link, &rate.round().to_string(), 4.0);
            sweep.record(rate.round(), &report);
        }
        let found = sweep.achievable_rate_hz().unwrap();
        // A little more than the limit passes for 4 s, because the queue takes up to a second's worth.
        assert!((1_800.0..=2_700.0).contains(&found), "{found}");
    }

    #[test]
    fn a_sender_that_cannot_keep_up_has_not_achieved_the_rate() {
        let mut sweep = RateSweep::new(1000.0, 4000.0);
        let report =
            |sent_rate_hz| ProbeReport { sent: 1000, received: 1000, sent_rate_hz, ..ProbeReport::default() };
        sweep.record(1000.0, &report(999.0));
        assert_eq!(sweep.next_rate(), Some(2000.0));
        sweep.record(2000.0, &report(1500.0));
        assert_eq!(sweep.achievable_rate_hz(), Some(1000.0));
    }

    #[test]
    fn foreign_and_damaged_datagrams_are_ignored() {
        let rate_hz = "100".parse().unwrap();
        let config = ProbeConfig { rate_hz, duration_s: 1.0, datagram_bytes: 0, linger_s: 1.0, id: 1 };
        let mut prober = Prober::new(config, target(), LocalTime(0));
        let probe = prober.poll_transmit(LocalTime(0)).unwrap();
        assert_eq!(probe.bytes.len(), MIN_PROBE_BYTES);
        let echo = reflect_probe(&probe.bytes).unwrap();
        let mut damaged = echo.clone();
        damaged[30] ^= 1;
        prober.handle_datagram(LocalTime(5), target(), &damaged);
        prober.handle_datagram(LocalTime(5), target(), &probe.bytes);
        prober.handle_datagram(LocalTime(5), route("192.0.2.9:1"), &echo);
        assert_eq!(prober.report().received, 0);
        prober.handle_datagram(LocalTime(5), target(), &echo);
        prober.handle_datagram(LocalTime(6), target(), &echo);
        assert_eq!((prober.report().received, prober.report().duplicates), (1, 1));
    }
}
