//! Members who lie: each sends, in the place of its honest samples and through its own end of the session, what cannot be. What another
//! feels of it is held, in virtual time, against the same run without the lie; one lies over a real socket.

use std::net::SocketAddr;
use std::time::Duration;

use cotouch_device::SimulatedUser;
use cotouch_net::{Config, Endpoint, Entry, StatePacket};
use cotouch_runtime::real_time::{realisable, serve};
use cotouch_runtime::transport::{self, Secured};
use cotouch_runtime::virtual_run::{run as run_scene, run_with_devices};
use cotouch_runtime::{Failures, NetworkThreads, RealTimeOptions, VirtualSession, clock};
use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_testkit::built_in;
use glam::{DQuat, DVec3};

use crate::sessions::until;

/// When lying begins, s.
const FROM_S: f64 = 4.0;
const UNTIL_S: f64 = 7.0;

type Lie = fn(u64, &mut StatePacket);

/// A lie that cannot be told from an accident once: a device that fell silent and is somewhere else when it comes back. The liar is
/// faded out, and comes back where it says to be as slowly as any peer that returns.
const ACCIDENTS: [&str; 1] = ["hand somewhere else"];

/// What the victim felt and saw.
struct Outcome {
    /// The largest change of a finger's force from one tick to the next from when lying begins, N.
    max_change_n: f64,
    diverged: bool,
    /// Why it expelled the liar.
    expelled: Option<String>,
    /// The liar's share in the end, and the least that it was.
    fade: f64,
    least_fade: f64,
    /// What the liar was told.
    is_told: bool,
}

/// A session in which `liar` has lied to `victim` by `lie`.
fn run(scene: &Scene, liar: HostIndex, victim: HostIndex, lie: Option<Lie>) -> Outcome {
    let device = |host| (SimulatedUser::new(scene, host).unwrap(), None);
    let mut session = VirtualSession::with_devices(scene, device).unwrap();
    assert!(session.run_to_tick(0, |_, _| {}));
    let rate = scene.rates.control_hz;
    let (from, until) = (rate.ticks_in(FROM_S), rate.ticks_in(UNTIL_S));
    let mut last: Option<Vec<DVec3>> = None;
    let mut outcome = Outcome {
        max_change_n: 0.0,
        diverged: false,
        expelled: None,
        fade: 0.0,
        least_fade: 1.0,
        is_told: false,
    };
    for tick in 0..until {
        if let Some(lie) = lie.filter(|_| tick >= from) {
            tell_lie(&mut session, liar, victim, tick, lie);
        }
        session.run_to_tick(tick + 1, |host, record| {
            if host != victim || record.commanded.is_empty() {
                return;
            }
            let forces: Vec<DVec3> = record.commanded.iter().map(|wrench| wrench.force).collect();
            let changes = last.iter().flatten().zip(&forces).map(|(before, now)| before.distance(*now));
            if tick >= from {
                outcome.max_change_n = changes.fold(outcome.max_change_n, f64::max);
            }
            last = Some(forces);
            outcome.diverged |= record.diverged;
            if tick >= from {
                outcome.least_fade = outcome.least_fade.min(record.fades[liar.index()]);
            }
        });
    }
    let seen = session.host_mut(victim);
    let expelled = seen.endpoint.expelled().iter().find(|expelled| expelled.host == liar);
    outcome.expelled = expelled.map(|expelled| expelled.reason.to_string());
    outcome.fade = seen.station.state.host.peers[liar.index()].fade;
    outcome.is_told = !session.host_mut(liar).station.state.host.peers[victim.index()].present;
    outcome
}

/// Sends the sample of the liar's next network step, as it would be but for the lie, before the honest one.
fn tell_lie(
    session: &mut VirtualSession<SimulatedUser>,
    liar: HostIndex,
    victim: HostIndex,
    tick: u64,
    lie: Lie,
) {
    let host = session.host_mut(liar);
    let station = &host.station;
    let Some(step) = station.model.step_due(&station.state.host, tick) else { return };
    let mut state = station.state.host.clone();
    let readings = &station.state.last_readings;
    let honest = station.model.sample(&mut state, step, readings);
    let honest = honest.or_else(|| station.model.respond(&state, step, readings, victim));
    let mut packet = honest.expect("every host says something");
    lie(step, &mut packet);
    // It is refused once the victim has said that it has expelled the liar.
    let _ = host.endpoint.send_state(&packet, victim);
}

fn each_hand(packet: &mut StatePacket, change: impl Fn(&mut Pose, &mut Twist)) {
    for entry in &mut packet.entries {
        if let Entry::Hand { pose, twist, .. } = entry {
            change(pose, twist);
        }
    }
}

fn each_body(packet: &mut StatePacket, change: impl Fn(&mut Pose, &mut Twist)) {
    for entry in &mut packet.entries {
        if let Entry::Object { pose, twist, .. } = entry {
            change(pose, twist);
        }
    }
}

