//! A skin around a fluid that keeps its volume.

use crate::common::{at_node, central_differences, exact_step, fix, scene, shaken, sphere};
use cotouch_scene::scene::{Scene, SoftModel};
use cotouch_soft::{PointForce, SoftBody, SoftState, soft_body};
use glam::DVec3;

const RADIUS: f64 = 0.05;

/// A ball of water in rubber that stands on its lowest part.
fn standing(halvings: u32) -> Scene {
    let mut scene = scene(SoftModel::Balloon, sphere(RADIUS, halvings));
    scene = scene.edit_unchecked(|scene| {
        scene.soft.young_pa = 100e3;
        scene.soft.poisson_ratio = 0.4;
    });
    fix(&mut scene, [-1.0, -1.0, -1.0], [1.0, 1.0, -0.7 * RADIUS]);
    scene
}

fn volume(body: &dyn SoftBody) -> f64 {
    let corner = |node: u32| body.state().positions_m[node as usize];
    body.triangles().iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
}

/// The node that rests farthest along a direction.
fn outermost(body: &dyn SoftBody, direction: DVec3) -> usize {
    let along = |node: &usize| body.rest_m()[*node].dot(direction);
    (0..body.rest_m().len()).max_by(|a, b| along(a).total_cmp(&along(b))).unwrap()
}

fn press(body: &dyn SoftBody, side: DVec3, force_n: DVec3) -> PointForce {
    PointForce { at: at_node(outermost(body, side)), force_n }
}

#[test]
fn blown_up_it_rests() {
    let mut body = soft_body(&standing(2)).unwrap();
    for _ in 0..10 {
        body.step(&[]);
    }
    let moved =
        body.state().positions_m.iter().zip(body.rest_m()).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(moved < 1e-12, "{moved}");
    let out = body.rest_m().iter().map(|at| (at.length() - RADIUS).abs()).fold(0.0, f64::max);
    assert!(out < 0.03 * RADIUS, "rest is about the mesh: {out}");
}

#[test]
fn every_allowed_stretch_rests_and_says_its_compliance() {
    let mut last = f64::INFINITY;
    for stretch in [1.001, 1.1, 1.5, 1.99] {
        let scene = standing(1).edit_unchecked(|scene| scene.soft.skin_stretch = stretch);
        let body = soft_body(&scene).unwrap();
        let top = at_node(outermost(&*body, DVec3::Z));
        let compliance = body.compliance(&[top]).unwrap();
        let largest = compliance.symmetric_eigenvalues().max();
        println!("the largest compliance of a node at the top, skin stretched {stretch}: {largest} m/N");
        assert!(
            largest > 0.0 && largest < last,
            "tension makes it stiffer: {largest} after {last} at {stretch}"
        );
        last = largest;
    }
}

#[test]
fn the_volume_is_kept_however_hard_and_long_it_is_pressed() {
    let scene = standing(2).edit_unchecked(|scene| scene.gravity_m_per_s2 = DVec3::new(0.0, 0.0, -9.81));
    let mut body = soft_body(&scene).unwrap();
    let at_first = volume(&*body);
    for force in [0.5, 5.0, 50.0, 1000.0] {
        let forces = [
            press(&*body, DVec3::X, -force * DVec3::X),
            press(&*body, DVec3::Z, force * DVec3::new(0.1, 0.0, -1.0)),
        ];
        for _ in 0..60 {
            body.step(&forces);
            let error = (volume(&*body) / at_first - 1.0).abs();
            assert!(error < 1e-6, "{error} at {force} N");
        }
    }
}

#[test]
fn pressing_here_bulges_there() {
    let mut body = soft_body(&standing(2)).unwrap();
    body.settle(&[press(&*body, DVec3::X, -0.3 * DVec3::X), press(&*body, DVec3::Z, DVec3::ZERO)]).unwrap();
    let out = |side: DVec3| {
        let node = outermost(&*body, side);
        (body.state().positions_m[node] - body.rest_m()[node]).dot(side)
    };
    assert!(out(DVec3::X) < -1e-3, "in where it is pressed: {}", out(DVec3::X));
    for side in [DVec3::NEG_X, DVec3::Z, DVec3::Y, DVec3::NEG_Y] {
        assert!(out(side) > 1e-5, "out towards {side}: {}", out(side));
    }
}

#[test]
fn a_step_is_what_its_linearisation_says_at_rest_and_pressed() {
    for (newton_steps, force) in [(1, 0.0), (1, 0.3), (3, 0.3)] {
        let scene = standing(1).edit_unchecked(|scene| scene.soft.newton_steps = newton_steps);
        let mut body = soft_body(&scene).unwrap();
        let forces = [press(&*body, DVec3::X, force * DVec3::new(-1.0, 0.0, -0.3))];
        body.settle(&forces).unwrap();
        let linear = body.linear().unwrap();
        assert!(linear.volume_gradient.is_some());
        let exact = exact_step(&linear);
        let differences = central_differences(&*body, &forces, 1e-7);
        let error = (exact - &differences).amax() / differences.amax();
        assert!(error < 1e-6, "{error} under {force} N, {newton_steps} steps");
    }
}

