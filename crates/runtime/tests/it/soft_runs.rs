//! Sessions with a soft object, in virtual time: one user and several, both architectures, recorded and replayed.

use std::path::Path;
use std::sync::Arc;

use crate::sessions::assert_replays;
use cotouch_device::SimulatedUser;
use cotouch_runtime::{
    HostChange, RecordKind, Recording, RecordingHeader, Summary, SurfaceRecord, VirtualSession, virtual_run,
};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_testkit::scenes::{built_in, edited};

/// A small block, so that a test is quick.
const SMALL: [&str; 1] = ["soft.mesh.cells=[4, 2, 2]"];

fn block(settings: &[&str]) -> Scene {
    built_in("soft-block", &[&SMALL, settings].concat())
}

fn run(scene: &Scene, seconds: f64, recording: Option<&Path>) -> Summary {
    virtual_run::run(scene, seconds, recording, |_| true).unwrap()
}

fn session(scene: &Scene) -> VirtualSession {
    let hand = |host| (SimulatedUser::new(scene, host).unwrap(), None);
    VirtualSession::with_devices(scene, hand).unwrap()
}

/// How far the node that has moved most is from where it rests, m.
fn displacement(session: &VirtualSession, host: usize) -> f64 {
    let station = &session.hosts()[host].station;
    let frame = station.state.host.soft.frame.as_ref().unwrap();
    let rest = station.soft().unwrap().rest_frame();
    let moved = frame.positions_m.iter().zip(&rest.positions_m).map(|(at, rest)| at.distance(*rest));
    moved.fold(0.0, f64::max)
}

fn surfaces(recording: &Recording, host: u8) -> Vec<(u64, &SurfaceRecord)> {
    let items = recording.items.iter().filter(|item| item.host == HostIndex(host));
    let surfaces = items.filter_map(|item| match &item.kind {
        RecordKind::Surface(surface) => Some((item.tick, surface)),
        _ => None,
    });
    surfaces.collect()
}

#[test]
fn one_user_presses_a_spring_and_the_spring_gives_way() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("spring.mcap");
    let scene = built_in("spring", &[]);
    assert_eq!(scene.session.users, 1);
    let summary = run(&scene, 3.0, Some(&path));
    assert!(summary.stable, "{:?} {:?}", summary.diverged, summary.shaking);
    let soft = summary.soft.unwrap();
    // Of 60 periods, those whose result was due before the end.
    assert!((57..=60).contains(&soft.steps), "{}", soft.steps);
    assert_eq!((soft.late, soft.missed), (0, 0));
    let object = &summary.objects[0];
    assert_eq!((object.name.as_str(), summary.objects.len()), ("soft", 1));
    // K_h = 100 in series with K_o = 900 N/m, pressed 25 mm by a hand that its tracking holds with 200 N/m.
    let force_n = 0.025 / (1.0 / 100.0 + 1.0 / 900.0 + 1.0 / 200.0);
    let moved = object.max_displacement_m.unwrap();
    assert!((moved / (force_n / 900.0) - 1.0).abs() < 0.02, "{moved}");
    let user = summary.users_detail[0].passivity.unwrap();
    assert!(user.least_energy_j <= 0.0 && user.energy_given_j >= 0.0 && user.braked_s == 0.0);
    assert_replays(&path);
}

#[test]
fn two_users_at_one_block_replay_bit_for_bit_and_twice_the_same() {
    for settings in [
        &[][..],
        &["session.architecture=\"centralized\"", "link.delay_periods=2", "link.return_delay_periods=1"],
        &["local_model.kind=\"pi\"", "local_model.hold=\"first\"", "link.impairment.loss_rate=0.2"],
        &["local_model.kind=\"hold\"", "local_model.returned_force=\"first\""],
        &[
            "local_model.kind=\"p\"",
            "local_model.returned_force=\"last\"",
            "local_model.result_delay_periods=2",
        ],
    ] {
        let scene = block(settings);
        let folder = tempfile::tempdir().unwrap();
        let paths = ["first.mcap", "second.mcap"].map(|name| folder.path().join(name));
        let summary = run(&scene, 3.0, Some(&paths[0]));
        run(&scene, 3.0, Some(&paths[1]));
        assert!(std::fs::read(&paths[0]).unwrap() == std::fs::read(&paths[1]).unwrap(), "{settings:?}");
        let replayed = assert_replays(&paths[0]);
        assert_eq!(replayed.skipped, 0);
        assert!(summary.objects[0].max_displacement_m.unwrap() > 1e-4, "{settings:?}: the block was pressed");
    }
}

#[test]
fn surfaces_come_into_use_when_they_are_due_and_are_recorded() {
    for (settings, delay) in [
        (&[][..], 1),
        (&["local_model.returned_force=\"first\""], 0),
        (&["local_model.result_delay_periods=3"], 3),
    ] {
        let scene = block(settings);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("block.mcap");
        run(&scene, 1.0, Some(&path));
        let recording = Recording::open(&path).unwrap();
        let schedule = scene.slow_schedule();
        for host in 0..2 {
            let surfaces = surfaces(&recording, host);
            assert!(surfaces.len() > 50);
            for (period, (tick, surface)) in (0..).zip(surfaces) {
                assert_eq!((surface.period, tick), (period, schedule.tick_of_step(period + 1 + delay)));
                assert_eq!(surface.positions_m.len(), scene.soft.mesh().nodes_m.len());
                assert_eq!(surface.stress_pa.len(), surface.positions_m.len());
            }
        }
    }
}