const OF_HANDS: [(&str, Lie); 9] = [
    ("hand somewhere else", |_, packet| {
        each_hand(packet, |pose, twist| (*pose, *twist) = (Pose::at(DVec3::X * 0.3), Twist::default()));
    }),
    ("hand 100 m off", |_, packet| each_hand(packet, |pose, _| pose.position.x += 100.0)),
    ("hand 1e6 m off", |_, packet| each_hand(packet, |pose, _| pose.position.x += 1e6)),
    ("hand to and fro", |step, packet| {
        each_hand(packet, |pose, _| pose.position.x += if step % 2 == 0 { 1.0 } else { -1.0 });
    }),
    ("hand at 1 km/s", |_, packet| each_hand(packet, |_, twist| twist.linear.x = 1e3)),
    ("hand is no number", |_, packet| each_hand(packet, |pose, _| pose.position.x = f64::NAN)),
    ("no hands", |_, packet| packet.entries.retain(|entry| !matches!(entry, Entry::Hand { .. }))),
    ("hands twice", |_, packet| {
        let first = packet.entries[0];
        packet.entries.truncate(9);
        packet.entries.push(first);
    }),
    ("a force from who has none to send", |_, packet| {
        let wrench = Wrench::force(DVec3::X * 5.0);
        packet.entries.truncate(9);
        packet.entries.push(Entry::Force { point: 0, wrench });
    }),
];

const OF_BODIES: [(&str, Lie); 6] = [
    ("body 1 m off", |_, packet| each_body(packet, |pose, _| pose.position.x += 1.0)),
    ("body 2 km off", |_, packet| each_body(packet, |pose, _| pose.position.x += 2e3)),
    ("body at 1 km/s", |_, packet| each_body(packet, |_, twist| twist.linear.x = 1e3)),
    ("body upside down", |step, packet| {
        let turn = DQuat::from_rotation_z(if step % 2 == 0 { 0.0 } else { 3.0 });
        each_body(packet, |pose, _| pose.orientation = turn);
    }),
    ("no bodies", |_, packet| packet.entries.retain(|entry| !matches!(entry, Entry::Object { .. }))),
    ("nothing: its world has diverged", |_, packet| packet.entries.clear()),
];

/// The world of the victim lives, the liar is faded out and told, and a tick brings no more than it does without the lie.
fn assert_harmless(name: &str, liar: HostIndex, victim: HostIndex, lies: &[(&str, Lie)]) {
    let scene = built_in(name, &[]);
    let honest = run(&scene, liar, victim, None);
    assert!(honest.expelled.is_none() && honest.fade == 1.0, "{name}: {:?}", honest.expelled);
    println!("| {name} | none | {:.3} | |", honest.max_change_n);
    for (what, lie) in lies {
        let outcome = run(&scene, liar, victim, Some(*lie));
        let reason = outcome.expelled.as_deref();
        println!("| {name} | {what} | {:.3} | {} |", outcome.max_change_n, reason.unwrap_or("not expelled"));
        assert!(!outcome.diverged, "{name}, {what}");
        let is_expelled = !ACCIDENTS.contains(what);
        assert_eq!(reason.is_some(), is_expelled, "{name}, {what}");
        assert_eq!(outcome.fade == 0.0, is_expelled, "{name}, {what}");
        assert_eq!(outcome.is_told, is_expelled, "{name}, {what}");
        assert_eq!(outcome.least_fade, 0.0, "{name}, {what}");
        if !is_expelled {
            continue;
        }
        let allowed_n = (1.3 * honest.max_change_n).max(0.1);
        assert!(
            outcome.max_change_n <= allowed_n,
            "{name}, {what}: {} N in a tick, {} N without",
            outcome.max_change_n,
            honest.max_change_n
        );
    }
}

/// Built-in scenes, on good and on bad links: nothing honest is refused.
#[test]
fn honest_members_send_nothing_that_cannot_be() {
    let bad =
        ["link.impairment.latency_s=0.02", "link.impairment.loss_rate=0.05", "link.impairment.jitter_s=0.01"];
    for name in cotouch_scene::builtin::names() {
        for settings in [&[][..], &bad] {
            let summary = run_scene(&built_in(name, settings), 6.0, None, |_| true).unwrap();
            assert_eq!((summary.network.implausible, summary.expelled.len()), (0, 0), "{name} {settings:?}");
            assert_eq!(summary.network.stale, 0, "{name} {settings:?}");
        }
    }
}

