//! Small scenes with soft bodies, and a step's matrix by its linearisation and by central differences.

use std::sync::Arc;

use cotouch_scene::scene::{FixedRegion, Scene, SoftModel};
use cotouch_scene::soft_mesh::SoftMesh;
use cotouch_soft::{LinearBody, MaterialPoint, PointForce, SoftBody, SoftState};
use cotouch_testkit::Random;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// A scene with this soft object: 60 Hz, a little damping, nothing fixed, no gravity.
pub(crate) fn scene(model: SoftModel, mesh: SoftMesh) -> Scene {
    cotouch_scene::load("single-axis", &[]).expect("it is built in").edit_unchecked(|scene| {
        scene.rates.simulation_hz = "60".parse().expect("a rate");
        scene.gravity_m_per_s2 = DVec3::ZERO;
        let soft = &mut scene.soft;
        soft.model = model;
        soft.young_pa = 20e3;
        soft.poisson_ratio = 0.25;
        soft.density_kg_per_m3 = 1000.0;
        soft.mass_damping_per_s = 0.3;
        soft.stiffness_damping_s = 0.01;
        soft.newton_steps = 1;
        soft.quasi_static = false;
        soft.skin_thickness_m = 1e-3;
        soft.skin_stretch = 1.3;
        soft.fixed = Vec::new();
        soft.nodes = Some(Arc::new(mesh));
    })
}

/// Fixes all nodes in a box.
pub(crate) fn fix(scene: &mut Scene, from: [f64; 3], to: [f64; 3]) {
    *scene = scene.edit_unchecked(|scene| {
        scene.soft.fixed.push(FixedRegion { from_m: DVec3::from(from), to_m: DVec3::from(to) })
    });
}

/// The paper's spring: an equilateral triangle of 20 mm sides across the x axis.
pub(crate) fn spring_scene(stiffness_n_per_m: f64, quasi_static: bool) -> Scene {
    let radius = 0.02 / 3.0_f64.sqrt();
    let corner = |turn: f64| {
        let angle = std::f64::consts::TAU * turn / 3.0;
        DVec3::new(0.0, radius * angle.cos(), -radius * angle.sin())
    };
    let nodes_m = vec![corner(0.0), corner(1.0), corner(2.0)];
    let mesh =
        SoftMesh { nodes_m, tetrahedra: vec![], triangles: vec![[0, 1, 2]], tied_n_per_m: stiffness_n_per_m };
    scene(SoftModel::MassSpring, mesh).edit_unchecked(|scene| scene.soft.quasi_static = quasi_static)
}

/// Cubes of `edge` m, each cut into six tetrahedra around a diagonal; one corner at the origin.
pub(crate) fn block(cells: [u32; 3], edge: f64) -> SoftMesh {
    let [nx, ny, nz] = cells;
    let index = |[x, y, z]: [u32; 3]| (z * (ny + 1) + y) * (nx + 1) + x;
    let places = (0..=nz).flat_map(|z| (0..=ny).flat_map(move |y| (0..=nx).map(move |x| [x, y, z])));
    let nodes_m = places.map(|place| edge * DVec3::from(place.map(f64::from))).collect();
    let mut tetrahedra = Vec::new();
    for (x, y, z) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (x, y, z)))) {
        for (order, turned) in [([0, 1, 2], false), ([1, 2, 0], false), ([2, 0, 1], false)]
            .into_iter()
            .chain([([0, 2, 1], true), ([2, 1, 0], true), ([1, 0, 2], true)])
        {
            let mut corner = [x, y, z];
            let mut path = [index(corner); 4];
            for (step, axis) in order.into_iter().enumerate() {
                corner[axis] += 1;
                path[step + 1] = index(corner);
            }
            if turned {
                path.swap(2, 3);
            }
            tetrahedra.push(path);
        }
    }
    let triangles = surface(&tetrahedra);
    SoftMesh { nodes_m, tetrahedra, triangles, tied_n_per_m: 0.0 }
}

/// The faces that only one tetrahedron has, seen from outside.
fn surface(tetrahedra: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let mut faces = std::collections::BTreeMap::new();
    for &[a, b, c, d] in tetrahedra {
        for face in [[a, c, b], [a, b, d], [a, d, c], [b, c, d]] {
            let mut key = face;
            key.sort_unstable();
            faces.entry(key).and_modify(|known| *known = None).or_insert(Some(face));
        }
    }
    faces.into_values().flatten().collect()
}

/// An icosphere around the origin, every edge halved `halvings` times.
pub(crate) fn sphere(radius: f64, halvings: u32) -> SoftMesh {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut nodes: Vec<DVec3> = [-1.0, 1.0]
        .into_iter()
        .flat_map(|a| {
            [-golden, golden].map(|b| [DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)])
        })
        .flatten()
        .map(|place| radius * place.normalize())
        .collect();
    let mut triangles = hull(&nodes);
    for _ in 0..halvings {
        let mut middles = std::collections::BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                nodes.push(radius * (nodes[a as usize] + nodes[b as usize]).normalize());
                nodes.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]: &[u32; 3]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    SoftMesh { nodes_m: nodes, tetrahedra: vec![], triangles, tied_n_per_m: 0.0 }
}

