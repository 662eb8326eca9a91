//! The maps of grasps against sessions that are written out tick by tick with their true, nonlinear forces: central
//! differences about the operating point.

use crate::naive_grasp::{Simulation, contact_force};
use cotouch_analysis::{LiftedMap, OperatingPoint, compile_at};
use cotouch_scene::scene::{Architecture, Integrator, Scene, ShapeKind, Space, VelocityEstimate, WallPlane};
use cotouch_testkit::scenes::{edited, finger, grasp, grasp_action, spring, with_ratio};
use glam::{DMat3, DQuat, DVec3};

const BOTH: [Architecture; 2] = [Architecture::Distributed, Architecture::Centralized];

/// The move to either side: m, rad, m/s, N.
const STEP: f64 = 1e-5;

/// Largest difference of an element, as a share of the matrix's norm.
const TOLERANCE: f64 = 1e-6;

fn inertia(scene: &Scene) -> DMat3 {
    let (m, shape) = (scene.object.mass_kg, &scene.object.shape);
    let diagonal = match shape.kind {
        ShapeKind::Ball => DVec3::splat(0.4 * m * shape.radius_m.powi(2)),
        _ => {
            let DVec3 { x, y, z } = shape.size_m * shape.size_m * (m / 12.0);
            DVec3::new(y + z, x + z, x + y)
        }
    };
    DMat3::from_diagonal(diagonal)
}

fn assert_agreement(scene: &Scene, point: &OperatingPoint) {
    let LiftedMap { matrix, coordinates } = compile_at(scene, point).lift().unwrap();
    let steps = scene.schedule().steps_per_pattern() as i64;
    for (column, &moved) in coordinates.iter().enumerate() {
        let mut after = [1.0, -1.0].map(|sign| {
            let mut simulation = Simulation::new(scene, point, inertia(scene), 12);
            simulation.displace(moved, sign * STEP);
            simulation.pattern();
            simulation
        });
        for (row, &name) in coordinates.iter().enumerate() {
            let [above, below] = &mut after;
            let measured = (above.read(name, steps) - below.read(name, steps)) / (2.0 * STEP);
            let expected = matrix[(row, column)];
            assert!(
                (measured - expected).abs() <= TOLERANCE * matrix.norm(),
                "d {name} / d {moved} is {expected} in the analysis and {measured} written out"
            );
        }
    }
}

/// Something in every term of the loop.
fn furnished(architecture: Architecture) -> Scene {
    edited(&grasp(architecture), |scene| {
        scene.governor.damping_n_s_per_m = 0.7;
        scene.object.damping_n_s_per_m = -0.4;
        scene.object.axis_damping_n_s_per_m = DVec3::new(0.2, 0.5, 0.9);
        scene.object.rotational_damping_n_m_s_per_rad = 0.003;
    })
}

/// The grasp in space: fingers out of line, a turned box, gravity.
fn in_space(architecture: Architecture) -> Scene {
    let mut scene = furnished(architecture);
    scene = edited(&scene, |scene| {
        scene.space = Space::Space;
        scene.gravity_m_per_s2 = DVec3::new(0.0, 0.0, -2.0);
        scene.object.position_m = DVec3::new(0.01, -0.02, 0.03);
        scene.object.rotation_rad = DVec3::new(0.2, -0.1, 0.4);
    });
    let turn = DQuat::from_scaled_axis(scene.object.rotation_rad);
    scene = edited(&scene, |scene| {
        for (user, x) in scene.users.iter_mut().zip([-0.03, 0.035]) {
            let at = |y: f64, z: f64| finger(scene.object.position_m + turn * DVec3::new(x, y, z));
            user.fingers = vec![at(-0.073, 0.01), at(0.073, -0.012)];
        }
    });
    scene
}

#[test]
fn in_the_plane() {
    for architecture in BOTH {
        for n in 0..4 {
            for ratio in [1, 8] {
                let scene =
                    edited(&with_ratio(furnished(architecture), ratio), |scene| scene.link.delay_periods = n);
                assert_agreement(&scene, &OperatingPoint::settled_grasp(&scene));
            }
        }
    }
}

#[test]
fn in_space_under_gravity() {
    for architecture in BOTH {
        for n in 0..3 {
            let scene = edited(&in_space(architecture), |scene| scene.link.delay_periods = n);
            let point = OperatingPoint::settled_grasp(&scene);
            assert_eq!(point.fingers.len(), if architecture == Architecture::Distributed { 8 } else { 4 });
            assert_agreement(&scene, &point);
        }
    }
}

