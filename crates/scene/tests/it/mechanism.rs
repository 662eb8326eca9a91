//! Mechanisms against finite differences, virtual work and the energy of their links.

use cotouch_scene::mechanism::{Assembly, Mechanism, Pantograph, Phantom, Placed, endpoint_inertia};
use cotouch_scene::scene::{DeviceKind, DeviceSpec, VelocityEstimate};
use glam::{DMat3, DVec2, DVec3};
use proptest::prelude::*;

const MECHANISMS: [Mechanism; 3] = [
    Mechanism::Pantograph(Pantograph::MARK_2),
    Mechanism::Pantograph(Pantograph::DESKTOP),
    Mechanism::Phantom(Phantom::PUBLISHED),
];

/// A mechanism, and a place in its workspace.
fn anywhere() -> impl Strategy<Value = (Mechanism, DVec3)> {
    let share = || -1.0..1.0_f64;
    (proptest::sample::select(MECHANISMS.to_vec()), share(), share(), share()).prop_map(
        |(mechanism, x, y, z)| {
            let workspace = mechanism.workspace();
            (mechanism, workspace.centre + workspace.half_size * DVec3::new(x, y, z))
        },
    )
}

fn vector() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0, -1.0..1.0, -1.0..1.0_f64).prop_map(DVec3::from)
}

/// What a mechanism can do of a vector.
fn possible(mechanism: &Mechanism, vector: DVec3) -> DVec3 {
    if mechanism.joints() == 2 { vector.with_z(0.0) } else { vector }
}

proptest! {
    #[test]
    fn kinematics_go_there_and_back((mechanism, place) in anywhere()) {
        let joints = mechanism.joints_at(place).unwrap();
        let again = mechanism.position(joints).unwrap();
        prop_assert!((again - place).length() < 1e-14, "{place} {again}");
        prop_assert!(mechanism.reciprocal_condition(joints) > 0.25);
    }

    #[test]
    fn any_place_in_reach_goes_there_and_back(place in vector()) {
        let near = Mechanism::Pantograph(Pantograph { assembly: Assembly::Near, ..Pantograph::MARK_2 });
        for mechanism in MECHANISMS.into_iter().chain([near]) {
            let place = possible(&mechanism, place * 0.5);
            let Some(joints) = mechanism.joints_at(place) else { continue };
            if mechanism.reciprocal_condition(joints) > 1e-4 {
                let again = mechanism.position(joints).unwrap();
                prop_assert!((again - place).length() < 1e-11, "{mechanism:?} {place} {again}");
            }
        }
    }

    #[test]
    fn the_jacobian_is_the_derivative((mechanism, place) in anywhere(), rates in vector()) {
        let joints = mechanism.joints_at(place).unwrap();
        let h = 1e-5;
        let at = |step: f64| mechanism.position(joints + rates * step).unwrap();
        let velocity = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        let found = mechanism.jacobian(joints).unwrap() * rates;
        prop_assert!((velocity - found).length() < 1e-9, "{velocity} {found}");
    }

    #[test]
    fn torques_do_the_work_of_the_force(
        (mechanism, place) in anywhere(),
        rates in vector(),
        force in vector(),
    ) {
        let joints = mechanism.joints_at(place).unwrap();
        let velocity = mechanism.jacobian(joints).unwrap() * rates;
        let torques = mechanism.torques(joints, force).unwrap();
        prop_assert!((torques.dot(rates) - force.dot(velocity)).abs() < 1e-15);
        prop_assert!((mechanism.force(joints, torques).unwrap() - force).length() < 1e-13);
        let lever_m = mechanism.longest_lever_m() * (1.0 + 1e-3);
        let largest = possible(&mechanism, torques).abs().max_element();
        prop_assert!(largest <= lever_m * possible(&mechanism, force).length());
    }

    #[test]
    fn inertia_is_that_of_the_moving_links((mechanism, place) in anywhere(), velocity in vector()) {
        let velocity = possible(&mechanism, velocity);
        let inertia = mechanism.link_inertia(place).unwrap();
        let expected = match mechanism {
            Mechanism::Pantograph(pantograph) => energy_of_bars(&pantograph, place, velocity),
            Mechanism::Phantom(phantom) => energy_of_arm(&phantom, place, velocity),
        };
        let found = 0.5 * velocity.dot(inertia * velocity);
        prop_assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        let joints = mechanism.joints_at(place).unwrap();
        let rates = mechanism.jacobian(joints).unwrap().inverse() * velocity;
        let of_joints = 0.5 * rates.dot(mechanism.joint_inertia(joints).unwrap() * rates);
        prop_assert!((found - of_joints).abs() < 1e-13);
        let (again, _) = mechanism.dynamics(place, velocity).unwrap();
        prop_assert!(difference(inertia, again) < 1e-14);
    }

    /// b = Λ̇·v − ∇(vᵀ·Λ·v)/2.
    #[test]
    fn the_bias_is_lagranges((mechanism, place) in anywhere(), velocity in vector()) {
        let velocity = possible(&mechanism, velocity);
        let h = 1e-4;
        let inertia = |step: DVec3| mechanism.link_inertia(place + step).unwrap();
        let along = |direction: DVec3| {
            let derivative = |h: f64| (inertia(direction * h) - inertia(direction * -h)) * (0.5 / h);
            (derivative(h) * 4.0 - derivative(2.0 * h)) * (1.0 / 3.0)
        };
        let gradient = DVec3::from_array(
            DVec3::AXES.map(|axis| velocity.dot(along(possible(&mechanism, axis)) * velocity)),
        );
        let expected = along(velocity) * velocity - 0.5 * gradient;
        let (_, found) = mechanism.dynamics(place, velocity).unwrap();
        prop_assert!((found - expected).length() < 1e-6 * (1.0 + expected.length()), "{found} {expected}");
    }
}

