//! A whole run in virtual time: simulated hands, a recording, a summary.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use cotouch_device::{Device, DeviceOpenError};
use cotouch_scene::names::HostIndex;
use cotouch_scene::reference;
use cotouch_scene::scene::Scene;
use cotouch_soft::SoftError;

use crate::device_choice::{DeviceChoice, missing_fingers, open_device};
use crate::exchange::RecordSink;
use crate::record::{RecordItem, TickRecord};
use crate::recorder::{RecordError, Recorder};
use crate::recording_thread::{facts, header};
use crate::summary::Summary;
use crate::summary_of_run::{HostRun, summarise};
use crate::timing::Timing;
use crate::virtual_time::VirtualSession;

/// Ticks between two reports of progress.
const PROGRESS_TICKS: u64 = 1024;

/// After this time a device that still renders a force is let go of by ending anyway, s.
const LONGEST_RELEASE_S: f64 = 2.0;

/// Why a run in virtual time did not come to its end.
#[derive(Debug, thiserror::Error)]
pub enum VirtualRunError {
    /// The simulated hosts never all joined.
    #[error(
        "the hosts could not join within 10 simulated seconds; the simulated link loses, delays or holds back too much: {impaired}"
    )]
    NotJoined {
        /// What impairs the scene's link, as `KEY = VALUE`.
        impaired: String,
    },
    /// A user's device cannot be had.
    #[error(transparent)]
    Device(#[from] DeviceOpenError),
    /// The scene's soft object cannot be simulated.
    #[error(transparent)]
    Soft(#[from] SoftError),
    /// The recording cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordError),
}

/// Runs `scene` for `duration_s` of session time, then lets go of the hands. `progress` is told the session time (s)
/// now and then; the run ends early when it returns false. The same scene gives the same recording, byte for byte.
///
/// # Errors
/// When the hosts cannot join over the simulated link, or the recording cannot be written.
pub fn run(
    scene: &Scene,
    duration_s: f64,
    recording: Option<&Path>,
    progress: impl FnMut(f64) -> bool,
) -> Result<Summary, VirtualRunError> {
    run_observed(scene, duration_s, recording, progress, |_, _| {})
}

/// As [`run`], with the devices of `devices` instead of simulated hands for everybody. `tell` is told what a person is to
/// know of them, in words, before the run begins.
///
/// # Errors
/// As [`run`], and when a device cannot be had.
pub fn run_with_devices(
    scene: &Scene,
    devices: &[DeviceChoice],
    tell: impl FnMut(String),
    duration_s: f64,
    recording: Option<&Path>,
    progress: impl FnMut(f64) -> bool,
) -> Result<Summary, VirtualRunError> {
    let devices = open_devices(scene, devices)?;
    let notes = scene.hosts().zip(&devices).filter_map(|(host, device)| missing_fingers(scene, host, device));
    notes.for_each(tell);
    run_all(scene, devices, duration_s, recording, progress, |_, _| {})
}

/// As [`run`]; `observe` sees every tick of every host, the release afterwards left out.
///
/// # Errors
/// As [`run`].
pub fn run_observed(
    scene: &Scene,
    duration_s: f64,
    recording: Option<&Path>,
    progress: impl FnMut(f64) -> bool,
    observe: impl FnMut(HostIndex, &TickRecord),
) -> Result<Summary, VirtualRunError> {
    run_all(scene, open_devices(scene, &[])?, duration_s, recording, progress, observe)
}

/// Every key by which the link of `scene` is impaired, with its value.
fn impaired(scene: &Scene) -> String {
    let keys = reference::keys().into_iter().map(|key| key.name);
    let of_link = keys.filter(|key| key.starts_with("link.impairment."));
    let acting = of_link.filter_map(|key| Some((scene.number(&key).filter(|&value| value != 0.0)?, key)));
    acting.map(|(value, key)| format!("{key} = {value}")).collect::<Vec<_>>().join(", ")
}

fn run_all(
    scene: &Scene,
    devices: Vec<Box<dyn Device>>,
    duration_s: f64,
    recording: Option<&Path>,
    mut progress: impl FnMut(f64) -> bool,
    mut observe: impl FnMut(HostIndex, &TickRecord),
) -> Result<Summary, VirtualRunError> {
    let recorder = recording.map(|path| Recorder::create(path, &header(scene, 0))).transpose()?;
    let recorder = recorder.map(|recorder| Arc::new(Mutex::new(recorder)));
    let mut session = new_session(scene, devices, recorder.as_ref())?;
    if !session.run_to_tick(0, |_, _| {}) {
        return Err(VirtualRunError::NotJoined { impaired: impaired(scene) });
    }
    let rate = scene.rates.control_hz;
    let end = rate.ticks_in(duration_s);
    let mut tick = 0;
    while tick < end {
        tick = end.min(tick + PROGRESS_TICKS);
        session.run_to_tick(tick, &mut observe);
        if !progress(rate.instant(tick).as_secs_f64()) {
            break;
        }
    }
    let mut summary = summarise(scene, rate.instant(tick).as_secs_f64(), &runs(&session));
    release(&mut session, tick, tick + rate.ticks_in(LONGEST_RELEASE_S));
    drop(session);
    if let (Some(recorder), Some(path)) = (recorder.and_then(Arc::into_inner), recording) {
        // What came of the run is not lost with its recording.
        match recorder.into_inner().unwrap_or_else(PoisonError::into_inner).finish(facts(&summary)) {
            Ok(_) => summary.recording = Some(path.display().to_string()),
            Err(error) => summary.failures.push(error.to_string()),
        }
    }
    Ok(summary)
}

fn new_session(
    scene: &Scene,
    devices: Vec<Box<dyn Device>>,
    recorder: Option<&Arc<Mutex<Recorder>>>,
) -> Result<VirtualSession<Box<dyn Device>>, SoftError> {
    let mut devices = devices.into_iter();
    VirtualSession::with_devices(scene, |_| {
        let sink =
            recorder.map(|recorder| Box::new(Shared(Arc::clone(recorder))) as Box<dyn RecordSink + Send>);
        (devices.next().expect("one a host"), sink)
    })
}

fn open_devices(scene: &Scene, choices: &[DeviceChoice]) -> Result<Vec<Box<dyn Device>>, DeviceOpenError> {
    scene.hosts().map(|host| open_device(scene, host, choices, ())).collect()
}

/// Runs on until no device renders a force any more.
fn release(session: &mut VirtualSession<Box<dyn Device>>, tick: u64, longest: u64) {
    let hosts: Vec<HostIndex> = session.hosts().iter().map(|host| host.station.model.host).collect();
    for &host in &hosts {
        session.host_mut(host).station.release();
    }
    let mut next = tick;
    while next < longest && !session.hosts().iter().all(|host| host.station.is_released()) {
        next += 1;
        session.run_to_tick(next, |_, _| {});
    }
}

fn runs(session: &VirtualSession<Box<dyn Device>>) -> Vec<HostRun> {
    let run = |host: &crate::virtual_time::VirtualHost<Box<dyn Device>>| {
        let timing = Timing { ticks: host.station.state.host.ticks_done, ..Timing::new() };
        HostRun::new(&host.station, timing).with_network(&host.endpoint)
    };
    session.hosts().iter().map(run).collect()
}

/// All stations write into one recording, in the order of events.
struct Shared(Arc<Mutex<Recorder>>);

impl RecordSink for Shared {
    fn record(&mut self, item: &RecordItem) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).record(item);
    }
}
