//! What the handles of a live session and its watcher share.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cotouch_scene::scene::Scene;
use cotouch_scene::time::LocalTime;

use crate::session_handle::SessionHandle;
use crate::snapshot::Snapshot;
use crate::start_error::StartError;
use crate::summary::{EarlierSession, Summary};

/// How the session of this number, from 2, is started when a change needs a new one: with the scene's
/// `link.impairment` on every way, since that is what its users ask for. Recordings of sessions that have ended are
/// kept: each has a file of its own (see [`super::numbered_path`]).
pub type Starter = Box<dyn Fn(&Scene, u32) -> Result<SessionHandle, StartError> + Send + Sync>;

/// Why a change was not made; the session that ran goes on, unless it says otherwise.
#[derive(Debug, thiserror::Error)]
pub enum ChangeError {
    /// The hosts of this session run in several processes.
    #[error("a session that several computers share cannot be changed while it runs")]
    Shared,
    /// The session is over.
    #[error("the session is over")]
    Ended,
    /// The next session did not start; the one before has begun anew, if that was possible.
    #[error("the session with these settings did not start: {0}")]
    NotStarted(String),
}

/// How a change was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Changed {
    /// In the running session, from one tick to the next.
    WhileRunning,
    /// By the next session.
    ByRestart,
}

/// A session that may be followed by another one.
pub(super) struct Shared {
    /// Nothing when the session cannot be changed.
    pub(super) starter: Option<Starter>,
    /// Held by whoever changes the session: one at a time.
    pub(super) changing: Mutex<()>,
    /// Held for moments only, never while a session starts or ends.
    pub(super) present: Mutex<Present>,
    /// A stop that comes while no session runs holds for the one that is being started.
    pub(super) stopping: AtomicBool,
}

/// The session that runs.
pub(super) struct Present {
    /// Nothing while one session has ended and the next has not begun, and after the very last.
    pub(super) handle: Option<SessionHandle>,
    pub(super) restarting: bool,
    /// The session was stopped, and waits for somebody to begin it anew.
    pub(super) paused: bool,
    pub(super) scene: Arc<Scene>,
    pub(super) generation: u32,
    /// What is shown while there is no session.
    pub(super) last: Snapshot,
    /// What happened in the session before.
    pub(super) summary: Option<Summary>,
    /// All sessions that have ended.
    pub(super) ended: Vec<EarlierSession>,
    pub(super) news: Vec<String>,
    /// What failed in sessions that have ended, and was not told yet.
    pub(super) failures: Vec<String>,
    /// Sessions on end that began because the objects had left all bounds.
    pub(super) begun_anew: u32,
    /// Somebody watches, until then at least.
    pub(super) watched_until: LocalTime,
    /// Until then a session that is stopped waits for somebody to begin it anew.
    pub(super) waits_until: LocalTime,
}

impl Shared {
    /// The session that runs, locked.
    pub(super) fn present(&self) -> MutexGuard<'_, Present> {
        self.present.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until nobody else changes the session.
    pub(super) fn begin_change(&self) -> MutexGuard<'_, ()> {
        self.changing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Present {
    /// Whether no session runs, and none is being started.
    pub(super) fn has_ended(&self) -> bool {
        !self.restarting && !self.paused && self.handle.as_ref().is_none_or(SessionHandle::has_ended)
    }
}
