//! Friction against closed forms: a block on a floor.

use crate::common::{self, G, T, model};
use cotouch_scene::geometry::Wrench;
use cotouch_scene::scene::Integrator;
use cotouch_world::{
    BodyState, ContactForce, ContactModel, ContactState, Freedom, Phase, Sphere, Stepper, touch_plane,
};
use glam::DVec3;

const MASS: f64 = 0.4;

/// A block that does not turn and stands on a floor.
struct Block {
    body: BodyState,
    contact: ContactState,
    model: ContactModel,
}

impl Block {
    /// At the depth at which the floor carries it, sliding at `speed`.
    fn at_speed(speed: DVec3) -> Self {
        let model = model();
        let depth = MASS * G / model.normal.stiffness_n_per_m;
        let mut body = BodyState::at_rest(DVec3::Y * (0.01 - depth));
        body.twist.linear = speed;
        Self { body, contact: ContactState::default(), model }
    }

    fn step(&mut self, pull: DVec3) -> ContactForce {
        let (centre, velocity) = self.body.point();
        let sphere = Sphere { centre, velocity, radius_m: 0.01 };
        let force =
            touch_plane(&self.model, &mut self.contact, &common::floor(), &sphere).expect("on the floor");
        let stepper = Stepper::new(MASS, T, Integrator::ExactHold, Freedom::Space);
        stepper.step(&mut self.body, &Wrench::force(force.force + pull - DVec3::Y * MASS * G));
        force
    }
}

#[test]
fn a_sliding_block_slows_by_friction_stops_and_sticks() {
    let way = DVec3::new(3.0, 0.0, 4.0) / 5.0;
    let mut block = Block::at_speed(way * 0.8);
    let deceleration = block.model.dynamic_friction * G;
    let mut slid = 0;
    while block.contact.phase != Phase::PreSlide || slid == 0 {
        let before = block.body.twist.linear.dot(way);
        let force = block.step(DVec3::ZERO);
        slid += 1;
        if force.phase == Phase::Slide && before > 0.02 {
            let slowed = (before - block.body.twist.linear.dot(way)) / T;
            assert!((slowed - deceleration).abs() < 1e-6, "{slowed} at {before}");
        }
        assert!(slid < 2000, "it never sticks");
    }
    let stopped_after = f64::from(slid) * T;
    assert!((stopped_after - 0.8 / deceleration).abs() < 3.0 * T, "{stopped_after}");
    let path = block.body.pose.position.dot(way);
    assert!((path - 0.8 * 0.8 / (2.0 * deceleration)).abs() < 1e-3 * path, "{path}");
    for _ in 0..4096 {
        assert_eq!(block.step(DVec3::ZERO).phase, Phase::PreSlide);
    }
    assert!(block.body.twist.linear.length() < 1e-9);
    let rebound = path - block.body.pose.position.dot(way);
    let spring = block.model.dynamic_friction * MASS * G / block.model.tangential.stiffness_n_per_m;
    assert!((0.5 * spring..1.5 * spring).contains(&rebound), "{rebound}, spring {spring}");
}

#[test]
fn a_block_that_is_pulled_below_the_cone_does_not_creep() {
    let mut block = Block::at_speed(DVec3::ZERO);
    let pull = DVec3::Z * 0.49 * MASS * G;
    let ramp = |tick: u32| pull * f64::min(1.0, f64::from(tick) / 2048.0);
    for tick in 0..10_000 {
        block.step(ramp(tick));
    }
    let settled = block.body.pose.position;
    assert!((settled.z - pull.z / block.model.tangential.stiffness_n_per_m).abs() < 1e-9);
    for _ in 0..1_000_000 {
        assert_eq!(block.step(pull).phase, Phase::PreSlide);
    }
    assert!((block.body.pose.position - settled).length() < 1e-12);
}

#[test]
fn a_block_that_is_pulled_beyond_the_cone_slides_by_newton() {
    let mut block = Block::at_speed(DVec3::ZERO);
    let pull = DVec3::X * 0.7 * MASS * G;
    let mut phases = vec![Phase::Free];
    for _ in 0..1024 {
        let phase = block.step(pull).phase;
        if phases.last() != Some(&phase) {
            phases.push(phase);
        }
    }
    assert_eq!(phases, [Phase::Free, Phase::PreSlide, Phase::Slide]);
    let before = block.body.twist.linear.x;
    block.step(pull);
    let acceleration = (block.body.twist.linear.x - before) / T;
    assert!((acceleration - (0.7 - 0.4) * G).abs() < 1e-6, "{acceleration}");
}

/// The force on a finger that is led along a path over a floor.
fn led(velocity: impl Fn(f64) -> f64) -> Vec<(Phase, f64)> {
    let (mut contact, mut x) = (ContactState::default(), 0.0);
    (0..2048)
        .map(|tick| {
            let v = velocity(f64::from(tick) * T);
            let sphere = Sphere { centre: DVec3::new(x, 0.009, 0.0), velocity: DVec3::X * v, radius_m: 0.01 };
            x += v * T;
            let force = touch_plane(&model(), &mut contact, &common::floor(), &sphere).expect("in contact");
            (force.phase, force.force.x)
        })
        .collect()
}

#[test]
fn it_sticks_again_without_a_jump() {
    // It slows down to nothing within a second.
    let forces = led(|t| 0.1 * (1.0 - t).max(0.0));
    let again = (1..forces.len())
        .find(|&k| forces[k - 1].0 == Phase::Slide && forces[k].0 == Phase::PreSlide)
        .expect("it sticks again");
    let jump = (forces[again].1 - forces[again - 1].1).abs();
    let normal_n = 2000.0 * 0.001;
    assert!((forces[again - 1].1 + 0.4 * normal_n).abs() < 1e-12, "it slid with the sliding friction");
    // One tick at the speed v_tr stretches the spring by k_T·v_tr·T.
    assert!(jump <= 1500.0 * 0.002 * T + 1e-9, "{jump}");
    assert!(forces[again..].iter().all(|(phase, _)| *phase == Phase::PreSlide));
}

#[test]
fn a_finger_that_turns_back_feels_no_jump() {
    let forces = led(|t| 0.1 * (3.0 * t).cos());
    let largest = (2..forces.len()).map(|k| (forces[k].1 - forces[k - 1].1).abs()).fold(0.0, f64::max);
    // The spring's stretch in one tick at the largest speed, or the step from static to sliding friction.
    assert!(largest <= 1500.0 * 0.1 * T + (0.5 - 0.4) * 2.0, "{largest}");
    assert!(forces.iter().any(|force| force.1 > 0.79) && forces.iter().any(|force| force.1 < -0.79));
}

#[test]
fn a_finger_that_is_thrown_back_unloads_the_spring_first() {
    let forces = led(|t| if t < 1.0 { 0.1 } else { -0.1 });
    // It slid with 0.8 N, of which 0.5 N were the damper's: −0.3 N are the spring's, and the damper turns round.
    assert!((forces[1023].1 + 0.8).abs() < 1e-12);
    assert!((forces[1024].1 - (-0.3 - 1500.0 * 0.1 * T + 0.5)).abs() < 1e-9, "{}", forces[1024].1);
    assert!((forces[1100].1 - 0.8).abs() < 1e-12);
}

#[test]
fn a_strong_damper_does_not_carry_the_anchor_ahead() {
    // At 1 m/s the damper alone is 5 N, friction 0.8 N; the finger then stops at once.
    let forces = led(|t| if t < 0.1 { 1.0 } else { 0.0 });
    assert!(forces.iter().all(|force| force.1 <= 1e-12), "friction pushed a finger forward");
}