#[test]
fn the_compliance_is_symmetric_and_what_small_forces_do() {
    let body = soft_body(&standing(2)).unwrap();
    let sides = [DVec3::X, DVec3::NEG_X];
    let points = sides.map(|side| at_node(outermost(&*body, side)));
    let compliance = body.compliance(&points).unwrap();
    assert!((&compliance - compliance.transpose()).amax() == 0.0);
    for column in 0..6 {
        let mut force_n = DVec3::ZERO;
        force_n[column % 3] = 1e-5;
        let mut pressed = body.clone();
        pressed.settle(&[PointForce { at: points[column / 3], force_n }]).unwrap();
        for (row, point) in points.iter().enumerate() {
            let moved = (point.at(&pressed.state().positions_m) - point.at(body.rest_m())) / 1e-5;
            for axis in 0..3 {
                let expected = compliance[(3 * row + axis, column)];
                assert!((moved[axis] - expected).abs() < 1e-3 * compliance.amax(), "{moved} {expected}");
            }
        }
    }
    assert!(compliance[(0, 3)] > 0.0, "pushed at +x it moves out at -x and the other way round");
}

#[test]
fn energy_never_grows_without_input() {
    for (seed, far) in [(1, 1e-4), (2, 5e-3), (3, 0.1)] {
        let scene = standing(1).edit_unchecked(|scene| {
            scene.soft.stiffness_damping_s = 0.0;
            scene.soft.mass_damping_per_s = 0.0;
            scene.gravity_m_per_s2 = DVec3::new(0.0, 0.0, -9.81);
        });
        let mut body = soft_body(&scene).unwrap();
        body.set_state(&shaken(&*body, seed, far, 10.0 * far));
        // The first step brings back the volume that the made-up state had not.
        body.step(&[]);
        let mut last = body.energy().total_j();
        let scale = last.abs();
        for _ in 0..200 {
            body.step(&[]);
            let energy = body.energy().total_j();
            assert!(energy <= last + 1e-9 * scale, "{energy} after {last}");
            last = energy;
        }
    }
}

#[test]
fn collapsed_flat_and_inside_out_it_recovers() {
    let scene = standing(1);
    let rest = soft_body(&scene).unwrap();
    let at_first = volume(&*rest);
    type Shape = fn(DVec3) -> DVec3;
    let shapes: [Shape; 4] = [
        |at| DVec3::new(at.x, at.y, 0.0),
        |_| DVec3::ZERO,
        |at| DVec3::new(at.x, at.y, -at.z),
        |at| 10.0 * at,
    ];
    for (index, shape) in shapes.iter().enumerate() {
        let mut body = rest.clone();
        let positions_m = body.rest_m().iter().map(|at| shape(*at)).collect();
        let still = vec![DVec3::ZERO; body.rest_m().len()];
        body.set_state(&SoftState { positions_m, velocities_m_per_s: still });
        for _ in 0..200 {
            body.step(&[]);
        }
        assert!((volume(&*body) / at_first - 1.0).abs() < 1e-6);
        let moved = body
            .state()
            .positions_m
            .iter()
            .zip(body.rest_m())
            .map(|(a, b)| a.distance(*b))
            .fold(0.0, f64::max);
        assert!(moved < 2e-3, "shape {index}: {moved}");
    }
}

#[test]
fn without_inertia_every_step_ends_in_equilibrium() {
    let scene = standing(2).edit_unchecked(|scene| scene.soft.quasi_static = true);
    let mut stepped = soft_body(&scene).unwrap();
    let mut settled = stepped.clone();
    let forces = [press(&*stepped, DVec3::Y, -0.2 * DVec3::Y)];
    stepped.step(&forces);
    settled.settle(&forces).unwrap();
    for (a, b) in stepped.state().positions_m.iter().zip(&settled.state().positions_m) {
        assert!(a.distance(*b) < 1e-9);
    }
}

#[test]
fn its_skin_at_rest_has_the_stress_of_its_tension() {
    let scene = standing(3);
    let body = soft_body(&scene).unwrap();
    let mut stress = Vec::new();
    body.stress_pa(&mut stress);
    let soft = &scene.soft;
    let expected = soft.young_pa / (1.0 - soft.poisson_ratio) * (soft.skin_stretch - 1.0) / soft.skin_stretch;
    let mean = stress.iter().map(|&stress| f64::from(stress)).sum::<f64>() / stress.len() as f64;
    assert!((mean / expected - 1.0).abs() < 0.03, "{mean} {expected}");
}
