//! Networks of springs along the edges of tetrahedra.

use crate::common::{at_node, block, central_differences, exact_step, fix, momentum, scene, shaken};
use cotouch_scene::scene::{Scene, SoftModel};
use cotouch_soft::{MaterialPoint, PointForce, SoftBody, SoftState, soft_body};
use glam::{DMat3, DVec3};

const EDGE: f64 = 0.025;

/// A block of cubes of 25 mm, fixed at x = 0.
fn clamped(cells: [u32; 3]) -> Scene {
    let mut scene = scene(SoftModel::MassSpring, block(cells, EDGE));
    fix(&mut scene, [0.0, -1.0, -1.0], [0.0, 1.0, 1.0]);
    scene
}

/// A node at the far end.
fn tip(body: &dyn SoftBody) -> MaterialPoint {
    let far = body.rest_m().iter().enumerate().max_by(|a, b| a.1.length().total_cmp(&b.1.length())).unwrap();
    at_node(far.0)
}

#[test]
fn a_step_is_what_its_linearisation_says_at_rest_and_pressed() {
    for (newton_steps, press) in [(1, 0.0), (1, 0.4), (2, 0.4)] {
        let scene = clamped([2, 1, 1]).edit_unchecked(|scene| scene.soft.newton_steps = newton_steps);
        let mut body = soft_body(&scene).unwrap();
        let forces = [PointForce { at: tip(&*body), force_n: DVec3::new(-press, 0.5 * press, -0.2 * press) }];
        body.settle(&forces).unwrap();
        let exact = exact_step(&body.linear().unwrap());
        let differences = central_differences(&*body, &forces, 1e-7);
        let error = (exact - &differences).amax() / differences.amax();
        assert!(error < 1e-7, "{error} under {press} N");
    }
}

#[test]
fn without_inertia_every_step_ends_in_equilibrium() {
    let scene = clamped([3, 1, 1]).edit_unchecked(|scene| scene.soft.quasi_static = true);
    let mut stepped = soft_body(&scene).unwrap();
    let mut settled = stepped.clone();
    let forces = [PointForce { at: tip(&*stepped), force_n: DVec3::new(0.2, -0.3, 0.1) }];
    stepped.step(&forces);
    settled.settle(&forces).unwrap();
    for (a, b) in stepped.state().positions_m.iter().zip(&settled.state().positions_m) {
        assert!(a.distance(*b) < 1e-10);
    }
    let exact = exact_step(&settled.linear().unwrap());
    let differences = central_differences(&*settled, &forces, 1e-7);
    assert!((exact - differences).amax() < 1e-4, "the step forgets where it began");
}

#[test]
fn the_compliance_is_symmetric_and_what_small_forces_do() {
    let body = soft_body(&clamped([3, 2, 1])).unwrap();
    let inside = MaterialPoint { nodes: [3, 7, 11, 2], weights: [0.4, 0.3, 0.2, 0.1] };
    let points = [tip(&*body), inside];
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
}

#[test]
fn without_anything_fixed_momentum_is_kept_and_rest_turned_is_rest() {
    let scene = scene(SoftModel::MassSpring, block([2, 2, 2], EDGE))
        .edit_unchecked(|scene| scene.soft.mass_damping_per_s = 0.0);
    let mut body = soft_body(&scene).unwrap();
    let mass = body.linear().unwrap();
    let turn = DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(-1.1);
    let turned: Vec<DVec3> = body.rest_m().iter().map(|at| turn * *at + DVec3::X).collect();
    let still = vec![DVec3::ZERO; turned.len()];
    body.set_state(&SoftState { positions_m: turned.clone(), velocities_m_per_s: still });
    body.step(&[]);
    assert!(body.state().positions_m.iter().zip(&turned).all(|(a, b)| a.distance(*b) < 1e-14));
    assert!(body.energy().elastic_j.abs() < 1e-20);

    body.set_state(&shaken(&*body, 7, 0.002, 0.3));
    let before = momentum(&mass, body.state());
    for _ in 0..50 {
        body.step(&[]);
        let after = momentum(&mass, body.state());
        assert!(after.distance(before) < 1e-12, "{after} {before}");
    }
}

