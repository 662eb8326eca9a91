//! When a received sample is used: the play-out buffer of one sender at one receiver.
//!
//! *Scheduled* (the default): the sample of network step `j` is used from step `j + n` on; one that comes later than that,
//! from the first network step after it came. With a constant latency L the data are `max(n, ⌈L/T_t⌉)` periods old.
//! *On arrival*: used at the first haptic tick at or after its arrival. In both, the newest sample that is due wins, one
//! older than what is held is dropped, and where none came, the last one stays held.

use cotouch_scene::scene::PlayOut;
use serde::{Deserialize, Serialize};

use crate::packet::StatePacket;
use crate::statistics::{ArrivalOrder, SequenceTracker};

/// What became of the samples of one sender.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlayOutCounts {
    /// Samples that were used.
    pub used: u64,
    /// Came after the step from which they should have been used (scheduled).
    pub late: u64,
    /// Samples that had come before.
    pub duplicate: u64,
    /// Came after a newer one.
    pub reordered: u64,
    /// Never used: something newer was held or due by then.
    pub superseded: u64,
    /// Too far ahead of their time to be kept.
    pub overflowed: u64,
}

/// Samples of one sender on their way to being held. A plain value; its memory is reserved when it is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlayOutBuffer {
    policy: PlayOut,
    /// n, the network periods between sampling and use.
    periods: u64,
    /// The queued packet of step `s` lies in slot `s % slots.len()`.
    slots: Vec<Option<StatePacket>>,
    queued: usize,
    held: Option<StatePacket>,
    /// The network step of the last play-out.
    played: Option<u64>,
    tracker: SequenceTracker,
    counts: PlayOutCounts,
}

/// Room beyond the n packets that wait by intention: for packets of hosts whose clocks are ahead.
const SPARE_SLOTS: usize = 16;

impl PlayOutBuffer {
    /// An empty buffer; `periods` is n, the network periods between sampling and use (ignored on arrival).
    #[must_use]
    pub fn new(policy: PlayOut, periods: u32) -> Self {
        let periods = match policy {
            PlayOut::Scheduled => periods,
            PlayOut::OnArrival => 0,
        };
        Self {
            policy,
            periods: u64::from(periods),
            slots: vec![None; periods as usize + SPARE_SLOTS],
            queued: 0,
            held: None,
            played: None,
            tracker: SequenceTracker::default(),
            counts: PlayOutCounts::default(),
        }
    }

    /// Takes a packet that has arrived. Does not allocate; bounded work.
    pub fn insert(&mut self, packet: StatePacket) {
        match self.tracker.arrive(packet.step) {
            ArrivalOrder::Duplicate => {
                self.counts.duplicate += 1;
                return;
            }
            ArrivalOrder::Reordered => self.counts.reordered += 1,
            ArrivalOrder::Newest => {}
        }
        if self.is_late(packet.step) {
            self.counts.late += 1;
        }
        if self.held.as_ref().is_some_and(|held| packet.step <= held.step) {
            self.counts.superseded += 1;
        } else {
            self.enqueue(packet);
        }
    }

    fn is_late(&self, step: u64) -> bool {
        let due = step.saturating_add(self.periods);
        self.policy == PlayOut::Scheduled && self.played.is_some_and(|played| due <= played)
    }

    fn enqueue(&mut self, packet: StatePacket) {
        let length = self.slots.len() as u64;
        let horizon = self.played.map(|played| played.saturating_add(length));
        if self.policy == PlayOut::Scheduled && horizon.is_some_and(|horizon| packet.step > horizon) {
            self.counts.overflowed += 1;
            return;
        }
        let slot = &mut self.slots[(packet.step % length) as usize];
        match slot {
            Some(other) if other.step > packet.step => self.counts.superseded += 1,
            Some(other) => {
                *other = packet;
                self.counts.superseded += 1;
            }
            None => {
                *slot = Some(packet);
                self.queued += 1;
            }
        }
    }

