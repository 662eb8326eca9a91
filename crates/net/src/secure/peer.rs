//! What a node remembers of another.

use arrayvec::ArrayVec;
use cotouch_scene::time::LocalTime;
use snow::HandshakeState;

use super::channel::Channel;
use super::frame::{Kind, MAX_SEALED};
use super::key::PublicKey;
use super::noise::take_answer;
use crate::backoff::Backoff;
use crate::route::Route;

/// Calls that may still be answered: with pauses of half a second, 4 s of round trip.
const MAX_CALLS: usize = 8;
/// Channels to one peer: two hosts that call each other at once make two.
const MAX_CHANNELS: usize = 2;
/// A peer that is sent to and not heard for so long is called again.
const UNANSWERED_NS: i64 = 1_500_000_000;
/// A peer is called for so long after it was last sent to.
const WANTED_NS: i64 = 2_000_000_000;

/// A call that waits for its answer.
#[derive(Debug)]
pub(super) struct OpenCall {
    pub(super) number: u64,
    /// The number of the channel here.
    pub(super) channel: u32,
    pub(super) handshake: HandshakeState,
}

/// Another host, known by its key.
#[derive(Debug)]
pub(super) struct Peer {
    pub(super) key: PublicKey,
    pub(super) route: Route,
    /// Where its newest authenticated datagram came from, or where it is said to be.
    pub(super) address: Option<Route>,
    /// The newest last.
    pub(super) channels: ArrayVec<Channel, MAX_CHANNELS>,
    calls: ArrayVec<OpenCall, MAX_CALLS>,
    /// Numbers of the calls that made or did not make the newest channel: answers to them are of no use any more.
    done_calls: ArrayVec<u64, MAX_CALLS>,
    next_call: Backoff,
    /// When its newest first message was made, on its clock.
    pub(super) newest_call: Option<LocalTime>,
    pub(super) last_heard: LocalTime,
    unanswered_since: Option<LocalTime>,
    wanted_at: Option<LocalTime>,
}

impl Peer {
    pub(super) fn new(key: PublicKey, now: LocalTime) -> Self {
        Self {
            key,
            route: key.route(),
            address: None,
            channels: ArrayVec::new(),
            calls: ArrayVec::new(),
            done_calls: ArrayVec::new(),
            next_call: Backoff::from(now),
            newest_call: None,
            last_heard: now,
            unanswered_since: None,
            wanted_at: None,
        }
    }

    /// Somebody wants to say something to it.
    pub(super) fn note_wanted(&mut self, now: LocalTime) {
        self.wanted_at = Some(now);
    }

    /// Seals through the newest channel; where to send it and its length.
    pub(super) fn seal(
        &mut self,
        now: LocalTime,
        kind: Kind,
        said: &[u8],
        out: &mut [u8; MAX_SEALED],
    ) -> Option<(Route, usize)> {
        let address = self.address?;
        let length = self.channels.last_mut()?.seal(kind, said, out)?;
        self.unanswered_since.get_or_insert(now);
        Some((address, length))
    }

    /// An authenticated datagram came from `from`; the newest says where it is.
    pub(super) fn note_heard(&mut self, now: LocalTime, from: Route, is_newest: bool) {
        self.last_heard = self.last_heard.max(now);
        self.unanswered_since = None;
        if is_newest {
            self.address = Some(from);
        }
    }

    /// Whether there is a channel, and no reason to think that the other has forgotten it.
    pub(super) fn is_reached(&self, now: LocalTime) -> bool {
        let is_unanswered = self.unanswered_since.is_some_and(|since| now.since(since) >= UNANSWERED_NS);
        !self.channels.is_empty() && !is_unanswered
    }

    /// When to call it (again), if somebody wants it.
    pub(super) fn call_due(&self) -> Option<LocalTime> {
        let wanted_until = self.wanted_at?.plus_ns(WANTED_NS);
        let lost_at = match self.unanswered_since {
            _ if self.channels.is_empty() => LocalTime(i64::MIN),
            Some(since) => since.plus_ns(UNANSWERED_NS),
            None => return None,
        };
        let due = lost_at.max(self.next_call.due());
        (due <= wanted_until).then_some(due)
    }

    /// A call is made at `now`.
    pub(super) fn note_calling(&mut self, now: LocalTime) {
        self.next_call.again(now);
    }

    /// A call that was made waits for its answer; the oldest of too many does no longer.
    pub(super) fn await_answer(&mut self, call: OpenCall) {
        if self.calls.is_full() {
            self.calls.remove(0);
        }
        self.calls.push(call);
    }

    pub(super) fn has_called(&self, number: u64) -> bool {
        self.calls.iter().any(|call| call.number == number)
    }

    /// Whether this was a call whose answer is of no use any more.
    pub(super) fn is_done_with(&self, number: u64) -> bool {
        self.done_calls.contains(&number)
    }

    /// The channel that the answer to a call makes; `None` when it is no answer to it.
    pub(super) fn take_answer(&mut self, number: u64, answer: &[u8]) -> Option<Channel> {
        let place = self.calls.iter().position(|call| call.number == number)?;
        let there = take_answer(&mut self.calls[place].handshake, answer)?;
        self.done_calls = self.calls.iter().map(|call| call.number).collect();
        let OpenCall { channel, handshake, .. } = self.calls.swap_remove(place);
        self.calls.clear();
        Some(Channel::new(handshake.into_stateless_transport_mode().ok()?, channel, there))
    }

    /// From now on it is reached through this channel.
    pub(super) fn add_channel(&mut self, now: LocalTime, channel: Channel) {
        if self.channels.is_full() {
            self.channels.remove(0);
        }
        self.channels.push(channel);
        self.next_call = Backoff::from(now);
    }
}
