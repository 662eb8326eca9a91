//! Sessions in virtual time and in real time; recorder and replay.

pub mod clock;
pub mod exchange;
pub mod export;
mod haptic_loop;
mod impairment;
pub mod joining;
mod messages;
pub mod monitor;
mod priority;
pub mod real_time;
pub mod record;
pub mod recorder;
pub mod recording;
mod recording_thread;
pub mod replay;
pub mod session_handle;
pub mod snapshot;
pub mod station;
pub mod summary;
mod summary_of_run;
mod tick_fields;
pub mod transport;
pub mod virtual_run;
pub mod virtual_time;
