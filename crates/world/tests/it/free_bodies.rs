//! Bodies that turn: what is conserved, closed forms, the order of the scheme, and inertia.

use crate::common::{T, body, cuboid, shape};
use cotouch_scene::geometry::Wrench;
use cotouch_scene::scene::{Integrator, ShapeKind};
use cotouch_world::{BodyState, Freedom, Inertia, Stepper};
use glam::{DMat3, DQuat, DVec3};

fn tumbler() -> (Inertia, BodyState) {
    let inertia = Inertia::new(0.4, DMat3::from_diagonal(DVec3::new(1.0, 2.0, 3.5) * 1e-4));
    let mut state = BodyState::at_rest(DVec3::ZERO);
    state.pose.orientation = DQuat::from_scaled_axis(DVec3::new(0.4, -1.0, 0.3));
    // Close to the middle axis: it tumbles.
    state.twist.angular = state.pose.orientation * DVec3::new(0.3, 6.0, 0.2);
    (inertia, state)
}

#[test]
fn a_tumbling_body_keeps_its_momentum_and_its_energy() {
    for integrator in [Integrator::ExactHold, Integrator::SemiImplicitEuler] {
        let (inertia, mut state) = tumbler();
        let stepper = Stepper::rigid(inertia, T, integrator, Freedom::Space);
        let (momentum, energy) = (inertia.angular_momentum(&state), inertia.kinetic_energy_j(&state));
        let mut largest = [0.0_f64; 4];
        let mut turned_over = false;
        for tick in 0..40_960 {
            stepper.step(&mut state, &Wrench::default());
            let error = (inertia.angular_momentum(&state) - momentum).length() / momentum.length();
            assert!(error < 1e-9, "tick {tick}: {error}");
            let error = (inertia.kinetic_energy_j(&state) / energy - 1.0).abs();
            largest[tick / 10_240] = largest[tick / 10_240].max(error);
            turned_over |= (state.pose.orientation.conjugate() * state.twist.angular).y < -5.0;
        }
        assert!(turned_over);
        assert!(largest[0] > 1e-12 && largest[0] < 1e-4, "{largest:?}");
        assert!(largest[3] < 1.05 * largest[0], "energy drifts: {largest:?}");
    }
}

#[test]
fn turning_in_space_is_of_second_order() {
    let at_the_end = |ticks: u32| {
        let (inertia, mut state) = tumbler();
        let period = 1.0 / f64::from(ticks);
        let stepper = Stepper::rigid(inertia, period, Integrator::ExactHold, Freedom::Space);
        for _ in 0..ticks {
            stepper.step(&mut state, &Wrench::default());
        }
        state.pose.orientation
    };
    let [coarse, middle, fine] = [128, 256, 512].map(at_the_end);
    let ratio = coarse.angle_between(middle) / middle.angle_between(fine);
    assert!((ratio - 4.0).abs() < 0.2, "{ratio}");
}

#[test]
fn a_held_torque_turns_by_the_closed_form() {
    let inertia = Inertia::new(0.4, DMat3::from_diagonal(DVec3::new(1.0, 2.0, 3.5) * 1e-4));
    for freedom in [Freedom::Plane(DVec3::Z), Freedom::Space] {
        let stepper = Stepper::rigid(inertia, T, Integrator::ExactHold, freedom);
        let mut state = BodyState::at_rest(DVec3::ZERO);
        state.twist.angular = DVec3::Z * -0.4;
        let wrench = Wrench { force: DVec3::ZERO, torque: DVec3::Z * 3.5e-4 };
        for _ in 0..1024 {
            stepper.step(&mut state, &wrench);
        }
        let expected = DQuat::from_rotation_z(-0.4 + 0.5);
        assert!(state.pose.orientation.angle_between(expected) < 1e-7, "{freedom:?}");
        assert!((state.pose.orientation.z - expected.z).abs() < 1e-12, "{freedom:?}");
        assert!((state.twist.angular - DVec3::Z * 0.6).length() < 1e-12, "{freedom:?}");
    }
}

#[test]
fn a_body_in_a_plane_turns_about_its_normal_only_and_one_on_a_line_not_at_all() {
    let inertia = Inertia::from_body(&body(cuboid(DVec3::new(0.1, 0.05, 0.02)), 0.4, DVec3::ZERO));
    let wrench = Wrench { force: DVec3::ONE, torque: DVec3::ONE };
    let after = |freedom| {
        let mut state = BodyState::at_rest(DVec3::ZERO);
        for _ in 0..50 {
            Stepper::rigid(inertia, T, Integrator::ExactHold, freedom).step(&mut state, &wrench);
        }
        state
    };
    let plane = after(Freedom::Plane(DVec3::Z));
    assert!(plane.twist.angular.z > 1.0 && plane.pose.position.z == 0.0);
    assert_eq!((plane.twist.angular.x, plane.twist.angular.y), (0.0, 0.0));
    assert_eq!((plane.pose.orientation.x, plane.pose.orientation.y), (0.0, 0.0));
    let line = after(Freedom::Line(DVec3::X));
    assert_eq!((line.pose.orientation, line.twist.angular), (DQuat::IDENTITY, DVec3::ZERO));
}

#[test]
fn a_fixed_body_stays() {
    let fixed = cotouch_scene::scene::Body { fixed: true, ..body(cuboid(DVec3::ONE), 2.0, DVec3::X) };
    let stepper = Stepper::rigid(Inertia::from_body(&fixed), T, Integrator::ExactHold, Freedom::Space);
    let mut state = BodyState::start(&fixed);
    stepper.step(&mut state, &Wrench { force: DVec3::ONE, torque: DVec3::ONE });
    assert_eq!(state, BodyState::start(&fixed));
}

#[test]
fn inertia_is_that_of_the_solid() {
    for kind in [ShapeKind::Ball, ShapeKind::Box, ShapeKind::Capsule] {
        let shape = shape(kind);
        let (half, radius) = (0.5 * shape.size_m, shape.radius_m);
        let inside = |p: DVec3| match kind {
            ShapeKind::Box => (p.abs() - half).max_element() < 0.0,
            ShapeKind::Ball => p.length() < radius,
            _ => (p - DVec3::Y * p.y.clamp(-0.5 * shape.length_m, 0.5 * shape.length_m)).length() < radius,
        };
        let (mut count, mut sum, steps) = (0.0, DVec3::ZERO, 120);
        let at = |i: i32| (f64::from(i) + 0.5) / f64::from(steps) * 0.12 - 0.06;
        for (x, y, z) in
            (0..steps).flat_map(|x| (0..steps).flat_map(move |y| (0..steps).map(move |z| (x, y, z))))
        {
            let p = DVec3::new(at(x), at(y), at(z));
            if inside(p) {
                count += 1.0;
                sum += DVec3::splat(p.length_squared()) - p * p;
            }
        }
        let expected = 0.4 * sum / count;
        let inertia = Inertia::from_body(&body(shape, 0.4, DVec3::ZERO)).inertia_kg_m2;
        for axis in 0..3 {
            let ratio = inertia.col(axis)[axis] / expected[axis];
            assert!((ratio - 1.0).abs() < 0.005, "{kind:?} {axis}: {ratio}");
        }
    }
    assert!(!Inertia::from_body(&body(shape(ShapeKind::Point), 0.4, DVec3::ZERO)).turns());
}
