//! The passivity observer and controller at a finger that presses against springs.

use cotouch_device::{Acted, DeviceLimits, Governor, GovernorInput, PortEnergy, SecondOrderPlant};
use cotouch_scene::geometry::{Reading, Wrench};
use cotouch_scene::scene::{GovernorLimits, Rates, SceneValues};
use cotouch_scene::time::Rate;
use glam::DVec3;

const MASS_KG: f64 = 0.1;

/// A hand without damping of its own that flies into `spring`, which renders a force (N) at a place (m).
struct Flight {
    governor: Governor,
    plant: SecondOrderPlant,
    spring: fn(f64) -> f64,
}

/// What came of it.
struct Flown {
    port: PortEnergy,
    kinetic_j: f64,
    braked_ticks: u32,
    largest_force_n: f64,
}

impl Flight {
    fn new(passivity_control: bool, max_force_n: f64, spring: fn(f64) -> f64) -> Self {
        let governor = GovernorLimits {
            max_force_n,
            max_slew_n_per_s: max_force_n * 1000.0,
            watchdog_s: 0.02,
            soft_start_s: 0.0,
            release_s: 0.1,
            damping_n_s_per_m: 0.0,
            passivity_control,
        };
        let control: Rate = "1000".parse().unwrap();
        let rates = Rates { control_hz: control, ..Rates::default() };
        let scene = SceneValues { governor, rates, ..SceneValues::default() };
        Self {
            governor: Governor::new(&scene, DeviceLimits::NONE),
            plant: SecondOrderPlant::new(MASS_KG, 0.0, 0.0, control.period_s()),
            spring,
        }
    }

    fn fly(&self, ticks: u32) -> Flown {
        let (mut state, mut port) = (self.governor.start(), PortEnergy::default());
        let (mut x, mut v) = (0.0, 0.1);
        let (mut braked_ticks, mut largest_force_n) = (0, 0.0_f64);
        for _ in 0..ticks {
            let reading = Reading::point(DVec3::X * x, DVec3::X * v);
            port.arrive(&reading);
            let requested = Wrench::force(DVec3::X * (self.spring)(x));
            let input =
                GovernorInput { deficit_j: port.deficit_j(), ..GovernorInput::healthy(requested, reading) };
            let output = self.governor.govern(&mut state, &input);
            port.hold(&reading, output.commanded);
            braked_ticks += u32::from(output.acted.contains(Acted::PASSIVITY));
            largest_force_n = largest_force_n.max(output.commanded.force.length());
            (x, v) = self.plant.step(x, v, output.commanded.force.x);
        }
        Flown { port, kinetic_j: 0.5 * MASS_KG * v * v, braked_ticks, largest_force_n }
    }
}

/// A wall at 0 that pushes back.
fn wall(x: f64) -> f64 {
    if x > 0.0 { -3000.0 * x } else { 0.0 }
}

/// A spring that holds on to the hand, so that what one swing gives comes on top of the last one's.
fn spring(x: f64) -> f64 {
    -3000.0 * x
}

#[test]
fn a_held_wall_gives_energy_and_the_observer_says_how_much() {
    let flown = Flight::new(false, 100.0, wall).fly(100);
    let gained_j = flown.kinetic_j - 0.5 * MASS_KG * 0.01;
    assert!(gained_j > 1e-4, "{gained_j}");
    assert!((flown.port.energy_j() + gained_j).abs() < 1e-12, "energy of the hand comes through the port");
    assert_eq!((flown.port.least_energy_j(), flown.braked_ticks), (flown.port.energy_j(), 0));
}

#[test]
fn the_controller_takes_back_what_a_wall_gave() {
    let without = Flight::new(false, 100.0, wall).fly(100);
    let with = Flight::new(true, 100.0, wall).fly(100);
    assert!(with.braked_ticks > 0);
    assert!(with.port.energy_j() > -1e-9, "{}", with.port.energy_j());
    assert!(with.kinetic_j < 0.5 * MASS_KG * 0.01 + 1e-9);
    assert!(with.port.least_energy_j() > 0.5 * without.port.least_energy_j());
}

#[test]
fn an_active_loop_is_passive_with_the_controller() {
    let without = Flight::new(false, 1e6, spring).fly(2000);
    assert!(without.kinetic_j > 1e3, "grows without end: {}", without.kinetic_j);
    let with = Flight::new(true, 1e6, spring).fly(20_000);
    assert!(
        with.port.least_energy_j() > -5e-4,
        "no more than one swing gives: {}",
        with.port.least_energy_j()
    );
    assert!(with.kinetic_j < 0.5 * MASS_KG * 0.01 + 5e-4, "{}", with.kinetic_j);
}

#[test]
fn braking_stays_within_the_largest_force_and_is_not_counted_as_a_limit() {
    let flown = Flight::new(true, 1.5, spring).fly(2000);
    assert!(flown.braked_ticks > 0 && flown.largest_force_n <= 1.5);
    assert!(!Acted::LIMITS.intersects(Acted::PASSIVITY) && !Acted::FADING.intersects(Acted::PASSIVITY));
}

#[test]
fn a_passive_port_is_left_alone_bit_for_bit() {
    // Against a damper energy only goes in.
    let run = |passivity_control| {
        let flight = Flight::new(passivity_control, 100.0, wall);
        let (mut state, mut port) = (flight.governor.start(), PortEnergy::default());
        let (mut x, mut v, mut forces) = (0.0, 0.3, Vec::new());
        for _ in 0..500 {
            let reading = Reading::point(DVec3::X * x, DVec3::X * v);
            port.arrive(&reading);
            let requested = Wrench::force(reading.twist.linear * -5.0);
            let input =
                GovernorInput { deficit_j: port.deficit_j(), ..GovernorInput::healthy(requested, reading) };
            let output = flight.governor.govern(&mut state, &input);
            assert_eq!(output.acted, Acted::empty());
            port.hold(&reading, output.commanded);
            (x, v) = flight.plant.step(x, v, output.commanded.force.x);
            forces.push(output.commanded.force.x.to_bits());
        }
        (forces, port.least_energy_j())
    };
    assert_eq!(run(true), run(false));
    assert_eq!(run(true).1, 0.0);
}
