//! What a cotouch session is, and the words that all other crates share.

pub mod geometry;
pub mod names;
pub mod scene;
pub mod time;
