//! Hands that pointers take from their scripts, and free places that they take, in real time on loopback.

use std::net::{SocketAddr, UdpSocket};

use crate::sessions::{self, assert_adds_up, assert_replays, scene, until};
use cotouch_device::Targets;
use cotouch_runtime::real_time::{join, realisable, run_local, serve};
use cotouch_runtime::{
    FingerSnapshot, HeldBy, HostSnapshot, LiveSession, PointerHandle, RealTimeOptions, RecordItem,
    RecordKind, Recording, TakeError,
};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_testkit::scenes::edited;
use glam::DVec3;

const ANNA: HostIndex = HostIndex::FIRST;
const BEN: HostIndex = HostIndex(1);

fn host_of(live: &LiveSession, user: HostIndex) -> Option<HostSnapshot> {
    live.snapshot().0.hosts.into_iter().find(|host| host.host == user && host.ticks > 0)
}

fn finger(live: &LiveSession, user: HostIndex) -> Option<FingerSnapshot> {
    host_of(live, user)?.fingers.first().copied()
}

fn by(live: &LiveSession, user: HostIndex) -> HeldBy {
    live.seats()[user.index()].by
}

/// Draws all fingers by `shift` from where they are; gives the first one's target.
fn draw(live: &LiveSession, hand: &mut PointerHandle, shift: DVec3) -> DVec3 {
    let host = until("a picture", || host_of(live, hand.user));
    let target = |finger: &FingerSnapshot| finger.reading.pose.position + shift;
    let targets: Targets = host.fingers.iter().map(target).collect();
    assert!(hand.point(&targets));
    targets[0]
}

fn free_address() -> SocketAddr {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap()
}

fn still(scene: &mut Scene) {
    *scene = edited(scene, |scene| scene.users.iter_mut().for_each(|user| user.script.clear()));
}

#[test]
fn a_hand_that_is_taken_goes_where_the_pointer_says_and_then_does_as_its_script() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    // A hand whose script does not repeat would keep what it holds.
    let scene =
        cotouch_scene::load("grasp", &[]).unwrap().edit(|scene| scene.users[0].repeat = true).unwrap();
    let options = RealTimeOptions { recording: Some(path.clone()), ..RealTimeOptions::default() };
    let live = LiveSession::fixed(run_local(&realisable(&scene).0, &options).unwrap());
    until("a picture", || finger(&live, ANNA));
    assert!(finger(&live, ANNA).unwrap().target.is_none());
    let mut hand = live.take(ANNA).unwrap();
    assert_eq!((by(&live, ANNA), by(&live, BEN)), (HeldBy::Pointer, HeldBy::Script));
    assert!(matches!(live.take(ANNA), Err(TakeError::Taken { name }) if name == scene.users[0].name));
    assert!(matches!(live.take(HostIndex(2)), Err(TakeError::NoSuchUser { user: 2, users: 2 })));

    // Away from the box.
    let target = draw(&live, &mut hand, DVec3::new(-0.01, 0.02, 0.0));
    until("the finger at its target", || {
        let finger = finger(&live, ANNA)?;
        let (drawn, place) = (finger.target?, finger.reading.pose.position);
        (drawn.distance(target) < 1e-3 && place.distance(target) < 3e-3).then_some(())
    });
    drop(hand);
    assert_eq!(by(&live, ANNA), HeldBy::Script);
    until("the target gone", || finger(&live, ANNA)?.target.is_none().then_some(()));
    // The script closes the fingers on the box once more.
    until("the box held", || finger(&live, ANNA)?.proxy);
    live.stop();
    assert_adds_up(&live.finish());
    assert_replays(&path);
    let recording = Recording::open(&path).unwrap();
    let went = |item: &RecordItem| match &item.kind {
        RecordKind::Tick(tick) => item.host == ANNA && tick.readings[0].pose.position.distance(target) < 4e-3,
        _ => false,
    };
    assert!(recording.items.iter().any(went), "the recording has the way of the finger");
}

#[test]
fn a_finger_in_touch_shows_where_it_is_held_and_what_it_has_given() {
    let scene = cotouch_scene::load("grasp", &[]).unwrap();
    let live = LiveSession::fixed(run_local(&realisable(&scene).0, &RealTimeOptions::default()).unwrap());
    let (finger, proxy) = until("a finger that presses", || {
        let finger = finger(&live, ANNA)?;
        (finger.commanded.force.length() > 0.3).then_some((finger, finger.proxy?))
    });
    // 0.3 N at 800 N/m are 0.4 mm; a pulse of moment cancellation is more at less depth.
    let depth = proxy.distance(finger.reading.pose.position);
    assert!(depth > 1e-6 && depth < 0.02, "{depth} m");
    assert!(finger.energy_j != 0.0);
    let host = host_of(&live, ANNA).unwrap();
    let sum: f64 = host.fingers.iter().map(|finger| finger.energy_j).sum();
    assert!((sum - host.energy_j).abs() < 1e-12);
    assert!(host.lateness_us >= 0.0);
}