fn difference(a: DMat3, b: DMat3) -> f64 {
    (0..3).map(|column| (a.col(column) - b.col(column)).abs().max_element()).fold(0.0, f64::max)
}

/// Bars as they lie at `place`: their ends, and the angles of the motors.
fn bars(pantograph: &Pantograph, place: DVec3) -> ([[DVec2; 2]; 4], DVec2) {
    let joints = pantograph.joints_at(place).unwrap();
    let arm = |x: f64, angle: f64| {
        let base = DVec2::X * x;
        let elbow = base + DVec2::from_angle(angle) * pantograph.proximal_m;
        [[base, elbow], [elbow, place.truncate()]]
    };
    let half = 0.5 * pantograph.separation_m;
    let ([a, b], [c, d]) = (arm(-half, joints.x), arm(half, joints.y));
    ([a, b, c, d], joints.truncate())
}

/// Each bar by Simpson's rule, which is exact for a uniform rod.
fn energy_of_bars(pantograph: &Pantograph, place: DVec3, velocity: DVec3) -> f64 {
    let h = 1e-6;
    let ((before, q0), (after, q1)) =
        (bars(pantograph, place - velocity * h), bars(pantograph, place + velocity * h));
    let mut energy = 0.5 * pantograph.rotor_kg_m2 * ((q1 - q0) / (2.0 * h)).length_squared();
    for (before, after) in before.iter().zip(&after) {
        let mass = pantograph.bar_kg_per_m * (after[1] - after[0]).length();
        let [u, v] = [0, 1].map(|end| (after[end] - before[end]) / (2.0 * h));
        energy += mass / 12.0 * (u.length_squared() + (u + v).length_squared() + v.length_squared());
    }
    energy
}

/// The bodies of Table 1 of Çavuşoğlu et al. 2002, each with its moving centre and its turning.
fn energy_of_arm(phantom: &Phantom, place: DVec3, velocity: DVec3) -> f64 {
    let (l1, l2, l3, h) = (0.215, 0.170, 0.0325, 1e-6);
    let joints = |step: f64| phantom.joints_at(place + velocity * step).unwrap();
    let rates = (joints(h) - joints(-h)) / (2.0 * h);
    let at = |along_upper: f64, along_fore: f64, q: DVec3| {
        let out = along_upper * q.y.cos() + along_fore * q.z.sin();
        let up = along_upper * q.y.sin() - along_fore * q.z.cos();
        DVec3::new(out * q.x.sin(), out * q.x.cos(), up)
    };
    let moving = |mass: f64, along_upper: f64, along_fore: f64| {
        let there = |step: f64| at(along_upper, along_fore, joints(step));
        0.5 * mass * ((there(h) - there(-h)) / (2.0 * h)).length_squared()
    };
    let turning = |[x, y, z]: [f64; 3], angle: f64, rate: f64| {
        let (sine, cosine) = angle.sin_cos();
        0.5 * (x * rate * rate + (y * cosine * cosine + z * sine * sine) * rates.x * rates.x)
    };
    let q = joints(0.0);
    moving(0.0202, l1, 0.5 * l2)
        + moving(0.0249, 0.5 * l1, l3)
        + turning([0.4864e-4, 0.001_843e-4, 0.4864e-4], q.z, rates.z)
        + turning([0.959e-4, 0.959e-4, 0.0051e-4], q.y, rates.y)
        + turning([11.09e-4, 10.06e-4, 0.591e-4], q.y, rates.y)
        + turning([7.11e-4, 0.629e-4, 6.246e-4], q.z, rates.z)
        + 0.5 * 11.87e-4 * rates.x * rates.x
}

