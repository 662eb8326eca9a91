//! The contact law over triangle meshes, held against the smooth shapes that they stand for.

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::common::{G, T, add, body, cuboid, model, shape, spring};
use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::mesh::{TriangleMesh, Triangles, generators};
use cotouch_scene::scene::{Integrator, Shape, ShapeKind};
use cotouch_world::{
    BodyState, ContactForce, ContactModel, ContactState, Freedom, Inertia, Phase, Sphere, Stepper, Surface,
    touch,
};
use glam::DVec3;

const RADIUS_M: f64 = 0.008;

fn mesh_shape(triangles: &Triangles) -> Shape {
    let mesh = TriangleMesh::closed(triangles).expect("a solid");
    Shape { surface: Some(Arc::new(mesh)), ..shape(ShapeKind::Mesh) }
}

fn mesh(triangles: &Triangles) -> Surface {
    Surface::new(&mesh_shape(triangles))
}

/// Friction 0.6 and the gains of a finger.
fn finger() -> ContactModel {
    ContactModel {
        normal: spring(800.0, 1.0),
        tangential: spring(1200.0, 2.0),
        static_friction: 0.6,
        dynamic_friction: 0.6,
        ..model()
    }
}

/// The forces on a finger that is led through places, a tick each, over a body at rest.
fn led(surface: &Surface, way: &[DVec3]) -> Vec<Option<ContactForce>> {
    let mut state = ContactState::default();
    let mut last = way[0];
    let tick = |&centre: &DVec3| {
        let sphere = Sphere { centre, velocity: (centre - last) / T, radius_m: RADIUS_M };
        last = centre;
        touch(&finger(), &mut state, surface, (&Pose::default(), &Twist::default()), &sphere, 0.0)
    };
    way.iter().map(tick).collect()
}

fn largest(forces: &[Option<ContactForce>]) -> f64 {
    forces.iter().flatten().map(|force| force.force.length()).fold(0.0, f64::max)
}

#[test]
fn friction_over_the_facets_of_a_ball_never_spikes() {
    let (large, depth) = (0.05, 0.003);
    let ball = Surface::new(&Shape { radius_m: large, ..shape(ShapeKind::Ball) });
    for subdivisions in [4, 5] {
        let facets = mesh(&generators::icosphere(large, subdivisions));
        for speed in [0.05, 0.3, 1.0] {
            let turn = speed * T / (large + RADIUS_M - depth);
            let at = |tick: u32| {
                let (angle, in_from) = (f64::from(tick) * turn, 0.004 * (-f64::from(tick) / 20.0).exp());
                let out = DVec3::new(angle.cos(), angle.sin(), 0.4 * (3.0 * angle).sin()).normalize();
                out * (large + RADIUS_M - depth + in_from)
            };
            let way: Vec<DVec3> = (0..(0.6 * TAU / turn) as u32).map(at).collect();
            let (smooth, rough) = (led(&ball, &way), led(&facets, &way));
            let (allowed, found) = (1.2 * largest(&smooth), largest(&rough));
            assert!(found > 0.5 * allowed && found < allowed, "{found} N of {allowed} N at {speed} m/s");
            let slid = rough.iter().flatten().filter(|force| force.phase == Phase::Slide).count();
            assert!(slid > rough.len() / 2, "{slid} of {}", rough.len());
        }
    }
}

#[test]
fn friction_over_the_edges_of_a_box_is_that_of_the_box() {
    let size = DVec3::new(0.06, 0.05, 0.04);
    let (box_, facets) = (Surface::new(&cuboid(size)), mesh(&generators::cuboid(size)));
    for speed in [0.05, 0.3, 1.0] {
        // Around the box at a depth of 3 mm, over four edges.
        let half = 0.5 * size;
        let length = TAU * 0.035;
        let ticks = (length / (speed * T)) as u32;
        let at = |tick: u32| {
            let turn = TAU * f64::from(tick) / f64::from(ticks);
            let way = DVec3::new(turn.cos(), turn.sin(), 0.1 * (2.0 * turn).sin());
            let far = 0.2 * way;
            let onto = far.clamp(-half, half);
            let onto = DVec3::new(onto.x, onto.y, 0.3 * onto.z);
            onto + (far - onto).normalize() * (RADIUS_M - 0.003)
        };
        let way: Vec<DVec3> = (0..ticks).map(at).collect();
        let (smooth, rough) = (led(&box_, &way), led(&facets, &way));
        let (allowed, found) = (1.2 * largest(&smooth), largest(&rough));
        assert!(found > 0.5 * allowed && found < allowed, "{found} N of {allowed} N at {speed} m/s");
        for (tick, pair) in smooth.iter().zip(&rough).enumerate() {
            let (Some(smooth), Some(rough)) = pair else { panic!("apart at {tick}") };
            let apart = (smooth.force - rough.force).length();
            assert!(apart < 1e-3 * allowed, "{apart} N at tick {tick} with {speed} m/s");
        }
    }
}

