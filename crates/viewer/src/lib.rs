//! The web page of a running session, or of recordings.
//!
//! A [`Viewer`] serves on one address `/`, the page that `build.rs` bundles; `/live`, a WebSocket that carries pictures and
//! messages ([`protocol`], [`picture`]); `/recordings/N/pictures`, what a recording looked like; and `/healthz`, which
//! answers 200. It runs on a thread of its own, only ever asks for the newest picture, and sends the next one when the
//! browser has taken the last: a slow browser sees fewer pictures and slows nothing down.
//!
//! A browser may take a hand and move it, and one on the same computer may change the session: the [`Base`] says where the
//! scene comes from, so that it can be had with other settings, and a [`predictor::Predictor`] says what the analysis
//! thinks of them.
//!
//! The page makes no request to any other host. A page from another origin cannot read the session: the `Origin` and
//! `Host` of a request must be this server's, by address or as `localhost`.

mod about;
mod browser;
mod bundle;
mod changing;
mod controls;
mod lesson;
mod manners;
pub mod picture;
mod predicting;
pub mod predictor;
pub mod protocol;
mod replays;
mod room;
mod server;
mod settings;
pub mod skin;
mod talking;

pub use replays::ReplayError;
pub use server::{Show, Viewer, ViewerError};
pub use settings::Base;
