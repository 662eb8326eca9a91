//! The one pacing thread of a process: every host's tick at its instant.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use arrayvec::ArrayVec;
use cotouch_device::device::Device;
use cotouch_device::energy::PortEnergy;
use cotouch_host::output::ContactSurface;
use cotouch_net::clock::ClockMap;
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::Rate;
use cotouch_world::Phase;
use glam::DVec3;
use hdrhistogram::Histogram;

use crate::clock;
use crate::mailbox::Mailbox;
use crate::monitor;
use crate::network_threads::{HapticPort, Inbound};
use crate::priority;
use crate::record::TickRecord;
use crate::snapshot::{FingerSnapshot, HostSnapshot, Lately, SurfaceShown};
use crate::station::{Punctuality, Station};

/// Displays are told of at most every this many nanoseconds.
const SNAPSHOT_PERIOD_NS: i64 = 1_000_000_000 / 60;
/// The verdict so far is renewed every second, the first time when there is something to judge.
const VERDICT_PERIOD_NS: i64 = 1_000_000_000;
/// What the last seconds were like is renewed so often.
const LATELY_PERIOD_NS: i64 = 100_000_000;
const FIRST_VERDICT_NS: i64 = 3_000_000_000;
/// After this time a device that still renders a force is let go of by ending anyway, s.
const LONGEST_RELEASE_S: f64 = 2.0;

/// One host as the haptic thread sees it.
pub(crate) struct HapticHost {
    pub(crate) station: Station<Box<dyn Device>>,
    pub(crate) port: HapticPort,
    pub(crate) snapshot: triple_buffer::Input<HostSnapshot>,
    pub(crate) timing: Timing,
}

/// How a host's ticks went.
#[derive(Clone, Debug)]
pub(crate) struct Timing {
    pub(crate) ticks: u64,
    pub(crate) missed: u64,
    pub(crate) compute_ns: Histogram<u64>,
    pub(crate) lateness_ns: Histogram<u64>,
    /// The largest lateness since displays were last told.
    pub(crate) latest_ns: i64,
}

impl Timing {
    pub(crate) fn new() -> Self {
        // From 1 ns to 10 s with three digits; nothing is allocated after this.
        let histogram =
            || Histogram::new_with_bounds(1, 10_000_000_000, 3).expect("constant bounds are sound");
        Self { ticks: 0, missed: 0, compute_ns: histogram(), lateness_ns: histogram(), latest_ns: 0 }
    }

    fn observe(&mut self, record: &TickRecord) {
        self.ticks += 1;
        self.compute_ns.saturating_record(record.compute_ns.max(1) as u64);
        self.lateness_ns.saturating_record(record.lateness_ns.max(1) as u64);
        self.latest_ns = self.latest_ns.max(record.lateness_ns);
    }
}

/// What others may ask of the haptic thread, and what it tells them.
#[derive(Debug, Default)]
pub(crate) struct Control {
    pub(crate) stop: AtomicBool,
    /// Session time of the run so far, ns since its first tick.
    pub(crate) elapsed_ns: AtomicU64,
    /// The run goes on until here at least, ns since its first tick, unless it is stopped.
    pub(crate) go_on_ns: AtomicU64,
    pub(crate) started: AtomicBool,
    pub(crate) ended: AtomicBool,
    /// Whether the run has stayed stable so far: one of the constants of [`Verdict`].
    pub(crate) verdict: AtomicU8,
    /// What the last seconds were like, in the same words.
    pub(crate) lately: AtomicU8,
    /// Bits of the energy (J) that goes with it.
    pub(crate) oscillation_j: AtomicU64,
    /// What the system did not allow the haptic thread.
    pub(crate) warning: Mutex<Option<String>>,
}

impl Control {
    /// Between ticks; no allocation.
    fn tell_lately(&self, hosts: &[HapticHost]) {
        let diverged = hosts.iter().any(|host| host.station.state.host.diverged);
        let lately = monitor::lately(hosts.iter().map(|host| &host.station.lately), diverged);
        self.lately.store(Verdict::of(lately.stable), Ordering::Relaxed);
        self.oscillation_j.store(lately.oscillation_j.to_bits(), Ordering::Relaxed);
    }

    /// What the last seconds were like.
    pub(crate) fn lately(&self) -> Lately {
        Lately {
            stable: Verdict::is_stable(self.lately.load(Ordering::Relaxed)),
            oscillation_j: f64::from_bits(self.oscillation_j.load(Ordering::Relaxed)),
        }
    }
}

/// What [`Control::verdict`] says.
pub(crate) struct Verdict;

impl Verdict {
    pub(crate) const TOO_EARLY: u8 = 0;
    pub(crate) const STABLE: u8 = 1;
    pub(crate) const UNSTABLE: u8 = 2;

    fn of(stable: Option<bool>) -> u8 {
        stable.map_or(Self::TOO_EARLY, |stable| if stable { Self::STABLE } else { Self::UNSTABLE })
    }

