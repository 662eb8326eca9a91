//! What becomes of forces, peers, recordings and summaries when a part of a session fails.

use std::io::Read as _;
use std::net::{SocketAddr, UdpSocket};
use std::os::fd::AsRawFd as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;

use crate::sessions::{assert_adds_up, assert_replays, scene, until};
use cotouch_device::{Acted, Device, Fault, FaultyDevice, ForceSwitch, SimulatedUser};
use cotouch_runtime::real_time::{join, realisable, run_local_with, serve};
use cotouch_runtime::{
    LiveSession, OwnLimits, RealTimeOptions, RecordItem, RecordKind, Recording, SessionHandle, TickRecord,
    VirtualSession,
};
use cotouch_scene::geometry::Wrench;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;

const FOR_EVER_S: f64 = 1e5;

type Switches = Vec<Arc<dyn ForceSwitch>>;

/// Devices of which the first has a fault, and their switches.
fn devices(scene: &Scene, fault: Fault, from_s: f64, duration_s: f64) -> (Vec<Box<dyn Device>>, Switches) {
    let device = |host| {
        let hand = SimulatedUser::new(scene, host).unwrap();
        let duration_s = if host == HostIndex::FIRST { duration_s } else { 0.0 };
        let from_s = if host == HostIndex::FIRST { from_s } else { FOR_EVER_S };
        let rate = scene.rates.control_hz;
        Box::new(FaultyDevice::new(hand, fault, from_s, duration_s, rate)) as Box<dyn Device>
    };
    let devices: Vec<_> = scene.hosts().map(device).collect();
    let switches = devices.iter().map(|device| device.force_switch()).collect();
    (devices, switches)
}

fn real_scene() -> Scene {
    realisable(&scene("distributed", &[])).0
}

fn ends(handle: &SessionHandle) {
    until("the end", || handle.has_ended().then_some(()));
}

fn are_off(switches: &[Arc<dyn ForceSwitch>]) -> bool {
    switches.iter().all(|switch| switch.is_disabled())
}

fn free_address() -> SocketAddr {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap()
}

fn recorded(path: &Path) -> RealTimeOptions {
    RealTimeOptions { recording: Some(path.to_owned()), ..RealTimeOptions::default() }
}

#[test]
fn a_haptic_thread_that_panics_ends_its_session_with_forces_off_and_a_whole_recording() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let scene = real_scene();
    let (devices, switches) = devices(&scene, Fault::Panic, 0.6, FOR_EVER_S);
    let handle = run_local_with(&scene, devices, &recorded(&path)).unwrap();
    ends(&handle);
    assert!(are_off(&switches));
    let told = handle.take_failures();
    assert_eq!(told, ["the haptic thread failed: the device panics on purpose"]);
    assert_eq!(handle.take_failures(), [""; 0]);
    let summary = handle.finish();
    assert_eq!(summary.failures, told);
    assert!(summary.haptic.ticks > 0);
    assert!(!assert_replays(&path).ended_abruptly);
}

#[test]
fn peers_of_a_host_whose_haptic_thread_panics_hear_that_it_has_left() {
    let address = free_address();
    let scene = real_scene();
    let survivor = serve(&scene, address, &RealTimeOptions::default()).unwrap();
    let ben = scene.users[1].name.clone();
    let devices = vec!["faulty:panic@0".parse().unwrap()];
    let options = RealTimeOptions { devices, ..RealTimeOptions::default() };
    let (_, peer) = join(survivor.ticket().unwrap(), Some(&ben), &options, &|| true).unwrap();
    ends(&peer);
    assert!(peer.finish().failures[0].contains("on purpose"));
    let mut news = Vec::new();
    until("the news that the peer has left", || {
        news.extend(survivor.take_news());
        news.iter().any(|news| news.starts_with(&format!("{ben} has left"))).then_some(())
    });
    survivor.stop();
    assert_adds_up(&survivor.finish());
}

