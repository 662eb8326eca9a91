//! What an endpoint remembers of another.

use arrayvec::ArrayVec;
use cotouch_scene::limits::{MAX_RETRY_S, MAX_SILENCE_S};
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::LocalTime;

use super::config::MILLISECOND;
use super::trust::Trust;
use crate::backoff::Backoff;
use crate::message::PeerId;
use crate::route::Route;
use crate::statistics::{LinkStatistics, RoundTripMeter, SequenceTracker};

/// Between pings of peers that are present and send states too, and at most between those of others: 8 Hz.
pub(super) const PING_PERIOD_NS: i64 = (MAX_RETRY_S * 1e9) as i64;
/// Between pings while the clock is not agreed upon.
const BURST_PERIOD_NS: i64 = 20 * MILLISECOND;
/// A lost peer is sent samples for so long after it was heard.
pub(super) const REACHABLE_NS: i64 = (MAX_SILENCE_S * 1e9) as i64;
/// Pings that may wait for their answers: 2.5 s of round trip in a burst, and more afterwards.
const OPEN_PINGS: usize = 128;
/// Unanswered pings after which a burst gives way to pauses.
const MAX_BURST: u32 = 100;

/// Whether a peer is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// Announced by the server, not heard yet.
    Expected,
    /// A sample came within the time-out, or any word from one that has sent none yet.
    Present,
    /// It has sent no sample that could be used for longer than the time-out.
    Lost,
    /// It has said good-bye, or was expelled.
    Left,
}

/// What an endpoint remembers of another.
#[derive(Clone, Debug)]
pub(super) struct Peer {
    pub(super) host: HostIndex,
    pub(super) id: PeerId,
    pub(super) route: Route,
    pub(super) presence: Presence,
    /// Whether the caller was told of it.
    pub(super) introduced: bool,
    /// Whether it is a new life of the peer of which the caller was not told yet.
    pub(super) restarted: bool,
    /// Anything at all.
    pub(super) last_heard: LocalTime,
    /// A sample of this life that was young enough and could be.
    pub(super) last_sample: Option<LocalTime>,
    /// Whether anything was heard within [`REACHABLE_NS`], so that it is worth sending to.
    pub(super) is_reachable: bool,
    pub(super) trust: Trust,
    pub(super) next_ping: LocalTime,
    pub(super) unanswered: u32,
    open_pings: ArrayVec<LocalTime, OPEN_PINGS>,
    /// Whether its clock is agreed upon (it says so).
    pub(super) ready: bool,
    /// The roster that it is to know (server only).
    pub(super) roster: Backoff,
    pub(super) roster_known: bool,
    /// Another who wants this one's place, and since when (server only).
    pub(super) contender: Option<(PeerId, LocalTime)>,
    pub(super) sent: u64,
    pub(super) late: u64,
    pub(super) stale: u64,
    pub(super) implausible: u64,
    pub(super) sequence: SequenceTracker,
    pub(super) round_trip: RoundTripMeter,
}

impl Peer {
    pub(super) fn new(host: HostIndex, id: PeerId, route: Route, now: LocalTime) -> Self {
        Self {
            host,
            id,
            route,
            presence: Presence::Expected,
            introduced: false,
            restarted: false,
            last_heard: now,
            last_sample: None,
            is_reachable: false,
            trust: Trust::default(),
            next_ping: now,
            unanswered: 0,
            open_pings: ArrayVec::new(),
            ready: false,
            roster: Backoff::from(now),
            roster_known: false,
            contender: None,
            sent: 0,
            late: 0,
            stale: 0,
            implausible: 0,
            sequence: SequenceTracker::default(),
            round_trip: RoundTripMeter::default(),
        }
    }

    /// A new life of the peer took its place; statistics go on.
    pub(super) fn restart(&mut self, id: PeerId, route: Route, now: LocalTime) {
        // One that said good-bye is a newcomer again.
        self.introduced &= self.presence != Presence::Left;
        self.restarted = self.introduced;
        self.presence = Presence::Expected;
        self.id = id;
        self.route = route;
        self.last_heard = now;
        self.last_sample = None;
        self.is_reachable = false;
        self.trust = Trust::default();
        self.next_ping = now;
        self.unanswered = 0;
        self.open_pings.clear();
        self.ready = false;
        self.roster = Backoff::from(now);
        self.roster_known = false;
        self.contender = None;
        self.sequence.restart();
    }

    /// When it last showed that it takes part: by a sample, or by any word as long as it has never sent one.
    pub(super) fn last_sign(&self) -> LocalTime {
        self.last_sample.unwrap_or(self.last_heard)
    }

    /// Whether samples are sent to it: also to one that is lost, which may well hear this host, and returns by the first sample
    /// that gets through; after long silence, only once it speaks.
    pub(super) fn takes_samples(&self) -> bool {
        match self.presence {
            Presence::Present => true,
            Presence::Lost => self.is_reachable,
            Presence::Expected | Presence::Left => false,
        }
    }

    /// When something about it is to be done next.
    pub(super) fn due(&self, timeout_ns: i64, tells_roster: bool) -> Option<LocalTime> {
        if self.presence == Presence::Left {
            return None;
        }
        let silence = match self.presence {
            Presence::Present => Some(self.last_sign().plus_ns(timeout_ns)),
            Presence::Lost if self.is_reachable => Some(self.last_heard.plus_ns(REACHABLE_NS)),
            _ => None,
        };
        let roster = (tells_roster && !self.roster_known && self.presence == Presence::Present)
            .then(|| self.roster.due());
        [Some(self.next_ping), silence, roster].into_iter().flatten().min()
    }

    /// A ping goes out; while the peer is present, the next does after `period_ns`, else no later than that.
    pub(super) fn note_ping(&mut self, now: LocalTime, in_burst: bool, period_ns: i64) {
        if self.open_pings.is_full() {
            self.open_pings.remove(0);
        }
        self.open_pings.push(now);
        let pause_ns = match self.presence {
            _ if in_burst && self.unanswered < MAX_BURST => BURST_PERIOD_NS,
            Presence::Present => period_ns,
            _ => Backoff::pause_after(self.unanswered).min(period_ns),
        };
        self.unanswered = self.unanswered.saturating_add(1);
        self.next_ping = now.plus_ns(pause_ns);
    }

    /// Whether a ping of that time waits for its answer; it does so no longer.
    pub(super) fn take_ping(&mut self, sent: LocalTime) -> bool {
        let Some(index) = self.open_pings.iter().position(|&open| open == sent) else { return false };
        self.open_pings.remove(index);
        self.unanswered = 0;
        true
    }

    pub(super) fn statistics(&self) -> LinkStatistics {
        LinkStatistics {
            sent: self.sent,
            sequence: self.sequence.counts(),
            late: self.late,
            stale: self.stale,
            implausible: self.implausible,
            round_trip: self.round_trip.summary(),
        }
    }
}