    /// What the constant means; `None` while it is too early to say.
    pub(crate) fn is_stable(verdict: u8) -> Option<bool> {
        match verdict {
            Self::STABLE => Some(true),
            Self::UNSTABLE => Some(false),
            _ => None,
        }
    }
}

/// Runs ticks until a stop is asked for or `duration_s` is over, then releases the devices. Returns the hosts.
pub(crate) fn run(
    mut hosts: Vec<HapticHost>,
    rate: Rate,
    duration_s: Option<f64>,
    mut mailbox: Mailbox,
    control: &Arc<Control>,
) -> Vec<HapticHost> {
    let warning = priority::raise_haptic_thread();
    *control.warning.lock().unwrap_or_else(PoisonError::into_inner) = warning;
    if let Some(first) = wait_for_start(&mut hosts, rate, control) {
        run_ticks(&mut hosts, rate, first, duration_s, &mut mailbox, control);
    }
    control.ended.store(true, Ordering::Release);
    hosts
}

/// The first tick of this process; `None` when a stop was asked for before the session started.
fn wait_for_start(hosts: &mut [HapticHost], rate: Rate, control: &Control) -> Option<u64> {
    loop {
        if control.stop.load(Ordering::Relaxed) {
            return None;
        }
        if hosts.iter_mut().all(|host| host.port.clock().is_some())
            && let Some(map) = hosts[0].port.clock()
        {
            control.started.store(true, Ordering::Release);
            let now = map.session(clock::now());
            return Some(if now.0 < 0 { 0 } else { join_under_way(hosts, rate.last_tick_at(now) + 1) });
        }
        clock::sleep_towards(clock::now().plus_ns(1_000_000));
    }
}

/// A host that comes to a session that is under way takes the world as it finds it; the first host is the world.
fn join_under_way(hosts: &mut [HapticHost], first: u64) -> u64 {
    for host in hosts.iter_mut().filter(|host| host.station.model.host != HostIndex::FIRST) {
        host.station.adopt_world();
    }
    first
}

fn run_ticks(
    hosts: &mut [HapticHost],
    rate: Rate,
    first: u64,
    duration_s: Option<f64>,
    mailbox: &mut Mailbox,
    control: &Control,
) {
    let seconds = |seconds: f64| (seconds * rate.hz()).ceil() as u64;
    let last = duration_s.map_or(u64::MAX, |duration| first.saturating_add(seconds(duration)));
    let mut give_up = u64::MAX;
    let mut tick = first;
    let mut next_snapshot_ns = 0;
    let mut next_verdict_ns = FIRST_VERDICT_NS;
    let mut next_lately_ns = 0;
    loop {
        let Some((due, lateness_ns)) = wait_for_tick(&mut hosts[0].port, rate, tick) else {
            if control.stop.load(Ordering::Relaxed) && hosts[0].port.clock().is_none() {
                break;
            }
            continue;
        };
        let elapsed_ns = rate.instant(due).since(rate.instant(first));
        let is_over = due >= last && elapsed_ns as u64 >= control.go_on_ns.load(Ordering::Relaxed);
        let releasing = give_up != u64::MAX || is_over || control.stop.load(Ordering::Relaxed);
        if releasing && give_up == u64::MAX {
            give_up = due.saturating_add(seconds(LONGEST_RELEASE_S));
        }
        let shows = elapsed_ns >= next_snapshot_ns;
        if mailbox.deliver(hosts) {
            control.verdict.store(Verdict::TOO_EARLY, Ordering::Relaxed);
            next_verdict_ns = elapsed_ns + FIRST_VERDICT_NS;
        }
        for host in hosts.iter_mut() {
            if releasing {
                host.station.release();
            }
            let before_skip = if host.timing.ticks == 0 { due } else { tick };
            tick_host(host, due, due - before_skip, lateness_ns);
            if shows {
                host.show(due);
            }
        }
        hosts.iter_mut().for_each(|host| host.port.wake_sender());
        if shows {
            next_snapshot_ns = elapsed_ns + SNAPSHOT_PERIOD_NS;
        }
        if elapsed_ns >= next_lately_ns {
            next_lately_ns = elapsed_ns + LATELY_PERIOD_NS;
            control.tell_lately(hosts);
        }
        if elapsed_ns >= next_verdict_ns {
            next_verdict_ns = elapsed_ns + VERDICT_PERIOD_NS;
            control.verdict.store(verdict(hosts), Ordering::Relaxed);
        }
        if !releasing || control.elapsed_ns.load(Ordering::Relaxed) == 0 {
            // One period on: where this tick ends. The release afterwards is not part of the run.
            let end_ns = elapsed_ns + (1e9 * rate.period_s()) as i64;
            control.elapsed_ns.store(end_ns as u64, Ordering::Relaxed);
        }
        if releasing && (hosts.iter().all(|host| host.station.is_released()) || due >= give_up) {
            break;
        }
        tick = due + 1;
    }
}