    /// Scheduled play-out at network step `step`: the newest sample that is due becomes the held one and is returned, if
    /// there is one. Does nothing on arrival. Does not allocate; bounded work.
    pub fn due_at_step(&mut self, step: u64) -> Option<&StatePacket> {
        if self.policy != PlayOut::Scheduled {
            return None;
        }
        self.played = Some(self.played.map_or(step, |played| played.max(step)));
        self.play_out(step.checked_sub(self.periods)?)
    }

    /// On-arrival play-out at a haptic tick: the newest sample that has come becomes the held one and is returned, if there
    /// is one. Does nothing when scheduled. Does not allocate; bounded work.
    pub fn due_at_tick(&mut self) -> Option<&StatePacket> {
        if self.policy == PlayOut::OnArrival { self.play_out(u64::MAX) } else { None }
    }

    /// Holds the newest queued packet of step `newest` or before and drops what is older.
    fn play_out(&mut self, newest: u64) -> Option<&StatePacket> {
        if self.queued == 0 {
            return None;
        }
        let is_due =
            |slot: &&mut Option<StatePacket>| slot.as_ref().is_some_and(|packet| packet.step <= newest);
        let mut played = false;
        for slot in self.slots.iter_mut().filter(is_due) {
            self.queued -= 1;
            let candidate = slot.take();
            let newer = match (&candidate, &self.held) {
                (Some(candidate), Some(held)) => candidate.step > held.step,
                _ => true,
            };
            if newer {
                // What was chosen a moment ago is superseded by this one; what was held before was used.
                self.counts.superseded += u64::from(played);
                self.held = candidate;
                played = true;
            } else {
                self.counts.superseded += 1;
            }
        }
        self.counts.used += u64::from(played);
        if played { self.held.as_ref() } else { None }
    }

    /// The sample in use.
    #[must_use]
    pub const fn held(&self) -> Option<&StatePacket> {
        self.held.as_ref()
    }

    /// The sample of `step`, whether it waits or is held, to be changed (all but its step).
    pub fn sample_mut(&mut self, step: u64) -> Option<&mut StatePacket> {
        let index = (step % self.slots.len() as u64) as usize;
        let slot = self.slots[index].as_mut();
        slot.into_iter().chain(&mut self.held).find(|packet| packet.step == step)
    }

    /// What became of the samples so far.
    #[must_use]
    pub const fn counts(&self) -> PlayOutCounts {
        self.counts
    }

