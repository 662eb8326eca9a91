//! Tetrahedra of corotational elasticity: physics that every elastic body has to show.

use crate::common::{block, central_differences, exact_step, fix, scene};
use cotouch_scene::scene::{Scene, SoftModel};
use cotouch_soft::{Corotational, MaterialPoint, PointForce, SoftBody, SoftState};
use cotouch_testkit::Random;
use glam::{DMat3, DVec3};
use nalgebra::DMatrix;

/// A beam of cubes along x, clamped at x = 0.
fn clamped(cells: [u32; 3], edge: f64) -> Scene {
    let mut scene = scene(SoftModel::Corotational, block(cells, edge));
    fix(&mut scene, [-1.0; 3], [1e-9, 1.0, 1.0]);
    scene
}

fn body_of(scene: &Scene) -> Corotational {
    Corotational::from_scene(scene).expect("a good scene")
}

fn node_at(body: &Corotational, place: DVec3) -> u32 {
    body.rest_m().iter().position(|node| node.abs_diff_eq(place, 1e-9)).expect("a node there") as u32
}

fn at_node(node: u32) -> MaterialPoint {
    MaterialPoint { nodes: [node; 4], weights: [1.0, 0.0, 0.0, 0.0] }
}

fn push(node: u32, force_n: DVec3) -> PointForce {
    PointForce { at: at_node(node), force_n }
}

fn placed(body: &Corotational, map: impl Fn(DVec3) -> DVec3) -> SoftState {
    let positions_m: Vec<DVec3> = body.rest_m().iter().map(|&node| map(node)).collect();
    SoftState { velocities_m_per_s: vec![DVec3::ZERO; positions_m.len()], positions_m }
}

fn numbers(seed: u64) -> impl FnMut() -> f64 {
    let mut random = Random::new(seed | 1);
    move || random.unit() - 0.5
}

#[test]
fn rigid_motions_store_no_energy_and_are_kept() {
    let scene = scene(SoftModel::Corotational, block([3, 2, 2], 0.02))
        .edit_unchecked(|scene| (scene.soft.mass_damping_per_s, scene.soft.stiffness_damping_s) = (0.0, 0.0));
    let mut body = body_of(&scene);
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 2.5);
    let mut moved = placed(&body, |node| turn * node + DVec3::new(0.3, -4.0, 1.0));
    moved.velocities_m_per_s.fill(DVec3::new(0.1, 0.2, -0.3));
    body.set_state(&moved);
    assert!(body.energy().elastic_j < 1e-24, "{}", body.energy().elastic_j);
    body.step(&[]);
    for (velocity, (after, before)) in
        body.state().velocities_m_per_s.iter().zip(body.state().positions_m.iter().zip(&moved.positions_m))
    {
        assert!(velocity.distance(DVec3::new(0.1, 0.2, -0.3)) < 1e-10);
        assert!(after.distance(*before + *velocity * body.period_s()) < 1e-13);
    }
    let mut stress = Vec::new();
    body.stress_pa(&mut stress);
    assert!(stress.iter().all(|pa| *pa < 1e-4));
}

/// The stress of a linear deformation is the same everywhere, and pulls inner nodes nowhere, however the mesh is.
#[test]
fn patch_test() {
    let mut mesh = block([4, 4, 4], 0.01);
    let mut jitter = numbers(7);
    let inside = |node: DVec3| node.min_element() > 1e-9 && node.max_element() < 0.04 - 1e-9;
    for node in &mut mesh.nodes_m {
        let shift = 0.002 * DVec3::new(jitter(), jitter(), jitter());
        *node += if inside(*node) { shift } else { DVec3::ZERO };
    }
    let mut body = body_of(&scene(SoftModel::Corotational, mesh));
    let strain = DMat3::from_cols(
        DVec3::new(0.02, 0.005, 0.0),
        DVec3::new(0.005, -0.01, 0.004),
        DVec3::new(0.0, 0.004, 0.01),
    );
    let turn = DMat3::from_axis_angle(DVec3::Y, 0.4);
    body.set_state(&placed(&body, |node| turn * ((DMat3::IDENTITY + strain) * node)));
    let forces = inner_forces(&body);
    let most = forces.iter().map(|force| force.length()).fold(0.0, f64::max);
    for (node, force) in forces.iter().enumerate().filter(|(node, _)| inside(body.rest_m()[*node])) {
        assert!(force.length() < 1e-6 * most, "force {force} on inner node {node}, {most} outside");
    }
    let mut stress = Vec::new();
    body.stress_pa(&mut stress);
    let (least, largest) = stress.iter().fold((f32::MAX, 0.0_f32), |(a, b), pa| (a.min(*pa), b.max(*pa)));
    assert!(largest - least < 1e-5 * largest && least > 100.0, "stress from {least} to {largest}");
}

