//! The session's time at one host.

use cotouch_scene::time::{LocalTime, SessionTime};

use crate::clock::{ClockFilter, ClockMap, Exchange};

/// A session that has not begun begins no later than this, ns.
const MAX_START_DELAY_NS: i64 = 60_000_000_000;
/// No session lasts longer, ns: a year.
const MAX_SESSION_NS: i64 = 365 * 86_400_000_000_000;

/// The session's time: the server's clock, counted from tick 0.
#[derive(Clone, Debug)]
pub(super) struct Timekeeping {
    /// Nothing at the server, whose clock it is.
    filter: Option<ClockFilter>,
    /// Instant of tick 0 on the server's clock, ns.
    origin_ns: Option<i64>,
    /// Whether the caller knows that the clock is agreed upon.
    is_ready: bool,
    /// Whether the caller knows when tick 0 is.
    has_started: bool,
}

impl Timekeeping {
    /// The time at the server, whose clock counts.
    pub(super) const fn keeper() -> Self {
        Self { filter: None, origin_ns: None, is_ready: true, has_started: false }
    }

    /// At a host that follows the server's clock.
    pub(super) fn follower() -> Self {
        Self { filter: Some(ClockFilter::default()), origin_ns: None, is_ready: false, has_started: false }
    }

    /// The map from this host's clock, once the caller knows when tick 0 is.
    pub(super) fn map(&self) -> Option<ClockMap> {
        let origin_ns = self.origin_ns.filter(|_| self.has_started)?;
        match &self.filter {
            None => Some(ClockMap::exact(LocalTime(origin_ns))),
            Some(filter) => Some(filter.map()?.with_origin(origin_ns)),
        }
    }

    pub(super) fn session(&self, now: LocalTime) -> Option<SessionTime> {
        self.map().map(|map| map.session(now))
    }

    pub(super) fn is_agreed(&self) -> bool {
        self.filter.as_ref().is_none_or(ClockFilter::is_agreed)
    }

    /// Whether the caller knows that the clock is agreed upon.
    pub(super) const fn is_ready(&self) -> bool {
        self.is_ready
    }

    pub(super) const fn origin_ns(&self) -> Option<i64> {
        self.origin_ns
    }

    /// Takes an exchange with the server; by how much it contradicts those before, ns, where it is the first that is not followed.
    pub(super) fn observe(&mut self, exchange: &Exchange) -> Option<i64> {
        self.filter.as_mut()?.observe(exchange)
    }

    /// Whether the time that the session would start with, if it is known, is one that a session can have.
    pub(super) fn start_can_be(&self, now: LocalTime) -> bool {
        let map = self.filter.as_ref().and_then(ClockFilter::map);
        let session = map.zip(self.origin_ns).map(|(map, origin_ns)| map.with_origin(origin_ns).session(now));
        session.is_none_or(|session| (-MAX_START_DELAY_NS..=MAX_SESSION_NS).contains(&session.0))
    }

    /// The origin is set once; a running session's time never jumps.
    pub(super) fn set_origin(&mut self, origin_ns: Option<i64>) {
        self.origin_ns = self.origin_ns.or(origin_ns);
    }

    /// Whether the caller knows when tick 0 is.
    pub(super) const fn has_started(&self) -> bool {
        self.has_started
    }

    /// Whether the clock is agreed upon and nobody was told yet; from now on it is ready.
    pub(super) fn become_ready(&mut self) -> bool {
        self.is_agreed() && !std::mem::replace(&mut self.is_ready, true)
    }

    /// Whether tick 0 is set and nobody was told yet; from now on the session has started.
    pub(super) fn start(&mut self) -> bool {
        let starts = self.origin_ns.is_some() && !self.has_started;
        if starts {
            self.has_started = true;
            self.filter.iter_mut().for_each(ClockFilter::keep_steady);
        }
        starts
    }
}
