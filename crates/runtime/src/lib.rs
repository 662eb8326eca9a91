//! Sessions in virtual time and in real time; recorder and replay.

pub mod clock;
pub mod exchange;
mod impairment;
pub mod joining;
pub mod monitor;
mod priority;
pub mod record;
pub mod snapshot;
pub mod station;
pub mod summary;
pub mod transport;
pub mod virtual_time;