/// A simulated hand flies while its device fails, and is somewhere else when that comes back. Its host tells of it from where it was, so that
/// nothing jumps; where that is left to the couplings, it is faded out and in, and not expelled, nor is the server that tells others where it
/// keeps its own.
#[test]
fn a_device_that_comes_back_is_no_lie() {
    for (name, device, jumps) in [
        ("single-axis-centralized", "anna=faulty:fail@2+0.3", true),
        ("single-axis-centralized", "ben=faulty:fail@2+0.3", true),
        ("single-axis", "ben=faulty:fail@2+1", true),
        ("grasp", "ben=faulty:fail@4+0.5", false),
    ] {
        let devices = [device.parse().unwrap()];
        for (rejoin, jumps) in [("session.rejoin_s=1.5", false), ("session.rejoin_s=0", jumps)] {
            let scene = built_in(name, &[rejoin]);
            let summary = run_with_devices(&scene, &devices, |_| (), 8.0, None, |_| true).unwrap();
            assert_eq!(summary.expelled, [], "{name} {device} {rejoin}");
            assert!(summary.users_detail.iter().any(|user| user.device_faults.is_some()));
            assert_eq!(summary.network.implausible > 0, jumps, "{name} {device} {rejoin}");
        }
    }
}

#[test]
fn a_member_that_lies_about_its_hand_or_its_world_is_expelled_and_nobody_feels_it() {
    for name in ["single-axis", "grasp"] {
        assert_harmless(name, HostIndex(1), HostIndex(0), &OF_HANDS);
        assert_harmless(name, HostIndex(1), HostIndex(0), &OF_BODIES);
    }
}

#[test]
fn a_client_that_lies_to_the_server_is_expelled_and_nobody_feels_it() {
    for name in ["single-axis-centralized", "grasp-centralized"] {
        assert_harmless(name, HostIndex(1), HostIndex(0), &OF_HANDS);
    }
}

#[test]
fn a_server_that_sends_forces_that_cannot_be_is_let_go_of() {
    let lies: [(&str, Lie); 3] = [
        ("force of 1e5 N", |_, packet| {
            for entry in &mut packet.entries {
                if let Entry::Force { wrench, .. } = entry {
                    wrench.force.x = 1e5;
                }
            }
        }),
        ("no forces", |_, packet| packet.entries.retain(|entry| !matches!(entry, Entry::Force { .. }))),
        ("nothing: its world has diverged", |_, packet| packet.entries.clear()),
    ];
    for name in ["single-axis-centralized", "grasp-centralized"] {
        assert_harmless(name, HostIndex(0), HostIndex(1), &lies);
    }
}

/// Over a real socket, with a valid ticket and the protocol's own words.
#[test]
fn a_ticket_holder_who_lies_is_expelled_and_the_session_goes_on() {
    let (scene, _) = realisable(&built_in("single-axis", &[]));
    let any: SocketAddr = "127.0.0.1:0".parse().unwrap();
    let session = serve(&scene, any, &RealTimeOptions::default()).unwrap();
    let ticket = session.ticket().unwrap();
    let end = Secured::join(transport::connect(ticket.address).unwrap(), ticket, clock::now());
    end.reach_server(Duration::from_secs(60), &|| true).unwrap();
    let config = Config::new(session.scene(), cotouch_scene::scene_hash(session.scene()), 7).unwrap();
    let endpoint =
        Endpoint::join(Config { routes_are_proven: true, ..config }, ticket.key.server(), clock::now());
    let (liar, mut port) = NetworkThreads::start(end, endpoint, "liar", &Failures::default()).unwrap();
    let mut told = Vec::new();
    until("the liar is expelled", || {
        if let Some(clock_map) = port.clock() {
            let step = scene.rates.network_hz.last_tick_at(clock_map.session(clock::now()));
            let hand = Entry::Hand { point: 0, pose: Pose::at(DVec3::X * 1e6), twist: Twist::default() };
            port.leave(None, StatePacket { step, entries: [hand].into_iter().collect() });
            port.wake_sender();
        }
        told.extend(session.take_news());
        told.iter().any(|news| news.contains("was expelled: it leaves out body 1")).then_some(())
    });
    assert!(told.iter().any(|news| news.contains("sends what cannot be")), "{told:?}");
    let mut heard = Vec::new();
    until("the liar is told", || {
        heard.extend(liar.take_news());
        heard.iter().any(|news| news.contains("has left: expelled")).then_some(())
    });
    let ticks = session.snapshot().hosts[0].ticks;
    until("ticks go on", || (session.snapshot().hosts[0].ticks > ticks + 100).then_some(()));
    session.stop();
    let summary = session.finish();
    assert_eq!(summary.expelled.len(), 1);
    assert_eq!((summary.expelled[0].user.as_str(), summary.expelled[0].by.as_str()), ("ben", "anna"));
    assert!(summary.network.implausible >= 26 && summary.stable, "{summary:?}");
    assert!(summary.network.receive_buffer_bytes.is_some_and(|bytes| bytes > 0));
}
