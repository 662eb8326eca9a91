//! The haptic thread never allocates: not in a station's instant, not in recording it, not where it meets the network.

use crate::common::session;
use arrayvec::ArrayVec;
use cotouch_device::SimulatedUser;
use cotouch_net::StatePacket;
use cotouch_runtime::transport::{self, Secured, Transport as _};
use cotouch_runtime::{
    Failures, HostChange, LiveVerdict, NetworkThreads, Punctuality, RECORD_RING_BYTES, RecordConsumer,
    RecordItem, RecordKind, RecordSink, Station, full_session_endpoint, record_ring, slow_simulation,
    start_slow_thread,
};
use cotouch_scene::load;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_testkit::{allocations, built_in, deallocations};

#[test]
fn recording_does_not_allocate() {
    let items = session(500);
    let (mut producer, mut consumer) = record_ring(HostIndex(0), 1 << 20);
    assert_eq!(allocations(|| items.iter().for_each(|item| producer.record(item))), 0);
    assert_eq!(producer.dropped(), 0);
    // Again until it is full, and on.
    assert_eq!(allocations(|| (0..5).for_each(|_| items.iter().for_each(|item| producer.record(item)))), 0);
    assert!(producer.dropped() > 0);
    let mut out = Vec::new();
    let counted = allocations(|| {
        consumer.drain(&mut out);
    });
    assert!(counted > 0, "the counter counts");
    assert_eq!(allocations(|| producer.record(&items[0])), 0);
}

#[test]
fn an_instant_does_not_allocate() {
    for name in ["single-axis", "single-axis-centralized"] {
        for users in [2, 8] {
            assert_instants_do_not_allocate(&built_in(name, &[&format!("session.users={users}")]));
        }
    }
    for architecture in ["distributed", "centralized"] {
        let architecture = format!("session.architecture={architecture}");
        assert_instants_do_not_allocate(&built_in("grasp", &[&architecture]));
    }
}

/// Three seconds of a session, a peer that goes and comes, a change of settings and a release included.
fn assert_instants_do_not_allocate(scene: &Scene) {
    let (mut stations, mut consumers) = recorded_stations(scene);
    let mut items = Vec::new();
    let mut changes: Vec<HostChange> = scene.hosts().map(|host| HostChange::new(scene, host)).collect();
    for tick in 0..3 * 1024 {
        let counted = allocations(|| {
            match tick {
                0 => set_all_present(&mut stations, true),
                1500 => set_all_present(&mut stations, false),
                1600 => set_all_present(&mut stations, true),
                2200 => {
                    let changes = stations.iter_mut().zip(&mut changes);
                    changes.for_each(|(station, change)| assert!(station.change(change)));
                }
                2700 => stations.iter_mut().for_each(Station::release),
                _ => {}
            }
            instant(&mut stations, tick);
            std::hint::black_box(LiveVerdict::combine(stations.iter().map(|station| station.observer.now())));
            std::hint::black_box(stations.iter().map(|station| station.observer.verdict()).max());
        });
        assert!(tick < 100 || counted == 0, "{counted} allocations at tick {tick} with {}", scene.name);
        consumers.iter_mut().for_each(|consumer| _ = consumer.drain(&mut items));
    }
    assert_everything_happened(&items, stations.len(), stations[0].model.has_surfaces());
    assert!(stations.iter().all(Station::is_released));
}

#[test]
fn an_instant_at_a_soft_body_neither_allocates_nor_frees() {
    let settings = ["soft.mesh.cells=[4, 2, 2]", "governor.passivity_control=true"];
    let scene = built_in("soft-block", &settings);
    let simulation = slow_simulation(&scene).unwrap().unwrap();
    let (stations, mut consumers) = recorded_stations(&scene);
    let with_soft = |station: Station<SimulatedUser>| {
        let (port, thread) =
            start_slow_thread(&scene, station.model.host, simulation.clone(), &Failures::default()).unwrap();
        (station.with_soft(port), thread)
    };
    let (mut stations, threads): (Vec<_>, Vec<_>) = stations.into_iter().map(with_soft).unzip();
    set_all_present(&mut stations, true);
    let mut items = Vec::new();
    for tick in 0..3 * 1024 {
        let mut allocated = 0;
        let gone = deallocations(|| allocated = allocations(|| instant(&mut stations, tick)));
        assert!(tick < 100 || (allocated, gone) == (0, 0), "{allocated} and {gone} at tick {tick}");
        consumers.iter_mut().for_each(|consumer| _ = consumer.drain(&mut items));
        // The simulation is to be done with most periods.
        std::thread::sleep(std::time::Duration::from_micros(200));
    }
    let surfaces = items.iter().filter(|item| matches!(item.kind, RecordKind::Surface(_))).count();
    assert!(surfaces > 0, "no frame came into use");
    let touches =
        |item: &&RecordItem| matches!(&item.kind, RecordKind::Tick(tick) if !tick.contacts.is_empty());
    assert!(items.iter().any(|item| touches(&item)), "nothing was touched");
    drop(stations);
    threads.into_iter().for_each(|thread| thread.join().unwrap());
}