#[test]
fn singular_places_are_told() {
    let pantograph = Pantograph::MARK_2;
    let reach_m = pantograph.proximal_m + pantograph.distal_m;
    let base = DVec3::X * 0.5 * pantograph.separation_m;
    let towards = DVec3::new(-0.3, 1.0, 0.0).normalize();
    let nearly = pantograph.joints_at(base + towards * reach_m * (1.0 - 1e-9)).unwrap();
    assert!(pantograph.reciprocal_condition(nearly) < 1e-3, "a stretched arm");
    assert_eq!(pantograph.joints_at(base + towards * reach_m * (1.0 + 1e-9)), None);
    assert_eq!(pantograph.joints_at(base), None, "on a motor");
    // The distal bars in line: the elbows are two bars apart.
    let half = pantograph.distal_m - 0.5 * pantograph.separation_m;
    let angle = (half / pantograph.proximal_m).acos();
    let in_line = DVec3::new(std::f64::consts::PI - angle, angle, 0.0);
    let slack = DVec3::new(-1e-6, 1e-6, 0.0);
    assert!(pantograph.reciprocal_condition(in_line + slack) < 0.01);
    assert_eq!(pantograph.position(in_line - slack * 1e3), None, "bars that do not meet");
    assert_eq!(pantograph.reciprocal_condition(in_line - slack * 1e3), 0.0);

    let phantom = Phantom::PUBLISHED;
    let shoulder = DVec3::new(0.0, phantom.upper_m, phantom.fore_m);
    let towards = DVec3::new(0.2, -1.0, -0.5).normalize();
    let reach_m = phantom.upper_m + phantom.fore_m;
    let nearly = phantom.joints_at(shoulder + towards * reach_m * (1.0 - 1e-9)).unwrap();
    assert!(phantom.reciprocal_condition(nearly) < 1e-3);
    assert_eq!(phantom.joints_at(shoulder + towards * reach_m * (1.0 + 1e-9)), None);
    assert_eq!(phantom.joints_at(shoulder - DVec3::Z * 0.2), None, "on the turret's axis");
    let beside = phantom.joints_at(shoulder + DVec3::new(1e-4, 0.0, -0.2)).unwrap();
    assert!(phantom.reciprocal_condition(beside) < 1e-3);
}

#[test]
fn both_assemblies_of_one_pair_of_angles_mirror_each_other() {
    let far = Pantograph::MARK_2;
    let near = Pantograph { assembly: Assembly::Near, ..far };
    let joints = DVec3::new(2.0, 1.0, 0.0);
    let (one, other) = (far.position(joints).unwrap(), near.position(joints).unwrap());
    let elbow = |x: f64, angle: f64| (DVec2::X * x + DVec2::from_angle(angle) * far.proximal_m).extend(0.0);
    for elbow in [elbow(-0.0125, 2.0), elbow(0.0125, 1.0)] {
        assert!(((one - elbow).length() - far.distal_m).abs() < 1e-15);
        assert!(((other - elbow).length() - far.distal_m).abs() < 1e-15);
    }
    assert!(one.y > other.y);
}

#[test]
fn a_finger_has_its_hands_inertia_and_the_links_where_the_scene_says_so() {
    let mut device = DeviceSpec {
        kind: DeviceKind::Pantograph,
        encoder_counts_per_turn: 0,
        velocity: VelocityEstimate::Exact,
        velocity_cutoff_hz: 30.0,
        max_joint_torque_n_m: 0.0,
        inertia: false,
    };
    let (start, place) = (DVec3::new(0.5, -0.2, 0.1), DVec3::new(0.55, -0.25, 0.1));
    let hand = DMat3::from_diagonal(DVec3::splat(0.3));
    assert_eq!(endpoint_inertia(&device, 0.3, start, place), hand);
    device.inertia = true;
    let placed = Placed::of_finger(&device, start).unwrap();
    assert!((start + placed.offset - placed.mechanism.workspace().centre).length() < 1e-15);
    let links = placed.mechanism.link_inertia(place + placed.offset).unwrap();
    assert_eq!(endpoint_inertia(&device, 0.3, start, place), hand + links);
    assert_eq!(endpoint_inertia(&device, 0.3, start, place + DVec3::X), hand, "out of reach");
    assert!(links.x_axis.x > 0.005 && links.x_axis.x < 0.2, "{links}");
    device.kind = DeviceKind::Point;
    assert_eq!(endpoint_inertia(&device, 0.3, start, place), hand);
}
