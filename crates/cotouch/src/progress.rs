//! A progress bar on stderr for long work, only where someone sees it, and Ctrl-C.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context as _;
use indicatif::{ProgressBar, ProgressStyle};

/// A bar that fills with the share of the work that is done.
pub(crate) struct Progress(ProgressBar);

const STEPS: u64 = 1000;

impl Progress {
    /// A bar that says what is going on. Draws nothing unless stderr is a terminal.
    pub(crate) fn new(what: &str) -> Self {
        let bar = ProgressBar::new(STEPS);
        let style = ProgressStyle::with_template("{msg} [{bar:40}] {percent:>3} %, {eta} to go");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
        bar.set_message(what.to_owned());
        Self(bar)
    }

    /// A line that counts, for work whose length is not known.
    pub(crate) fn unmeasured(what: &str) -> Self {
        let bar = ProgressBar::no_length();
        let style = ProgressStyle::with_template("{msg} {spinner} {human_pos} ticks");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        bar.set_message(what.to_owned());
        Self(bar)
    }

    /// Shows how much is done.
    pub(crate) fn count(&self, done: u64) {
        self.0.set_position(done);
    }

    /// Shows the share that is done, 0 to 1.
    pub(crate) fn show(&self, share: f64) {
        self.0.set_position((share.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Set when the user wants the work to end.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Set by Ctrl-C, by SIGTERM and by SIGHUP from now on; the program then ends in order.
    pub(crate) fn on_interrupt() -> anyhow::Result<Self> {
        let stop = Self::default();
        let flag = Arc::clone(&stop.0);
        // The first signal releases the hands and closes the recording. Others are ignored: they often come in pairs,
        // and a session that is being released must not be cut off.
        let set = move || flag.store(true, Ordering::Relaxed);
        ctrlc::set_handler(set).context("Ctrl-C cannot be listened to")?;
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
