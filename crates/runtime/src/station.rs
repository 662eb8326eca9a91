//! One host with its device and its governor, without sockets and clocks: the same in virtual time, in real time and
//! in a replay.
//!
//! An instant has three phases. All hosts [`Station::begin`]: the device is read and, at a network step, the host
//! says where it is. What has arrived by now is handed over with [`Station::receive`]. Then [`Station::respond`]: due
//! samples come into use and, at a network step, a server answers its clients. Then [`Station::finish`]: forces are
//! computed and governed, the device renders, and the world moves on by one period.

use cotouch_device::acted::LimitWatch;
use cotouch_device::device::Device;
use cotouch_device::energy::PortEnergy;
use cotouch_device::governor::{Governor, GovernorInput, GovernorState};
use cotouch_host::model::{HostModel, Role};
use cotouch_host::state::HostState;
use cotouch_host::step::TickOutput;
use cotouch_net::packet::StatePacket;
use cotouch_scene::geometry::{Reading, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use serde::{Deserialize, Serialize};

use crate::exchange::RecordSink;
use crate::monitor::OscillationMonitor;
use crate::record::{Note, RecordItem, RecordKind, TickRecord};

/// Room for a serialised state: 16 peers with full play-out buffers.
const STATE_BYTES: usize = 1 << 18;

/// A host that renders at a device.
///
/// It belongs to one thread and shares nothing with any other: there is no lock in it, and whoever records or transmits
/// does so behind queues that never wait ([`crate::exchange`], [`crate::transport::HapticPort`]). After the first
/// instants it allocates nothing.
pub struct Station<D> {
    /// The host's constants.
    pub model: HostModel,
    /// Everything that changes and that a replay re-creates.
    pub state: StationState,
    /// The device in the user's hand.
    pub device: D,
    /// Watches for oscillation.
    pub oscillation: OscillationMonitor,
    /// Watches for limits that act for long.
    pub limits: LimitWatch,
    governor: Governor,
    /// After a longer gap between ticks, forces begin again softly.
    watchdog_ticks: u64,
    sink: Option<Box<dyn RecordSink + Send>>,
    /// Where states are serialised, so that recording one allocates nothing.
    state_bytes: Vec<u8>,
    instant: Instant,
}

/// What a replay re-creates, as a value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StationState {
    /// The host's.
    pub host: HostState,
    /// The governor's.
    pub governor: GovernorState,
    /// What went through the device's port.
    pub port: PortEnergy,
    /// Whether the governor is to let go.
    pub releasing: bool,
    /// The last tick that was done.
    pub last_tick: Option<u64>,
    /// The last good reading: what counts while the device fails.
    pub last_reading: Reading,
}

/// What is known of the instant that is being worked on.
#[derive(Clone, Copy, Debug, Default)]
struct Instant {
    tick: u64,
    step: Option<u64>,
    reading: Reading,
    device_failed: bool,
    /// Ticks that were left out before this one.
    skipped: u64,
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
    pub fn new(scene: &Scene, host: HostIndex, device: D, sink: Option<Box<dyn RecordSink + Send>>) -> Self {
        let model = HostModel::new(scene, host);
        let governor = Governor::new(&scene.governor, device.limits(), scene.rates.control_hz);
        let state = StationState {
            host: HostState::new(&model),
            governor: governor.start(),
            port: PortEnergy::default(),
            releasing: false,
            last_tick: None,
            last_reading: Reading::default(),
        };
        Self {
            state,
            device,
            oscillation: OscillationMonitor::new(&scene.schedule()),
            limits: LimitWatch::default(),
            governor,
            watchdog_ticks: (scene.governor.watchdog_s * scene.rates.control_hz.hz()) as u64,
            state_bytes: Vec::with_capacity(if sink.is_some() { STATE_BYTES } else { 0 }),
            sink,
            instant: Instant::default(),
            model,
        }
    }

    /// The same station, not recorded: what it does leaves the original alone.
    #[must_use]
    pub fn fork(&self) -> Self
    where
        D: Clone,
    {
        Self {
            model: self.model.clone(),
            state: self.state.clone(),
            device: self.device.clone(),
            oscillation: self.oscillation.clone(),
            limits: self.limits,
            governor: self.governor.clone(),
            watchdog_ticks: self.watchdog_ticks,
            sink: None,
            state_bytes: Vec::new(),
            instant: self.instant,
        }
    }