/// The elastic force on every node, as the gradient of the energy by central differences.
fn inner_forces(body: &Corotational) -> Vec<DVec3> {
    let step = 1e-6;
    let mut probe = body.clone();
    let state = body.state().clone();
    let mut forces = vec![DVec3::ZERO; state.positions_m.len()];
    for (node, force) in forces.iter_mut().enumerate() {
        for axis in 0..3 {
            let mut energy = |step: f64| {
                let mut moved = state.clone();
                moved.positions_m[node][axis] += step;
                probe.set_state(&moved);
                probe.energy().elastic_j
            };
            force[axis] = (energy(-step) - energy(step)) / (2.0 * step);
        }
    }
    forces
}

/// Linear tetrahedra are too stiff in bending, by an error that falls with the square of their size.
#[test]
fn a_cantilever_converges_to_beam_theory() {
    let (length, side) = (0.16_f64, 0.02_f64);
    let deflection = |across: u32| {
        let scene = clamped([8 * across, across, across], side / f64::from(across))
            .edit_unchecked(|scene| (scene.soft.young_pa, scene.soft.poisson_ratio) = (1e5, 0.0));
        let body = body_of(&scene);
        let tip = node_at(&body, DVec3::new(length, 0.0, 0.0));
        let end: Vec<u32> = (0..body.rest_m().len() as u32)
            .filter(|&n| body.rest_m()[n as usize].x > length - 1e-9)
            .collect();
        // An even load on the end face, and how far its corner moves.
        let weight = |node: u32| {
            let part = |axis: usize| {
                let place = body.rest_m()[node as usize][axis] / side;
                if (1e-9..=1.0 - 1e-9).contains(&place) { 1.0 } else { 0.5 }
            };
            part(1) * part(2) / f64::from(across * across)
        };
        let points: Vec<MaterialPoint> = end.iter().map(|&node| at_node(node)).collect();
        let compliance = body.compliance(&points).expect("it is clamped");
        let row = 3 * end.iter().position(|&node| node == tip).expect("the tip is at the end") + 2;
        end.iter().enumerate().map(|(i, &node)| compliance[(row, 3 * i + 2)] * weight(node)).sum::<f64>()
    };
    let moment = side.powi(4) / 12.0;
    let theory = length.powi(3) / (3.0 * 1e5 * moment) + length / (5.0 / 6.0 * 5e4 * side * side);
    let errors: Vec<f64> = [1, 2, 4].map(|across| 1.0 - deflection(across) / theory).to_vec();
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0] && pair[1] > 0.0), "{errors:?}");
    // With an error of order two in the compliance's inverse: (1/(1 − e) − 1) falls to a quarter.
    let excess: Vec<f64> = errors.iter().map(|error| error / (1.0 - error)).collect();
    let orders: Vec<f64> = excess.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect();
    assert!(orders.iter().all(|order| (1.7..2.3).contains(order)), "orders {orders:?} of errors {errors:?}");
    let extrapolated = (4.0 * excess[2] - excess[1]) / 3.0;
    assert!(extrapolated.abs() < 0.02, "{extrapolated} beside the theory in the limit, errors {errors:?}");
}