#[test]
fn a_haptic_thread_that_stands_still_loses_its_forces_and_begins_again_from_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let scene = real_scene();
    let (devices, switches) = devices(&scene, Fault::Block, 1.0, 1.5);
    let handle = run_local_with(&scene, devices, &recorded(&path)).unwrap();
    until("forces that are off while the device blocks", || are_off(&switches).then_some(()));
    until("forces that are on again", || {
        (handle.elapsed_s() > 3.0 && switches.iter().all(|switch| !switch.is_disabled())).then_some(())
    });
    assert!(handle.take_standstill().unwrap().contains("switched off"));
    handle.stop();
    let summary = handle.finish();
    assert_adds_up(&summary);
    assert!(summary.haptic.stood_still >= 1);
    assert_replays(&path);
    for host in scene.hosts() {
        assert_softly_again(&scene, &Recording::open(&path).unwrap().items, host);
    }
}

/// After every time that forces were switched off, the first ones are nothing, and they grow no faster than a soft start lets them.
fn assert_softly_again(scene: &Scene, items: &[RecordItem], host: HostIndex) {
    let mut of_host = items.iter().filter(|item| item.host == host);
    let mut times = 0;
    while of_host.any(|item| item.kind == RecordKind::ForceOff) {
        times += 1;
        let tick = |item: &RecordItem| match &item.kind {
            RecordKind::Tick(tick) => Some(tick.clone()),
            _ => None,
        };
        let next: Vec<TickRecord> = of_host.clone().filter_map(tick).take(20).collect();
        assert_eq!(next[0].commanded[0], Wrench::default());
        for tick in &next {
            let acted = Acted::from_bits_truncate(tick.governor_acted[0] as u16);
            assert!(acted.intersects(Acted::SOFT_START | Acted::RELEASE), "{acted:?}");
            // Of 20 ticks of a soft start of 256: 3·(20/256)².
            let share = tick.commanded[0].force.length() / tick.requested[0].force.length().max(1e-9);
            assert!(share <= 0.02, "{share} of the force, at {:?}", scene.rates.control_hz);
        }
    }
    assert!(times >= 1, "{host}");
}

#[test]
fn a_haptic_thread_that_never_comes_back_does_not_keep_the_process() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let scene = real_scene();
    let (devices, switches) = devices(&scene, Fault::Block, 0.6, FOR_EVER_S);
    let handle = run_local_with(&scene, devices, &recorded(&path)).unwrap();
    until("forces that are off", || are_off(&switches).then_some(()));
    handle.stop();
    ends(&handle);
    let summary = handle.finish();
    assert!(summary.failures[0].contains("has not ticked"), "{:?}", summary.failures);
    assert!(are_off(&switches));
    assert_replays(&path);
}

/// A file that takes so many bytes and no more.
fn full_after(bytes: usize) -> (PathBuf, std::io::PipeWriter) {
    let (mut reader, writer) = std::io::pipe().unwrap();
    thread::spawn(move || reader.read_exact(&mut vec![0; bytes]).unwrap());
    (format!("/proc/self/fd/{}", writer.as_raw_fd()).into(), writer)
}

#[cfg(target_os = "linux")]
#[test]
fn a_recording_that_cannot_be_written_on_is_told_at_once_and_the_session_goes_on() {
    let (path, _kept_open) = full_after(400_000);
    let scene = real_scene();
    let (devices, _) = devices(&scene, Fault::Fail, FOR_EVER_S, 1.0);
    let handle = run_local_with(&scene, devices, &recorded(&path)).unwrap();
    let told = until("the news that the recording has ended", || handle.take_failures().pop());
    assert!(told.contains("goes on without a recording"), "{told}");
    assert!(!handle.has_ended());
    let before_s = handle.elapsed_s();
    until("more ticks", || (handle.elapsed_s() > before_s + 0.2).then_some(()));
    handle.stop();
    let summary = handle.finish();
    assert_eq!((&summary.failures, &summary.recording), (&vec![told], &None));
    assert!(summary.haptic.ticks > 0);
}

