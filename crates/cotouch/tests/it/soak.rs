//! Seeded random hands on every built-in scene: nothing but finite numbers, no force above what the governor allows, and
//! no body that gathers energy.
//!
//! `cargo test` gives each scene some seconds of virtual time. An hour each, on all cores:
//! `cargo test --release -p cotouch --test it soak -- --ignored --nocapture`

use cotouch_device::SimulatedUser;
use cotouch_runtime::{SlowPort, TickRecord, VirtualSession};
use cotouch_scene::scene::{Action, DeviceKind, Scene, Space};
use cotouch_scene::{builtin, load};
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Hands wander so far (m) from where they start, and as far beyond the middle of the scene.
const WANDER_M: f64 = 0.03;
/// A pantograph reaches only so far.
const WANDER_ON_A_PANTOGRAPH_M: f64 = 0.015;

/// Energy in the last quarter may be above that of any quarter before by this factor, on top of what hands bring.
const MAX_GROWTH: f64 = 3.0;

/// What a hand brings at any time (J), by a spring of 200 N/m that is stretched by 3 cm, to every copy.
const OF_A_HAND_J: f64 = 0.09;

/// A number between -1 and 1.
fn signed(random: &mut Pcg64Mcg) -> f64 {
    2.0 * random.random::<f64>() - 1.0
}

fn vector(random: &mut Pcg64Mcg, space: Space) -> DVec3 {
    let [x, y, z] = std::array::from_fn(|_| signed(random));
    match space {
        Space::Line => DVec3::new(x, 0.0, 0.0),
        Space::Plane => DVec3::new(x, y, 0.0),
        Space::Space => DVec3::new(x, y, z),
    }
}

/// Somewhere between where the finger starts and the middle of all that there is, or a little beyond.
fn somewhere(random: &mut Pcg64Mcg, scene: &Scene, start: DVec3) -> DVec3 {
    if scene.device.kind == DeviceKind::Pantograph {
        return start + vector(random, scene.space) * WANDER_ON_A_PANTOGRAPH_M;
    }
    let target = match &scene.soft.nodes {
        Some(mesh) => mesh.nodes_m[random.random_range(0..mesh.nodes_m.len())],
        None => start + vector(random, scene.space) * WANDER_M,
    };
    let target = if scene.space == Space::Line { DVec3::X * target.x } else { target };
    start.lerp(target, 1.2 * random.random::<f64>()) + vector(random, scene.space) * 0.005
}

fn action(random: &mut Pcg64Mcg, scene: &Scene, start: DVec3) -> Action {
    let duration_s = 0.1 + 1.4 * random.random::<f64>();
    match random.random_range(0..10) {
        0 => Action::Relax { duration_s },
        1 => Action::Hold { duration_s },
        2 => Action::Force { force_n: vector(random, scene.space) * 2.0, duration_s: 0.2 * duration_s },
        3 => Action::Tremor { rms_n: vector(random, scene.space).abs(), duration_s },
        _ => Action::Reach { to_m: somewhere(random, scene, start), duration_s },
    }
}

/// The scene with hands that do `seconds` of one thing after the other.
fn with_random_hands(scene: &Scene, seed: u64, seconds: f64) -> Scene {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut users = scene.users.clone();
    for user in &mut users {
        user.script.clear();
        user.repeat = true;
        for finger in &mut user.fingers {
            let mut scripted_s = 0.0;
            finger.script.clear();
            while scripted_s < seconds {
                let next = action(&mut random, scene, finger.position_m);
                scripted_s += next.duration_s();
                finger.script.push(next);
            }
        }
    }
    // Hands whose scene gives them no spring to follow paths with stay where they are: no scene, but harmless.
    scene.edit_unchecked(|scene| scene.users = users)
}

/// What all copies of all bodies hold, in motion and in deformation, J.
fn energy_j(scene: &Scene, session: &VirtualSession<SimulatedUser>) -> f64 {
    let masses: Vec<f64> =
        scene.world_bodies().iter().map(|body| if body.fixed { 0.0 } else { body.mass_kg }).collect();
    let of_host = |host: &cotouch_runtime::VirtualHost<SimulatedUser>| {
        let bodies = masses.iter().zip(&host.station.state.host.bodies);
        let rigid: f64 = bodies.map(|(mass, body)| 0.5 * mass * body.twist.linear.length_squared()).sum();
        let soft =
            host.station.soft().and_then(SlowPort::simulation).map(|simulation| simulation.body().energy());
        rigid + soft.map_or(0.0, |energy| energy.elastic_j + energy.kinetic_j)
    };
    session.hosts().iter().map(of_host).sum()
}

fn assert_sound(name: &str, scene: &Scene, record: &TickRecord) {
    let most_n = scene.governor.max_force_n * (1.0 + 1e-12);
    let sound =
        record.commanded.iter().all(|wrench| wrench.force.is_finite() && wrench.force.length() <= most_n)
            && record.requested.iter().all(|wrench| wrench.is_finite())
            && record.readings.iter().all(|reading| reading.is_finite())
            && !record.diverged;
    assert!(sound, "{name} at {} s: {record:?}", record.instant.as_secs_f64());
}

fn soak(name: &str, seed: u64, seconds: f64) {
    let scene = with_random_hands(&load(name, &[]).unwrap(), seed, seconds);
    let user = |host| (SimulatedUser::new(&scene, host).unwrap(), None);
    let mut session = VirtualSession::with_devices(&scene, user).unwrap();
    // Quarters of mean energy, looked at ten times a second.
    let looks = (10.0 * seconds) as u64;
    let mut quarters = [0.0; 4];
    for look in 0..looks {
        let tick = ((look + 1) as f64 * 0.1 * scene.rates.control_hz.hz()) as u64;
        assert!(
            session.run_to_tick(tick, |_, record| assert_sound(name, &scene, record)),
            "{name}: not joined"
        );
        quarters[(4 * look / looks) as usize] += energy_j(&scene, &session) * 4.0 / looks as f64;
    }
    let [first, second, third, last] = quarters;
    let before = first.max(second).max(third);
    println!("{name}: {seconds} s, mean energy {quarters:.4?} J");
    let hands: usize = scene.users.iter().map(|user| user.fingers.len()).sum();
    let brought_j = OF_A_HAND_J * (hands * scene.users.len()) as f64;
    assert!(last < brought_j + MAX_GROWTH * before, "{name}: mean energy by quarters {quarters:?} J");
}

#[test]
fn random_hands_do_no_harm_to_any_scene() {
    for (seed, name) in (0..).zip(builtin::names()) {
        soak(name, seed, 4.0);
    }
}

#[test]
#[ignore = "an hour of virtual time of every scene"]
fn random_hands_do_no_harm_in_an_hour() {
    use rayon::prelude::*;
    let scenes: Vec<_> = (100..).zip(builtin::names()).collect();
    scenes.into_par_iter().for_each(|(seed, name)| soak(name, seed, 3600.0));
}
