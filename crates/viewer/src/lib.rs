//! The web page of a running session.
//!
//! A [`Viewer`] serves three things on one address: `/`, a page that draws the session; `/live`, a WebSocket that
//! carries what the page draws; and `/healthz`, which answers 200. It runs on a thread of its own, only ever asks for
//! the newest snapshot, and sends the next one when the browser has taken the last: a slow browser sees fewer
//! pictures and slows nothing down.
//!
//! The page makes no request to any other host. A page from another origin cannot read the session: the `Origin` and
//! `Host` of a request must be this server's, by address or as `localhost`.
//!
//! ```no_run
//! use cotouch_runtime::snapshot::Snapshot;
//! use cotouch_viewer::{About, Viewer};
//!
//! # fn show(scene: &cotouch_scene::scene::Scene) -> Result<(), cotouch_viewer::ViewerError> {
//! let about = About::new(scene, || serde_json::json!({ "stable": true, "spectral_radius": 0.98 }));
//! let viewer = Viewer::start("127.0.0.1:7700".parse().unwrap(), about, Snapshot::default)?;
//! println!("see http://{}", viewer.address());
//! # Ok(())
//! # }
//! ```

mod about;
mod live;
mod manners;
mod server;

pub use about::About;
pub use server::{Viewer, ViewerError};
