//! Mutexes that outlive a thread that panicked while it held one.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// What is behind `mutex`; what a thread that panicked has left there is used on.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
