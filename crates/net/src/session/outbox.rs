//! What an endpoint has to say, until it is taken.

use std::collections::VecDeque;

use super::event::Event;
use crate::wire::Transmit;

/// Most datagrams that wait to be sent; more are dropped, as a socket would.
const MAX_TRANSMITS: usize = 512;
/// Most events that wait to be taken. States are dropped at half of it, so that they never displace the others.
const MAX_EVENTS: usize = 2048;

/// Datagrams and events that led to nothing, and why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Not readable: see [`WireError`](crate::wire::WireError).
    pub malformed: u64,
    /// Of another protocol version.
    pub other_version: u64,
    /// Not from a route and a peer that takes part.
    pub unknown_sender: u64,
    /// Datagrams of another session.
    pub wrong_session: u64,
    /// Readable, but not what was to be expected: stale answers, samples of impossible times.
    pub unexpected: u64,
    /// States that came twice.
    pub duplicates: u64,
    /// Joins that were turned away.
    pub refused: u64,
    /// Datagrams to send or events that nobody took in time.
    pub overflowed: u64,
}

/// Datagrams for peers and events for the caller. Does not allocate while they are taken in time.
#[derive(Clone, Debug)]
pub(super) struct Outbox {
    transmits: VecDeque<Transmit>,
    events: VecDeque<Event>,
    pub(super) counters: Counters,
}

impl Outbox {
    pub(super) fn new() -> Self {
        Self {
            transmits: VecDeque::with_capacity(64),
            events: VecDeque::with_capacity(64),
            counters: Counters::default(),
        }
    }

    pub(super) fn send(&mut self, transmit: Transmit) {
        if self.transmits.len() < MAX_TRANSMITS {
            self.transmits.push_back(transmit);
        } else {
            self.counters.overflowed += 1;
        }
    }

    pub(super) fn tell(&mut self, event: Event) {
        let room = if matches!(event, Event::State { .. }) { MAX_EVENTS / 2 } else { MAX_EVENTS };
        if self.events.len() < room {
            self.events.push_back(event);
        } else {
            self.counters.overflowed += 1;
        }
    }

    pub(super) fn next_transmit(&mut self) -> Option<Transmit> {
        self.transmits.pop_front()
    }

    pub(super) fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }
}
