//! Sessions in virtual time and in real time; recorder and replay.
//!
//! A [`Station`] is one host with its device and its governor, as a value that is stepped. Everything else here decides
//! *when* it is stepped and what it hears:
//!
//! - [`VirtualSession`] holds a whole session in one thread, with simulated links and clocks; [`virtual_run`] runs a
//!   scene that way, far faster than real time, to the same bytes every time;
//! - [`real_time`] starts sessions on real clocks and sockets: one pacing thread a process, two network threads a host
//!   ([`NetworkThreads`]) around a [`transport`], one thread a host that simulates a soft object, one recorder thread, and a
//!   watchdog that switches forces off when ticks do not come. A [`SessionHandle`] is the rest of the program's view of it.
//!
//! Both write the same recording (a [`Recorder`] writes [`RecordItem`]s), which [`RecordingReader`] reads, [`export_csv`]
//! turns into tables and [`replay()`] simulates again, bit for bit. A tick is due at `k·T_c` of session time; a host that is
//! late skips to the tick that is due, advances its world by one period and says so in the recording.
//!
//! ```
//! let scene = cotouch_scene::load("single-axis", &[])?;
//! let summary = cotouch_runtime::virtual_run::run(&scene, 0.5, None, |_elapsed_s| true)?;
//! assert_eq!(summary.haptic.due, summary.haptic.ticks + summary.haptic.missed);
//! assert!(summary.stable);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod change;
pub mod clock;
mod control;
mod data_age;
mod demand;
mod device_choice;
mod exchange;
mod export;
mod failures;
mod faults;
mod force_off;
mod guests;
mod haptic_host;
mod haptic_loop;
mod heartbeat;
mod joining;
mod live;
mod mailbox;
mod messages;
mod network_threads;
mod observer;
mod options;
mod own_limits;
mod pointer;
mod priority;
pub mod real_time;
mod record;
mod recorder;
mod recording;
mod recording_thread;
mod replay;
mod session_handle;
mod settings_log;
mod slow;
mod slow_thread;
mod snapshot;
mod start_error;
mod station;
mod summary;
mod summary_of_run;
mod tick_fields;
mod timing;
pub mod transport;
pub mod virtual_run;
mod virtual_time;
mod watchdog;

pub use change::HostChange;
pub use demand::scripted_demand;
pub use device_choice::DeviceChoice;
pub use exchange::{RECORD_RING_BYTES, RecordConsumer, RecordProducer, RecordSink, record_ring};
pub use export::{ExportError, export_csv};
pub use failures::Failures;
pub use faults::{DeviceFaults, FaultText};
pub use force_off::switch_off_all_forces;
pub use joining::full_session_endpoint;
pub use live::{ChangeError, Changed, LiveSession, Starter, numbered_path, plain_name};
pub use network_threads::{HapticPort, Inbound, NetworkThreads, Outbound};
pub use observer::{
    Diverged, Divergence, LiveVerdict, Observer, Rendered, RunVerdict, SettingsVerdict, Shaking,
};
pub use options::RealTimeOptions;
pub use own_limits::OwnLimits;
pub use pointer::{HeldBy, PointerHandle, Seat, TakeError};
pub use record::{DeviceRecord, Note, RecordItem, RecordKind, SurfaceRecord, TickRecord};
pub use recorder::{MAX_MESSAGE_BYTES, RecordError, Recorder, RecordingHeader, RecordingSummary};
pub use recording::{Recording, RecordingEnd, RecordingError, RecordingReader};
pub use replay::{Comparison, Difference, ReplayError, Replayed, TickDifference, replay};
pub use session_handle::{LOOK_PERIOD, SessionHandle};
pub use slow::{SlowPort, slow_simulation};
pub use slow_thread::start_slow_thread;
pub use snapshot::{FingerSnapshot, HostSnapshot, LinkSnapshot, Snapshot, SurfaceShown};
pub use start_error::StartError;
pub use station::{Punctuality, Station, StationState};
pub use summary::{
    DeviceFaultSummary, DivergedSummary, EarlierSession, ExpelledSummary, HapticSummary, LatenessSummary,
    NetworkSummary, ObjectSummary, PassivitySummary, Percentiles, Predicted, PredictedForDelay,
    RoundTripSummary, SettingValue, SettingsSummary, ShakingSummary, SoftSummary, Summary, Unproven,
    UserSummary,
};
pub use virtual_time::{VirtualHost, VirtualSession};