#[test]
fn compliance_is_the_inverse_of_the_condensed_stiffness() {
    let scene = clamped([3, 2, 2], 0.02);
    let body = body_of(&scene);
    let (tip, side) =
        (node_at(&body, DVec3::new(0.06, 0.0, 0.04)), node_at(&body, DVec3::new(0.04, 0.04, 0.0)));
    let compliance = body.compliance(&[at_node(tip), at_node(side)]).unwrap();
    assert_eq!(compliance, compliance.transpose());
    let linear = body.linear().unwrap();
    let of_contacts = |(node, _): &(u32, u8)| *node == tip || *node == side;
    let (mut order, others): (Vec<usize>, Vec<usize>) =
        (0..linear.coordinates.len()).partition(|&i| of_contacts(&linear.coordinates[i]));
    order.sort_by_key(|&i| (linear.coordinates[i].0 != tip, linear.coordinates[i].1));
    let mut stiffness = DMatrix::<f64>::zeros(linear.coordinates.len(), linear.coordinates.len());
    linear
        .stiffness
        .iter()
        .for_each(|&(row, column, value)| stiffness[(row as usize, column as usize)] += value);
    assert!((&stiffness - stiffness.transpose()).amax() < 1e-12 * stiffness.amax());
    let part = |rows: &[usize], columns: &[usize]| stiffness.select_rows(rows).select_columns(columns);
    let inner = part(&others, &others).cholesky().expect("it is clamped");
    let condensed = part(&order, &order) - part(&order, &others) * inner.solve(&part(&others, &order));
    let product: DMatrix<f64> = condensed * &compliance;
    assert!((product - DMatrix::identity(6, 6)).amax() < 1e-9);
    // A point inside of a tetrahedron moves as the mean of its corners.
    let between = MaterialPoint { nodes: [tip, side, tip, side], weights: [0.2, 0.3, 0.1, 0.4] };
    let joint = body.compliance(&[between, at_node(tip)]).unwrap();
    let expected = compliance.view((0, 0), (3, 3)) * 0.3 + compliance.view((3, 0), (3, 3)) * 0.7;
    assert!((joint.view((0, 3), (3, 3)) - expected).amax() < 1e-12 * compliance.amax());
}

#[test]
fn small_deflections_are_force_times_compliance() {
    let scene = clamped([4, 2, 2], 0.02);
    let mut body = body_of(&scene);
    let tip = node_at(&body, DVec3::new(0.08, 0.04, 0.04));
    let force = DVec3::new(1.0, -2.0, 0.5) * 1e-7;
    let compliance = body.compliance(&[at_node(tip)]).unwrap();
    body.settle(&[push(tip, force)]).unwrap();
    let moved = body.state().positions_m[tip as usize] - body.rest_m()[tip as usize];
    let expected = compliance * nalgebra::Vector3::new(force.x, force.y, force.z);
    assert!(moved.distance(DVec3::new(expected[0], expected[1], expected[2])) < 1e-5 * moved.length());
}

#[test]
fn an_equilibrium_stays_and_balances() {
    let mut scene = clamped([5, 2, 2], 0.02);
    scene = scene.edit_unchecked(|scene| scene.gravity_m_per_s2 = DVec3::new(0.0, 0.0, -9.81));
    let mut body = body_of(&scene);
    let tip = node_at(&body, DVec3::new(0.1, 0.04, 0.04));
    let forces = [push(tip, DVec3::new(-0.1, 0.3, 0.1))];
    body.settle(&forces).unwrap();
    let (settled, energy) = (body.state().clone(), body.energy());
    assert!(energy.elastic_j > 1e-3 && energy.kinetic_j == 0.0 && energy.potential_j < 0.0, "{energy:?}");
    for _ in 0..20 {
        body.step(&forces);
    }
    for (after, before) in body.state().positions_m.iter().zip(&settled.positions_m) {
        assert!(after.distance(*before) < 1e-10);
    }
    // The same shape with nothing fixed: its forces are the loads and the clamp's reactions, which balance.
    scene = scene.edit_unchecked(|scene| scene.soft.fixed.clear());
    let mut loose = body_of(&scene);
    loose.set_state(body.state());
    let inner = inner_forces(&loose);
    let most = inner.iter().map(|force| force.length()).fold(0.0, f64::max);
    let sum: DVec3 = inner.iter().sum();
    let moment: DVec3 =
        inner.iter().zip(&settled.positions_m).map(|(force, place)| place.cross(*force)).sum();
    assert!(sum.length() < 1e-6 * most && moment.length() < 1e-7 * most, "{sum} N, {moment} N m");
    let at_tip = inner[tip as usize] + forces[0].force_n;
    assert!(at_tip.length() < 0.02, "at the tip only its weight is left, not {at_tip} N");
}

