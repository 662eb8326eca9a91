//! Sessions that are changed while they run, in real time: what even a busy computer can promise.

use std::path::Path;
use std::thread;
use std::time::Duration;

use crate::sessions::{assert_adds_up, assert_replays, scene, until};
use cotouch_runtime::real_time::{realisable, run_local, serve};
use cotouch_runtime::{
    ChangeError, Changed, HeldBy, LiveSession, RealTimeOptions, RecordKind, Recording, RunVerdict, Summary,
    TakeError, numbered_path,
};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, Impairment, Scene};
use cotouch_testkit::scenes::edited;

fn real_scene(settings: &[&str]) -> Scene {
    realisable(&scene("distributed", settings)).0
}

fn live(scene: &Scene, recording: Option<&Path>) -> LiveSession {
    let options = RealTimeOptions { recording: recording.map(Path::to_owned), ..RealTimeOptions::default() };
    LiveSession::run_local(scene, options).unwrap()
}

fn wait_until(session: &LiveSession, mut is_so: impl FnMut(&LiveSession) -> bool) {
    until("what the session comes to", || {
        let found = is_so(session).then_some(());
        assert!(found.is_some() || !session.has_ended(), "the session ended by itself");
        found
    });
}

/// Waits for so many ticks of the session that runs now.
fn wait_for_ticks(session: &LiveSession, ticks: u64) {
    let done = |session: &LiveSession| session.snapshot().0.hosts[0].ticks;
    let (before, generation) = (done(session), session.scene().1);
    assert_eq!(session.snapshot().1, generation);
    wait_until(session, |session| done(session) >= before + ticks);
}

fn stop(session: LiveSession) -> Summary {
    session.stop();
    let summary = session.finish();
    assert_adds_up(&summary);
    summary
}

#[test]
fn what_forces_are_made_of_changes_while_running_and_replays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("live.mcap");
    let session = live(&real_scene(&[]), Some(&path));
    assert!(session.may_change());
    wait_for_ticks(&session, 300);
    let before = session.snapshot().0.hosts[0].ticks;
    let softer = real_scene(&["coupling.object_object.stiffness_n_per_m=100"]);
    assert_eq!(session.change(softer.clone()).unwrap(), Changed::WhileRunning);
    assert_eq!((*session.scene().0 == softer, session.scene().1), (true, 1));
    wait_for_ticks(&session, 300);
    assert!(session.snapshot().0.hosts[0].ticks > before, "the same session goes on");
    stop(session);
    assert_replays(&path);
    let changes = |item: &&_| {
        let item: &&cotouch_runtime::RecordItem = item;
        matches!(&item.kind, RecordKind::Changed(text) if text.contains("100"))
    };
    assert_eq!(Recording::open(&path).unwrap().items.iter().filter(changes).count(), 2);
}

#[test]
fn what_the_network_does_changes_while_running() {
    let session = live(&real_scene(&[]), None);
    wait_for_ticks(&session, 300);
    let lost = |session: &LiveSession| session.snapshot().0.hosts[0].links[0].lost;
    let lossy = real_scene(&["link.impairment.loss_rate=0.5"]);
    assert_eq!(session.change(lossy).unwrap(), Changed::WhileRunning);
    let before = lost(&session);
    wait_until(&session, |session| lost(session) >= before + 20);
    assert_eq!(session.change(real_scene(&[])).unwrap(), Changed::WhileRunning);
    let received = |session: &LiveSession| session.snapshot().0.hosts[0].links[0].received;
    let before = received(&session);
    wait_until(&session, |session| received(session) >= before + 100);
    let _: Summary = stop(session);
}

#[test]
fn any_other_change_begins_the_next_session_with_a_recording_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("live.mcap");
    let session = live(&real_scene(&[]), Some(&path));
    wait_for_ticks(&session, 200);
    let of_three = real_scene(&["session.users=3", "link.impairment.loss_rate=0.2"]);
    assert_eq!(session.change(of_three.clone()).unwrap(), Changed::ByRestart);
    assert_eq!((*session.scene().0 == of_three, session.scene().1), (true, 2));
    assert!(!session.has_ended());
    wait_for_ticks(&session, 200);
    assert_eq!((session.snapshot().0.hosts.len(), session.seats().len()), (3, 3));
    assert!(session.seats().iter().all(|seat| seat.by == HeldBy::Script));
    session.again().unwrap();
    assert_eq!(session.scene().1, 3);
    wait_for_ticks(&session, 100);
    let summary = stop(session);
    let recordings: Vec<_> =
        summary.earlier.iter().map(|session| session.recording.clone().unwrap()).collect();
    let of = |generation| numbered_path(&path, generation).display().to_string();
    assert_eq!((recordings, summary.recording), (vec![of(1), of(2)], Some(of(3))));
    for generation in 1..=3 {
        let replayed = assert_replays(&numbered_path(&path, generation));
        assert!(!replayed.ended_abruptly);
    }
    assert!(folder.path().join("live-3.mcap").exists());
}

