//! When to repeat what was not answered yet.

use cotouch_scene::time::LocalTime;

/// Growing pauses between repeats: 50 ms, then half as long again each time, up to half a second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Backoff {
    due: LocalTime,
    pause_ns: i64,
}

impl Backoff {
    const FIRST_PAUSE_NS: i64 = 50_000_000;
    const MAX_PAUSE_NS: i64 = 500_000_000;

    /// A repeat that is due at once.
    pub(crate) const fn from(now: LocalTime) -> Self {
        Self { due: now, pause_ns: Self::FIRST_PAUSE_NS }
    }

    pub(crate) const fn due(&self) -> LocalTime {
        self.due
    }

    /// It was done at `now`; due again after the next pause.
    pub(crate) fn again(&mut self, now: LocalTime) {
        self.due = now.plus_ns(self.pause_ns);
        self.pause_ns = (self.pause_ns * 3 / 2).min(Self::MAX_PAUSE_NS);
    }

    /// The pause, ns, that follows so many repeats.
    pub(crate) fn pause_after(attempts: u32) -> i64 {
        let mut backoff = Self::from(LocalTime(0));
        for _ in 0..attempts.min(8) {
            backoff.again(LocalTime(0));
        }
        backoff.pause_ns
    }
}
