//! One host with its device and its governor, without sockets and clocks: the same in virtual time, in real time and
//! in a replay.
//!
//! An instant has three phases. All hosts [`Station::begin`]: the device is read and, at a network step, the host
//! says where it is. What has arrived by now is handed over with [`Station::receive`]. Then [`Station::respond`]: due
//! samples come into use and, at a network step, a server answers its clients. Then [`Station::finish`]: forces are
//! computed and governed, the device renders, and the world moves on by one period.

use arrayvec::ArrayVec;
use cotouch_device::{
    Acted, Device, DeviceError, Governor, GovernorInput, GovernorOutput, GovernorState, PortEnergy, WorldView,
};
use cotouch_host::{HostModel, HostState, Role, TickOutput};
use cotouch_net::StatePacket;
use cotouch_scene::geometry::{Pose, Reading, Readings, Wrench, Wrenches};
use cotouch_scene::limits::{MAX_BODIES, MAX_FINGERS};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::change::HostChange;
use crate::data_age::DataAge;
use crate::exchange::RecordSink;
use crate::faults::DeviceFaults;
use crate::observer::{Observer, Rendered};
use crate::record::{DeviceRecord, Note, RecordItem, RecordKind, SurfaceRecord, TickRecord};
use crate::settings_log::SettingsLog;
use crate::slow::SlowPort;
use crate::summary::PassivitySummary;

/// A finger that has moved farther than this (m) while its device did not say where it is has moved unseen.
const UNSEEN_MOVE_M: f64 = 1e-3;

/// Room for what a station's state has besides its host's, serialised.
const STATE_BYTES: usize = 4 << 10;

/// A host that renders at a device.
///
/// It belongs to one thread and shares nothing with any other: there is no lock in it, and whoever records or transmits
/// does so behind queues that never wait ([`crate::record_ring`], [`crate::HapticPort`]). After the first
/// instants it allocates nothing.
pub struct Station<D> {
    /// What does not change about the host.
    pub model: HostModel,
    /// Everything that changes and that a replay re-creates.
    pub state: StationState,
    /// The device in the user's hand.
    pub device: D,
    /// Judges the run.
    pub observer: Observer,
    governor: Governor,
    /// Where fingers start, m.
    starts: ArrayVec<DVec3, MAX_FINGERS>,
    settings: SettingsLog,
    data_age: DataAge,
    /// The way to the simulation of a soft object, where this host has one.
    soft: Option<SlowPort>,
    /// Where surfaces are put together for the recording, so that it allocates nothing.
    surface: SurfaceRecord,
    /// Finger-ticks at which the passivity controller braked.
    braked_ticks: u64,
    faults: DeviceFaults,
    /// After a longer gap between ticks, forces begin again softly.
    watchdog_ticks: u64,
    sink: Option<Box<dyn RecordSink + Send>>,
    /// Where states are serialised, so that recording one allocates nothing.
    state_bytes: Vec<u8>,
    instant: Instant,
    /// Of the last tick; large, so that it is made in place.
    output: TickOutput,
    record: TickRecord,
}

/// What a replay re-creates, as a value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StationState {
    /// The host's own state.
    pub host: HostState,
    /// One governor's a finger of the device; their number is that of the fingers.
    pub governors: ArrayVec<GovernorState, MAX_FINGERS>,
    /// What went through the device's port, at each finger.
    pub ports: ArrayVec<PortEnergy, MAX_FINGERS>,
    /// Whether the governor is to let go.
    pub releasing: bool,
    /// The last tick that was done.
    pub last_tick: Option<u64>,
    /// The last good readings: what counts while the device fails.
    pub last_readings: Readings,
}

impl StationState {
    /// Takes over another state, but for the frames of the soft body in use, which are not saved with a state.
    pub(crate) fn take_over(&mut self, other: Self) {
        let before = std::mem::replace(self, other);
        self.host.soft.frame = before.host.soft.frame;
        self.host.soft.previous = before.host.soft.previous;
    }