/// A station whose loop stood still begins again from nothing, whatever was rendered before, in virtual time.
#[test]
fn a_station_whose_force_was_switched_off_grows_from_nothing_in_every_architecture() {
    for architecture in crate::sessions::ARCHITECTURES {
        let scene = scene(architecture, &[]);
        let device = |host| (SimulatedUser::new(&scene, host).unwrap(), None);
        let mut session = VirtualSession::with_devices(&scene, device).unwrap();
        let mut largest_n: f64 = 0.0;
        assert!(session.run_to_tick(3000, |_, tick| {
            largest_n = largest_n.max(tick.commanded[0].force.length());
        }));
        assert!(largest_n > 0.2, "there is a force to lose: {largest_n} N");
        scene.hosts().for_each(|host| session.host_mut(host).station.force_off());
        let soft_start = scene.rates.control_hz.ticks_in(scene.governor.soft_start_s) as f64;
        let mut ticks = vec![0_u32; usize::from(scene.session.users)];
        assert!(session.run_to_tick(3200, |host, tick| {
            let s = f64::from(ticks[host.index()]) / soft_start;
            ticks[host.index()] += 1;
            let bound_n = tick.requested[0].force.length() * s * s * (3.0 - 2.0 * s);
            assert!(tick.commanded[0].force.length() <= bound_n + 1e-12, "{architecture} {host} {s}");
        }));
    }
}

#[test]
fn a_joiner_takes_no_more_force_from_a_servers_scene_than_it_allows() {
    let address = free_address();
    let greedy = ["governor.max_force_n=1000", "governor.max_slew_n_per_s=1e9"];
    let scene = realisable(&scene("distributed", &greedy)).0;
    let server = serve(&scene, address, &RealTimeOptions::default()).unwrap();
    assert_eq!(server.device_notes(), [""; 0], "the server's scene is its own");
    for (limits, allowed_n) in [(None, 20.0), (Some(OwnLimits::max_force(2.0)), 2.0)] {
        let options = RealTimeOptions { limits, ..RealTimeOptions::default() };
        let (joined, peer) = join(server.ticket().unwrap(), None, &options, &|| true).unwrap();
        let in_one_tick = allowed_n * scene.rates.control_hz.hz();
        assert_eq!((joined.governor.max_force_n, joined.governor.max_slew_n_per_s), (allowed_n, in_one_tick));
        let told =
            format!("the scene asks for 1000 N (governor.max_force_n), this host allows {allowed_n} N");
        assert_eq!(peer.device_notes(), [told]);
        assert_eq!(peer.scene(), &joined);
        until("a tick of the joiner", || (peer.elapsed_s() > 0.0).then_some(()));
        peer.stop();
        assert_adds_up(&peer.finish());
        until("the place is free", || server.present_peers().is_empty().then_some(()));
    }
    server.stop();
    assert_adds_up(&server.finish());
}

#[test]
fn a_change_never_raises_what_a_session_began_with() {
    let scene = realisable(&scene("distributed", &["governor.max_force_n=5"])).0;
    let live = LiveSession::run_local(&scene, RealTimeOptions::default()).unwrap();
    let stronger = scene.edit(|scene| scene.governor.max_force_n = 500.0).unwrap();
    live.change(stronger.clone()).unwrap();
    assert_eq!(live.scene().0.governor.max_force_n, 5.0);
    assert_eq!(live.as_it_would_run(&stronger).0.governor.max_force_n, 5.0);
    let weaker = scene.edit(|scene| scene.governor.max_force_n = 1.0).unwrap();
    live.change(weaker).unwrap();
    assert_eq!(live.scene().0.governor.max_force_n, 1.0);
    live.again().unwrap();
    live.change(stronger).unwrap();
    assert_eq!(live.scene().0.governor.max_force_n, 5.0);
    live.stop();
    assert_eq!(live.finish().failures, [""; 0]);
}
