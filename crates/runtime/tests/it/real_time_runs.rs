//! Whole runs in real time, on loopback: what even a busy computer can promise.
//!
//! Nothing here depends on how fast this computer is: a tick that comes late or is left out, and a packet that is
//! lost, are as good as any other.

use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use crate::sessions::{ARCHITECTURES, assert_adds_up, assert_replays, scene, until};
use cotouch_device::{Device, DeviceError, DeviceLimits, ForceSwitch, SimulatedUser, WorldView};
use cotouch_runtime::real_time::{join, realisable, run_local, run_local_with, serve};
use cotouch_runtime::{Note, RealTimeOptions, RecordItem, RecordKind, Recording, SessionHandle, TickRecord};
use cotouch_scene::geometry::{Readings, Wrench, Wrenches};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Impairment, Scene};
use glam::DVec3;

fn real_scene(architecture: &str, settings: &[&str]) -> Scene {
    realisable(&scene(architecture, settings)).0
}

fn recorded(path: &Path) -> RealTimeOptions {
    RealTimeOptions { recording: Some(path.to_owned()), ..RealTimeOptions::default() }
}

/// Waits for something that comes sooner or later, or for the session's end.
fn wait_until(handle: &SessionHandle, mut is_so: impl FnMut(&SessionHandle) -> bool) {
    until("what the session comes to", || (handle.has_ended() || is_so(handle)).then_some(()));
    assert!(!handle.has_ended(), "the session ended by itself");
}

/// Waits for so many more ticks of the first host.
fn wait_for_ticks(handle: &SessionHandle, ticks: u64) {
    let done = |handle: &SessionHandle| handle.snapshot().hosts[0].ticks;
    let enough = done(handle) + ticks;
    wait_until(handle, |handle| done(handle) >= enough);
}

/// The ticks of one host in a recording.
fn ticks_of(recording: &Recording, host: HostIndex) -> Vec<(u64, TickRecord)> {
    let tick = |item: &RecordItem| match &item.kind {
        RecordKind::Tick(record) if item.host == host => Some((item.tick, record.clone())),
        _ => None,
    };
    recording.items.iter().filter_map(tick).collect()
}

/// From tick to recorded tick, no force changes by more than the governor's slew; without gaps in the recording.
fn assert_smooth(scene: &Scene, ticks: &[(u64, TickRecord)]) {
    let slew_n = scene.governor.max_slew_n_per_s / scene.rates.control_hz.hz() * (1.0 + 1e-9);
    for pair in ticks.windows(2) {
        assert!(pair[0].0 < pair[1].0);
        let change = pair[1].1.commanded[0].force - pair[0].1.commanded[0].force;
        assert!(change.length() <= slew_n, "tick {}: {} N in one tick", pair[1].0, change.length());
    }
}

fn dropped(recording: &Recording) -> u64 {
    recording.end.summary.as_ref().map_or(u64::MAX, |summary| summary.dropped)
}

#[test]
fn runs_end_add_up_and_replay() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let lossy = Impairment { loss_rate: 0.2, loss_burst_packets: 1.25, jitter_s: 0.003, ..Impairment::NONE };
    for architecture in ARCHITECTURES {
        for impairment in [None, Some(lossy.clone())] {
            let scene = real_scene(architecture, &[]);
            let options = RealTimeOptions { duration_s: Some(1.5), impairment, ..recorded(&path) };
            let summary = run_local(&scene, &options).unwrap().finish();
            assert_adds_up(&summary);
            assert!(summary.duration_s > 0.0 && summary.haptic.hosts == 2, "{summary:?}");
            let network = &summary.network;
            assert!(network.received > 0 && network.received <= network.sent, "{network:?}");
            let replayed = assert_replays(&path);
            assert!(!replayed.ended_abruptly);
            if dropped(&Recording::open(&path).unwrap()) == 0 {
                // The recording also has the ticks of the release.
                assert!(replayed.comparison.ticks >= summary.haptic.ticks && replayed.skipped == 0);
            }
        }
    }
}

#[test]
fn a_stop_lets_go_smoothly() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    for architecture in ARCHITECTURES {
        let scene = real_scene(architecture, &["governor.max_slew_n_per_s=500"]);
        let handle = run_local(&scene, &recorded(&path)).unwrap();
        wait_for_ticks(&handle, 700);
        handle.stop();
        let summary = handle.finish();
        assert_adds_up(&summary);
        assert!(!assert_replays(&path).ended_abruptly);
        let recording = Recording::open(&path).unwrap();
        for host in scene.hosts() {
            let ticks = ticks_of(&recording, host);
            assert_smooth(&scene, &ticks);
            assert!(
                ticks.iter().any(|(_, tick)| tick.commanded[0].force.length() > 0.05),
                "{architecture} {host}"
            );
            assert_eq!(ticks.last().unwrap().1.commanded[..], [Wrench::default()], "{architecture} {host}");
        }
    }
}

