//! Sessions with other devices than simulated hands: they replay, and what a driver says when it fails is told.

use std::sync::Arc;

use crate::changes::{Kept, write};
use crate::sessions::{assert_adds_up, assert_replays, scene};
use cotouch_device::{
    Device, DeviceError, DeviceLimits, DeviceOpenError, ForceSwitch, SimulatedUser, StillDevice, WorldView,
};
use cotouch_runtime::real_time::{realisable, run_local, run_local_with};
use cotouch_runtime::{
    Note, RealTimeOptions, RecordItem, RecordKind, Recording, StartError, VirtualSession, virtual_run,
};
use cotouch_scene::geometry::{Readings, Wrench, Wrenches};
use cotouch_scene::names::HostIndex;
use glam::DVec3;

/// A simulated hand on a device that renders little, and fails between two ticks.
struct Weak {
    hand: SimulatedUser,
    max_force_n: f64,
    fails: std::ops::Range<u64>,
}

impl Device for Weak {
    fn name(&self) -> &str {
        "weak"
    }

    fn fingers(&self) -> usize {
        self.hand.fingers()
    }

    fn limits(&self) -> DeviceLimits {
        DeviceLimits { max_force_n: self.max_force_n, ..self.hand.limits() }
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

    fn observe(&mut self, view: &WorldView<'_>) {
        self.hand.observe(view);
    }

    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
        let readings = self.hand.read(tick)?;
        if self.fails.contains(&tick) { Err(DeviceError::driver("cable pulled")) } else { Ok(readings) }
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        self.hand.write(wrenches)
    }

    fn rendered(&self) -> Wrenches {
        self.hand.rendered()
    }
}

fn faults(items: &[RecordItem]) -> Vec<(u64, &str)> {
    let faults = items.iter().filter_map(|item| match &item.kind {
        RecordKind::Note(Note::DeviceFault(text)) => Some((item.tick, text.as_str())),
        _ => None,
    });
    faults.collect()
}

#[test]
fn a_session_with_a_weak_device_that_fails_replays_without_it() {
    let scene = cotouch_scene::load("grasp", &[]).unwrap();
    let kept = Kept::default();
    let mut session = VirtualSession::with_devices(&scene, |host| {
        let hand = SimulatedUser::new(&scene, host).unwrap();
        let fails = if host == HostIndex::FIRST { 3000..3200 } else { 0..0 };
        (Weak { hand, max_force_n: 0.4, fails }, Some(Box::new(kept.clone())))
    })
    .unwrap();
    let mut largest_n: f64 = 0.0;
    assert!(session.run_to_tick(4096, |_, tick| {
        let forces = tick.commanded.iter().map(|wrench| wrench.force.length());
        largest_n = forces.fold(largest_n, f64::max);
    }));
    assert!(largest_n > 0.39 && largest_n <= 0.4, "the device's limit acted: {largest_n} N");
    drop(session);
    let items = kept.0.lock().unwrap();
    assert_eq!(faults(&items), [(3000, "weak: cable pulled")]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("weak.mcap");
    write(&path, &scene, &items);
    assert_eq!(assert_replays(&path).comparison.ticks, 2 * 4096);
}

#[test]
fn what_a_driver_says_stands_in_notes_summary_and_recording() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let scene = realisable(&scene("distributed", &[])).0;
    let device = |host| {
        let hand = SimulatedUser::new(&scene, host).unwrap();
        let fails = if host == HostIndex::FIRST { 200..u64::MAX } else { 0..0 };
        Box::new(Weak { hand, max_force_n: f64::INFINITY, fails }) as Box<dyn Device>
    };
    let options = RealTimeOptions {
        duration_s: Some(1.0),
        recording: Some(path.clone()),
        ..RealTimeOptions::default()
    };
    let handle = run_local_with(&scene, scene.hosts().map(device).collect(), &options).unwrap();
    let mut news = Vec::new();
    while !handle.has_ended() {
        news.extend(handle.take_device_faults());
        // The end of the session is waited for.
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    news.extend(handle.take_device_faults());
    let user = &scene.users[0].name;
    assert_eq!(news, [format!("{user}'s device fails: weak: cable pulled")]);
    let summary = handle.finish();
    assert_adds_up(&summary);
    let told = summary.users_detail[0].device_faults.as_ref().unwrap();
    assert!(told.ticks > 0 && told.last == "weak: cable pulled", "{told:?}");
    assert!(summary.users_detail[1].device_faults.is_none());
    let items = Recording::open(&path).unwrap().items;
    let words: Vec<&str> = faults(&items).into_iter().map(|(_, text)| text).collect();
    assert_eq!(words, ["weak: cable pulled"]);
    assert_replays(&path);
}

#[test]
fn a_session_says_whose_device_has_too_few_fingers() {
    let scene = realisable(&scene("distributed", &[])).0;
    let fingers = scene.users[0].fingers.len() + 1;
    let scene = scene.edit(|scene| {
        let finger = scene.users[0].fingers[0].clone();
        scene.users[0].fingers.push(finger);
    });
    let scene = scene.unwrap();
    let device = |_| Box::new(StillDevice::new([DVec3::ZERO])) as Box<dyn Device>;
    let options = RealTimeOptions { duration_s: Some(0.05), ..RealTimeOptions::default() };
    let handle = run_local_with(&scene, scene.hosts().map(device).collect(), &options).unwrap();
    let user = &scene.users[0].name;
    let note = format!("{user}'s device has 1 of {fingers} fingers; the prediction is of {fingers}");
    assert_eq!(handle.device_notes(), [note]);
    handle.finish();
}

#[test]
fn devices_are_chosen_by_their_specs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("still.mcap");
    let scene = scene("distributed", &[]);
    let ben = format!("{}=still", scene.users[1].name).parse().unwrap();
    virtual_run::run_with_devices(&scene, &[ben], |_| {}, 1.5, Some(&path), |_| true).unwrap();
    assert_replays(&path);
    let recording = Recording::open(&path).unwrap();
    let moved = |host: u8| {
        let places = recording.items.iter().filter_map(|item| match &item.kind {
            RecordKind::Tick(tick) if item.host == HostIndex(host) => Some(tick.readings[0].pose.position),
            _ => None,
        });
        let places: Vec<DVec3> = places.collect();
        places.iter().any(|place| place.distance(places[0]) > 1e-4)
    };
    assert!(moved(0) && !moved(1), "one follows its script, the other stays");

    let devices = vec!["nothing".parse().unwrap()];
    let error = run_local(&realisable(&scene).0, &RealTimeOptions { devices, ..RealTimeOptions::default() });
    assert!(matches!(error.err(), Some(StartError::Device(DeviceOpenError::Unknown { .. }))));
}