#[test]
fn a_recording_that_is_named_after_its_scene_is_named_after_the_next_one_too() {
    let folder = tempfile::tempdir().unwrap();
    let scene = real_scene(&[]);
    let first = folder.path().join(format!("{}-today.mcap", scene.name));
    let session = live(&scene, Some(&first));
    wait_for_ticks(&session, 100);
    let other = edited(&real_scene(&["session.users=3"]), |scene| scene.name = "../an other".to_owned());
    session.change(other).unwrap();
    wait_for_ticks(&session, 100);
    let summary = stop(session);
    let second = folder.path().join("---an-other-today-2.mcap").display().to_string();
    assert_eq!(summary.earlier[0].recording, Some(first.display().to_string()));
    assert_eq!(summary.recording, Some(second));
}

#[test]
fn pictures_go_on_while_a_session_follows_another_and_a_stop_holds_for_the_next() {
    let session = live(&real_scene(&[]), None);
    wait_for_ticks(&session, 100);
    thread::scope(|scope| {
        let change = scope.spawn(|| session.change(real_scene(&["session.users=3"])));
        wait_until(&session, |session| {
            assert!(!session.snapshot().0.hosts.is_empty());
            assert!(!session.snapshot().0.ended);
            session.snapshot().1 == 2
        });
        assert_eq!(change.join().unwrap().unwrap(), Changed::ByRestart);
        let again = scope.spawn(|| session.again());
        // Mostly long enough for the next session to be under way; it may have begun before the stop or not at all.
        thread::sleep(Duration::from_millis(20));
        session.stop();
        let _either = again.join().unwrap();
        until("the end", || session.has_ended().then_some(()));
    });
    assert!(matches!(session.again(), Err(ChangeError::Ended)));
    assert!(matches!(session.change(real_scene(&[])), Err(ChangeError::Ended)));
    session.finish();
}

#[test]
fn a_session_that_does_not_start_leaves_the_one_before() {
    let first = real_scene(&[]);
    let options = RealTimeOptions::default();
    let starter = move |scene: &Scene, _| {
        let blocked = Path::new("/no such folder/run.mcap").to_owned();
        let recording = (scene.session.users == 3).then_some(blocked);
        run_local(scene, &RealTimeOptions { recording, ..RealTimeOptions::default() })
    };
    let session = LiveSession::changeable(run_local(&first, &options).unwrap(), Box::new(starter));
    wait_for_ticks(&session, 100);
    let error = session.change(real_scene(&["session.users=3"])).unwrap_err();
    assert!(error.to_string().contains("no such folder"), "{error}");
    assert_eq!((*session.scene().0 == first, session.scene().1), (true, 2));
    wait_for_ticks(&session, 100);
    let _: Summary = stop(session);
}

#[test]
fn past_the_boundary_it_shakes_and_before_it_settles() {
    let stiff = |stiffness: u32| {
        real_scene(&[format!("coupling.object_object.stiffness_n_per_m={stiffness}").as_str()])
    };
    let session = live(&stiff(300), None);
    let now = |session: &LiveSession| session.snapshot().0.now;
    let is_quiet = |session: &LiveSession| now(session).verdict == Some(RunVerdict::Quiet);
    wait_until(&session, is_quiet);
    let calm_n = now(&session).fast_force_n;
    assert_eq!(session.change(stiff(2500)).unwrap(), Changed::WhileRunning);
    wait_until(&session, |session| {
        let now = now(session);
        now.verdict > Some(RunVerdict::Quiet) && now.fast_force_n > 10.0 * calm_n
    });
    session.change(stiff(300)).unwrap();
    wait_until(&session, is_quiet);
    let _: Summary = stop(session);
}

