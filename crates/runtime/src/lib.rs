//! (under construction)
//! Sessions in virtual time and in real time; recorder and replay.

pub mod record;
pub mod snapshot;
pub mod summary;
