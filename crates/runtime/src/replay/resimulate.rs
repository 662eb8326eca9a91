//! Feeding recorded inputs to fresh stations.

use std::collections::BTreeMap;
use std::io::Read;
use std::sync::Arc;

use cotouch_device::{Device, DeviceError, DeviceLimits, ForceSwitch, HeldWrenches};
use cotouch_host::SlowLoop;
use cotouch_scene::SceneErrors;
use cotouch_scene::geometry::{Readings, Wrench, Wrenches};
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_soft::SoftError;
use glam::DVec3;

use super::comparison::{Comparison, Difference, TickDifference};
use crate::change::HostChange;
use crate::record::{Note, RecordItem, RecordKind, TickRecord};
use crate::recording::{RecordingError, RecordingReader};
use crate::slow::{SlowPort, is_simulated_at, slow_simulation};
use crate::station::{Punctuality, Station, StationState};
use crate::summary::Summary;
use crate::summary_of_run::{HostRun, summarise};
use crate::timing::Timing;

/// What came of a replay.
#[derive(Clone, Debug, PartialEq)]
pub struct Replayed {
    /// Ticks compared, and the first difference.
    pub comparison: Comparison,
    /// Ticks that could not be compared, because items before them are missing in the recording.
    pub skipped: u64,
    /// Whether the recording stops without having been finished.
    pub ended_abruptly: bool,
    /// What the run was, as the observers of the replayed hosts saw it, with each of its settings. When ticks came, and what
    /// the network did, is not known. `None` where ticks are missing.
    pub run: Option<Summary>,
}

/// Why a recording cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The file does not read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Its scene does not read.
    #[error("the scene in the recording cannot be used: {0}")]
    Scene(SceneErrors),
    /// Its soft object cannot be simulated.
    #[error("the soft object in the recording cannot be simulated: {0}")]
    Soft(#[from] SoftError),
    /// A changed scene in it does not read, or is not one that the session could change to.
    #[error("the scene that the recording changes to at tick {tick} cannot be used: {why}")]
    Change {
        /// The tick before which it changes.
        tick: u64,
        /// What is wrong with it.
        why: String,
    },
    /// It speaks of a host that its scene does not have.
    #[error("the recording speaks of {host}; its scene has {users} hosts")]
    Host {
        /// The host that the scene lacks.
        host: HostIndex,
        /// Hosts of the scene.
        users: u8,
    },
}

/// Re-simulates a recording and compares. `progress` is told how many ticks are done, now and then.
///
/// # Errors
/// When the recording or its scene does not read.
pub fn replay<R: Read>(
    mut recording: RecordingReader<R>,
    mut progress: impl FnMut(u64),
) -> Result<Replayed, ReplayError> {
    let text = recording.header().scene_toml.clone();
    let scene = cotouch_scene::parse(&text, "the recorded scene", None, &[]).map_err(ReplayError::Scene)?;
    let simulation = slow_simulation(&scene)?;
    let mut hosts: BTreeMap<HostIndex, Resimulated> = BTreeMap::new();
    let mut comparison = Comparison::default();
    for item in recording.by_ref() {
        let item = item?;
        let (host, users) = (item.host, scene.session.users);
        if host.0 >= users {
            return Err(ReplayError::Host { host, users });
        }
        let limits = match &item.kind {
            RecordKind::Device(device) => device.limits(),
            // Recordings of old began with something else, and had devices without limits.
            _ => DeviceLimits::POINT,
        };
        let begin = || Resimulated::new(&scene, host, simulation.as_ref(), limits);
        hosts.entry(host).or_insert_with(begin).take(item, &mut comparison)?;
        if comparison.ticks.is_multiple_of(1024) {
            progress(comparison.ticks);
        }
    }
    let skipped = hosts.values().map(|host| host.skipped).sum();
    Ok(Replayed {
        comparison,
        skipped,
        ended_abruptly: recording.end().is_none_or(|end| end.ended_abruptly),
        run: (skipped == 0).then(|| run(&scene, hosts.values())),
    })
}

fn run<'a>(scene: &Scene, hosts: impl Iterator<Item = &'a Resimulated>) -> Summary {
    let run = |host: &Resimulated| {
        let timing = Timing { ticks: host.station.state.host.ticks_done, ..Timing::new() };
        HostRun::new(&host.station, timing)
    };
    let runs: Vec<(u64, HostRun)> =
        hosts.map(|host| (host.station.observer.observed_ticks(), run(host))).collect();
    let ticks = runs.iter().map(|(ticks, _)| *ticks).max().unwrap_or(0);
    let runs: Vec<HostRun> = runs.into_iter().map(|(_, run)| run).collect();
    summarise(scene, scene.rates.control_hz.instant(ticks).as_secs_f64(), &runs)
}

/// One host that is fed from a recording.
struct Resimulated {
    station: Station<RecordedDevice>,
    /// Whether the station's state is what the recorded host's was: from a recorded state on, until a gap.
    in_step: bool,
    skipped: u64,
}

