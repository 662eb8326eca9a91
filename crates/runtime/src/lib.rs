//! Sessions in virtual time and in real time; recorder and replay.
//!
//! A [`station::Station`] is one host with its device and its governor, as a value that is stepped. Everything else
//! here decides *when* it is stepped and what it hears:
//!
//! - [`virtual_time`] holds a whole session in one thread, with simulated links and clocks; [`virtual_run`] runs a
//!   scene that way, far faster than real time, to the same bytes every time;
//! - [`real_time`] starts sessions on real clocks and sockets: one pacing thread a process, two network threads a host
//!   ([`network_threads`]) around a [`transport`], one thread a host that simulates a soft object, one recorder thread. A [`session_handle::SessionHandle`] is the rest of the program's view of it.
//!
//! Both write the same recording ([`record`], [`recorder`]), which [`recording`] reads, [`export`] turns into tables
//! and [`replay`] simulates again, bit for bit. A tick is due at `k·T_c` of session time; a host that is late skips to
//! the tick that is due, advances its world by one period and says so in the recording.
//!
//! ```
//! let scene = cotouch_scene::load("single-axis", &[])?;
//! let summary = cotouch_runtime::virtual_run::run(&scene, 0.5, None, |_elapsed_s| true)?;
//! assert_eq!(summary.haptic.due, summary.haptic.ticks + summary.haptic.missed);
//! assert!(summary.stable);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod change;
pub mod clock;
mod control;
mod device_choice;
pub mod exchange;
pub mod export;
mod faults;
mod guests;
mod haptic_host;
mod haptic_loop;
pub mod joining;
pub mod live;
mod mailbox;
mod messages;
pub mod network_threads;
pub mod observer;
mod options;
mod pointer;
mod priority;
pub mod real_time;
pub mod record;
pub mod recorder;
pub mod recording;
mod recording_thread;
pub mod replay;
pub mod session_handle;
pub mod slow;
pub mod slow_thread;
pub mod snapshot;
mod start_error;
pub mod station;
pub mod summary;
mod summary_of_run;
mod tick_fields;
mod timing;
pub mod transport;
pub mod virtual_run;
pub mod virtual_time;

pub use device_choice::DeviceChoice;
pub use faults::{DeviceFaults, FaultText};
pub use options::RealTimeOptions;
pub use pointer::{HeldBy, PointerHandle, Seat, TakeError};
pub use start_error::StartError;