    /// Phase 1 of the instant of `tick`: reads the device. What the host says to all its peers, at a network step.
    ///
    /// No allocation, no lock, no system call besides the device's.
    pub fn begin(&mut self, tick: u64) -> Option<StatePacket> {
        self.record_state_every_second(tick);
        if self.state.last_tick.is_none() {
            self.device.start(tick);
        }
        let read = self.device.read(tick);
        let device_failed = read.is_err();
        let reading = read.unwrap_or(self.state.last_reading);
        let step = self.model.step_due(&self.state.host, tick);
        let skipped = self.state.last_tick.map_or(0, |last| tick.saturating_sub(last + 1));
        self.instant = Instant { tick, step, reading, device_failed, skipped };
        if skipped > 0 {
            self.record(|| RecordKind::Note(Note::Skipped { ticks: skipped }));
        }
        let packet = self.model.sample(&self.state.host, step?, &reading)?;
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
        self.state.host.adopting = true;
    }

    /// Lets go of the user, smoothly.
    pub fn release(&mut self) {
        if !self.state.releasing {
            self.record(|| RecordKind::Release);
            self.state.releasing = true;
        }
    }

    /// Whether the device renders no force any more after a [`release`](Self::release).
    #[must_use]
    pub fn is_released(&self) -> bool {
        self.state.releasing && self.state.governor.is_released()
    }

    /// Phase 2: due samples come into use; at a network step, `send` is handed what a server answers its clients.
    pub fn respond(&mut self, mut send: impl FnMut(HostIndex, &StatePacket)) {
        self.play_out();
        let Instant { step, reading, .. } = self.instant;
        let (Role::Server, Some(step)) = (self.model.role, step) else { return };
        for client in self.model.sources() {
            if let Some(packet) = self.model.respond(&self.state.host, step, &reading, client) {
                self.record(|| RecordKind::Sent { to: Some(client), packet: packet.clone() });
                send(client, &packet);
            }
        }
    }

    /// Phase 3: forces from what is known now, through the governor to the device, and the world one period on.
    ///
    /// No allocation, no lock, no system call besides the device's.
    pub fn finish(&mut self, punctuality: impl FnOnce() -> Punctuality) -> TickRecord {
        self.play_out();
        let Instant { tick, step, reading, device_failed, skipped } = self.instant;
        self.state.last_tick = Some(tick);
        self.state.last_reading = reading;
        let output = self.model.tick(&mut self.state.host, tick, &reading);
        let governed = self.governor.govern(
            &mut self.state.governor,
            &GovernorInput {
                requested: output.device,
                reading,
                stop: self.state.releasing || output.diverged || skipped > self.watchdog_ticks,
                link_ok: self.model.role != Role::Client || self.state.host.peers[0].present,
                fresh: !device_failed,
            },
        );
        let write_failed = self.device.write(governed.commanded).is_err();
        self.state.port.observe(&reading, governed.commanded);
        // What a hand does when its force is taken away says nothing about the loop.
        if !self.state.releasing {
            self.oscillation.observe(&output.couplers, step.is_some());
            self.limits.observe(governed.acted);
        }
        if device_failed || write_failed {
            self.record(|| RecordKind::Note(Note::DeviceFault));
        }
        let mut record = self.tick_record(&output, governed.commanded, governed.acted.bits().into());
        let Punctuality { lateness_ns, compute_ns } = punctuality();
        (record.lateness_ns, record.compute_ns) = (lateness_ns, compute_ns);
        self.record(|| RecordKind::Tick(record.clone()));
        record
    }

    /// Puts due samples into use. A host that has waited for the world meets it where it is: the device's frame is
    /// moved so that the hand is at the object.
    fn play_out(&mut self) {
        let tick = self.instant.tick;
        let was_adopting = self.state.host.adopting;
        self.model.play_out(&mut self.state.host, tick);
        if was_adopting && !self.state.host.adopting {
            self.device.recentre(self.state.host.object.pose.position);
            self.instant.reading = self.device.read(tick).unwrap_or(self.instant.reading);
        }
    }

    fn tick_record(&self, output: &TickOutput, commanded: Wrench, governor_acted: u32) -> TickRecord {
        let host = &self.state.host;
        TickRecord {
            instant: self.model.schedule.control().instant(self.instant.tick),
            reading: self.instant.reading,
            device_failed: self.instant.device_failed,
            steps_in_use: host.steps_in_use(),
            fades: host.peers.iter().map(|peer| peer.fade).collect(),
            object: host.object,
            object_force: output.object_force,
            requested: output.device,
            commanded,
            governor_acted,
            governor_gain: self.governor.gain(&self.state.governor),
            energy_j: self.state.port.energy_j(),
            touches_wall: output.touches_wall,
            diverged: output.diverged,
            lateness_ns: 0,
            compute_ns: 0,
        }
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
