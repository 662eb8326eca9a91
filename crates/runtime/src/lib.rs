//! Sessions in virtual time and in real time; recorder and replay.

pub mod exchange;
pub mod export;
pub mod messages;
pub mod record;
pub mod recorder;
pub mod recording;
pub mod replay;
pub mod tick_fields;