#[test]
fn a_world_that_left_all_bounds_begins_anew() {
    let settings = ["coupling.object_object.stiffness_n_per_m=200000", "object.mass_kg=0.05"];
    let session = live(&real_scene(&settings), None);
    wait_until(&session, |session| session.snapshot().0.hosts.iter().any(|host| host.diverged));
    // Where nobody watches, what happened stays to be seen in the summary.
    thread::sleep(Duration::from_secs(2));
    assert_eq!(session.scene().1, 1);
    wait_until(&session, |session| {
        session.is_watched(10.0);
        session.scene().1 == 2
    });
    let mut news = Vec::new();
    wait_until(&session, |session| {
        news.extend(session.take_news());
        news.iter().any(|news| news.contains("begun anew"))
    });
    // Settings that hold are taken at once, or by the next session where this one has left all bounds too.
    session.change(real_scene(&[])).unwrap();
    wait_for_ticks(&session, 300);
    assert!(session.snapshot().0.hosts.iter().all(|host| !host.diverged));
    let _: Summary = stop(session);
}

#[test]
fn a_shared_session_is_as_it_is() {
    let scene = real_scene(&[]);
    let impairment = Some(Impairment { latency_s: 0.002, ..Impairment::NONE });
    let options = RealTimeOptions { impairment, ..RealTimeOptions::default() };
    let session = LiveSession::fixed(
        serve(&scene, cotouch_runtime::transport::parse("127.0.0.1:0").unwrap(), &options).unwrap(),
    );
    assert!(!session.may_change());
    assert!(matches!(session.change(scene.clone()), Err(ChangeError::Shared)));
    assert!(matches!(session.again(), Err(ChangeError::Shared)));
    let (would_run, note) = session.as_it_would_run(&real_scene(&["link.impairment.latency_s=0.05"]));
    assert_eq!((would_run.link.impairment.latency_s, note), (0.002, None));
    let seats: Vec<HeldBy> = session.seats().iter().map(|seat| seat.by).collect();
    assert_eq!(seats, [HeldBy::Script, HeldBy::Nobody]);
    session.stop();
    session.finish();
}

#[test]
fn predictions_are_for_what_a_real_network_can_play() {
    let session = live(&real_scene(&[]), None);
    let asked = scene("distributed", &["link.delay_periods=0", "link.impairment.latency_s=0.05"]);
    let (would_run, note) = session.as_it_would_run(&asked);
    assert_eq!((would_run.link.delay_periods, would_run.link.impairment.latency_s), (1, 0.05));
    assert!(note.unwrap().contains("delay_periods"));
    wait_for_ticks(&session, 1);
    let _: Summary = stop(session);
}

#[test]
fn recordings_are_numbered_from_the_second_on() {
    let name = |generation| numbered_path(Path::new("a/b.c.mcap"), generation).display().to_string();
    assert_eq!([name(1), name(2), name(10)], ["a/b.c.mcap", "a/b.c-2.mcap", "a/b.c-10.mcap"]);
    assert_eq!(numbered_path(Path::new("b"), 2), Path::new("b-2"));
}

#[test]
fn a_watched_session_that_shakes_against_its_limits_is_stopped_and_waits_for_other_settings() {
    let session = live(&real_scene(&["coupling.remote_hand_object.stiffness_n_per_m=4000"]), None);
    wait_until(&session, |session| {
        session.is_watched(2.0);
        session.paused().is_some()
    });
    assert!(!session.has_ended() && session.scene().1 == 1);
    assert!(matches!(session.take(HostIndex(0)), Err(TakeError::Ended)), "there is no hand");
    assert_eq!(session.change(real_scene(&[])).unwrap(), Changed::ByRestart);
    assert_eq!((session.paused(), session.scene().1), (None, 2));
    wait_for_ticks(&session, 100);
    let summary = stop(session);
    // What came after does not make good what was.
    assert_ne!(summary.earlier[0].verdict, RunVerdict::Quiet);
    assert_eq!((summary.verdict, summary.stable), (summary.earlier[0].verdict, false));
}

#[test]
fn scripts_that_are_over_begin_anew_while_somebody_watches_and_no_pointer_holds_a_hand() {
    let short = real_scene(&[]).edit(|scene| {
        for user in &mut scene.users {
            user.repeat = false;
            user.script = vec![Action::Relax { duration_s: 0.2 }];
        }
    });
    let session = live(&short.unwrap(), None);
    let hand = session.take(HostIndex(0)).unwrap();
    let until_s = 4.5;
    wait_until(&session, |session| {
        session.is_watched(2.0);
        session.elapsed_s() > until_s
    });
    assert_eq!(session.scene().1, 1, "somebody holds a hand");
    drop(hand);
    wait_until(&session, |session| {
        session.is_watched(2.0);
        session.scene().1 == 2
    });
    let mut news = session.take_news();
    wait_until(&session, |session| {
        news.extend(session.take_news());
        news.iter().any(|news| news.contains("scripts were over"))
    });
    wait_for_ticks(&session, 100);
    stop(session);
}
