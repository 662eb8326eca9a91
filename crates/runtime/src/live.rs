//! A session that people watch, join and change while it runs: what a page's server works with.
//!
//! Behind it is one [`SessionHandle`] at a time. A change that the running loops can take is made in the running
//! session; any other ends it, smoothly, and begins the next one: the generation counts them.

use std::sync::Arc;

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;

use crate::hand::{Hand, Seat, TakeError};
use crate::session_handle::SessionHandle;
use crate::snapshot::Snapshot;
use crate::summary::Summary;

/// How the next session is started when a change needs one. Recordings of sessions that have ended are kept: each has a
/// file of its own.
pub type Starter =
    Box<dyn Fn(&Scene, u32) -> Result<SessionHandle, crate::real_time::StartError> + Send + Sync>;

/// Why a change was not made; the session that ran goes on, unless it says otherwise.
#[derive(Debug, thiserror::Error)]
pub enum ChangeError {
    /// The hosts of this session run in several processes.
    #[error("a session that several computers share cannot be changed while it runs")]
    Shared,
    /// The session is over.
    #[error("the session is over")]
    Ended,
    /// The next session did not start; there is none now.
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

/// A session that is watched, joined and changed.
pub struct LiveSession {}

impl LiveSession {
    /// A session that cannot be changed: this process runs some of its hosts only.
    #[must_use]
    pub fn fixed(handle: SessionHandle) -> Self {
        let _ = handle;
        todo!()
    }

    /// A session whose hosts all run in this process; `starter` starts the next one when a change needs that.
    #[must_use]
    pub fn changeable(handle: SessionHandle, starter: Starter) -> Self {
        let _ = (handle, starter);
        todo!()
    }

    /// The scene that runs, and its number, from 1.
    #[must_use]
    pub fn scene(&self) -> (Arc<Scene>, u32) {
        todo!()
    }

    /// Whether the session can be changed at all.
    #[must_use]
    pub fn may_change(&self) -> bool {
        todo!()
    }

    /// Runs `scene` from now on. Blocks for as long as a restart takes; a newer call waits for an older one.
    ///
    /// # Errors
    /// When the session is shared, over, or the next one does not start.
    pub fn change(&self, scene: Scene) -> Result<Changed, ChangeError> {
        let _ = scene;
        todo!()
    }

    /// Begins anew with the same scene.
    ///
    /// # Errors
    /// As for [`LiveSession::change`].
    pub fn again(&self) -> Result<(), ChangeError> {
        todo!()
    }

    /// `scene` as this session would run it, for a prediction: as a real network can play it, with this session's impairment,
    /// and with the hands tracked that pointers move. With a sentence where that differs from what was asked for.
    #[must_use]
    pub fn as_it_would_run(&self, scene: &Scene) -> (Scene, Option<String>) {
        let _ = scene;
        todo!()
    }

    /// The newest picture, and the number of the session that it is of; never holds up a haptic loop.
    #[must_use]
    pub fn snapshot(&self) -> (Snapshot, u32) {
        todo!()
    }

    /// Who moves which hand.
    #[must_use]
    pub fn seats(&self) -> Vec<Seat> {
        todo!()
    }

    /// Takes a user's hand from its script, or a free place. Blocks for as long as joining takes.
    ///
    /// # Errors
    /// When somebody else has it, or a free place cannot be had.
    pub fn take(&self, user: HostIndex) -> Result<Hand, TakeError> {
        let _ = user;
        todo!()
    }

    /// News in words since the last call.
    #[must_use]
    pub fn take_news(&self) -> Vec<String> {
        todo!()
    }

    /// Asks the session to end.
    pub fn stop(&self) {
        todo!()
    }

    /// Whether it has ended, for good.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        todo!()
    }

    /// Waits for the end and says what happened in the last session.
    ///
    /// # Errors
    /// When a recording could not be written to its end.
    pub fn finish(self) -> Result<Summary, crate::recorder::RecordError> {
        todo!()
    }
}
