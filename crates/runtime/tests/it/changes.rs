//! Settings that change while a session runs, in virtual time: what is recorded replays, and what the last seconds were
//! like follows the settings.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex};

use crate::sessions::{ARCHITECTURES, assert_replays, scene};
use cotouch_device::SimulatedUser;
use cotouch_runtime::real_time::realisable;
use cotouch_runtime::{
    HostChange, LiveVerdict, RecordItem, RecordKind, RecordSink, Recorder, Recording, RecordingHeader,
    RecordingReader, ReplayError, RunVerdict, SettingValue, SettingsSummary, Station, VirtualSession, replay,
};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;

/// On both sides of the boundary, which is at 400 to 1500 N/m.
const STABLE: &str = "coupling.object_object.stiffness_n_per_m=400";
const UNSTABLE: &str = "coupling.object_object.stiffness_n_per_m=3000";

#[derive(Clone, Default)]
pub(crate) struct Kept(pub(crate) Arc<Mutex<Vec<RecordItem>>>);

impl RecordSink for Kept {
    fn record(&mut self, item: &RecordItem) {
        self.0.lock().unwrap().push(item.clone());
    }
}

fn start(scene: &Scene, kept: &Kept) -> VirtualSession {
    VirtualSession::new(scene, |host| {
        let hand = SimulatedUser::new(scene, host).unwrap();
        Station::new(scene, host, hand, Some(Box::new(kept.clone())))
    })
}

fn change(session: &mut VirtualSession, to: &Scene) {
    for host in to.hosts() {
        assert!(session.host_mut(host).station.change(&mut HostChange::new(to, host)));
    }
}

fn run_to(session: &mut VirtualSession, seconds: f64) {
    assert!(session.run_to_tick((seconds * 1024.0) as u64, |_, _| {}));
}

fn now(session: &VirtualSession) -> LiveVerdict {
    LiveVerdict::combine(session.hosts().iter().map(|host| host.station.observer.now()))
}

pub(crate) fn write(path: &Path, scene: &Scene, items: &[RecordItem]) {
    let header = RecordingHeader {
        cotouch_version: "0".to_owned(),
        scene_toml: cotouch_scene::to_toml(scene),
        control_hz: scene.rates.control_hz,
        epoch_unix_ns: 0,
        facts: BTreeMap::new(),
    };
    let mut recorder = Recorder::create(path, &header).unwrap();
    items.iter().for_each(|item| recorder.write(item).unwrap());
    recorder.finish(BTreeMap::new()).unwrap();
}

fn is_change(item: &RecordItem) -> bool {
    matches!(item.kind, RecordKind::Changed(_))
}

#[test]
fn a_changed_session_replays_bit_for_bit_and_only_with_its_changes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("changed.mcap");
    for architecture in ARCHITECTURES {
        let first = scene(architecture, &[]);
        let second = scene(
            architecture,
            &[
                "coupling.hand_object.stiffness_n_per_m=1234",
                "object.mass_kg=0.7",
                "governor.damping_n_s_per_m=1",
            ],
        );
        let kept = Kept::default();
        let mut session = start(&first, &kept);
        run_to(&mut session, 1.3);
        change(&mut session, &second);
        run_to(&mut session, 2.6);
        let changed_at = session.hosts()[0].station.last_record().clone();
        change(&mut session, &first);
        run_to(&mut session, 3.5);
        assert_ne!(&changed_at, session.hosts()[0].station.last_record());

        let items = std::mem::take(&mut *kept.0.lock().unwrap());
        write(&path, &first, &items);
        assert_eq!(Recording::open(&path).unwrap().items, items);
        assert_eq!(items.iter().filter(|item| is_change(item)).count(), 4, "two changes at two hosts");
        let replayed = assert_replays(&path);
        assert_eq!((replayed.skipped, replayed.ended_abruptly), (0, false));

        let without: Vec<RecordItem> = items.into_iter().filter(|item| !is_change(item)).collect();
        write(&path, &first, &without);
        let replayed = replay(RecordingReader::open(&path).unwrap(), |_| {}).unwrap();
        assert!(!replayed.comparison.identical(), "{architecture}: the change made no difference");
    }
}

#[test]
fn a_recorded_change_that_cannot_be_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.mcap");
    let scene_of_two = scene("distributed", &[]);
    let of_three = cotouch_scene::to_toml(&scene("distributed", &["session.users=3"]));
    let of_bodies = cotouch_scene::to_toml(&cotouch_scene::load("stack", &[]).unwrap());
    for text in ["no scene".to_owned(), of_three, of_bodies] {
        let kind = RecordKind::Changed(text);
        write(&path, &scene_of_two, &[RecordItem { host: HostIndex(1), tick: 7, kind }]);
        let error = replay(RecordingReader::open(&path).unwrap(), |_| {}).unwrap_err();
        assert!(matches!(error, ReplayError::Change { tick: 7, .. }), "{error}");
        assert!(error.to_string().contains("changes to at tick 7"), "{error}");
    }
}

