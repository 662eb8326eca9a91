//! When a received sample is used: at its scheduled step, or on arrival.

use serde::{Deserialize, Serialize};

use crate::packet::StatePacket;

/// Packets that may wait beyond the scheduled delay, for links that deliver in bursts.
const SPARE: u64 = 8;

/// One peer's samples at a receiver: the one in use, and those that wait.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlayOutBuffer {
    held: Option<StatePacket>,
    /// In order of their steps.
    waiting: Vec<StatePacket>,
    capacity: usize,
}

impl PlayOutBuffer {
    /// For samples that are used `periods` network steps after they were taken. Nothing allocates after this.
    #[must_use]
    pub fn new(periods: u64) -> Self {
        let capacity = (periods + SPARE) as usize;
        Self { held: None, waiting: Vec::with_capacity(capacity), capacity }
    }

    /// The sample in use.
    #[must_use]
    pub fn held(&self) -> Option<&StatePacket> {
        self.held.as_ref()
    }

    /// Takes a packet that arrived. One that is not newer than the one in use, or that is here already, is dropped;
    /// when the buffer is full, the oldest that waits is.
    pub fn insert(&mut self, packet: &StatePacket) {
        if self.held.as_ref().is_some_and(|held| held.step >= packet.step) {
            return;
        }
        let Err(mut place) = self.waiting.binary_search_by_key(&packet.step, |waiting| waiting.step) else {
            return;
        };
        if self.waiting.len() == self.capacity {
            if place == 0 {
                return;
            }
            self.waiting.remove(0);
            place -= 1;
        }
        self.waiting.insert(place, packet.clone());
    }

    /// At network step `step`: uses the newest sample that is at least `periods` steps old.
    pub fn play_out_scheduled(&mut self, step: u64, periods: u64) {
        let due = self.waiting.partition_point(|packet| packet.step + periods <= step);
        self.use_newest_of(due);
    }

    /// Uses the newest sample that is here.
    pub fn play_out_on_arrival(&mut self) {
        self.use_newest_of(self.waiting.len());
    }

    fn use_newest_of(&mut self, due: usize) {
        if let Some(newest) = self.waiting.drain(..due).next_back() {
            self.held = Some(newest);
        }
    }

    /// The sample of one network step, in use or waiting.
    pub fn sample_mut(&mut self, step: u64) -> Option<&mut StatePacket> {
        self.held.iter_mut().chain(&mut self.waiting).find(|packet| packet.step == step)
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.held = None;
        self.waiting.clear();
    }
}