    /// Whether this is a state of a station of `model`: one that was read may be of another scene.
    #[must_use]
    pub fn fits(&self, model: &HostModel) -> bool {
        let fingers = self.governors.len();
        self.host.fits(model)
            && (1..=model.own_fingers()).contains(&fingers)
            && self.ports.len() == fingers
            && self.last_readings.len() == fingers
    }
}

/// What is known of the instant that is being worked on.
#[derive(Clone, Debug, Default)]
struct Instant {
    tick: u64,
    step: Option<u64>,
    readings: Readings,
    device_failed: bool,
    /// Why the device was not read, or not written.
    fault: Option<DeviceError>,
    /// Ticks that were left out before this one.
    skipped: u64,
    /// Whether frames of the slow simulation that are due have been taken.
    frames_taken: bool,
}

/// How a tick went in real time; zeros in virtual time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Punctuality {
    /// How late the tick began, ns.
    pub lateness_ns: i64,
    /// How long it has taken so far, ns.
    pub compute_ns: i64,
}

impl<D: Device> Station<D> {
    /// The station of `host` in `scene`, before its first tick.
    #[must_use]
    pub fn new(
        scene: &Scene,
        host: HostIndex,
        device: D,
        mut sink: Option<Box<dyn RecordSink + Send>>,
    ) -> Self {
        let model = HostModel::new(scene, host);
        let governor = Governor::new(scene, device.limits());
        let fingers = device.fingers().clamp(1, model.own_fingers());
        let state = StationState {
            host: HostState::new(&model),
            governors: std::iter::repeat_n(governor.start(), fingers).collect(),
            ports: std::iter::repeat_n(PortEnergy::default(), fingers).collect(),
            releasing: false,
            last_tick: None,
            last_readings: resting(scene, host, fingers),
        };
        let starts = state.last_readings.iter().map(|reading| reading.pose.position).collect();
        let state_bytes = if sink.is_some() { STATE_BYTES + model.state_bytes() } else { 0 };
        if let Some(sink) = &mut sink {
            let kind = RecordKind::Device(DeviceRecord::new(device.name(), device.limits()));
            sink.record(&RecordItem { host, tick: 0, kind });
        }
        Self {
            state,
            device,
            observer: Observer::new(scene, fingers),
            settings: SettingsLog::new(scene),
            data_age: DataAge::new(scene),
            governor,
            starts,
            soft: None,
            surface: SurfaceRecord::default(),
            braked_ticks: 0,
            faults: DeviceFaults::default(),
            watchdog_ticks: scene.rates.control_hz.ticks_in(scene.governor.watchdog_s),
            state_bytes: Vec::with_capacity(state_bytes),
            sink,
            instant: Instant::default(),
            output: TickOutput::default(),
            record: TickRecord::default(),
            model,
        }
    }

    /// The same station, before its first tick, with the simulation of its scene's soft object.
    #[must_use]
    pub fn with_soft(mut self, port: SlowPort) -> Self {
        let rest = port.rest_frame();
        if self.sink.is_some() {
            self.surface.fill(&rest);
        }
        self.model.take_frame(&mut self.state.host, 0, rest);
        self.soft = Some(port);
        self
    }

    /// The way to the simulation of a soft object, where this host has one.
    #[must_use]
    pub fn soft(&self) -> Option<&SlowPort> {
        self.soft.as_ref()
    }

    /// The same, to change what is on it.
    pub fn soft_mut(&mut self) -> Option<&mut SlowPort> {
        self.soft.as_mut()
    }

    /// The same station, not recorded: what it does leaves the original alone.
    #[cfg(feature = "testing")]
    #[must_use]
    pub fn fork(&self) -> Self
    where
        D: Clone,
    {
        Self {
            model: self.model.clone(),
            state: self.state.clone(),
            device: self.device.clone(),
            observer: self.observer.clone(),
            governor: self.governor.clone(),
            starts: self.starts.clone(),
            settings: self.settings.clone(),
            data_age: self.data_age.clone(),
            soft: self.soft.as_ref().and_then(SlowPort::fork),
            surface: SurfaceRecord::default(),
            braked_ticks: self.braked_ticks,
            faults: self.faults.clone(),
            watchdog_ticks: self.watchdog_ticks,
            sink: None,
            state_bytes: Vec::new(),
            instant: self.instant.clone(),
            output: self.output.clone(),
            record: self.record.clone(),
        }
    }