    /// Forgets all samples, as is right when a new life of the sender has come; the counts go on.
    pub fn restart(&mut self) {
        self.slots.fill(None);
        self.queued = 0;
        self.held = None;
        self.tracker.restart();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn packet(step: u64) -> StatePacket {
        StatePacket { step, ..StatePacket::default() }
    }

    fn queued(buffer: &PlayOutBuffer) -> impl Iterator<Item = &StatePacket> {
        buffer.slots.iter().flatten()
    }

    fn held(buffer: &PlayOutBuffer) -> Option<u64> {
        buffer.held().map(|packet| packet.step)
    }

    #[test]
    fn data_are_max_of_n_and_latency_old() {
        for n in 0..=3 {
            for latency in 0..=4u64 {
                let mut buffer = PlayOutBuffer::new(PlayOut::Scheduled, n);
                for step in 0..50u64 {
                    // What arrives at the instant of a network step is there before that step's play-out.
                    if let Some(sent) = step.checked_sub(latency) {
                        buffer.insert(packet(sent));
                    }
                    buffer.due_at_step(step);
                    assert_eq!(
                        held(&buffer),
                        step.checked_sub(latency.max(n.into())),
                        "n {n} latency {latency}"
                    );
                }
                let late = if latency > n.into() { 50 - latency } else { 0 };
                assert_eq!(buffer.counts().late, late, "n {n} latency {latency}");
                assert_eq!(buffer.counts().used, 50 - latency.max(n.into()));
            }
        }
    }

    #[test]
    fn on_arrival_takes_the_newest_at_the_next_tick() {
        let mut buffer = PlayOutBuffer::new(PlayOut::OnArrival, 3);
        assert_eq!(buffer.due_at_tick(), None);
        for step in [4, 6, 5] {
            buffer.insert(packet(step));
        }
        assert_eq!(buffer.due_at_step(100), None);
        assert_eq!(buffer.due_at_tick().map(|packet| packet.step), Some(6));
        buffer.insert(packet(3));
        assert_eq!(buffer.due_at_tick(), None);
        let counts = buffer.counts();
        assert_eq!((counts.used, counts.superseded, counts.reordered, counts.late), (1, 3, 2, 0));
    }

    #[test]
    fn samples_can_be_changed_by_step() {
        let mut buffer = PlayOutBuffer::new(PlayOut::Scheduled, 2);
        for step in 0..4 {
            buffer.insert(packet(step));
            buffer.due_at_step(step);
        }
        assert_eq!(held(&buffer), Some(1));
        let steps = [0, 1, 2, 3, 4].map(|step| buffer.sample_mut(step).is_some());
        assert_eq!(steps, [false, true, true, true, false]);
        for step in 1..4 {
            buffer.sample_mut(step).unwrap().entries.push(crate::packet::Entry::Force {
                point: step as u8,
                wrench: cotouch_scene::geometry::Wrench::default(),
            });
        }
        assert_eq!(queued(&buffer).map(|packet| packet.entries.len()).sum::<usize>(), 2);
        assert_eq!(buffer.held().unwrap().entries.len(), 1);
    }

    #[test]
    fn a_packet_from_far_ahead_blocks_nothing() {
        let mut buffer = PlayOutBuffer::new(PlayOut::Scheduled, 1);
        buffer.insert(packet(0));
        buffer.due_at_step(1);
        buffer.insert(packet(u64::MAX));
        for step in 2..40 {
            buffer.insert(packet(step - 1));
            buffer.due_at_step(step);
        }
        assert_eq!(buffer.counts().overflowed, 1);
    }

    proptest! {
        /// Whatever arrives whenever: nothing is used before its time, nothing goes back, and the newest due one wins.
        #[test]
        fn never_early_never_back(
            n in 0u32..=3,
            delays in proptest::collection::vec(proptest::option::weighted(0.8, 0u64..8), 1..200),
            twice in proptest::collection::vec(any::<bool>(), 200),
        ) {
            let mut buffer = PlayOutBuffer::new(PlayOut::Scheduled, n);
            let mut last = None;
            let mut arrived = Vec::new();
            for now in 0..delays.len() as u64 + 8 {
                for (step, delay) in delays.iter().enumerate() {
                    if delay.is_some_and(|delay| step as u64 + delay == now) {
                        arrived.push(step as u64);
                        buffer.insert(packet(step as u64));
                        if twice[step] {
                            buffer.insert(packet(step as u64));
                        }
                    }
                }
                buffer.due_at_step(now);
                let expected = arrived.iter().copied().filter(|step| step + u64::from(n) <= now).max();
                prop_assert_eq!(held(&buffer), expected);
                prop_assert!(held(&buffer) >= last);
                last = held(&buffer);
                prop_assert_eq!(queued(&buffer).count(), buffer.queued);
            }
            let counts = buffer.counts();
            prop_assert_eq!(counts.used + counts.superseded, arrived.len() as u64);
            prop_assert_eq!(counts.duplicate, arrived.iter().filter(|step| twice[**step as usize]).count() as u64);
            prop_assert_eq!(counts.overflowed, 0);
        }

        /// A copy behaves like the original, also after a detour through text.
        #[test]
        fn is_a_value(steps in proptest::collection::vec(0u64..40, 0..60)) {
            let mut buffer = PlayOutBuffer::new(PlayOut::Scheduled, 2);
            for (now, step) in steps.iter().enumerate() {
                buffer.insert(packet(*step));
                buffer.due_at_step(now as u64);
            }
            let text = serde_json::to_string(&buffer).unwrap();
            let mut copy: PlayOutBuffer = serde_json::from_str(&text).unwrap();
            prop_assert_eq!(&copy, &buffer);
            copy.insert(packet(41));
            buffer.insert(packet(41));
            prop_assert_eq!(copy.due_at_step(50), buffer.due_at_step(50));
            prop_assert_eq!(copy, buffer);
        }
    }
}
