//! What a session's threads and the rest of the program tell each other through atomics.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

use crate::snapshot::Lately;

/// What others may ask of the haptic thread, and what it tells them.
#[derive(Debug, Default)]
pub(crate) struct Control {
    pub(crate) stop: AtomicBool,
    /// Session time of the run so far, ns since its first tick.
    pub(crate) elapsed_ns: AtomicU64,
    /// The run goes on until here at least, ns since its first tick, unless it is stopped.
    pub(crate) go_on_ns: AtomicU64,
    pub(crate) started: AtomicBool,
    pub(crate) ended: AtomicBool,
    /// Whether the run has stayed stable so far.
    pub(crate) stable: AtomicVerdict,
    /// Whether the last seconds were stable.
    lately: AtomicVerdict,
    /// Bits of the energy (J) that goes with it.
    oscillation_j: AtomicU64,
    /// What the system did not allow the haptic thread.
    pub(crate) warning: Mutex<Option<String>>,
}

impl Control {
    /// Whether the session has ended or is about to.
    pub(crate) fn is_over(&self) -> bool {
        self.ended.load(Ordering::Acquire) || self.stop.load(Ordering::Relaxed)
    }

    /// Tells what the last seconds were like. No allocation, no lock.
    pub(crate) fn tell_lately(&self, lately: Lately) {
        self.lately.store(lately.stable);
        self.oscillation_j.store(lately.oscillation_j.to_bits(), Ordering::Relaxed);
    }

    /// What the last seconds were like.
    pub(crate) fn lately(&self) -> Lately {
        Lately {
            stable: self.lately.load(),
            oscillation_j: f64::from_bits(self.oscillation_j.load(Ordering::Relaxed)),
        }
    }
}

/// Stable, unstable, or too early to say (`None`, and so at first). Lock-free.
#[derive(Debug, Default)]
pub(crate) struct AtomicVerdict(AtomicU8);

impl AtomicVerdict {
    pub(crate) fn store(&self, stable: Option<bool>) {
        self.0.store(stable.map_or(0, |stable| 2 - u8::from(stable)), Ordering::Relaxed);
    }

    pub(crate) fn load(&self) -> Option<bool> {
        match self.0.load(Ordering::Relaxed) {
            0 => None,
            code => Some(code == 1),
        }
    }
}
