//! By which the watchdog sees that the haptic thread ticks, and the haptic thread that its force was taken away.

use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};

use cotouch_scene::time::LocalTime;

/// Before the first tick.
const NEVER: i64 = i64::MIN;

/// The beat of one haptic thread. Lock-free, one writer for each side.
///
/// The order is what counts (sequentially consistent): the watchdog switches forces off and says so; the haptic thread
/// beats, sees that, begins from nothing, switches forces on and says that it has. A force that was switched off is so never
/// switched on by a thread that does not know, and never stays off.
#[derive(Debug)]
pub(crate) struct Heartbeat {
    last_ns: AtomicI64,
    is_off: AtomicBool,
    /// How often forces were switched off.
    times: AtomicU64,
}

impl Default for Heartbeat {
    fn default() -> Self {
        Self { last_ns: AtomicI64::new(NEVER), is_off: AtomicBool::new(false), times: AtomicU64::new(0) }
    }
}

impl Heartbeat {
    /// The haptic thread's: a tick begins. Whether forces were switched off since the last one: then it has them begin from
    /// nothing, switches them on and calls [`resume`](Self::resume).
    pub(crate) fn beat(&self, now: LocalTime) -> bool {
        self.last_ns.store(now.0, Ordering::SeqCst);
        self.is_off.load(Ordering::SeqCst)
    }

    /// The haptic thread's: forces were switched on.
    pub(crate) fn resume(&self) {
        self.is_off.store(false, Ordering::SeqCst);
    }

    /// The watchdog's: when the last tick began; `None` before the first.
    pub(crate) fn last(&self) -> Option<LocalTime> {
        Some(self.last_ns.load(Ordering::SeqCst)).filter(|&last_ns| last_ns != NEVER).map(LocalTime)
    }

    /// The watchdog's: forces were switched off.
    pub(crate) fn stop(&self) {
        self.times.fetch_add(1, Ordering::SeqCst);
        self.is_off.store(true, Ordering::SeqCst);
    }

    /// Whether forces are off.
    pub(crate) fn is_off(&self) -> bool {
        self.is_off.load(Ordering::SeqCst)
    }

    /// How often forces were switched off.
    pub(crate) fn times(&self) -> u64 {
        self.times.load(Ordering::SeqCst)
    }
}
