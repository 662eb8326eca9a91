//! Why a session in real time does not start.

use std::io;
use std::time::Duration;

use cotouch_device::DeviceOpenError;
use cotouch_net::{Route, Unwelcome};
use cotouch_soft::SoftError;

use crate::recorder::RecordError;
use crate::transport::OpenError;

/// How long a newcomer waits to be taken in.
pub(crate) const JOIN_PATIENCE: Duration = Duration::from_secs(10);

/// Why a session did not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// No end of a transport.
    #[error(transparent)]
    Transport(#[from] OpenError),
    /// A thread could not be started.
    #[error("a thread of the session cannot be started: {0}")]
    Thread(io::Error),
    /// The session turned this host away.
    #[error("the session at {server} turned this host away: {reason}")]
    Refused {
        /// The address of the session's server.
        server: Route,
        /// The reason, in the server's words.
        reason: String,
    },
    /// The server does not take this host's calls.
    #[error("{server} does not answer this host: {reason}")]
    Unwelcome {
        /// The address of the session's server.
        server: Route,
        /// The reason.
        reason: Unwelcome,
    },
    /// Nobody answered in time.
    #[error("no session answered at {server} within {} s; is `cotouch serve` running there, and do datagrams get through?", JOIN_PATIENCE.as_secs())]
    Silence {
        /// The address of the session's server.
        server: Route,
    },
    /// Nobody had answered when the session was no longer wanted.
    #[error("interrupted before the session at {server} answered")]
    GivenUp {
        /// The address of the session's server.
        server: Route,
    },
    /// The server's scene does not read.
    #[error("the scene that {server} sent cannot be used: {reason}")]
    Scene {
        /// The address of the session's server.
        server: Route,
        /// What is wrong with it.
        reason: String,
    },
    /// A user's device cannot be had.
    #[error(transparent)]
    Device(#[from] DeviceOpenError),
    /// The scene's soft object cannot be simulated.
    #[error(transparent)]
    Soft(#[from] SoftError),
    /// The recording cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordError),
}