    /// Phase 1 of the instant of `tick`: reads the device. What the host says to all its peers, at a network step.
    ///
    /// No allocation, no lock, no system call besides the device's.
    pub fn begin(&mut self, tick: u64) -> Option<StatePacket> {
        if self.state.last_tick.is_none() {
            self.device.start(tick);
        }
        self.record_state_every_second(tick);
        let had_failed = self.instant.device_failed;
        self.instant.fault = self.read_device(tick).err();
        let device_failed = self.instant.fault.is_some();
        if device_failed {
            refill(&mut self.instant.readings, self.state.last_readings.iter().copied());
        }
        let step = self.model.step_due(&self.state.host, tick);
        let skipped = self.state.last_tick.map_or(0, |last| tick.saturating_sub(last + 1));
        (self.instant.tick, self.instant.step) = (tick, step);
        (self.instant.device_failed, self.instant.skipped) = (device_failed, skipped);
        self.instant.frames_taken = false;
        if skipped > 0 {
            self.record(|| RecordKind::Note(Note::Skipped { ticks: skipped }));
        }
        if skipped > self.watchdog_ticks || (had_failed && !device_failed && self.has_moved()) {
            self.state.host.fingers_moved_unseen();
        }
        self.model.look(&mut self.state.host, &self.instant.readings, &self.state.last_readings);
        let packet = self.model.sample(&mut self.state.host, step?, &self.instant.readings)?;
        self.record(|| RecordKind::Sent { to: None, packet: packet.clone() });
        Some(packet)
    }

    /// Hands over a packet that has arrived.
    pub fn receive(&mut self, from: HostIndex, packet: &StatePacket) {
        self.record(|| RecordKind::Received { from, packet: packet.clone() });
        self.model.receive(&mut self.state.host, from, packet);
    }

    /// Takes note that a peer came or went.
    pub fn set_present(&mut self, peer: HostIndex, present: bool) {
        self.record(|| RecordKind::Presence { peer, present });
        self.state.host.set_present(peer, present);
    }

    /// For a host that joins a session that is under way: it takes the world from the first peer that it hears.
    pub fn adopt_world(&mut self) {
        self.record(|| RecordKind::Adopt);
        // A soft body is not told of: every host begins with it at rest.
        self.state.host.adopting = self.model.body_count() > 0;
    }

    /// Goes on with other constants, if the state is one of them; whether it is. What was before stays in `change`, to be
    /// dropped elsewhere. No allocation, no lock.
    pub fn change(&mut self, change: &mut HostChange) -> bool {
        if change.model.host != self.model.host || !self.state.fits(&change.model) {
            return false;
        }
        let next_tick = self.state.last_tick.map_or(0, |last| last + 1);
        if let Some(sink) = &mut self.sink {
            let scene_toml = std::mem::take(&mut change.scene_toml);
            let kind = RecordKind::Changed(scene_toml);
            let item = RecordItem { host: self.model.host, tick: next_tick, kind };
            sink.record(&item);
            if let RecordKind::Changed(scene_toml) = item.kind {
                change.scene_toml = scene_toml;
            }
        }
        std::mem::swap(&mut self.model, &mut change.model);
        self.governor = Governor::new(&change.scene, self.device.limits());
        self.settings.change(&mut change.scene, &mut self.observer, next_tick);
        true
    }

    /// Lets go of the user, smoothly.
    pub fn release(&mut self) {
        if !self.state.releasing {
            self.record(|| RecordKind::Release);
            self.state.releasing = true;
        }
    }

