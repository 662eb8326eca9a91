//! Sessions in virtual time and in real time; recorder and replay.

pub mod clock;
pub mod exchange;
pub mod joining;
pub mod monitor;
pub mod record;
pub mod snapshot;
pub mod station;
pub mod summary;
pub mod transport;
pub mod virtual_time;
mod impairment;
mod priority;
