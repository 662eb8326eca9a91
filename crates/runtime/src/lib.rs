//! Sessions in virtual time and in real time; recorder and replay.

pub mod monitor;
pub mod record;
pub mod exchange;
pub mod station;
