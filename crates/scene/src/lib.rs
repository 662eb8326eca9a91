//! What a cotouch session is, and the words that all other crates share.

mod blank;
pub mod builtin;
mod check;
mod consistency;
pub mod error;
pub mod geometry;
mod keys;
pub mod names;
pub mod overrides;
pub mod scene;
pub mod source;
pub mod time;
mod tree;
mod unknown;
pub mod value;
