//! A simulated link, one way: an [`Impairment`] made to happen, seeded and on a virtual clock.
//!
//! - **Latency** L: a packet sent at `t` arrives at `t + L`.
//! - **Jitter**: plus an exponentially distributed time of the given mean; a packet that would overtake arrives together with
//!   the one before it.
//! - **Rate limit** R: packets are serialised one after the other, `bytes/R` each, before they travel. A packet that would
//!   wait longer than one second is dropped.
//! - **Loss** (Gilbert–Elliott): a chain of two states steps with every packet; in the bad one it is lost. With loss rate p and
//!   mean burst B, bad → good has probability r = 1/B and good → bad q = r·p/(1 − p), so the long-run loss is
//!   q/(q + r) = p. No chain has bursts shorter than p/(1 − p); there that length is taken.
//! - **Reordering**: a packet that overtakes skips the jitter and the queue: it arrives at `t + L`. Where there is neither, there
//!   is nothing to overtake.
//! - **Duplication**: a second copy, with a jitter of its own, after the first.
//! - **Outage**: what is sent in a stretch of the session's time is lost; what is on its way by then arrives.

use std::collections::VecDeque;

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Impairment;
use rand::{RngExt, SeedableRng};
use rand_distr::Exp1;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};

/// Longest wait in front of a rate limit, ns.
const MAX_QUEUE_NS: i64 = 1_000_000_000;

/// Most packets on the way at one time.
const MAX_IN_FLIGHT: usize = 1 << 16;

/// What a link has done to packets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkCounts {
    /// Packets that were handed to [`SimulatedLink::send`].
    pub sent: u64,
    /// Handed out by [`SimulatedLink::poll_delivery`].
    pub delivered: u64,
    /// Lost by chance, or in an outage.
    pub lost: u64,
    /// Dropped because the queue was full.
    pub dropped: u64,
    /// Let overtake.
    pub reordered: u64,
    /// Sent on twice.
    pub duplicated: u64,
}

/// One direction of a link between two hosts. A plain value: copied, compared and saved whole.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SimulatedLink {
    constants: Constants,
    random: Pcg64Mcg,
    /// When the session's time is 0; not before the session has begun.
    session_origin_ns: Option<i64>,
    /// Whether the loss chain is in its bad state.
    losing: bool,
    /// When the rate limit lets the next packet go.
    free_at_ns: i64,
    /// Latest arrival of a packet that keeps the order.
    last_arrival_ns: i64,
    /// By arrival, then by order of sending.
    in_flight: VecDeque<InFlight>,
    counts: LinkCounts,
    /// Buffers for reuse, and the last delivered packet.
    #[serde(skip)]
    spare: Vec<Vec<u8>>,
    #[serde(skip)]
    delivered: Vec<u8>,
}

/// One packet on its way.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct InFlight {
    arrival_ns: i64,
    bytes: Vec<u8>,
}

/// The impairment in the units of the computation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Constants {
    latency_ns: i64,
    jitter_ns: f64,
    into_loss: f64,
    out_of_loss: f64,
    reorder_rate: f64,
    duplicate_rate: f64,
    ns_per_byte: f64,
    outage_from_ns: i64,
    outage_ns: i64,
}

impl Constants {
    fn new(impairment: &Impairment) -> Self {
        let odds = impairment.loss_rate / (1.0 - impairment.loss_rate);
        let out_of_loss = impairment.loss_burst_packets.max(odds).max(1.0).recip();
        let limit = impairment.rate_limit_bytes_per_s;
        Self {
            latency_ns: (impairment.latency_s * 1e9).round() as i64,
            jitter_ns: impairment.jitter_s * 1e9,
            into_loss: (out_of_loss * odds).min(1.0),
            out_of_loss,
            reorder_rate: impairment.reorder_rate,
            duplicate_rate: impairment.duplicate_rate,
            ns_per_byte: if limit > 0.0 { 1e9 / limit } else { 0.0 },
            outage_from_ns: (impairment.outage_from_s * 1e9).round() as i64,
            outage_ns: (impairment.outage_duration_s * 1e9).round() as i64,
        }
    }
}