impl Resimulated {
    fn new(scene: &Scene, host: HostIndex, simulation: Option<&SlowLoop>, limits: DeviceLimits) -> Self {
        let mut station = Station::new(scene, host, RecordedDevice::new(limits), None);
        if let Some(simulation) = simulation.filter(|_| is_simulated_at(scene, host)) {
            station = station.with_soft(SlowPort::replayed(scene, simulation.clone()));
        }
        Self { station, in_step: false, skipped: 0 }
    }

    fn take(&mut self, item: RecordItem, comparison: &mut Comparison) -> Result<(), ReplayError> {
        match item.kind {
            RecordKind::Received { from, packet } => self.station.receive(from, &packet),
            RecordKind::Presence { peer, present } => self.station.set_present(peer, present),
            RecordKind::Adopt => self.station.adopt_world(),
            RecordKind::Release => self.station.release(),
            RecordKind::ForceOff => self.station.force_off(),
            RecordKind::Changed(scene_toml) => self.change(item.host, item.tick, &scene_toml)?,
            RecordKind::Surface(surface) => {
                if let Some(soft) = self.station.soft_mut() {
                    soft.take_as_recorded(surface.period);
                }
            }
            RecordKind::Note(Note::Dropped { .. }) => self.in_step = false,
            RecordKind::State(bytes) => self.meet_state(item.host, item.tick, &bytes, comparison),
            RecordKind::Tick(tick) if self.in_step => {
                let replayed = self.tick(item.tick, &tick);
                comparison.compare(item.host, item.tick, &tick, &replayed);
            }
            RecordKind::Tick(_) => self.skipped += 1,
            RecordKind::Sent { .. } | RecordKind::Note(_) | RecordKind::Device(_) => {}
        }
        Ok(())
    }

    fn change(&mut self, host: HostIndex, tick: u64, scene_toml: &str) -> Result<(), ReplayError> {
        let scene = cotouch_scene::parse(scene_toml, "the changed scene", None, &[])
            .map_err(|errors| ReplayError::Change { tick, why: errors.to_string() })?;
        let has_host = host.0 < scene.session.users;
        if has_host && self.station.change(&mut HostChange::new(&scene, host)) {
            return Ok(());
        }
        Err(ReplayError::Change {
            tick,
            why: "it has other users, bodies or walls than the scene before".to_owned(),
        })
    }

    fn tick(&mut self, tick: u64, recorded: &TickRecord) -> TickRecord {
        self.station.device.readings = recorded.readings.clone();
        self.station.device.failed = recorded.device_failed;
        self.station.begin(tick);
        self.station.respond(|_, _| {});
        self.station.finish(Punctuality::default).clone()
    }

    /// Whether the recorded state is all that there is to know. That of a soft body is not recorded: it is known before
    /// the first tick only.
    fn can_begin_with(&self, state: &StationState) -> bool {
        let is_whole = self.station.soft().is_none() || state.host.ticks_done == 0;
        is_whole && state.fits(&self.station.model)
    }

    /// A whole recorded state: compared where the station is in step, taken over where it is not.
    fn meet_state(&mut self, host: HostIndex, tick: u64, bytes: &[u8], comparison: &mut Comparison) {
        let own = postcard::to_allocvec(&self.station.state).unwrap_or_default();
        if self.in_step {
            if own != bytes && comparison.first_difference.is_none() {
                let difference = Difference {
                    field: "the whole state".to_owned(),
                    recorded: format!("{} bytes", bytes.len()),
                    replayed: format!("{} other bytes", own.len()),
                };
                comparison.first_difference = Some(TickDifference { host, tick, difference });
            }
        } else if let Some(state) =
            postcard::from_bytes::<StationState>(bytes).ok().filter(|state| self.can_begin_with(state))
        {
            self.station.state.take_over(state);
            self.in_step = true;
        }
    }
}

/// Reports what was recorded; what is rendered goes nowhere.
#[derive(Clone, Debug)]
struct RecordedDevice {
    limits: DeviceLimits,
    readings: Readings,
    failed: bool,
    force: HeldWrenches,
}

impl RecordedDevice {
    fn new(limits: DeviceLimits) -> Self {
        Self { limits, readings: Readings::new(), failed: false, force: HeldWrenches::new(MAX_FINGERS) }
    }
}

impl Device for RecordedDevice {
    fn name(&self) -> &str {
        "recording"
    }

    /// As many as the station wants; the recorded state says how many there were.
    fn fingers(&self) -> usize {
        MAX_FINGERS
    }

    fn limits(&self) -> DeviceLimits {
        self.limits
    }

    fn force_switch(&self) -> Arc<dyn ForceSwitch> {
        self.force.switch()
    }

    /// What was recorded had been moved already.
    fn recentre(&mut self, _: DVec3) {}

    fn read(&mut self, _tick: u64) -> Result<Readings, DeviceError> {
        if self.failed {
            return Err(DeviceError::driver("as recorded"));
        }
        Ok(self.readings.clone())
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        self.force.write(wrenches)
    }

    fn rendered(&self) -> Wrenches {
        self.force.rendered()
    }
}