    /// Takes note that the device's force was switched off from outside, because the loop stood still: forces begin again from
    /// nothing, through the soft start, and contacts where fingers are now. The switch is not touched. No allocation.
    pub fn force_off(&mut self) {
        self.record(|| RecordKind::ForceOff);
        self.state.governors.iter_mut().for_each(GovernorState::force_off);
        self.state.host.fingers_moved_unseen();
        for (port, reading) in self.state.ports.iter_mut().zip(&self.state.last_readings) {
            port.hold(reading, Wrench::default());
        }
    }

    /// Whether the device renders no force any more after a [`release`](Self::release).
    #[must_use]
    pub fn is_released(&self) -> bool {
        self.state.releasing && self.state.governors.iter().all(GovernorState::is_released)
    }

    /// Phase 2, a server's: at a network step due samples come into use, and `send` is handed what it answers its clients.
    pub fn respond(&mut self, mut send: impl FnMut(HostIndex, &StatePacket)) {
        let (Role::Server, Some(step)) = (self.model.role, self.instant.step) else { return };
        // Only here: what the server's answer brings to a client at this very instant must not count as late there.
        self.play_out();
        for client in self.model.sources() {
            if let Some(packet) = self.model.respond(&self.state.host, step, &self.instant.readings, client) {
                self.record(|| RecordKind::Sent { to: Some(client), packet: packet.clone() });
                send(client, &packet);
            }
        }
    }

    /// Phase 3: forces from what is known now, through the governors to the device, and the world one period on.
    ///
    /// No allocation, no lock, no system call besides the device's.
    pub fn finish(&mut self, punctuality: impl FnOnce() -> Punctuality) -> &TickRecord {
        self.play_out();
        if let Some(step) = self.instant.step.filter(|_| !self.state.releasing) {
            self.data_age.observe(&self.model, &self.state.host, step);
        }
        let tick = self.instant.tick;
        self.state.last_tick = Some(tick);
        refill(&mut self.state.last_readings, self.instant.readings.iter().copied());
        let mut view = ArrayVec::<Pose, MAX_BODIES>::new();
        view.extend(self.state.host.bodies.iter().map(|body| body.pose));
        self.model.tick_into(&mut self.state.host, tick, &self.instant.readings, &mut self.output);
        if let (Some(soft), Some(input)) = (&mut self.soft, &self.output.slow) {
            soft.ask(input);
        }
        for (port, reading) in self.state.ports.iter_mut().zip(&self.instant.readings) {
            port.arrive(reading);
        }
        let governed = self.govern();
        let commanded: Wrenches = governed.iter().map(|finger| finger.commanded).collect();
        self.device.observe(&WorldView { bodies: &view });
        let written = self.device.write(&commanded);
        self.instant.fault = self.instant.fault.take().or(written.err());
        for ((port, reading), wrench) in
            self.state.ports.iter_mut().zip(&self.instant.readings).zip(&commanded)
        {
            port.hold(reading, *wrench);
        }
        // What a hand does when its force is taken away says nothing about the loop.
        if !self.state.releasing {
            self.braked_ticks +=
                governed.iter().filter(|finger| finger.acted.contains(Acted::PASSIVITY)).count() as u64;
            let rendered = governed
                .iter()
                .map(|finger| Rendered { force_n: finger.commanded.force, acted: finger.acted });
            self.observer.observe(tick, rendered, self.output.diverged);
        }
        if let Some(text) = self.faults.observe(self.device.name(), self.instant.fault.take()) {
            self.record(|| RecordKind::Note(Note::DeviceFault(text)));
        }
        self.fill_record(&governed, &commanded);
        let Punctuality { lateness_ns, compute_ns } = punctuality();
        (self.record.lateness_ns, self.record.compute_ns) = (lateness_ns, compute_ns);
        if let Some(sink) = &mut self.sink {
            let kind = RecordKind::Tick(self.record.clone());
            sink.record(&RecordItem { host: self.model.host, tick, kind });
        }
        &self.record
    }

    /// What came of the last tick.
    #[must_use]
    pub fn last_record(&self) -> &TickRecord {
        &self.record
    }