#[test]
fn energy_never_grows_without_input() {
    for (seed, far) in [(1, 0.001), (2, 0.02), (3, 0.5)] {
        let scene = clamped([3, 2, 2]).edit_unchecked(|scene| {
            scene.soft.stiffness_damping_s = 0.0;
            scene.soft.mass_damping_per_s = 0.0;
            scene.gravity_m_per_s2 = DVec3::new(0.0, 0.0, -9.81);
        });
        let mut body = soft_body(&scene).unwrap();
        body.set_state(&shaken(&*body, seed, far, 10.0 * far));
        let mut last = body.energy().total_j();
        let scale = last.abs();
        for _ in 0..200 {
            body.step(&[]);
            let energy = body.energy().total_j();
            assert!(energy <= last + 1e-11 * scale, "{energy} after {last}");
            last = energy;
        }
    }
}

/// Pulls at a corner, lets go, and watches the energy fall.
fn pulled_and_let_go(force_n: DVec3) -> Box<dyn SoftBody> {
    let mut body = soft_body(&clamped([3, 2, 2])).unwrap();
    let at = tip(&*body);
    for _ in 0..40 {
        body.step(&[PointForce { at, force_n }]);
    }
    let mut last = body.energy().total_j();
    for _ in 0..300 {
        body.step(&[]);
        let energy = body.energy().total_j();
        assert!(energy <= last * (1.0 + 1e-11) + 1e-15, "{energy} after {last}");
        last = energy;
    }
    let state = body.state();
    assert!(state.positions_m.iter().chain(&state.velocities_m_per_s).all(|vector| vector.is_finite()));
    body
}

#[test]
fn a_hand_that_pulls_hard_does_not_blow_it_up() {
    for force in [-1e4 * DVec3::Z, 1e4 * DVec3::X, DVec3::splat(-800.0)] {
        let body = pulled_and_let_go(force);
        assert!(body.energy().kinetic_j < 1e-3, "it comes to rest after {force} N: {:?}", body.energy());
    }
    // From farther than anyone sees it need not come back within these five seconds, but it does not gain energy.
    pulled_and_let_go(1e12 * DVec3::X);
}

#[test]
fn pulled_at_one_corner_it_goes_back_to_rest() {
    for direction in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::new(-1.0, 0.4, -0.7).normalize()]
    {
        for force in [5.0, 40.0, 400.0] {
            let body = pulled_and_let_go(force * direction);
            let far = farthest_from_rest(&*body);
            assert!(far < 1e-3, "{far} m after {force} N towards {direction}");
        }
    }
}

fn farthest_from_rest(body: &dyn SoftBody) -> f64 {
    body.state().positions_m.iter().zip(body.rest_m()).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

#[test]
fn a_corner_that_was_pushed_through_the_body_comes_back() {
    let mut body = soft_body(&clamped([3, 2, 2])).unwrap();
    let corner = body.rest_m().len() - 1;
    for moved in [DVec3::new(-0.04, -0.03, -0.03), DVec3::new(-0.2, 0.0, 0.0), DVec3::new(0.0, -0.08, -0.02)]
    {
        let mut state = body.state().clone();
        state.positions_m[corner] = body.rest_m()[corner] + moved;
        body.set_state(&state);
        for _ in 0..300 {
            body.step(&[]);
        }
        assert!(farthest_from_rest(&*body) < 1e-4, "{} after {moved}", farthest_from_rest(&*body));
    }
}

#[test]
fn about_an_inverted_shape_too_stiffness_is_the_energys_second_derivative() {
    let mut body = soft_body(&clamped([1, 1, 1])).unwrap();
    let mut state = body.state().clone();
    let corner = body.rest_m().len() - 1;
    state.positions_m[corner] -= DVec3::new(0.03, 0.02, 0.028);
    body.set_state(&state);
    let linear = body.linear().unwrap();
    let step = 1e-6;
    let energy_at = |moves: [(usize, f64); 2]| {
        let mut moved = state.clone();
        for (index, sign) in moves {
            let (node, axis) = linear.coordinates[index];
            moved.positions_m[node as usize][axis as usize] += sign * step;
        }
        let mut copy = body.clone();
        copy.set_state(&moved);
        copy.energy().elastic_j
    };
    let count = linear.coordinates.len();
    for (row, column) in (0..count).flat_map(|row| (row..count).map(move |column| (row, column))) {
        let at = |a: f64, b: f64| energy_at([(row, a), (column, b)]);
        let second = (at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0)) / (4.0 * step * step);
        let here =
            linear.stiffness.iter().filter(|entry| (entry.0 as usize, entry.1 as usize) == (row, column));
        let stiffness: f64 = here.map(|entry| entry.2).sum();
        assert!((second - stiffness).abs() < 1e-3 * 20e3 * EDGE, "{second} {stiffness} at {row}, {column}");
    }
}