#[test]
fn a_flat_face_of_a_mesh_is_the_face_of_a_box() {
    let size = DVec3::new(0.1, 0.08, 0.05);
    let (box_, facets) = (Surface::new(&cuboid(size)), mesh(&generators::cuboid(size)));
    let at = |tick: u32| {
        let time = f64::from(tick) * T;
        let height = 0.025 + RADIUS_M - 0.004 * (3.0 * time).sin();
        DVec3::new(0.03 * (5.0 * time).sin(), 0.025 * (7.0 * time).cos(), height)
    };
    let way: Vec<DVec3> = (0..4096).map(at).collect();
    let (smooth, rough) = (led(&box_, &way), led(&facets, &way));
    let mut touched = 0;
    for (smooth, rough) in smooth.iter().zip(&rough) {
        let force = |found: &Option<ContactForce>| found.map_or(DVec3::ZERO, |found| found.force);
        let depth = |found: &Option<ContactForce>| found.map_or(0.0, |found| found.depth_m);
        assert!((force(smooth) - force(rough)).length() < 1e-9, "{smooth:?} {rough:?}");
        assert!((depth(smooth) - depth(rough)).abs() < 1e-9);
        touched += usize::from(rough.is_some());
    }
    assert!(touched > 1500);
}

#[test]
fn what_sticks_on_a_mesh_does_not_creep() {
    let facets = mesh(&generators::icosphere(0.05, 3));
    // On the edge between two facets and beside it, trembling a little.
    for direction in [DVec3::X, DVec3::new(0.3, 0.5, 0.8), DVec3::new(0.01, 0.02, 1.0)] {
        let out = direction.normalize();
        let aside = out.any_orthonormal_vector();
        let at = |tick: u32| {
            let press = 0.004 * (f64::from(tick) / 200.0).min(1.0);
            let drag = 0.0005 * (f64::from(tick) / 400.0).min(1.0);
            let shake = 2e-4 * (TAU * f64::from(tick) / 64.0).sin();
            out * (0.0502 + RADIUS_M - press) + aside * (drag + shake)
        };
        let way: Vec<DVec3> = (0..64 * 1600).map(at).collect();
        let forces = led(&facets, &way);
        let (early, late) = (forces[64 * 20].expect("held"), forces[64 * 1599].expect("held"));
        assert!(forces[64 * 20..].iter().flatten().all(|force| force.phase == Phase::PreSlide));
        assert!((early.force - late.force).length() < 1e-9, "{direction}: {early:?} {late:?}");
        assert!(early.tangential_force_n > 0.1);
    }
}

#[test]
fn no_speed_takes_a_finger_into_a_mesh_unseen() {
    let facets = mesh(&generators::icosphere(0.05, 4));
    for speed in [10.0, 30.0, 60.0] {
        // From outside to 28 mm deep, in whole steps.
        let at = |left: u32| DVec3::new(0.03 + speed * T * f64::from(left), 0.004, 0.003);
        let way: Vec<DVec3> = (0..8).rev().map(at).collect();
        let last = led(&facets, &way).last().copied().flatten().expect("in contact");
        assert!(last.normal.x > 0.9 && (last.depth_m - 0.028).abs() < 1e-3, "{speed}: {last:?}");
    }
}