/// The run's verdict, if it ended now. Between ticks; no allocation.
fn verdict(hosts: &[HapticHost]) -> u8 {
    let control = |host: &HapticHost| host.station.model.schedule.control();
    let limited = hosts
        .iter()
        .any(|host| host.station.limits.is_exceeded(control(host)) || host.station.state.host.diverged);
    let quarters = hosts.iter().map(|host| host.station.oscillation.last_two_quarters_j());
    let (before_j, last_j) = quarters.fold((0.0, 0.0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
    Verdict::of(Some(!limited && !monitor::grows(before_j, last_j)))
}

/// Waits for the instant of `tick`. The tick that is due then (a later one when this comes too late), and how late it
/// is, ns; `None` when it is not yet time.
fn wait_for_tick(port: &mut HapticPort, rate: Rate, tick: u64) -> Option<(u64, i64)> {
    let Some(map): Option<ClockMap> = port.clock() else {
        // The session's clock is gone; look again without keeping the processor.
        clock::sleep_towards(clock::now().plus_ns(1_000_000));
        return None;
    };
    let instant = map.local(rate.instant(tick));
    let now = clock::sleep_towards(instant);
    if now < instant {
        return None;
    }
    let due = rate.last_tick_at(map.session(now)).max(tick);
    Some((due, now.since(map.local(rate.instant(due))).max(0)))
}

/// One tick of one host. No allocation, no lock, no system call besides the device and the clock.
fn tick_host(host: &mut HapticHost, tick: u64, skipped: u64, lateness_ns: i64) {
    let began = clock::now();
    if let Some(packet) = host.station.begin(tick) {
        host.port.leave(None, packet);
    }
    while let Some(inbound) = host.port.take_inbound() {
        match inbound {
            Inbound::State { from, packet } => host.station.receive(from, &packet),
            Inbound::Presence { peer, present } => host.station.set_present(peer, present),
        }
    }
    let port = &mut host.port;
    host.station.respond(|client, packet| port.leave(Some(client), packet.clone()));
    host.station.finish(|| Punctuality { lateness_ns, compute_ns: clock::now().since(began) });
    if !host.station.state.releasing {
        host.timing.missed += skipped;
        host.timing.observe(host.station.last_record());
    }
}

fn fingers(station: &Station<Box<dyn Device>>) -> ArrayVec<FingerSnapshot, MAX_FINGERS> {
    let (host, record) = (station.model.host, station.last_record());
    let targets = station.device.drawn_to();
    let finger = |(index, (&reading, &commanded))| FingerSnapshot {
        reading,
        commanded,
        contact: record.contact_of(host, index).map_or(Phase::Free, |contact| contact.phase),
        proxy: proxy(station, index),
        target: targets.get(index).copied(),
        governor_acted: record.governor_acted.get(index).copied().unwrap_or_default(),
        governor_gain: record.governor_gain.get(index).copied().unwrap_or_default(),
        energy_j: station.state.ports.get(index).map_or(0.0, PortEnergy::energy_j),
    };
    record.readings.iter().zip(&record.commanded).enumerate().map(finger).collect()
}

/// Where a finger would be if it could not get into what it touches, m: at a body, the contact's anchor.
fn proxy(station: &Station<Box<dyn Device>>, finger: usize) -> Option<DVec3> {
    let (model, state) = (&station.model, &station.state.host);
    let record = station.last_record();
    let touched = record.contact_of(model.host, finger)?;
    match touched.surface {
        ContactSurface::Body(body) => {
            let body = usize::from(body);
            let contact = state.finger_contact(model, model.host, finger, body)?;
            Some(state.bodies.get(body)?.pose.to_world(contact.anchor))
        }
        ContactSurface::Soft => {
            let out = touched.force.try_normalize()?;
            Some(record.readings.get(finger)?.pose.position + out * touched.depth_m)
        }
        ContactSurface::Wall(_) => None,
    }
}

impl HapticHost {
    /// Leaves the newest picture of this host for displays. No allocation, no lock.
    fn show(&mut self, tick: u64) {
        let record = self.station.last_record();
        let snapshot = self.snapshot.input_buffer_mut();
        let instant = self.station.model.schedule.control().instant(tick);
        *snapshot = HostSnapshot {
            host: self.station.model.host,
            time_s: instant.as_secs_f64(),
            fingers: fingers(&self.station),
            bodies: record.bodies.iter().map(|body| body.pose).collect(),
            soft: self.station.state.host.soft.frame.clone().map(SurfaceShown),
            touches_wall: record.touches_wall,
            diverged: record.diverged,
            ticks: self.timing.ticks,
            missed: self.timing.missed,
            lateness_us: self.timing.latest_ns.max(record.lateness_ns) as f64 * 1e-3,
            energy_j: record.energy_j,
            links: ArrayVec::new(),
        };
        self.timing.latest_ns = 0;
        self.snapshot.publish();
    }
}