/// Two links are equal when they will do the same; buffers kept for reuse do not count.
impl PartialEq for SimulatedLink {
    fn eq(&self, other: &Self) -> bool {
        self.constants == other.constants
            && self.random == other.random
            && self.session_origin_ns == other.session_origin_ns
            && self.losing == other.losing
            && self.free_at_ns == other.free_at_ns
            && self.last_arrival_ns == other.last_arrival_ns
            && self.in_flight == other.in_flight
            && self.counts == other.counts
    }
}

impl SimulatedLink {
    /// The way from one host to another; `seed` is the session's.
    #[must_use]
    pub fn new(impairment: &Impairment, seed: u64, from: HostIndex, to: HostIndex) -> Self {
        // An odd multiplier keeps different ways apart; the generator's own seeding scrambles the rest.
        let way = u64::from(from.0) << 8 | u64::from(to.0);
        let mut random = Pcg64Mcg::seed_from_u64(seed ^ (way + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let constants = Constants::new(impairment);
        let losing = impairment.loss_rate > 0.0 && random.random::<f64>() < impairment.loss_rate;
        Self {
            constants,
            random,
            session_origin_ns: None,
            losing,
            free_at_ns: i64::MIN,
            last_arrival_ns: i64::MIN,
            in_flight: VecDeque::with_capacity(64),
            counts: LinkCounts::default(),
            spare: Vec::new(),
            delivered: Vec::new(),
        }
    }

    /// From now on packets meet another impairment; those on their way arrive as they would have.
    pub fn set_impairment(&mut self, impairment: &Impairment) {
        self.constants = Constants::new(impairment);
    }

    /// Says when the session's time is 0, in the time of this link: from then on there are outages.
    pub fn set_session_origin(&mut self, origin_ns: i64) {
        self.session_origin_ns = Some(origin_ns);
    }

    /// Sends a packet at `now_ns`, which does not go back from call to call. Allocates only until enough buffers are in
    /// use.
    pub fn send(&mut self, now_ns: i64, bytes: &[u8]) {
        self.counts.sent += 1;
        if self.is_out(now_ns) {
            self.counts.lost += 1;
            return;
        }
        if self.happens(self.constants.reorder_rate) {
            self.overtake(now_ns, bytes);
            return;
        }
        let Some(departure_ns) = self.serialise(now_ns, bytes.len()) else {
            self.counts.dropped += 1;
            return;
        };
        if self.is_lost() {
            self.counts.lost += 1;
            return;
        }
        self.travel_in_order(departure_ns, bytes);
        self.perhaps_twice(departure_ns, bytes);
    }

    fn is_out(&self, now_ns: i64) -> bool {
        let Constants { outage_from_ns, outage_ns, .. } = self.constants;
        let since_ns = |origin_ns: i64| now_ns.saturating_sub(origin_ns).saturating_sub(outage_from_ns);
        self.session_origin_ns.map(since_ns).is_some_and(|since_ns| (0..outage_ns).contains(&since_ns))
    }

    fn overtake(&mut self, now_ns: i64, bytes: &[u8]) {
        if self.is_lost() {
            self.counts.lost += 1;
            return;
        }
        self.counts.reordered += 1;
        self.enqueue(now_ns.saturating_add(self.constants.latency_ns), bytes);
        self.perhaps_twice(now_ns, bytes);
    }

    fn perhaps_twice(&mut self, departure_ns: i64, bytes: &[u8]) {
        if self.happens(self.constants.duplicate_rate) {
            self.counts.duplicated += 1;
            self.travel_in_order(departure_ns, bytes);
        }
    }

    /// When the rate limit lets the packet go; `None` when it would wait too long.
    fn serialise(&mut self, now_ns: i64, length: usize) -> Option<i64> {
        if self.constants.ns_per_byte == 0.0 {
            return Some(now_ns);
        }
        let start_ns = now_ns.max(self.free_at_ns);
        if start_ns - now_ns > MAX_QUEUE_NS {
            return None;
        }
        self.free_at_ns =
            start_ns.saturating_add((length as f64 * self.constants.ns_per_byte).round() as i64);
        Some(self.free_at_ns)
    }

    fn is_lost(&mut self) -> bool {
        let lost = self.losing;
        let change = if self.losing { self.constants.out_of_loss } else { self.constants.into_loss };
        self.losing ^= self.happens(change);
        lost
    }

    fn travel_in_order(&mut self, departure_ns: i64, bytes: &[u8]) {
        let jitter_ns = match self.constants.jitter_ns {
            0.0 => 0,
            mean => (mean * self.random.sample::<f64, _>(Exp1)).round() as i64,
        };
        let arrival_ns = departure_ns.saturating_add(self.constants.latency_ns).saturating_add(jitter_ns);
        self.last_arrival_ns = self.last_arrival_ns.max(arrival_ns);
        self.enqueue(self.last_arrival_ns, bytes);
    }

    /// Draws only for what can happen at all, so that a perfect link costs nothing.
    fn happens(&mut self, probability: f64) -> bool {
        probability > 0.0 && self.random.random::<f64>() < probability
    }

    fn enqueue(&mut self, arrival_ns: i64, bytes: &[u8]) {
        if self.in_flight.len() >= MAX_IN_FLIGHT {
            self.counts.dropped += 1;
            return;
        }
        let mut buffer = self.spare.pop().unwrap_or_default();
        buffer.clear();
        buffer.extend_from_slice(bytes);
        let packet = InFlight { arrival_ns, bytes: buffer };
        if self.in_flight.back().is_none_or(|last| last.arrival_ns <= arrival_ns) {
            self.in_flight.push_back(packet);
        } else {
            let place = self.in_flight.partition_point(|other| other.arrival_ns <= arrival_ns);
            self.in_flight.insert(place, packet);
        }
    }

    /// When the next packet arrives, ns.
    #[must_use]
    pub fn next_delivery(&self) -> Option<i64> {
        self.in_flight.front().map(|packet| packet.arrival_ns)
    }

    /// The next packet that has arrived by `now_ns`, and when it did. Does not allocate once as many packets as are on
    /// the way have been delivered.
    pub fn poll_delivery(&mut self, now_ns: i64) -> Option<(i64, &[u8])> {
        if self.next_delivery()? > now_ns {
            return None;
        }
        let packet = self.in_flight.pop_front()?;
        self.counts.delivered += 1;
        let used = std::mem::replace(&mut self.delivered, packet.bytes);
        self.spare.push(used);
        Some((packet.arrival_ns, &self.delivered))
    }

    /// The packets on the way, by arrival: when each arrives, ns, and its bytes, which can be rewritten.
    #[cfg(any(test, feature = "testing"))]
    pub fn in_flight_mut(&mut self) -> impl Iterator<Item = (i64, &mut Vec<u8>)> {
        self.in_flight.iter_mut().map(|packet| (packet.arrival_ns, &mut packet.bytes))
    }

    /// What has happened so far.
    #[must_use]
    pub const fn counts(&self) -> LinkCounts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn link(impairment: Impairment, seed: u64) -> SimulatedLink {
        SimulatedLink::new(&impairment, seed, HostIndex(0), HostIndex(1))
    }

    /// Sends `count` numbered packets of 100 bytes, one a millisecond, and returns (number, transit ns) as delivered.
    fn deliveries(link: &mut SimulatedLink, count: u64) -> Vec<(u64, i64)> {
        let mut delivered = Vec::new();
        for number in 0..=count {
            let now = if number < count { number as i64 * MS } else { i64::MAX };
            while let Some((arrival, bytes)) = link.poll_delivery(now) {
                let number = u64::from_le_bytes(bytes[..8].try_into().unwrap());
                delivered.push((number, arrival - number as i64 * MS));
            }
            if number < count {
                let mut bytes = [0; 100];
                bytes[..8].copy_from_slice(&number.to_le_bytes());
                link.send(now, &bytes);
            }
        }
        delivered
    }

    #[test]
    fn a_perfect_link_delivers_at_once_and_in_order() {
        let mut link = link(Impairment::NONE, 1);
        let expected: Vec<_> = (0..100).map(|number| (number, 0)).collect();
        assert_eq!(deliveries(&mut link, 100), expected);
    }

    #[test]
    fn latency_is_constant_and_not_early() {
        let mut link = link(Impairment { latency_s: 0.0125, ..Impairment::NONE }, 1);
        link.send(0, b"x");
        assert_eq!(link.next_delivery(), Some(12_500_000));
        assert_eq!(link.poll_delivery(12_499_999), None);
        assert_eq!(link.poll_delivery(12_500_000), Some((12_500_000, b"x".as_slice())));
        assert!(deliveries(&mut link, 50).iter().all(|&(_, transit)| transit == 12_500_000));
    }

    #[test]
    fn in_an_outage_of_the_session_nothing_that_is_sent_arrives() {
        let impairment =
            Impairment { latency_s: 0.005, outage_from_s: 0.02, outage_duration_s: 0.03, ..Impairment::NONE };
        let numbers = |origin_ns: Option<i64>| {
            let mut link = link(impairment.clone(), 1);
            origin_ns.into_iter().for_each(|origin_ns| link.set_session_origin(origin_ns));
            let numbers: Vec<u64> =
                deliveries(&mut link, 100).into_iter().map(|(number, _)| number).collect();
            assert_eq!(link.counts().lost, 100 - numbers.len() as u64);
            numbers
        };
        assert_eq!(numbers(None), (0..100).collect::<Vec<_>>(), "the session has not begun");
        assert_eq!(numbers(Some(10 * MS)), (0..30).chain(60..100).collect::<Vec<_>>());
    }

    #[test]
    fn jitter_has_its_mean_and_keeps_the_order() {
        // 0.1 ms of jitter at one packet a millisecond: the order is hardly ever enforced, so the mean is the draw's.
        let impairment = Impairment { latency_s: 0.002, jitter_s: 0.0001, ..Impairment::NONE };
        let delivered = deliveries(&mut link(impairment, 7), 40_000);
        assert!(delivered.is_sorted_by_key(|&(number, _)| number));
        let extra: f64 = delivered.iter().map(|&(_, t)| (t - 2 * MS) as f64).sum::<f64>() / 40_000.0;
        assert!((extra / 100_000.0 - 1.0).abs() < 0.03, "{extra}");
        let strong = Impairment { jitter_s: 0.02, ..Impairment::NONE };
        assert!(deliveries(&mut link(strong, 7), 5_000).is_sorted_by_key(|&(number, _)| number));
    }

    #[test]
    fn losses_have_their_rate_and_burst_length() {
        for (rate, burst) in
            [(0.01, 1.0 / 0.99), (0.1, 4.0), (0.3, 10.0), (0.5, 1.0), (0.05, 1.0), (0.9, 1.0)]
        {
            let impairment = Impairment { loss_rate: rate, loss_burst_packets: burst, ..Impairment::NONE };
            let count = 400_000;
            let delivered = deliveries(&mut link(impairment, 11), count);
            let lost = count - delivered.len() as u64;
            let gaps = delivered.windows(2).filter(|pair| pair[1].0 > pair[0].0 + 1).count();
            let found = (lost as f64 / count as f64, lost as f64 / gaps as f64);
            assert!((found.0 / rate - 1.0).abs() < 0.08, "rate {found:?} instead of {rate}");
            let burst = f64::max(burst, rate / (1.0 - rate));
            assert!((found.1 / burst - 1.0).abs() < 0.08, "burst {found:?} instead of {burst}");
        }
    }

    #[test]
    fn reordered_packets_overtake_and_the_others_keep_their_order() {
        let impairment =
            Impairment { latency_s: 0.001, jitter_s: 0.01, reorder_rate: 0.2, ..Impairment::NONE };
        let mut link = link(impairment, 3);
        let delivered = deliveries(&mut link, 20_000);
        let overtaking = delivered.iter().filter(|&&(_, transit)| transit == MS).count() as f64;
        assert!((overtaking / 4_000.0 - 1.0).abs() < 0.1, "{overtaking}");
        assert_eq!(delivered.len(), 20_000);
        assert!(!delivered.is_sorted_by_key(|&(number, _)| number));
        let others: Vec<_> = delivered.iter().filter(|&&(_, transit)| transit > MS).collect();
        assert!(others.is_sorted_by_key(|&&(number, _)| number));
    }

    #[test]
    fn duplicates_come_after_the_original() {
        let mut link = link(Impairment { duplicate_rate: 0.25, jitter_s: 0.001, ..Impairment::NONE }, 5);
        let delivered = deliveries(&mut link, 20_000);
        let extra = delivered.len() - 20_000;
        assert!((extra as f64 / 5_000.0 - 1.0).abs() < 0.05, "{extra}");
        assert_eq!(link.counts().duplicated, extra as u64);
        assert!(delivered.is_sorted_by_key(|&(number, _)| number));
    }

    #[test]
    fn a_rate_limit_serialises_and_drops_when_the_queue_is_full() {
        // 100-byte packets each millisecond through 50 kB/s: each takes 2 ms.
        let impairment = Impairment { rate_limit_bytes_per_s: 50_000.0, ..Impairment::NONE };
        let mut link = link(impairment, 1);
        let delivered = deliveries(&mut link, 10);
        let expected: Vec<_> = (0..10).map(|k| (k, 2 * MS + k as i64 * MS)).collect();
        assert_eq!(delivered, expected);
        let mut link = SimulatedLink::new(
            &Impairment { rate_limit_bytes_per_s: 50_000.0, ..Impairment::NONE },
            1,
            HostIndex(0),
            HostIndex(1),
        );
        let delivered = deliveries(&mut link, 10_000);
        assert!(delivered.iter().all(|&(_, transit)| transit <= MAX_QUEUE_NS + 2 * MS));
        assert_eq!(link.counts().dropped + delivered.len() as u64, 10_000);
        assert!((5_450..5_550).contains(&delivered.len()), "{}", delivered.len());
    }

    #[test]
    fn is_a_value_and_seeded() {
        let impairment = Impairment {
            latency_s: 0.005,
            jitter_s: 0.003,
            loss_rate: 0.1,
            loss_burst_packets: 3.0,
            reorder_rate: 0.1,
            duplicate_rate: 0.1,
            rate_limit_bytes_per_s: 1e6,
            ..Impairment::NONE
        };
        let mut first = link(impairment.clone(), 9);
        for k in 0..100 {
            first.send(k * MS, &k.to_le_bytes());
            first.poll_delivery(k * MS);
        }
        let text = serde_json::to_string(&first).unwrap();
        let mut second: SimulatedLink = serde_json::from_str(&text).unwrap();
        assert_eq!(first, second);
        assert_eq!(first.clone(), second);
        assert_eq!(deliveries(&mut first, 500), deliveries(&mut second, 500));
        assert_ne!(
            deliveries(&mut link(impairment.clone(), 10), 500),
            deliveries(&mut link(impairment, 11), 500)
        );
    }

    #[test]
    fn bytes_in_flight_can_be_rewritten() {
        let mut link = link(Impairment { latency_s: 0.01, ..Impairment::NONE }, 1);
        link.send(0, b"one");
        link.send(1, b"two");
        for (_, bytes) in link.in_flight_mut() {
            bytes.reverse();
        }
        assert_eq!(link.in_flight_mut().map(|(at, _)| at).collect::<Vec<_>>(), [10 * MS, 10 * MS + 1]);
        assert_eq!(link.poll_delivery(i64::MAX), Some((10 * MS, b"eno".as_slice())));
    }
}
