//! What coordination schemes remember and send, with one that no scene names.

use std::sync::Arc;

use cotouch_host::{HostModel, HostState};
use cotouch_net::{Entry, StatePacket};
use cotouch_scene::geometry::{Reading, Readings};
use cotouch_scene::names::HostIndex;
use cotouch_scene::{Override, Scene, load};
use cotouch_testkit::allocations;
use cotouch_world::LinearBlock;
use cotouch_world::coordination::{OwnMotion, Scheme, SchemeSize, TickMotion};
use glam::DVec3;
use nalgebra::DMatrix;

const HOSTS: [HostIndex; 2] = [HostIndex(0), HostIndex(1)];

/// Remembers the copies' distance of every tick and where the own one was at every network step, sends both sums and
/// renders what it receives.
#[derive(Debug)]
struct Sums;

impl Scheme for Sums {
    fn size(&self) -> SchemeSize {
        SchemeSize { tick_memory: 1, step_memory: 1, sent: 2 }
    }

    fn tick(&self, memory: &mut [DVec3], at: &TickMotion<'_>) -> DVec3 {
        memory[0] += at.apart.position;
        at.received[0] + at.received[1]
    }

    fn network_step(&self, ticks: &[DVec3], memory: &mut [DVec3], own: &OwnMotion<'_>, sent: &mut [DVec3]) {
        memory[0] += own.position();
        sent.copy_from_slice(&[memory[0], ticks[0]]);
    }

    fn tick_block(&self) -> LinearBlock {
        LinearBlock {
            a: DMatrix::identity(1, 1),
            b: DMatrix::from_row_slice(1, 6, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            c: DMatrix::zeros(1, 1),
            d: DMatrix::from_row_slice(1, 6, &[0.0, 0.0, 0.0, 0.0, 1.0, 1.0]),
        }
    }
}

/// Two hosts, fully coupled, the second one's body 10 mm from the first one's.
fn session(name: &str) -> (Scene, [HostModel; 2], [HostState; 2]) {
    let overrides = ["link.delay_periods=0", "session.peer_fade_s=0.01"];
    let overrides: Vec<Override> = overrides.iter().map(|text| text.parse().unwrap()).collect();
    let scene = load(name, &overrides).unwrap();
    let models = HOSTS.map(|host| HostModel::with_schemes(&scene, host, |_| Arc::new(Sums)));
    let mut states = [HostState::new(&models[0]), HostState::new(&models[1])];
    states[1].bodies[0].pose.position += DVec3::X * 0.01;
    for (host, state) in states.iter_mut().enumerate() {
        state.set_present(HOSTS[1 - host], true);
        state.peers[1 - host].fade = 1.0;
    }
    (scene, models, states)
}

fn away(scene: &Scene) -> Readings {
    scene.users[0].fingers.iter().map(|_| Reading::point(DVec3::Y * 10.0, DVec3::ZERO)).collect()
}

/// One instant with network step `step`, and its tick.
fn instant(
    scene: &Scene,
    models: &[HostModel; 2],
    states: &mut [HostState; 2],
    step: u64,
) -> [StatePacket; 2] {
    let readings = away(scene);
    let packets = [0, 1].map(|host| models[host].sample(&mut states[host], step, &readings).unwrap());
    let tick = models[0].schedule.tick_of_step(step);
    for (host, state) in states.iter_mut().enumerate() {
        models[host].receive(state, HOSTS[1 - host], &packets[1 - host]);
        models[host].play_out(state, tick);
        models[host].tick(state, tick, &readings);
    }
    packets
}

fn channel(packet: &StatePacket) -> (HostIndex, [DVec3; 4]) {
    let channel = |entry: &Entry| match entry {
        Entry::Channel { to, object: 0, vectors } => Some((*to, *vectors)),
        _ => None,
    };
    packet.entries.iter().find_map(channel).unwrap()
}

#[test]
fn what_is_remembered_is_sent_to_the_peer_and_felt_there() {
    let (scene, models, mut states) = session("grasp");
    let start = states[0].bodies[0].pose.position;
    let first = instant(&scene, &models, &mut states, 0);
    assert_eq!(channel(&first[0]), (HOSTS[1], [start, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO]));
    let apart = states[0].peers[1].memory[0];
    assert!((apart - DVec3::X * 0.01).length() < 1e-15, "{apart}");
    let before = states[0].bodies[0].pose.position;
    let second = instant(&scene, &models, &mut states, 1);
    assert_eq!(channel(&second[0]).1[..2], [start + before, apart], "sums go on");
    let told = channel(&second[1]).1;
    let output = models[0].tick(&mut states[0], 8, &away(&scene));
    assert!((output.wrenches[0].force - (told[0] + told[1])).length() < 1e-12, "{output:?}");
}

#[test]
fn a_state_with_memory_is_restored_bit_for_bit_and_fits_its_scheme_only() {
    let (scene, models, mut states) = session("grasp");
    for step in 0..3 {
        instant(&scene, &models, &mut states, step);
    }
    let mut saved = states.clone();
    let first = instant(&scene, &models, &mut states, 3);
    assert_eq!(instant(&scene, &models, &mut saved, 3), first);
    assert_eq!(saved, states);
    assert!(states[0].fits(&models[0]) && !states[0].fits(&HostModel::new(&scene, HOSTS[0])));
}

#[test]
fn what_is_remembered_of_a_peer_goes_with_it() {
    let (scene, models, mut states) = session("single-axis");
    instant(&scene, &models, &mut states, 0);
    assert!(states[0].peers[1].memory.iter().any(|vector| *vector != DVec3::ZERO));
    states[0].set_present(HOSTS[1], false);
    for tick in 1..100 {
        models[0].tick(&mut states[0], tick, &away(&scene));
    }
    assert!(states[0].peers[1].memory.iter().all(|vector| *vector == DVec3::ZERO));
}

#[test]
fn remembering_and_sending_allocate_nothing() {
    let (scene, models, mut states) = session("grasp");
    let readings = away(&scene);
    instant(&scene, &models, &mut states, 0);
    let counted = allocations(|| {
        for tick in 1..100 {
            let _ = models[0].sample(&mut states[0], tick, &readings);
            models[0].tick(&mut states[0], tick, &readings);
        }
    });
    assert_eq!(counted, 0);
}