#[test]
fn velocities_that_are_told_from_positions() {
    for architecture in BOTH {
        for velocity in [VelocityEstimate::Difference, VelocityEstimate::Filtered] {
            for mut scene in [furnished(architecture), in_space(architecture)] {
                scene = edited(&scene, |scene| {
                    scene.device.velocity = velocity;
                    scene.device.velocity_cutoff_hz = 60.0;
                });
                assert_agreement(&scene, &OperatingPoint::settled_grasp(&scene));
            }
        }
    }
}

#[test]
fn integrators_and_softer_remote_copies() {
    for architecture in BOTH {
        let scene = edited(&furnished(architecture), |scene| {
            scene.session.integrator = Integrator::SemiImplicitEuler;
            scene.coupling.remote_hand_object = spring(170.0, 3.0);
            scene.coupling.remote_hand_object_tangential = spring(270.0, 5.0);
        });
        let mut point = OperatingPoint::settled_grasp(&scene);
        settle_forces(&scene, &mut point);
        assert_agreement(&scene, &point);
    }
}

#[test]
fn a_ball_turns_its_normals() {
    for architecture in BOTH {
        for space in [Space::Plane, Space::Space] {
            let scene = edited(&furnished(architecture), |scene| {
                scene.space = space;
                scene.object.shape.kind = ShapeKind::Ball;
                scene.object.shape.radius_m = 0.04;
                scene.users[0].script = vec![grasp_action(3.0)];
            });
            let mut point = OperatingPoint::settled_grasp(&scene);
            assert!(point.fingers[0].curvature.x_axis.length() > 1.0);
            settle_forces(&scene, &mut point);
            assert_agreement(&scene, &point);
        }
    }
}

#[test]
fn against_a_wall() {
    for mut scene in [furnished(Architecture::Distributed), in_space(Architecture::Centralized)] {
        scene = edited(&scene, |scene| {
            scene.wall.stiffness_n_per_m = 4000.0;
            scene.wall.damping_n_s_per_m = 30.0;
            scene.wall.tangential_stiffness_n_per_m = 7000.0;
            scene.wall.tangential_damping_n_s_per_m = 50.0;
            scene.wall.planes = vec![WallPlane {
                name: "wall".into(),
                point_m: DVec3::Y * 0.1,
                normal: DVec3::new(0.1, -1.0, 0.0),
            }];
        });
        let mut point = OperatingPoint::settled_grasp(&scene);
        for host in scene.hosts().take(if scene.space == Space::Plane { 2 } else { 1 }) {
            for x in [-0.05, 0.05] {
                let corner = DVec3::new(x, 0.03, 0.0);
                let force = DVec3::new(0.3, -1.1, 0.0);
                let contact = cotouch_analysis::CornerContact { host, wall: 0, body: 0, corner, force };
                point.corners.push(contact);
            }
        }
        assert_agreement(&scene, &point);
    }
}

#[test]
fn copies_that_do_not_coincide() {
    for mut scene in [furnished(Architecture::Distributed), in_space(Architecture::Distributed)] {
        scene = edited(&scene, |scene| scene.coupling.remote_hand_object = spring(500.0, 4.0));
        let turn = if scene.space == Space::Plane { DVec3::Z * 0.03 } else { DVec3::new(0.01, -0.02, 0.03) };
        let mut point = OperatingPoint::settled_grasp(&scene);
        let pose = &mut point.poses[1][0];
        pose.position += DVec3::new(0.0005, 0.0007, 0.0);
        pose.orientation = DQuat::from_scaled_axis(turn) * pose.orientation;
        settle_forces(&scene, &mut point);
        assert_agreement(&scene, &point);
    }
}

/// Gives every contact the place of the finger at its own host, and the force that its law has there.
fn settle_forces(scene: &Scene, point: &mut OperatingPoint) {
    let first = point.clone();
    for contact in &mut point.fingers {
        let same = |other: &&cotouch_analysis::FingerContact| {
            (other.user, other.finger) == (contact.user, contact.finger)
        };
        contact.centre = first.fingers.iter().find(same).unwrap().centre;
        let pose = &first.poses[contact.host.index()][0];
        let at_rest = (pose.position, pose.orientation, DVec3::ZERO, DVec3::ZERO);
        contact.force = contact_force(scene, contact, (contact.centre, DVec3::ZERO), at_rest);
    }
}