    /// Whether a finger is elsewhere than it was a tick ago, by more than it may move in some ticks.
    fn has_moved(&self) -> bool {
        let moved = |(now, last): (&Reading, &Reading)| {
            (now.pose.position - last.pose.position).length() > UNSEEN_MOVE_M
        };
        self.instant.readings.iter().zip(&self.state.last_readings).any(moved)
    }

    /// Each finger's wrench through that finger's governor.
    fn govern(&mut self) -> ArrayVec<GovernorOutput, MAX_FINGERS> {
        let skipped_too_many = self.instant.skipped > self.watchdog_ticks;
        let stop = self.state.releasing || self.output.diverged || skipped_too_many;
        let link_ok = self.model.role != Role::Client || self.state.host.peers[0].present;
        let fresh = !self.instant.device_failed;
        let fingers = self.state.governors.iter_mut().zip(&self.state.ports).zip(&self.starts);
        let fingers = fingers.zip(&self.output.device).zip(&self.instant.readings);
        let govern = |((((state, port), &start), &requested), &reading): (
            (((&mut GovernorState, &PortEnergy), _), _),
            &Reading,
        )| {
            let (from_start, deficit_j) = (reading.pose.position - start, port.deficit_j());
            let input = GovernorInput { requested, reading, from_start, stop, link_ok, fresh, deficit_j };
            self.governor.govern(state, &input)
        };
        fingers.map(govern).collect()
    }

    /// Takes one reading a finger. A device that gives fewer has failed, and so has one that reports what is no number: the world, which
    /// would be lost with it for good, goes on with the reading of before.
    fn read_device(&mut self, tick: u64) -> Result<(), DeviceError> {
        let expected = self.state.governors.len();
        let readings = self.device.read(tick)?;
        let found = readings.len();
        let readings = readings.get(..expected).ok_or(DeviceError::MissingFingers { found, expected })?;
        if let Some(finger) = readings.iter().position(|reading| !reading.is_finite()) {
            return Err(DeviceError::ReadingNotFinite { finger: finger + 1 });
        }
        refill(&mut self.instant.readings, readings.iter().copied());
        Ok(())
    }

    /// Puts due samples and surfaces into use. A host that has waited for the world meets it where it is: where bodies
    /// have no surface, the device's frame is moved so that the hand is at the object.
    fn play_out(&mut self) {
        let tick = self.instant.tick;
        let was_adopting = self.state.host.adopting;
        self.model.play_out(&mut self.state.host, tick);
        self.take_frames();
        if was_adopting
            && !self.state.host.adopting
            && !self.model.has_surfaces()
            && let Some(body) = self.state.host.bodies.first()
        {
            self.device.recentre(body.pose.position);
            // The reading of before stands in for one that fails, as a replay finds it recorded.
            let again = self.read_device(tick);
            self.instant.fault = self.instant.fault.take().or(again.err());
        }
    }

    /// Brings the frames of the slow simulation that are due into use, once an instant: what a server answers is what its
    /// tick finds.
    fn take_frames(&mut self) {
        let tick = self.instant.tick;
        let Some(soft) = self.soft.as_mut().filter(|_| !self.instant.frames_taken) else { return };
        self.instant.frames_taken = true;
        while let Some(frame) = soft.due(tick) {
            if let Some(sink) = &mut self.sink {
                self.surface.fill(&frame);
                let kind = RecordKind::Surface(std::mem::take(&mut self.surface));
                let item = RecordItem { host: self.model.host, tick, kind };
                sink.record(&item);
                if let RecordKind::Surface(surface) = item.kind {
                    self.surface = surface;
                }
            }
            // What is given back here lives on in the simulation, which uses it again: nothing is freed.
            self.model.take_frame(&mut self.state.host, tick, frame);
        }
    }