#[test]
fn motion_is_not_made_from_nothing() {
    let scene = scene(SoftModel::Corotational, block([3, 2, 2], 0.02))
        .edit_unchecked(|scene| (scene.soft.mass_damping_per_s, scene.soft.stiffness_damping_s) = (0.0, 0.0));
    let mut body = body_of(&scene);
    let mut state = placed(&body, |node| DVec3::new(node.x * 1.3, node.y * 0.8, node.z));
    state
        .velocities_m_per_s
        .iter_mut()
        .enumerate()
        .for_each(|(i, v)| *v = DVec3::new(0.1, (i % 3) as f64, -0.2));
    body.set_state(&state);
    let masses = body.linear().unwrap();
    let momentum = |body: &Corotational| -> DVec3 {
        let of = |(i, &(node, axis)): (usize, &(u32, u8))| {
            DVec3::AXES[axis as usize] * masses.mass_kg[i] * body.state().velocities_m_per_s[node as usize]
        };
        masses.coordinates.iter().enumerate().map(of).sum()
    };
    let before = momentum(&body);
    let mut energy = body.energy().total_j();
    for _ in 0..200 {
        body.step(&[]);
        let now = body.energy().total_j();
        assert!(now <= energy * (1.0 + 1e-11), "{now} J after {energy} J");
        energy = now;
    }
    assert!(momentum(&body).distance(before) < 1e-9 * before.length());
}

/// Random pulls, strong enough to turn elements inside out: energy grows by no more than the work that they do.
#[test]
fn energy_grows_by_work_only() {
    for (newton_steps, damping) in [(1, 0.0), (1, 0.01), (3, 0.01)] {
        let scene = clamped([3, 1, 1], 0.03).edit_unchecked(|scene| {
            (scene.soft.newton_steps, scene.soft.stiffness_damping_s) = (newton_steps, damping);
            scene.gravity_m_per_s2 = DVec3::new(0.0, 0.0, -9.81);
        });
        let mut body = body_of(&scene);
        let mut number = numbers(3);
        for period in 0..300 {
            let node = ((number() + 0.5) * body.rest_m().len() as f64) as u32;
            let strength = if period % 50 < 25 { 40.0 } else { 0.0 };
            let force = strength * DVec3::new(number(), number(), number());
            let (before, from) = (body.energy().total_j(), body.state().positions_m[node as usize]);
            body.step(&[push(node, force)]);
            let after = body.energy().total_j();
            let work = force.dot(body.state().positions_m[node as usize] - from);
            let rounding = 1e-10 * (before.abs() + after.abs() + work.abs());
            assert!(after <= before + work + rounding, "{after} J after {before} J and work of {work} J");
        }
    }
}

#[test]
fn what_is_torn_twisted_flattened_or_turned_inside_out_recovers() {
    let scene = clamped([4, 2, 2], 0.02);
    let rest = body_of(&scene);
    let length = 0.08;
    let mut number = numbers(11);
    let mut scatter = || length * DVec3::new(number(), number(), number());
    let scattered: Vec<DVec3> = rest.rest_m().iter().map(|_| scatter()).collect();
    let mut torn = placed(&rest, |node| node);
    torn.positions_m[node_at(&rest, DVec3::new(0.08, 0.04, 0.0)) as usize] +=
        DVec3::new(10.0, 3.0, -2.0) * length;
    let twisted = placed(&rest, |node| DMat3::from_rotation_x(30.0 * node.x) * node);
    let flattened = placed(&rest, |node| node * DVec3::new(1.0, 1.0, 0.0));
    let collapsed = placed(&rest, |_| DVec3::ZERO);
    let inverted = placed(&rest, |node| node * DVec3::new(-1.0, 1.0, 1.0));
    let wild = SoftState { positions_m: scattered, ..torn.clone() };
    for (name, state) in [
        ("torn", torn),
        ("twisted", twisted),
        ("flattened", flattened),
        ("collapsed", collapsed),
        ("inverted", inverted),
        ("wild", wild),
    ] {
        let mut body = rest.clone();
        body.set_state(&state);
        let mut energy = body.energy().total_j();
        for _ in 0..900 {
            body.step(&[]);
            let now = body.energy().total_j();
            assert!(now <= energy * (1.0 + 1e-10) + 1e-20, "{name}: {now} J after {energy} J");
            energy = now;
        }
        let places = body.state().positions_m.iter().zip(body.rest_m());
        let far = places.map(|(place, rest)| place.distance(*rest)).fold(0.0, f64::max);
        assert!(far < 1e-4 * length, "{name}: {far} m from rest, {energy} J");
    }
}