fn recorded_stations(scene: &Scene) -> (Vec<Station<SimulatedUser>>, Vec<RecordConsumer>) {
    let station = |host| {
        let (producer, consumer) = record_ring(host, RECORD_RING_BYTES);
        let hand = SimulatedUser::new(scene, host).unwrap();
        (Station::new(scene, host, hand, Some(Box::new(producer))), consumer)
    };
    scene.hosts().map(station).unzip()
}

fn set_all_present(stations: &mut [Station<SimulatedUser>], present: bool) {
    let users = stations[0].model.users;
    for station in stations {
        for peer in station.model.host.others(users) {
            station.set_present(peer, present);
        }
    }
}

/// One instant of all stations, with a network that takes no time.
fn instant(stations: &mut [Station<SimulatedUser>], tick: u64) {
    let mut sent: ArrayVec<(HostIndex, StatePacket), 16> = ArrayVec::new();
    for station in stations.iter_mut() {
        if let Some(packet) = station.begin(tick) {
            sent.push((station.model.host, packet));
        }
    }
    for station in stations.iter_mut() {
        for (from, packet) in &sent {
            if station.model.sources().any(|source| source == *from) {
                station.receive(*from, packet);
            }
        }
    }
    for index in 0..stations.len() {
        let mut answers: ArrayVec<(HostIndex, StatePacket), 16> = ArrayVec::new();
        stations[index].respond(|client, packet| answers.push((client, packet.clone())));
        for (client, packet) in &answers {
            stations[client.index()].receive(HostIndex(index as u8), packet);
        }
    }
    for station in stations.iter_mut() {
        station.finish(Punctuality::default);
    }
}

/// The ticks that were counted did all that a tick can have to do.
fn assert_everything_happened(items: &[RecordItem], hosts: usize, has_surfaces: bool) {
    let count = |is: fn(&RecordKind) -> bool| items.iter().filter(|item| is(&item.kind)).count();
    assert_eq!(count(|kind| matches!(kind, RecordKind::Tick(_))), 3 * 1024 * hosts);
    let touches = |kind: &RecordKind| matches!(kind, RecordKind::Tick(tick) if !tick.contacts.is_empty());
    assert_eq!(count(touches) > 0, has_surfaces, "fingers touch where there is something to touch");
    assert_eq!(count(|kind| matches!(kind, RecordKind::State(bytes) if !bytes.is_empty())), 3 * hosts);
    let steps = 3 * 128;
    assert!(count(|kind| matches!(kind, RecordKind::Sent { .. })) >= steps * (hosts - 1));
    assert!(count(|kind| matches!(kind, RecordKind::Received { .. })) >= steps * (hosts - 1));
    assert_eq!(count(|kind| matches!(kind, RecordKind::Note(_))), 0, "nothing was dropped");
}

#[test]
fn the_haptic_threads_end_of_the_network_does_not_allocate() {
    let scene = load("single-axis", &[]).unwrap();
    let end = Secured::serve(transport::listen(transport::parse("127.0.0.1:0").unwrap()).unwrap());
    let route = end.route().unwrap();
    let endpoint = full_session_endpoint(&scene, HostIndex::FIRST, route, cotouch_runtime::clock::now());
    let (_threads, mut port) = NetworkThreads::start(end, endpoint, "test", &Failures::default()).unwrap();
    let packet = StatePacket::default();
    let counted = allocations(|| {
        for _ in 0..1000 {
            port.clock();
            while port.take_inbound().is_some() {}
            port.leave(None, packet.clone());
            port.leave(Some(HostIndex(1)), packet.clone());
            port.wake_sender();
        }
    });
    assert_eq!(counted, 0);
}
