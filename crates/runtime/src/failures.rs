//! What fails in the threads of a session, told from any of them to whoever watches it.

use std::any::Any;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

/// What failed in a session so far, in words. Clones speak of the same session. Not for the haptic tick: telling allocates.
#[derive(Clone, Debug, Default)]
pub struct Failures(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    ends_session: AtomicBool,
    told: Mutex<Vec<String>>,
}

impl Failures {
    /// Something failed without which the session goes on.
    pub(crate) fn tell(&self, why: String) {
        self.told().push(why);
    }

    /// Something failed without which the session cannot go on: it lets go of all devices and ends.
    pub(crate) fn tell_and_end(&self, why: String) {
        self.tell(why);
        self.0.ends_session.store(true, Ordering::Release);
    }

    /// Whether the session is to end. Lock-free.
    #[must_use]
    pub fn ends_session(&self) -> bool {
        self.0.ends_session.load(Ordering::Acquire)
    }

    /// All that failed so far, the first one first.
    #[must_use]
    pub fn all(&self) -> Vec<String> {
        self.told().clone()
    }

    fn told(&self) -> MutexGuard<'_, Vec<String>> {
        self.0.told.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Starts a thread without which a session cannot go on, called `what` in words: when it panics, the session is told and ends.
pub(crate) fn spawn_essential(
    thread: Builder,
    what: String,
    failures: Failures,
    body: impl FnOnce() + Send + 'static,
) -> io::Result<JoinHandle<()>> {
    thread.spawn(move || {
        if let Err(why) = catch(body) {
            failures.tell_and_end(format!("{what} failed: {why}"));
        }
    })
}

/// What `body` gives, or what it said when it panicked.
pub(crate) fn catch<T>(body: impl FnOnce() -> T) -> Result<T, String> {
    // What a panic leaves half done is looked at only to sum up and to let go.
    catch_unwind(AssertUnwindSafe(body)).map_err(|panic| in_words(&*panic))
}

fn in_words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "it panicked".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_in_an_essential_thread_is_told_and_ends_the_session() {
        let failures = Failures::default();
        failures.tell("the recording stops here".to_owned());
        assert!(!failures.ends_session());
        let number = 7;
        let panics = move || panic!("no {number}");
        let thread = spawn_essential(Builder::new(), "a test".to_owned(), failures.clone(), panics).unwrap();
        thread.join().unwrap();
        assert!(failures.ends_session());
        assert_eq!(failures.all(), ["the recording stops here", "a test failed: no 7"]);
    }

    #[test]
    fn a_thread_that_ends_by_itself_has_not_failed() {
        let failures = Failures::default();
        spawn_essential(Builder::new(), "a test".to_owned(), failures.clone(), || {})
            .unwrap()
            .join()
            .unwrap();
        assert!(!failures.ends_session() && failures.all().is_empty());
        assert_eq!(catch(|| std::panic::panic_any(7)), Err::<(), _>("it panicked".to_owned()));
    }
}