#[test]
fn a_station_refuses_constants_of_another_world_and_goes_on() {
    let one = scene("distributed", &[]);
    let mut session = start(&one, &Kept::default());
    run_to(&mut session, 0.5);
    let before = session.hosts()[0].station.state.clone();
    let others = [
        HostChange::new(&scene("distributed", &["session.users=3"]), HostIndex(0)),
        HostChange::new(&cotouch_scene::load("stack", &[]).unwrap(), HostIndex(0)),
        HostChange::new(&one, HostIndex(1)),
    ];
    for mut other in others {
        assert!(!session.host_mut(HostIndex(0)).station.change(&mut other));
    }
    assert_eq!(session.hosts()[0].station.state, before);
    run_to(&mut session, 0.6);
}

#[test]
fn it_shakes_past_the_boundary_and_settle_before_it() {
    let stable = realisable(&scene("distributed", &[STABLE])).0;
    let unstable = realisable(&scene("distributed", &[UNSTABLE])).0;
    let mut session = start(&stable, &Kept::default());
    run_to(&mut session, 0.9);
    assert_eq!(now(&session).verdict, None, "too early");
    run_to(&mut session, 4.0);
    assert_eq!(now(&session).verdict, Some(RunVerdict::Quiet));
    let at_rest_n = now(&session).fast_force_n;
    change(&mut session, &unstable);
    run_to(&mut session, 6.0);
    // It goes on for as long as it shakes, also when it grows no more.
    for quarter in 0..16 {
        run_to(&mut session, 6.0 + 0.25 * f64::from(quarter));
        let now = now(&session);
        assert!(now.verdict > Some(RunVerdict::Quiet), "{now:?}");
        assert!(now.fast_force_n > 30.0 * at_rest_n, "{now:?}");
    }
    change(&mut session, &stable);
    run_to(&mut session, 13.0);
    assert_eq!(now(&session).verdict, Some(RunVerdict::Quiet));
    assert!(now(&session).fast_force_n < 0.02);
}

#[test]
fn every_set_of_settings_has_a_verdict_of_its_own_and_a_recording_tells_it_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lesson.mcap");
    let stable = realisable(&scene("distributed", &[STABLE])).0;
    let unstable = realisable(&scene("distributed", &[UNSTABLE])).0;
    let kept = Kept::default();
    let mut session = start(&stable, &kept);
    let lesson = [(4.0, &unstable), (9.0, &stable), (9.3, &unstable), (9.6, &stable)];
    for (seconds, next) in lesson {
        run_to(&mut session, seconds);
        change(&mut session, next);
    }
    run_to(&mut session, 14.0);
    write(&path, &stable, &kept.0.lock().unwrap());
    let run = replay(RecordingReader::open(&path).unwrap(), |_| {}).unwrap().run.unwrap();
    assert_ne!(run.verdict, RunVerdict::Quiet, "all of it counts");
    assert!((run.duration_s - 14.0).abs() < 1e-9, "{}", run.duration_s);
    // What was changed again within a third of a second is left out.
    let [before, past, back] = &run.predictions[..] else { panic!("{:?}", run.predictions) };
    let times = |stretch: &SettingsSummary| (stretch.from_s, stretch.to_s);
    assert_eq!([before, past, back].map(times), [(0.0, 4.0), (4.0, 9.0), (9.599609375, 14.0)]);
    assert_eq!(before.verdict, Some(RunVerdict::Quiet));
    assert!(past.verdict > Some(RunVerdict::Quiet) && past.shaking > 0, "{past:?}");
    assert_eq!((back.verdict, back.shaking), (Some(RunVerdict::Quiet), 0));
    assert!((back.judged_s - (14.0 - 9.599609375 - 1.0)).abs() < 1e-9, "{}", back.judged_s);
    let key = UNSTABLE.split_once('=').unwrap().0;
    assert_eq!(past.settings.iter().collect::<Vec<_>>(), [(&key.to_owned(), &SettingValue::Number(3000.0))]);
    assert!(before.settings.is_empty() && back.settings.is_empty());
    assert_eq!(past.scene.as_deref(), Some(&unstable));
}

#[test]
fn users_who_touch_and_carry_do_not_shake() {
    for name in ["grasp", "hand-over", "stack", "push-wall", "sinusoid", "four-hands"] {
        let scene = realisable(&cotouch_scene::load(name, &[]).unwrap()).0;
        let mut session = start(&scene, &Kept::default());
        for half_second in 1..=20 {
            run_to(&mut session, 0.5 * f64::from(half_second));
            let verdict = now(&session).verdict;
            assert!(
                verdict <= Some(RunVerdict::Quiet),
                "{name} after {half_second} half seconds: {verdict:?}"
            );
        }
    }
}
