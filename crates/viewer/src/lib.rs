//! The web page of a running session, or of recordings.
//!
//! A [`Viewer`] serves on one address `/`, the page that `build.rs` bundles; `/live`, a WebSocket that carries pictures and
//! messages (`protocol.rs`, `picture.rs`); `/recordings/N/pictures`, what a recording looked like; and `/healthz`, which
//! answers 200. It runs on a thread of its own, only ever asks for the newest picture, and sends the next one when the
//! browser has taken the last: a slow browser sees fewer pictures and slows nothing down.
//!
//! A browser may take a hand and move it, and one on the same computer may change the session: the [`Base`] says where the
//! scene comes from, so that it can be had with other settings, and a [`Predictor`] says what the analysis
//! thinks of them.
//!
//! The page makes no request to any other host. A page from another origin cannot read the session: the `Origin` and
//! `Host` of a request must be this server's, by address or as `localhost`.

mod about;
mod browser;
mod bundle;
mod changes;
mod connections;
mod control;
mod controls;
mod hub;
mod lesson;
mod lock;
mod origin;
mod picture;
mod predicting;
mod predictor;
mod protocol;
mod replays;
mod sender;
mod server;
mod setting;
mod settings;
mod signals;
mod skin;

pub use picture::encode as encode_picture;
pub use predictor::{Answer, Predictor, Question};
pub use protocol::{MapAxes, MapAxis, check_page_message};
pub use replays::ShownRecordingError;
pub use server::{Show, Viewer, ViewerError};
pub use settings::Base;
pub use skin::Skin;
