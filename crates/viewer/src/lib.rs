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
mod about;
mod bundle;
mod manners;
pub mod picture;
pub mod predictor;
pub mod protocol;
mod server;

pub use server::{Base, Show, Viewer, ViewerError};