#[test]
fn a_pointer_that_outlives_its_session_moves_nothing() {
    let live = LiveSession::run_local(&realisable(&scene("distributed", &[])).0, RealTimeOptions::default())
        .unwrap();
    until("a picture", || finger(&live, BEN));
    let mut old = live.take(BEN).unwrap();
    assert!(old.point(&Targets::new()));
    live.again().unwrap();
    assert!(!old.point(&Targets::new()));
    assert_eq!(by(&live, BEN), HeldBy::Script);
    let hand = live.take(BEN).unwrap();
    let tracking = |live: &LiveSession| {
        let (would_run, _) = live.as_it_would_run(&live.scene().0);
        would_run.users.iter().map(|user| user.tracking).collect::<Vec<_>>()
    };
    let slack = live.scene().0.users[0].tracking;
    assert_eq!(tracking(&live), [slack, hand.spring], "the analysis is asked about the pointer's spring");
    drop(old);
    assert_eq!(by(&live, BEN), HeldBy::Pointer, "an old hand does not let go for a new one");
    drop(hand);
    assert_eq!(tracking(&live), [slack, slack]);
    live.stop();
    until("the end", || live.has_ended().then_some(()));
    assert!(matches!(live.take(ANNA), Err(TakeError::Ended)));
}

#[test]
fn a_free_place_is_taken_by_a_guest_and_is_free_again() {
    for architecture in sessions::ARCHITECTURES {
        let mut scene = realisable(&scene(architecture, &[])).0;
        still(&mut scene);
        let live = LiveSession::fixed(serve(&scene, free_address(), &RealTimeOptions::default()).unwrap());
        until("a picture", || finger(&live, ANNA));
        assert_eq!((by(&live, ANNA), by(&live, BEN)), (HeldBy::Script, HeldBy::Nobody));
        let mut hand = live.take(BEN).unwrap();
        assert_eq!(by(&live, BEN), HeldBy::Pointer);
        assert!(matches!(live.take(BEN), Err(TakeError::Taken { .. })));
        let target = draw(&live, &mut hand, DVec3::X * 0.03);
        until("the guest's finger at its target", || {
            let place = finger(&live, BEN)?.reading.pose.position;
            (place.distance(target) < 2e-3).then_some(())
        });
        // The object follows, also in the server's world.
        until("the object moved", || (host_of(&live, ANNA)?.bodies[0].position.x > 0.01).then_some(()));
        assert_eq!(live.snapshot().0.hosts.len(), 2, "the guest's picture is among the others");
        drop(hand);
        until("the place free again", || (by(&live, BEN) == HeldBy::Nobody).then_some(()));
        let again = live.take(BEN).unwrap();
        until("the guest back", || finger(&live, BEN));
        live.stop();
        drop(again);
        assert_adds_up(&live.finish());
    }
}

#[test]
fn somebody_elsewhere_keeps_their_hand_and_a_joined_computer_gives_its_own() {
    let scene = realisable(&scene("distributed", &[])).0;
    let address = free_address();
    let server = serve(&scene, address, &RealTimeOptions::default()).unwrap();
    let ticket = server.ticket().unwrap();
    let live = LiveSession::fixed(server);
    let (_, peer) = join(ticket, None, &RealTimeOptions::default(), &|| true).unwrap();
    let peer = LiveSession::fixed(peer);
    until("ben is there", || (by(&live, BEN) == HeldBy::Elsewhere).then_some(()));
    assert!(matches!(live.take(BEN), Err(TakeError::Taken { .. })));
    until("a picture", || finger(&peer, BEN));
    let mut hand = peer.take(BEN).unwrap();
    let target = draw(&peer, &mut hand, DVec3::X * 0.02);
    until("the target there", || (finger(&peer, BEN)?.target?.distance(target) < 1e-3).then_some(()));
    assert_eq!(by(&peer, ANNA), HeldBy::Elsewhere);
    for session in [peer, live] {
        session.stop();
        assert_adds_up(&session.finish());
    }
}
