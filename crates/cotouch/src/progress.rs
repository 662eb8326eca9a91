//! What long work shows on stderr while it lasts, and Ctrl-C.

use std::io::IsTerminal as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use anyhow::Context as _;
use cotouch_runtime::clock;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Work that is done sooner shows nothing.
const SILENT_FOR: Duration = Duration::from_secs(2);
/// Lines come so far apart.
const LINE_EVERY: Duration = Duration::from_secs(1);
/// A bar is drawn anew so often.
const DRAWN_EVERY: Duration = Duration::from_millis(200);

const STEPS: u64 = 1000;

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    /// As a bar, where stderr is a terminal; else not at all.
    Bar,
    /// In plain lines, whatever stderr is.
    Lines,
}

/// Work in progress. It shows how much is done once it has taken more than two seconds: in a bar, or in a line a second.
pub(crate) struct Progress {
    work: Arc<Work>,
    teller: Option<JoinHandle<()>>,
}

struct Work {
    what: String,
    bar: ProgressBar,
    ended: Mutex<bool>,
    wake: Condvar,
}

impl Progress {
    /// Work that says which share of it is done; until it does, its time is shown.
    pub(crate) fn new(what: &str, shown: Shown) -> Self {
        Self::begin(what, shown, "{msg} {spinner} {elapsed}")
    }

    /// Work that counts ticks, whose number is not known.
    pub(crate) fn unmeasured(what: &str, shown: Shown) -> Self {
        Self::begin(what, shown, "{msg} {spinner} {human_pos} ticks")
    }

    fn begin(what: &str, shown: Shown, template: &str) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        bar.set_style(
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_spinner()),
        );
        bar.set_message(what.to_owned());
        let (ended, wake) = (Mutex::new(false), Condvar::new());
        let work = Arc::new(Work { what: what.to_owned(), bar, ended, wake });
        let is_seen = shown == Shown::Lines || std::io::stderr().is_terminal();
        let teller = is_seen.then(|| {
            let work = Arc::clone(&work);
            thread::spawn(move || work.tell_until_ended(shown))
        });
        Self { work, teller }
    }

    /// Shows how much is done.
    pub(crate) fn count(&self, done: u64) {
        self.work.bar.set_position(done);
    }

    /// Shows the share that is done, 0 to 1.
    pub(crate) fn show(&self, share: f64) {
        let bar = &self.work.bar;
        if bar.length().is_none() {
            let style = ProgressStyle::with_template("{msg} [{bar:40}] {percent:>3} %, {eta} to go");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
            bar.set_length(STEPS);
        }
        bar.set_position((share.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        *self.work.ended.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.work.wake.notify_all();
        if let Some(teller) = self.teller.take() {
            // A thread that only prints has nothing to say about the work.
            let _ = teller.join();
        }
        self.work.bar.finish_and_clear();
    }
}

impl Work {
    fn tell_until_ended(&self, shown: Shown) {
        let mut wait = SILENT_FOR;
        while !self.has_ended_within(wait) {
            match shown {
                Shown::Lines => {
                    tell!("{}", self.line());
                    wait = LINE_EVERY;
                }
                Shown::Bar => {
                    if self.bar.is_hidden() {
                        self.bar.set_draw_target(ProgressDrawTarget::stderr());
                    }
                    self.bar.tick();
                    wait = DRAWN_EVERY;
                }
            }
        }
    }

    fn has_ended_within(&self, wait: Duration) -> bool {
        let ended = self.ended.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.wake.wait_timeout_while(ended, wait, |ended| !*ended);
        *waited.unwrap_or_else(PoisonError::into_inner).0
    }

    fn line(&self) -> String {
        let (what, elapsed_s) = (&self.what, self.bar.elapsed().as_secs());
        match (self.bar.length(), self.bar.position()) {
            (Some(steps), done) => format!("{what}: {} %, {elapsed_s} s", 100 * done / steps),
            (None, 0) => format!("{what}: {elapsed_s} s"),
            (None, ticks) => format!("{what}: {ticks} ticks, {elapsed_s} s"),
        }
    }
}

/// Signals that come within this time are one: terminals and service managers send them in pairs, and a session that is being
/// released must not be cut off by the second of a pair. ns.
const PAIR_NS: i64 = 200_000_000;

/// Nothing is waited for, but no device goes on rendering.
fn end_at_once() -> ! {
    cotouch_runtime::switch_off_all_forces();
    tell!("error: interrupted twice: all forces are off, and the program ends without an orderly release");
    std::process::exit(1);
}

/// Set when the user wants the work to end.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Set by Ctrl-C, by SIGTERM and by SIGHUP from now on; the program then ends in order: hands are released, and the recording
    /// is closed. A second one ends the process at once, whatever it does, with all forces off.
    pub(crate) fn on_interrupt() -> anyhow::Result<Self> {
        let stop = Self::default();
        let flag = Arc::clone(&stop.0);
        let mut first = None;
        let interrupted = move || {
            flag.store(true, Ordering::Relaxed);
            let now = clock::now();
            if now.since(*first.get_or_insert(now)) > PAIR_NS {
                end_at_once();
            }
        };
        ctrlc::set_handler(interrupted).context("Ctrl-C cannot be listened to")?;
        Ok(stop)
    }

    /// Whether the user wants the work to end.
    pub(crate) fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Asks for the end.
    pub(crate) fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_how_much_is_done_or_for_how_long() {
        let progress = Progress::new("analysing", Shown::Bar);
        assert!(progress.work.line().starts_with("analysing: 0 s"), "{}", progress.work.line());
        progress.show(0.351);
        assert!(progress.work.line().starts_with("analysing: 35 %, "), "{}", progress.work.line());
        let replaying = Progress::unmeasured("replaying", Shown::Bar);
        replaying.count(1234);
        assert!(replaying.work.line().starts_with("replaying: 1234 ticks, "), "{}", replaying.work.line());
    }

    #[test]
    fn work_that_ends_is_not_waited_for() {
        let progress = Progress::new("analysing", Shown::Lines);
        assert!(!progress.work.has_ended_within(Duration::ZERO));
        let work = Arc::clone(&progress.work);
        drop(progress);
        assert!(work.has_ended_within(Duration::from_secs(3600)));
    }
}