#[test]
fn a_client_simulates_nothing_and_a_peer_its_own_copy() {
    let central =
        ["session.architecture=\"centralized\"", "link.delay_periods=2", "link.return_delay_periods=1"];
    for (settings, simulated) in [(&central[..], [true, false]), (&[][..], [true, true])] {
        let scene = block(settings);
        let session = session(&scene);
        for (host, simulated) in session.hosts().iter().zip(simulated) {
            assert_eq!(host.station.soft().is_some(), simulated);
            assert_eq!(host.station.model.has_soft_body(), simulated);
        }
    }
}

#[test]
fn a_fork_goes_its_own_way_from_the_same_place() {
    let scene = block(&[]);
    let mut session = session(&scene);
    assert!(session.run_to_tick(2500, |_, _| {}));
    let mut forks = [session.fork(), session.fork()];
    let mut records = [Vec::new(), Vec::new()];
    for (fork, records) in forks.iter_mut().zip(&mut records) {
        fork.run_to_tick(2800, |_, record| records.push(record.clone()));
    }
    assert!(records[0] == records[1] && !records[0].is_empty());
    let mut own = Vec::new();
    session.run_to_tick(2800, |_, record| own.push(record.clone()));
    assert!(own == records[0]);
    assert_eq!(displacement(&session, 0), displacement(&forks[1], 0));
}

#[test]
fn what_one_user_presses_the_other_ones_copy_shows() {
    // Ben's hand does nothing.
    let scene = edited(&block(&[]), |scene| scene.users[1].script.clear());
    let mut session = session(&scene);
    assert!(session.run_to_tick(4400, |_, _| {}));
    let (of_anna, of_ben) = (displacement(&session, 0), displacement(&session, 1));
    assert!(of_anna > 1e-3, "{of_anna}");
    assert!((of_ben / of_anna - 1.0).abs() < 0.2, "{of_ben} at ben, {of_anna} at anna");
}

#[test]
fn kind_and_gains_of_the_local_model_change_between_two_ticks_and_the_technique_does_not() {
    let scene = block(&[]);
    for possible in [
        "local_model.kind=\"pi\"",
        "local_model.stiffness_ratio=0.3",
        "local_model.integral_ratio=0.1",
        "local_model.friction=0.2",
        "governor.passivity_control=true",
    ] {
        assert!(HostChange::is_possible(&scene, &block(&[possible])), "{possible}");
    }
    for impossible in [
        "soft.young_pa=30e3",
        "rates.simulation_hz=30",
        "local_model.hold=\"first\"",
        "local_model.returned_force=\"last\"",
        "local_model.result_delay_periods=2",
    ] {
        assert!(!HostChange::is_possible(&scene, &block(&[impossible])), "{impossible}");
    }
}

#[test]
fn a_session_whose_local_model_changes_replays() {
    let scene = block(&[]);
    let to = block(&["local_model.kind=\"pi\"", "local_model.stiffness_ratio=0.3"]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("changed.mcap");
    let recorder = cotouch_runtime::Recorder::create(&path, &header(&scene)).unwrap();
    let recorder = Arc::new(std::sync::Mutex::new(recorder));
    let hand = |host| {
        let sink = Shared(Arc::clone(&recorder));
        (SimulatedUser::new(&scene, host).unwrap(), Some(Box::new(sink) as Box<_>))
    };
    let mut session = VirtualSession::with_devices(&scene, hand).unwrap();
    assert!(session.run_to_tick(2400, |_, _| {}));
    for host in scene.hosts() {
        assert!(session.host_mut(host).station.change(&mut HostChange::new(&to, host)));
    }
    session.run_to_tick(3000, |_, _| {});
    scene.hosts().for_each(|host| session.host_mut(host).station.release());
    session.run_to_tick(3300, |_, _| {});
    drop(session);
    let recorder = Arc::into_inner(recorder).unwrap().into_inner().unwrap();
    recorder.finish(std::collections::BTreeMap::new()).unwrap();
    let replayed = assert_replays(&path);
    assert_eq!((replayed.comparison.ticks, replayed.skipped), (2 * 3300, 0));
}

struct Shared(Arc<std::sync::Mutex<cotouch_runtime::Recorder>>);

impl cotouch_runtime::RecordSink for Shared {
    fn record(&mut self, item: &cotouch_runtime::RecordItem) {
        self.0.lock().unwrap().record(item);
    }
}

fn header(scene: &Scene) -> RecordingHeader {
    RecordingHeader {
        cotouch_version: "0".to_owned(),
        scene_toml: cotouch_scene::to_toml(scene),
        control_hz: scene.rates.control_hz,
        epoch_unix_ns: 0,
        facts: std::collections::BTreeMap::new(),
    }
}