#[test]
fn a_hand_that_pulls_without_end_does_not_blow_it_up() {
    let scene = clamped([4, 2, 2], 0.02);
    let mut body = body_of(&scene);
    let tip = node_at(&body, DVec3::new(0.08, 0.04, 0.04));
    for period in 0..240 {
        let around = f64::from(period) * 0.3;
        let force = 1000.0 * DVec3::new(around.cos(), around.sin(), (0.37 * around).sin());
        body.step(&[push(tip, force)]);
        let state = body.state();
        assert!(state.positions_m.iter().chain(&state.velocities_m_per_s).all(|value| value.is_finite()));
    }
    body.step(&[push(tip, DVec3::new(f64::NAN, 0.0, f64::INFINITY)), push(tip, DVec3::splat(1e200))]);
    assert!(body.state().positions_m.iter().all(|value| value.is_finite()));
    for _ in 0..1200 {
        body.step(&[]);
    }
    let places = body.state().positions_m.iter().zip(body.rest_m());
    assert!(places.map(|(place, rest)| place.distance(*rest)).fold(0.0, f64::max) < 1e-5);
}

#[test]
fn a_step_is_what_its_linearisation_says() {
    for (quasi_static, newton_steps) in [(false, 1), (false, 3), (true, 1)] {
        let scene = clamped([2, 1, 1], 0.03).edit_unchecked(|scene| {
            (scene.soft.quasi_static, scene.soft.newton_steps) = (quasi_static, newton_steps)
        });
        let mut body = body_of(&scene);
        let tip = node_at(&body, DVec3::new(0.06, 0.0, 0.03));
        for forces in [vec![], vec![push(tip, DVec3::new(-1.5, 0.2, -0.6))]] {
            body.settle(&forces).unwrap();
            let linear = body.linear().unwrap();
            let expected = exact_step(&linear);
            let found = central_differences(&body, &forces, 1e-6);
            let error = (&found - &expected).amax();
            // Without inertia nothing depends on the state before: the matrix is zero.
            let size = if quasi_static { 1e-3 } else { expected.amax() };
            assert!(error < 1e-6 * size, "error {error} beside {size}, quasi-static {quasi_static}");
        }
    }
}

#[test]
fn without_inertia_a_period_ends_in_the_equilibrium() {
    let scene = clamped([3, 2, 2], 0.02).edit_unchecked(|scene| scene.soft.quasi_static = true);
    let mut body = body_of(&scene);
    let mut settled = body.clone();
    let tip = node_at(&body, DVec3::new(0.06, 0.04, 0.04));
    let forces = [push(tip, DVec3::new(0.1, -0.2, 0.3))];
    body.step(&forces);
    settled.settle(&forces).unwrap();
    for (one, other) in body.state().positions_m.iter().zip(&settled.state().positions_m) {
        assert!(one.distance(*other) < 1e-12);
    }
}

#[test]
fn what_cannot_be_simulated_is_said() {
    let mut turned = block([1, 1, 1], 0.02);
    turned.tetrahedra[3].swap(0, 1);
    let error = Corotational::from_scene(&scene(SoftModel::Corotational, turned)).unwrap_err();
    assert_eq!(error.to_string(), "tetrahedron 4 has no positive volume");
}

/// Larger bodies are solved with an older factor: they go the way that they go with a fresh one, and forget as asked.
#[test]
fn an_older_factor_changes_nothing() {
    let scene =
        clamped([8, 4, 4], 0.01).edit_unchecked(|scene| scene.gravity_m_per_s2 = DVec3::new(0.0, 0.0, -9.81));
    let mut body = body_of(&scene);
    let tip = node_at(&body, DVec3::new(0.08, 0.04, 0.04));
    let mut speed: f64 = 0.0;
    for period in 0..60 {
        let forces = [push(tip, DVec3::new(0.0, 0.2 * (f64::from(period) * 0.4).sin(), 0.0))];
        let mut fresh = body.clone();
        fresh.set_state(body.state());
        body.step(&forces);
        fresh.step(&forces);
        let velocities = body.state().velocities_m_per_s.iter().zip(&fresh.state().velocities_m_per_s);
        let difference = velocities.map(|(one, other)| one.distance(*other)).fold(0.0, f64::max);
        speed = body.state().velocities_m_per_s.iter().map(|v| v.length()).fold(speed, f64::max);
        // Six digits, in the measure of the matrix.
        assert!(difference < 1e-5 * speed, "{difference} m/s of {speed} m/s in period {period}");
    }
    let (factorisations, solutions) = body.solver_counts();
    assert!(factorisations < 30 && solutions > 120, "{factorisations} factorisations, {solutions} solutions");
    let mut one = body.clone();
    let mut other = body_of(&scene);
    for changed in [&mut one, &mut other] {
        changed.set_state(body.state());
        (0..3).for_each(|_| changed.step(&[]));
    }
    assert_eq!(one.state(), other.state());
}