    fn fill_record(&mut self, governed: &ArrayVec<GovernorOutput, MAX_FINGERS>, commanded: &Wrenches) {
        let (host, output) = (&self.state.host, &self.output);
        let energy_j = self.energy_j();
        let record = &mut self.record;
        record.instant = self.model.schedule.control().instant(self.instant.tick);
        refill(&mut record.readings, self.instant.readings.iter().copied());
        record.device_failed = self.instant.device_failed;
        refill(&mut record.steps_in_use, host.steps_in_use());
        refill(&mut record.fades, host.peers.iter().map(|peer| peer.fade));
        refill(&mut record.bodies, host.bodies.iter().copied());
        refill(&mut record.wrenches, output.wrenches.iter().copied());
        refill(&mut record.contacts, output.contacts.iter().copied());
        refill(&mut record.requested, output.device.iter().copied());
        refill(&mut record.commanded, commanded.iter().copied());
        refill(&mut record.governor_acted, governed.iter().map(|finger| finger.acted.bits().into()));
        let gain = |state| self.governor.gain(state);
        refill(&mut record.governor_gain, self.state.governors.iter().map(gain));
        record.energy_j = energy_j;
        refill(&mut record.finger_energy_j, self.state.ports.iter().map(PortEnergy::energy_j));
        record.touches_wall = output.touches_wall;
        record.diverged = output.diverged;
    }

    /// How old the data in use were.
    pub(crate) fn data_age(&self) -> &DataAge {
        &self.data_age
    }

    /// With which settings it has run, and what it was like with each.
    pub(crate) fn settings(&self) -> &SettingsLog {
        &self.settings
    }

    /// Energy that the user has put into the session so far, with all fingers together, J.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        self.state.ports.iter().map(PortEnergy::energy_j).sum()
    }

    /// What the passivity observers have seen so far.
    #[must_use]
    pub fn passivity(&self) -> PassivitySummary {
        let ports = || self.state.ports.iter();
        PassivitySummary {
            least_energy_j: ports().map(PortEnergy::least_energy_j).fold(0.0, f64::min),
            energy_given_j: ports().map(PortEnergy::largest_fall_j).fold(0.0, f64::max),
            braked_s: self.braked_ticks as f64 * self.model.schedule.control().period_s(),
        }
    }

    /// The largest force that reached a finger so far, N.
    #[must_use]
    pub fn peak_force_n(&self) -> f64 {
        self.state.ports.iter().map(PortEnergy::peak_force_n).fold(0.0, f64::max)
    }

    /// How the device has failed so far.
    #[must_use]
    pub fn device_faults(&self) -> &DeviceFaults {
        &self.faults
    }

    /// Once a second a replay can begin; also at the first tick.
    fn record_state_every_second(&mut self, tick: u64) {
        let second = |tick: u64| self.model.schedule.control().instant(tick).0.div_euclid(1_000_000_000);
        let is_due = self.state.host.ticks_done == 0 || tick > 0 && second(tick) != second(tick - 1);
        if self.sink.is_none() || !is_due {
            return;
        }
        let mut bytes = std::mem::take(&mut self.state_bytes);
        bytes.clear();
        let bytes = postcard::to_extend(&self.state, bytes).unwrap_or_default();
        let item = RecordItem { host: self.model.host, tick, kind: RecordKind::State(bytes) };
        if let Some(sink) = &mut self.sink {
            sink.record(&item);
        }
        if let RecordKind::State(bytes) = item.kind {
            self.state_bytes = bytes;
        }
    }

    fn record(&mut self, kind: impl FnOnce() -> RecordKind) {
        if let Some(sink) = &mut self.sink {
            sink.record(&RecordItem { host: self.model.host, tick: self.instant.tick, kind: kind() });
        }
    }
}

/// Where the scene's fingers are before a device has said so.
fn resting(scene: &Scene, host: HostIndex, fingers: usize) -> Readings {
    let rest = |finger: usize| scene.users[host.index()].fingers.get(finger).map(|finger| finger.position_m);
    let reading = |finger| Reading::point(rest(finger).unwrap_or_default(), DVec3::ZERO);
    (0..fingers).map(reading).collect()
}

fn refill<T, const N: usize>(list: &mut ArrayVec<T, N>, items: impl IntoIterator<Item = T>) {
    list.clear();
    list.extend(items);
}