#[test]
fn a_shape_without_thickness_survives_and_swells_again() {
    let mut body = soft_body(&clamped([3, 1, 1])).unwrap();
    let flat = body.rest_m().iter().map(|at| DVec3::new(at.x, at.y, 0.0)).collect();
    let still = vec![DVec3::ZERO; body.rest_m().len()];
    body.set_state(&SoftState { positions_m: flat, velocities_m_per_s: still });
    for _ in 0..300 {
        body.step(&[]);
    }
    assert!(farthest_from_rest(&*body) < 1e-3, "{}", farthest_from_rest(&*body));
}

/// A bar pulled along by its end: Young's modulus as the network has it, over that of the material.
fn youngs_modulus_of_a_bar(cells: [u32; 3]) -> f64 {
    let scene = clamped(cells);
    let mut body = soft_body(&scene).unwrap();
    let length = EDGE * f64::from(cells[0]);
    let end: Vec<usize> =
        (0..body.rest_m().len()).filter(|&node| body.rest_m()[node].x > length - 1e-9).collect();
    let pull = 1e-3 / end.len() as f64;
    let forces: Vec<PointForce> =
        end.iter().map(|&node| PointForce { at: at_node(node), force_n: pull * DVec3::X }).collect();
    body.settle(&forces).unwrap();
    let moved =
        end.iter().map(|&node| body.state().positions_m[node].x - length).sum::<f64>() / end.len() as f64;
    let area = EDGE * EDGE * f64::from(cells[1] * cells[2]);
    1e-3 / area * length / moved / scene.soft.young_pa
}

#[test]
fn a_bar_is_about_as_stiff_as_its_material() {
    for cells in [[8, 2, 2], [12, 4, 4]] {
        let ratio = youngs_modulus_of_a_bar(cells);
        println!("E of a bar of {cells:?} cells: {ratio} of the material's");
        assert!((0.75..1.25).contains(&ratio), "{ratio}");
    }
}

#[test]
fn the_stress_of_an_evenly_stretched_block_is_even() {
    let mut body = soft_body(&scene(SoftModel::MassSpring, block([6, 6, 6], EDGE))).unwrap();
    let strain = 1e-4;
    let stretched = body.rest_m().iter().map(|at| DVec3::new(at.x * (1.0 + strain), at.y, at.z)).collect();
    let still = vec![DVec3::ZERO; body.rest_m().len()];
    body.set_state(&SoftState { positions_m: stretched, velocities_m_per_s: still });
    let mut stress = Vec::new();
    body.stress_pa(&mut stress);
    // Springs of k·l² = 24/25·E·V in each of six tetrahedra: axes 1, 1, 1, diagonals of faces 2/3 each, of the cube 1. That is
    // stiffer along the axes than the material, whose 2·μ·ε would be 0.8·E·ε.
    let [along, across] = [1.0 + 1.0 / 3.0 + 1.0 / 9.0, 1.0 / 6.0 + 1.0 / 9.0];
    let shear: f64 = 2.0 * across * across + 1.0 / 81.0;
    let expected = 0.96 * 20e3 * strain * ((along - across) * (along - across) + 3.0 * shear).sqrt();
    let middle = DVec3::splat(3.0 * EDGE);
    let inner = (0..stress.len()).filter(|&node| body.rest_m()[node].distance(middle) < 1.5 * EDGE);
    for node in inner {
        let ratio = f64::from(stress[node]) / expected;
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
    }
}
