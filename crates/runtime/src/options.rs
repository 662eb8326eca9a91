//! What the caller of a session in real time decides.

use std::path::PathBuf;

use cotouch_scene::scene::Impairment;

use crate::device_choice::DeviceChoice;
use crate::own_limits::OwnLimits;

/// What the caller decides about a session in real time.
#[derive(Clone, Debug, Default)]
pub struct RealTimeOptions {
    /// Session time after which the run ends; `None` runs until it is stopped.
    pub duration_s: Option<f64>,
    /// Where the recording goes; `None` records nothing.
    pub recording: Option<PathBuf>,
    /// An impairment of every way out of this process.
    pub impairment: Option<Impairment>,
    /// Which devices the users of this process have; the simulated hand where nothing is said.
    pub devices: Vec<DeviceChoice>,
    /// What this host allows at most, whatever the scene asks for. Where nothing is said: the scene's own limits, and those of
    /// [`OwnLimits::BUILT_IN`] where the scene comes from a server.
    pub limits: Option<OwnLimits>,
}