/// The 20 faces of an icosahedron: triples whose three distances are the least.
fn hull(nodes: &[DVec3]) -> Vec<[u32; 3]> {
    let count = nodes.len() as u32;
    let distance = |a: u32, b: u32| nodes[a as usize].distance(nodes[b as usize]);
    let least = (1..count).map(|other| distance(0, other)).fold(f64::MAX, f64::min);
    let near = |a, b| distance(a, b) < 1.01 * least;
    let mut faces = Vec::new();
    for a in 0..count {
        for b in (a + 1..count).filter(|&b| near(a, b)) {
            for c in (b + 1..count).filter(|&c| near(a, c) && near(b, c)) {
                let [p, q, r] = [a, b, c].map(|node| nodes[node as usize]);
                faces.push(if (q - p).cross(r - p).dot(p) > 0.0 { [a, b, c] } else { [a, c, b] });
            }
        }
    }
    faces
}

/// The step's matrix, of (q, v) to (q⁺, v⁺), as [`LinearBody`] defines it.
pub(crate) fn exact_step(body: &LinearBody) -> DMatrix<f64> {
    let n = body.mass_kg.len();
    let h = body.period_s;
    let filled = |entries: &[(u32, u32, f64)]| {
        let mut matrix = DMatrix::zeros(n, n);
        entries.iter().for_each(|&(row, column, value)| matrix[(row as usize, column as usize)] += value);
        matrix
    };
    let stiffness = filled(&body.stiffness);
    let of_step = body.step_stiffness.as_deref().map_or_else(|| stiffness.clone(), filled);
    let mass = DMatrix::from_diagonal(&DVector::from_column_slice(&body.mass_kg));
    let rows = n + usize::from(body.volume_gradient.is_some());
    let (mut system, mut right) = (DMatrix::zeros(rows, rows), DMatrix::zeros(rows, 2 * n));
    if !body.quasi_static {
        let implicit =
            &mass * (1.0 + h * body.mass_damping_per_s) + of_step * (h * body.stiffness_damping_s + h * h);
        system.view_mut((0, 0), (n, n)).copy_from(&implicit);
        right.view_mut((0, 0), (n, n)).copy_from(&(stiffness * -h));
        right.view_mut((0, n), (n, n)).copy_from(&mass);
    } else {
        system.view_mut((0, 0), (n, n)).copy_from(&stiffness);
    }
    if let Some(gradient) = &body.volume_gradient {
        for (at, &part) in gradient.iter().enumerate() {
            system[(n, at)] = part;
            system[(at, n)] = part;
            if !body.quasi_static {
                right[(n, at)] = -part / h;
            }
        }
    }
    let solution = system.full_piv_lu().solve(&right).expect("a step has a result");
    let mut step = DMatrix::zeros(2 * n, 2 * n);
    if !body.quasi_static {
        let velocity = solution.rows(0, n).into_owned();
        step.view_mut((n, 0), (n, 2 * n)).copy_from(&velocity);
        let mut position = solution.rows(0, n) * h;
        (0..n).for_each(|at| position[(at, at)] += 1.0);
        step.view_mut((0, 0), (n, 2 * n)).copy_from(&position);
    }
    step
}

/// The same by stepping the body itself, from its present state.
pub(crate) fn central_differences(body: &dyn SoftBody, forces: &[PointForce], step_m: f64) -> DMatrix<f64> {
    let linear = body.linear().expect("it has a linearisation");
    let n = linear.coordinates.len();
    let period = body.period_s();
    let mut matrix = DMatrix::zeros(2 * n, 2 * n);
    let after = |column: usize, sign: f64| {
        let mut perturbed: SoftState = body.state().clone();
        let (node, axis) = linear.coordinates[column % n];
        let (field, step) = match column < n {
            true => (&mut perturbed.positions_m, step_m),
            false => (&mut perturbed.velocities_m_per_s, step_m / period),
        };
        field[node as usize][axis as usize] += sign * step;
        let mut copy = body.boxed_clone();
        copy.set_state(&perturbed);
        copy.step(forces);
        copy.state().clone()
    };
    for column in 0..2 * n {
        let (up, down) = (after(column, 1.0), after(column, -1.0));
        let width = 2.0 * if column < n { step_m } else { step_m / period };
        for (row, &(node, axis)) in linear.coordinates.iter().enumerate() {
            let of = |field: fn(&SoftState) -> &Vec<DVec3>| {
                (field(&up)[node as usize][axis as usize] - field(&down)[node as usize][axis as usize])
                    / width
            };
            matrix[(row, column)] = of(|state| &state.positions_m);
            matrix[(n + row, column)] = of(|state| &state.velocities_m_per_s);
        }
    }
    matrix
}

/// A node as a point of the material.
pub(crate) fn at_node(node: usize) -> MaterialPoint {
    MaterialPoint { nodes: [node as u32; 4], weights: [1.0, 0.0, 0.0, 0.0] }
}

/// The state with every node moved and set moving at random, the same for the same seed.
pub(crate) fn shaken(body: &dyn SoftBody, seed: u64, far_m: f64, fast_m_per_s: f64) -> SoftState {
    let mut random = Random::new(seed);
    let mut vector = move || 2.0 * DVec3::from_array([(); 3].map(|()| random.unit())) - 1.0;
    let mut state = body.state().clone();
    state.positions_m.iter_mut().for_each(|position| *position += far_m * vector());
    state.velocities_m_per_s.iter_mut().for_each(|velocity| *velocity = fast_m_per_s * vector());
    state
}

/// The momentum of a body of which nothing is fixed, kg·m/s.
pub(crate) fn momentum(linear: &LinearBody, state: &SoftState) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for (&(node, axis), mass) in linear.coordinates.iter().zip(&linear.mass_kg) {
        sum[axis as usize] += mass * state.velocities_m_per_s[node as usize][axis as usize];
    }
    sum
}
