//! Sessions with a soft object in real time: what even a busy computer can promise.

use std::net::SocketAddr;
use std::path::Path;

use crate::sessions::{assert_adds_up, assert_replays, until};
use cotouch_runtime::real_time::{join, realisable, run_local, serve};
use cotouch_runtime::{RealTimeOptions, RecordKind, Recording, SessionHandle};
use cotouch_scene::scene::Scene;
use cotouch_testkit::built_in;

fn real_scene(name: &str, settings: &[&str]) -> Scene {
    realisable(&built_in(name, settings)).0
}

fn recorded(path: &Path, seconds: f64) -> RealTimeOptions {
    let (duration_s, recording) = (Some(seconds), Some(path.to_owned()));
    RealTimeOptions { duration_s, recording, ..RealTimeOptions::default() }
}

/// A block that is simulated quickly even by a busy computer in a debug build.
const SMALL: &str = "soft.mesh.cells=[4, 2, 2]";
const CENTRALIZED: [&str; 2] = ["session.architecture=\"centralized\"", "link.delay_periods=2"];

#[test]
fn a_run_adds_up_and_replays_whatever_came_late() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    for (name, settings) in [
        ("soft-block", &[SMALL][..]),
        ("soft-block", &[SMALL, CENTRALIZED[0], CENTRALIZED[1]]),
        ("spring", &[]),
    ] {
        let scene = real_scene(name, settings);
        let summary = run_local(&scene, &recorded(&path, 2.5)).unwrap().finish();
        assert_adds_up(&summary);
        let soft = summary.soft.clone().unwrap();
        assert!(soft.steps > 0 && soft.late <= soft.steps, "{soft:?}");
        assert!(soft.compute_us.max.is_some());
        assert_eq!(summary.objects[0].name, "soft");
        assert!(summary.users_detail.iter().all(|user| user.passivity.is_some()));
        let replayed = assert_replays(&path);
        let recording = Recording::open(&path).unwrap();
        if recording.end.summary.as_ref().is_some_and(|summary| summary.dropped == 0) {
            assert_eq!(replayed.skipped, 0);
            let surface = |kind: &RecordKind| matches!(kind, RecordKind::Surface(_));
            let surfaces = recording.items.iter().filter(|item| surface(&item.kind)).count();
            assert!(surfaces as u64 >= soft.steps, "{surfaces} recorded, {soft:?}");
        }
    }
}

#[test]
fn a_simulation_that_cannot_keep_up_leaves_periods_out_and_the_run_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    // A period of 2 ms is too short for this block.
    let scene = real_scene("soft-block", &["rates.simulation_hz=512", "soft.mesh.cells=[16, 8, 8]"]);
    let summary = run_local(&scene, &recorded(&path, 1.5)).unwrap().finish();
    let soft = summary.soft.clone().unwrap();
    assert!(soft.steps > 0 && soft.late > 0 && soft.missed > 0, "{soft:?}");
    assert_adds_up(&summary);
    assert_replays(&path);
}

#[test]
fn the_picture_has_the_surface_in_use() {
    let scene = real_scene("spring", &[]);
    let handle = run_local(&scene, &RealTimeOptions::default()).unwrap();
    let has_stepped = |handle: &SessionHandle| {
        let snapshot = handle.snapshot();
        snapshot.hosts[0].soft.as_ref().is_some_and(|surface| surface.0.period.is_some())
    };
    until("a step of the body", || (handle.has_ended() || has_stepped(&handle)).then_some(()));
    let surface = handle.snapshot().hosts[0].soft.clone().unwrap();
    assert_eq!(surface.0.positions_m.len(), scene.soft.mesh().nodes_m.len());
    handle.stop();
    handle.finish();
}

#[test]
fn one_user_serves_alone_and_others_join_a_block() {
    let any: SocketAddr = "127.0.0.1:0".parse().unwrap();
    let spring = real_scene("spring", &[]);
    let alone = serve(&spring, any, &RealTimeOptions::default()).unwrap();
    until("some ticks", || (alone.elapsed_s() >= 0.2).then_some(()));
    alone.stop();
    assert_adds_up(&alone.finish());

    let block = real_scene("soft-block", &[SMALL]);
    let port = std::net::UdpSocket::bind(any).unwrap().local_addr().unwrap();
    let server = serve(&block, port, &RealTimeOptions::default()).unwrap();
    let (scene, guest) = join(server.ticket().unwrap(), None, &RealTimeOptions::default(), &|| true).unwrap();
    assert_eq!(scene.soft, block.soft);
    until("some steps", || (guest.elapsed_s() >= 0.5 || guest.has_ended()).then_some(()));
    guest.stop();
    let of_guest = guest.finish();
    assert!(of_guest.soft.unwrap().steps > 0, "the guest simulates a block of its own");
    server.stop();
    assert_adds_up(&server.finish());
}
