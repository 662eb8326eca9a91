//! What a session's threads and the rest of the program tell each other through atomics.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

use crate::failures::Failures;
use crate::heartbeat::Heartbeat;
use crate::observer::{LiveVerdict, RunVerdict};

/// What others may ask of the haptic thread, and what it tells them.
#[derive(Debug, Default)]
pub(crate) struct Control {
    pub(crate) stop: AtomicBool,
    /// Session time of the run so far, ns since its first tick.
    pub(crate) elapsed_ns: AtomicU64,
    /// The run goes on until here at least, ns since its first tick, unless it is stopped.
    pub(crate) go_on_ns: AtomicU64,
    /// When the run is to end, ns since its first tick; 0 where that is not said.
    pub(crate) ends_ns: AtomicU64,
    pub(crate) started: AtomicBool,
    pub(crate) ended: AtomicBool,
    /// The haptic thread does not answer any more, and is not waited for; it must not render again.
    pub(crate) abandoned: AtomicBool,
    /// By which the watchdog sees that ticks go on.
    pub(crate) heartbeat: Heartbeat,
    /// What failed, in any thread.
    pub(crate) failures: Failures,
    /// What the run has been so far.
    pub(crate) verdict: AtomicVerdict,
    /// What it is now.
    now: AtomicVerdict,
    /// Bits of the force (N) that goes with it.
    fast_force_n: AtomicU64,
    /// Bits of the time (s) that goes with it.
    saturated_s: AtomicU64,
    /// What the system did not allow the haptic thread.
    pub(crate) warning: Mutex<Option<String>>,
}

impl Control {
    /// Whether the session has ended or is about to.
    pub(crate) fn is_over(&self) -> bool {
        self.has_ended() || self.is_stopping()
    }

    /// Whether the haptic thread is to let go and end: because somebody wants that, or because something failed.
    pub(crate) fn is_stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.failures.ends_session()
    }

    /// Whether the run should be over by now, no tick having come for `silent_ns`.
    pub(crate) fn is_overdue(&self, silent_ns: i64) -> bool {
        let ends_ns = self.ends_ns.load(Ordering::Relaxed);
        let now_ns = self.elapsed_ns.load(Ordering::Relaxed).saturating_add(silent_ns.max(0) as u64);
        ends_ns > 0 && now_ns >= ends_ns.max(self.go_on_ns.load(Ordering::Relaxed))
    }

    /// Whether no tick will come any more.
    pub(crate) fn has_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire) || self.abandoned.load(Ordering::Acquire)
    }

    /// Tells what goes on. No allocation, no lock.
    pub(crate) fn tell_now(&self, now: LiveVerdict) {
        self.now.store(now.verdict);
        self.fast_force_n.store(now.fast_force_n.to_bits(), Ordering::Relaxed);
        self.saturated_s.store(now.saturated_s.to_bits(), Ordering::Relaxed);
    }

    /// What goes on.
    pub(crate) fn now(&self) -> LiveVerdict {
        let number = |bits: &AtomicU64| f64::from_bits(bits.load(Ordering::Relaxed));
        LiveVerdict {
            verdict: self.now.load(),
            fast_force_n: number(&self.fast_force_n),
            saturated_s: number(&self.saturated_s),
        }
    }
}

/// A verdict, or too early to say (`None`, and so at first). Lock-free.
#[derive(Debug, Default)]
pub(crate) struct AtomicVerdict(AtomicU8);

impl AtomicVerdict {
    pub(crate) fn store(&self, verdict: Option<RunVerdict>) {
        self.0.store(verdict.map_or(0, |verdict| 1 + verdict as u8), Ordering::Relaxed);
    }

    pub(crate) fn load(&self) -> Option<RunVerdict> {
        [RunVerdict::Quiet, RunVerdict::Shaking, RunVerdict::Diverging]
            .into_iter()
            .find(|&verdict| 1 + verdict as u8 == self.0.load(Ordering::Relaxed))
    }
}