#[test]
fn a_session_without_a_recording_and_one_that_is_let_go_of_end() {
    let scene = real_scene("distributed", &[]);
    let handle = run_local(&scene, &RealTimeOptions::default()).unwrap();
    wait_for_ticks(&handle, 10);
    drop(handle);
    let options = RealTimeOptions { duration_s: Some(0.2), ..RealTimeOptions::default() };
    assert_adds_up(&run_local(&scene, &options).unwrap().finish());
}

#[test]
fn a_peer_that_vanishes_is_faded_out_and_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("survivor.mcap");
    let address = free_address();
    let scene = real_scene("distributed", &["governor.max_slew_n_per_s=500"]);
    let survivor = serve(&scene, address, &recorded(&path)).unwrap();
    let ben = scene.users[1].name.clone();
    for is_last in [false, true] {
        let (_, peer) =
            join(survivor.ticket().unwrap(), Some(&ben), &RealTimeOptions::default(), &|| true).unwrap();
        wait_until(&survivor, |survivor| survivor.present_peers().contains(&ben));
        wait_for_ticks(&survivor, 500);
        if is_last {
            peer.stop();
            peer.finish();
        } else {
            // Nobody says goodbye: to the survivor it is as if the process had been killed.
            drop(peer);
        }
        wait_until(&survivor, |survivor| survivor.present_peers().is_empty());
        wait_for_ticks(&survivor, 500);
    }
    survivor.stop();
    assert_adds_up(&survivor.finish());
    assert_replays(&path);
    assert_faded_twice(&scene, &ticks_of(&Recording::open(&path).unwrap(), HostIndex::FIRST));
}

fn assert_faded_twice(scene: &Scene, ticks: &[(u64, TickRecord)]) {
    assert_smooth(scene, ticks);
    let fades: Vec<f64> = ticks.iter().map(|(_, tick)| tick.fades[1]).collect();
    let step = 1.0 / (scene.session.peer_fade_s * scene.rates.control_hz.hz()) + 1e-9;
    assert!(fades.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= step), "no jump");
    let mut ends: Vec<f64> = fades.into_iter().filter(|&fade| fade == 0.0 || fade == 1.0).collect();
    ends.dedup();
    // On a busy computer the peer may have seemed to be gone more often than it was.
    assert!(ends.len() >= 5 && ends[0] == 0.0 && ends.last() == Some(&0.0), "{ends:?}");
}

fn free_address() -> SocketAddr {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap()
}

/// A hand whose device now and then takes twenty milliseconds to answer.
struct Dozing {
    hand: SimulatedUser,
    reads: u64,
}

impl Device for Dozing {
    fn name(&self) -> &str {
        self.hand.name()
    }

    fn limits(&self) -> DeviceLimits {
        self.hand.limits()
    }

    fn force_switch(&self) -> Arc<dyn ForceSwitch> {
        self.hand.force_switch()
    }

    fn start(&mut self, tick: u64) {
        self.hand.start(tick);
    }

    fn recentre(&mut self, position: DVec3) {
        self.hand.recentre(position);
    }

    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
        self.reads += 1;
        if self.reads.is_multiple_of(150) {
            // A device that hangs for twenty ticks makes its loop late.
            thread::sleep(Duration::from_millis(20));
        }
        self.hand.read(tick)
    }

    fn observe(&mut self, view: &WorldView<'_>) {
        self.hand.observe(view);
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        self.hand.write(wrenches)
    }

    fn rendered(&self) -> Wrenches {
        self.hand.rendered()
    }
}

#[test]
fn a_slow_device_costs_ticks_that_are_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    for architecture in ARCHITECTURES {
        let scene = real_scene(architecture, &[]);
        let device = |host| {
            let hand = SimulatedUser::new(&scene, host).unwrap();
            Box::new(Dozing { hand, reads: 0 }) as Box<dyn Device>
        };
        let options = RealTimeOptions { duration_s: Some(1.5), ..recorded(&path) };
        let handle = run_local_with(&scene, scene.hosts().map(device).collect(), &options).unwrap();
        let summary = handle.finish();
        assert_adds_up(&summary);
        assert!(summary.haptic.missed > 0, "twenty periods do not go into one");
        assert_replays(&path);
        let recording = Recording::open(&path).unwrap();
        if dropped(&recording) == 0 {
            // Ticks that the release left out are in the recording only.
            assert!(skipped(&recording) >= summary.haptic.missed, "{architecture}");
        }
    }
}

/// Ticks that were left out, by the notes in a recording.
fn skipped(recording: &Recording) -> u64 {
    let ticks = |item: &RecordItem| match item.kind {
        RecordKind::Note(Note::Skipped { ticks }) => ticks,
        _ => 0,
    };
    recording.items.iter().map(ticks).sum()
}
