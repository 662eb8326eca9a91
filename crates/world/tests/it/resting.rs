//! Bodies that stand still for a long time, and bodies that are dropped.

use crate::common::{G, World, body, cuboid, model, shape, spring};
use cotouch_scene::scene::ShapeKind;
use cotouch_world::{ContactModel, Phase};
use glam::{DQuat, DVec3};
use proptest::prelude::*;

#[test]
fn a_box_stands_on_four_corners_without_drifting() {
    let (mass, size) = (0.4, DVec3::new(0.08, 0.06, 0.05));
    let depth = mass * G / 4.0 / model().normal.stiffness_n_per_m;
    let mut world = World::new(&[body(cuboid(size), mass, DVec3::Y * (0.03 - 0.5 * depth))], model());
    for _ in 0..20_000 {
        world.step();
    }
    let settled = world.things[0].state;
    for _ in 0..100_000 {
        world.step();
    }
    let after = world.things[0].state;
    assert_eq!(world.forces.len(), 4);
    for force in &world.forces {
        assert_eq!(force.phase, Phase::PreSlide);
        assert!((force.force - DVec3::Y * mass * G / 4.0).length() < 1e-9, "{force:?}");
    }
    assert!((after.pose.position - settled.pose.position).length() < 1e-12);
    assert!(after.pose.orientation.dot(settled.pose.orientation).abs() > 1.0 - 1e-14);
    assert!((after.pose.position.y - (0.03 - depth)).abs() < 1e-9);
    assert!(after.twist.linear.length() < 1e-9 && after.twist.angular.length() < 1e-9);
}

#[test]
fn three_stacked_boxes_come_to_rest_and_stay() {
    let model = ContactModel { normal: spring(3000.0, 8.0), tangential: spring(2000.0, 5.0), ..model() };
    let at = |level: u32| {
        let mut block = body(cuboid(DVec3::splat(0.06)), 0.3, DVec3::Y * (0.03 + 0.06 * f64::from(level)));
        // Not quite on each other.
        block.position_m += DVec3::new(0.004, 0.0005, -0.003) * f64::from(level);
        block.rotation_rad = DVec3::Y * 0.1 * f64::from(level);
        block
    };
    let mut world = World::new(&[at(0), at(1), at(2)], model);
    // The stack sways for long: at 3 Hz the dampers take little.
    for _ in 0..30_000 {
        world.step();
    }
    let settled: Vec<_> = world.things.iter().map(|thing| thing.state).collect();
    for _ in 0..30_000 {
        world.step();
        for thing in &world.things {
            let twist = thing.state.twist;
            assert!(twist.linear.length() < 1e-9 && twist.angular.length() < 1e-8, "{twist:?}");
        }
    }
    for (thing, settled) in world.things.iter().zip(&settled) {
        assert!((thing.state.pose.position - settled.pose.position).length() < 1e-11);
        assert!(thing.state.pose.orientation.dot(settled.pose.orientation).abs() > 1.0 - 1e-14);
    }
    let heights: Vec<f64> = settled.iter().map(|state| state.pose.position.y).collect();
    assert!(heights[0] > 0.027 && heights[1] > 0.086 && heights[2] > 0.145, "{heights:?}");
    let carried: f64 = world.forces.iter().filter(|f| f.point.y < 0.02).map(|f| f.force.y).sum();
    assert!((carried - 0.9 * G).abs() < 1e-6, "{carried}");
}

fn tumbling(seed: (DVec3, DVec3, DVec3)) -> impl Fn(&mut World, usize) {
    move |world, index| {
        let state = &mut world.things[index].state;
        state.pose.orientation = DQuat::from_scaled_axis(seed.0);
        state.twist.linear = seed.1;
        state.twist.angular = seed.2;
    }
}

fn vector(size: f64) -> impl Strategy<Value = DVec3> {
    [-size..size, -size..size, -size..size].prop_map(DVec3::from)
}

/// Runs, and fails where a world in which nothing touches has more energy than it had when last nothing touched.
fn never_gains(world: &mut World, ticks: u32) -> Result<(), TestCaseError> {
    let (mut energy, mut touched) = (world.energy(), false);
    for tick in 0..ticks {
        let before = world.energy();
        world.step();
        if world.forces.is_empty() {
            prop_assert!(
                before <= energy + 1e-9 * energy.abs().max(1e-3),
                "tick {tick}: {energy} J, then {before} J"
            );
            energy = before;
        }
        touched |= !world.forces.is_empty();
    }
    prop_assert!(touched, "nothing was hit");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_dropped_body_never_gains_energy(
        turn in vector(3.0), velocity in vector(0.8), spin in vector(10.0), damping in 3.0..15.0_f64, ball: bool,
    ) {
        let kind = if ball { ShapeKind::Ball } else { ShapeKind::Box };
        let model = ContactModel {
            normal: spring(2000.0, damping),
            tangential: spring(1500.0, 0.7 * damping),
            ..model()
        };
        let mut world = World::new(&[body(shape(kind), 0.4, DVec3::Y * 0.2)], model);
        tumbling((turn, velocity, spin))(&mut world, 0);
        never_gains(&mut world, 2048)?;
    }

    #[test]
    fn a_ball_that_hits_a_body_never_gains_energy(
        turn in vector(3.0), spin in vector(5.0), aside in vector(0.02), speed in 0.05..1.0_f64,
    ) {
        let bodies = [body(cuboid(DVec3::new(0.08, 0.06, 0.05)), 0.5, DVec3::Y * 5.0), body(shape(ShapeKind::Ball), 0.2, DVec3::Y * 5.1)];
        let mut world = World::new(&bodies, model());
        world.gravity = DVec3::ZERO;
        tumbling((turn, DVec3::ZERO, spin))(&mut world, 0);
        world.things[1].state.pose.position += DVec3::new(aside.x, 0.0, aside.z);
        tumbling((DVec3::ZERO, DVec3::Y * -speed, DVec3::ZERO))(&mut world, 1);
        let momentum = |world: &World| -> DVec3 {
            world.things.iter().map(|thing| thing.stepper.inertia().mass_kg * thing.state.twist.linear).sum()
        };
        let before = momentum(&world);
        never_gains(&mut world, 1024)?;
        prop_assert!((momentum(&world) - before).length() < 1e-12);
    }
}
