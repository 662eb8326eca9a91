//! How a command ends: exit status 0, 1 or 2.

use std::fmt::Display;
use std::process::ExitCode;

/// What a command that did its work says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Exit status 0.
    Good,
    /// Exit status 1: the work is done, and the answer is no.
    Bad,
}

impl From<Verdict> for ExitCode {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Good => Self::SUCCESS,
            Verdict::Bad => Self::from(1),
        }
    }
}

/// From now on a panic in any thread is one sentence on stderr; what becomes of the session, its own threads decide.
pub(crate) fn tell_panics_in_one_sentence() {
    std::panic::set_hook(Box::new(|panic| {
        let thread = std::thread::current();
        let name = thread.name().unwrap_or("without a name").to_owned();
        let text = panic.payload_as_str().unwrap_or("no reason given");
        let place = panic.location().map_or_else(String::new, |place| format!(" ({place})"));
        tell!("error: the thread {name} panicked, which is a fault of this program: {text}{place}");
    }));
}

/// Why a command could not do its work.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Exit status 2: bad usage, or an unreadable or invalid scene.
    Usage(String),
    /// Exit status 1: something failed on the way.
    Running(anyhow::Error),
}

impl Failure {
    /// What the user asked for cannot be.
    pub(crate) fn usage(reason: impl Display) -> Self {
        Self::Usage(reason.to_string())
    }

    /// Says why on stderr, one problem a line.
    pub(crate) fn report(&self) -> ExitCode {
        match self {
            Self::Usage(reason) => {
                reason.lines().for_each(|line| tell!("error: {line}"));
                ExitCode::from(2)
            }
            Self::Running(error) => {
                tell!("error: {}", in_one_sentence(error));
                ExitCode::from(1)
            }
        }
    }
}

/// The error and its causes, each said once: many errors of libraries say their cause themselves.
pub(crate) fn in_one_sentence(error: &anyhow::Error) -> String {
    error.chain().map(ToString::to_string).fold(String::new(), |said, cause| {
        if said.is_empty() {
            cause
        } else if said.contains(&cause) {
            said
        } else {
            format!("{said}: {cause}")
        }
    })
}

impl From<anyhow::Error> for Failure {
    fn from(error: anyhow::Error) -> Self {
        Self::Running(error)
    }
}

impl From<cotouch_scene::SceneErrors> for Failure {
    fn from(errors: cotouch_scene::SceneErrors) -> Self {
        Self::usage(errors)
    }
}