#[test]
fn a_mesh_is_touched_where_its_hull_is_not() {
    // Through the hole of a ring, and into its hollow side.
    let ring = mesh(&generators::torus(0.04, 0.01, 64, 32));
    let through: Vec<DVec3> = (0..200).map(|tick| DVec3::Z * (0.08 - 8e-4 * f64::from(tick))).collect();
    assert!(led(&ring, &through).iter().all(Option::is_none));
    let outward: Vec<DVec3> = (0..240).map(|tick| DVec3::X * 1e-4 * f64::from(tick)).collect();
    let last = led(&ring, &outward)[239].expect("in contact");
    assert!(last.normal.x < -0.99 && (last.depth_m - (0.0239 + RADIUS_M - 0.03)).abs() < 2e-4, "{last:?}");
}

/// Four fingers, each drawn to its place by a spring and damper, close on a body of 0.3 kg, lift it by 0.1 m and hold it
/// for 5 s. Where the body was in every tick, and whether a finger slid while it was held.
fn lifted(triangles: &Triangles, reach_m: f64) -> (Vec<BodyState>, bool) {
    let body = body(mesh_shape(triangles), 0.3, DVec3::ZERO);
    let surface = Surface::new(&body.shape);
    let stepper = Stepper::rigid(Inertia::from_body(&body), T, Integrator::ExactHold, Freedom::Space);
    let hand = Stepper::new(0.1, T, Integrator::ExactHold, Freedom::Space);
    let out = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y];
    let mut state = BodyState::start(&body);
    let mut hands = out.map(|out| BodyState::at_rest(out * (reach_m + RADIUS_M + 0.005)));
    let mut contacts = [ContactState::default(); 4];
    let (mut states, mut slid) = (Vec::new(), false);
    for tick in 0..9 * 1024 {
        let time = f64::from(tick) * T;
        let (closing, rise) = ((time / 1.0).min(1.0), ((time - 1.5) / 2.0).clamp(0.0, 1.0));
        let lift = DVec3::Z * 0.1 * rise * rise * (3.0 - 2.0 * rise);
        // It stands on something until it is held.
        let mut wrench = Wrench::force(if time > 1.2 { -0.3 * G * DVec3::Z } else { DVec3::ZERO });
        for (nth, out) in out.into_iter().enumerate() {
            let (centre, velocity) = hands[nth].point();
            let sphere = Sphere { centre, velocity, radius_m: RADIUS_M };
            let frame = (&state.pose, &state.twist);
            let found = touch(&finger(), &mut contacts[nth], &surface, frame, &sphere, 1.0 / 0.3);
            let target = out * (reach_m + RADIUS_M + 0.005 - 0.017 * closing) + lift;
            let mut force = 400.0 * (target - centre) - 10.0 * velocity;
            if let Some(found) = found {
                force += found.force;
                add(&mut wrench, found.on_surface(state.pose.position));
            }
            slid |= time > 4.0 && found.is_none_or(|found| found.phase != Phase::PreSlide);
            hand.step(&mut hands[nth], &Wrench::force(force));
        }
        stepper.step(&mut state, &wrench);
        states.push(state);
    }
    (states, slid)
}

#[test]
fn a_mesh_is_lifted_and_held_without_slip() {
    let meshes = [
        (generators::icosphere(0.05, 3), 0.05),
        (generators::icosphere(0.05, 5), 0.05),
        (generators::torus(0.05, 0.02, 64, 32), 0.07),
    ];
    for (triangles, reach_m) in &meshes {
        let (states, slid) = lifted(triangles, *reach_m);
        assert!(!slid, "a finger slid or let go");
        let (from, to) = (states[4096].pose, states[states.len() - 1].pose);
        assert!((to.position.z - 0.1).abs() < 0.01, "{to:?}");
        assert!(from.position.distance(to.position) < 1e-3, "{from:?} {to:?}");
        assert!(from.orientation.angle_between(to.orientation) < 0.02, "{from:?} {to:?}");
        let last = states[states.len() - 1].twist;
        assert!(last.linear.length() < 1e-4 && last.angular.length() < 2e-3, "{last:?}");
        assert!(states.iter().all(|state| state.twist.linear.length() < 0.3));
        assert_eq!(lifted(triangles, *reach_m).0, states);
    }
}
