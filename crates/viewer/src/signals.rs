//! What passes from the side that hears a browser to the side that tells it things.

use cotouch_scene::names::HostIndex;
use tokio::sync::watch;

/// What a browser has said that concerns what it is told.
pub(crate) struct PageSignals {
    /// Whose hand it moves.
    pub(crate) holds: watch::Sender<Option<HostIndex>>,
    /// How many pictures a second the browser wants.
    pub(crate) rate_hz: watch::Sender<f64>,
    /// The number of the last ping that it answered.
    pub(crate) answered: watch::Sender<u64>,
}
