//! The body as a few contacts see it.

use crate::common::{block, exact_step, fix, scene};
use cotouch_scene::scene::SoftModel;
use cotouch_soft::{Corotational, LinearBody, MaterialPoint, ReducedBody, SoftBody};
use nalgebra::{DMatrix, DVector};

fn beam(quasi_static: bool) -> LinearBody {
    let mut scene = scene(SoftModel::Corotational, block([3, 2, 1], 0.02));
    fix(&mut scene, [-1.0; 3], [1e-9, 1.0, 1.0]);
    scene = scene.edit_unchecked(|scene| scene.soft.quasi_static = quasi_static);
    Corotational::from_scene(&scene).expect("a good scene").linear().expect("it has one")
}

/// Two points, one of them a mean of nodes of which some are fixed.
fn points(body: &LinearBody) -> [MaterialPoint; 2] {
    let last = body.coordinates.iter().map(|(node, _)| *node).max().expect("it has nodes");
    let mixed = MaterialPoint { nodes: [last - 1, 0, last, last - 3], weights: [0.5, 0.1, 0.3, 0.1] };
    [MaterialPoint::on_triangle([last, last - 1, last - 2], [1.0, 0.0, 0.0]), mixed]
}

fn contact_weights(body: &LinearBody, points: &[MaterialPoint]) -> DMatrix<f64> {
    DMatrix::from_fn(3 * points.len(), body.coordinates.len(), |row, column| {
        let (node, axis) = body.coordinates[column];
        let (point, of_axis) = (&points[row / 3], row % 3 == usize::from(axis));
        let weights = point.nodes.iter().zip(point.weights).filter(|(of, _)| of_axis && **of == node);
        weights.map(|(_, weight)| weight).sum()
    })
}

/// How the contacts move in the periods after a push of one period, row by row.
fn response(body: &LinearBody, points: &[MaterialPoint], periods: usize) -> Vec<DVector<f64>> {
    let n = body.coordinates.len();
    let weights = contact_weights(body, points);
    let push = DVector::from_fn(3 * points.len(), |row, _| [1.0, -0.4, 0.2, 0.0, 0.7, -1.1][row]);
    let step = exact_step(body);
    // A force acts as a change of momentum h·f at the beginning of the period.
    let mut state = DVector::zeros(2 * n);
    let impulse = weights.transpose() * push * body.period_s;
    (0..n).for_each(|i| state[n + i] = impulse[i] / body.mass_kg[i]);
    let mut moved = Vec::new();
    for _ in 0..periods {
        state = &step * state;
        moved.push(&weights * state.rows(0, n));
    }
    moved
}

fn as_linear(body: &ReducedBody) -> LinearBody {
    let size = body.stiffness.nrows();
    let entries = (0..size).flat_map(|row| (0..size).map(move |column| (row, column)));
    LinearBody {
        period_s: body.period_s,
        quasi_static: body.quasi_static,
        coordinates: (0..size as u32).map(|i| (i, 0)).collect(),
        mass_kg: vec![1.0; size],
        mass_damping_per_s: body.mass_damping_per_s,
        stiffness_damping_s: body.stiffness_damping_s,
        stiffness: entries.map(|(r, c)| (r as u32, c as u32, body.stiffness[(r, c)])).collect(),
        step_stiffness: None,
        volume_gradient: None,
    }
}

fn reduced_response(body: &ReducedBody, periods: usize) -> Vec<DVector<f64>> {
    let step = exact_step(&as_linear(body));
    let size = body.stiffness.nrows();
    let push = DVector::from_column_slice(&[1.0, -0.4, 0.2, 0.0, 0.7, -1.1]);
    let mut state = DVector::zeros(2 * size);
    state.rows_mut(size, size).copy_from(&(body.contacts.transpose() * push * body.period_s));
    let mut moved = Vec::new();
    for _ in 0..periods {
        state = &step * state;
        moved.push(&body.contacts * state.rows(0, size));
    }
    moved
}

fn largest_difference(one: &[DVector<f64>], other: &[DVector<f64>]) -> f64 {
    let size = one.iter().map(DVector::amax).fold(0.0, f64::max);
    one.iter().zip(other).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max) / size
}

#[test]
fn a_few_blocks_are_enough_and_all_are_exact() {
    let free = beam(false);
    let gradient = (0..free.coordinates.len()).map(|i| ((i * 7) % 5) as f64 - 1.7).collect();
    let kept = LinearBody { volume_gradient: Some(gradient), ..free.clone() };
    for body in [free, kept] {
        let points = points(&body);
        let exact = response(&body, &points, 40);
        let errors = [1, 3, 30].map(|blocks| {
            let reduced = body.reduced(&points, blocks);
            assert!(reduced.stiffness.nrows() <= body.coordinates.len().min(6 * blocks));
            largest_difference(&exact, &reduced_response(&reduced, 40))
        });
        assert!(errors[1] < 0.3 * errors[0] && errors[1] < 0.05 && errors[2] < 1e-9, "{errors:?}");
    }
}

#[test]
fn without_inertia_one_block_is_the_compliance() {
    let body = beam(true);
    let points = points(&body);
    let reduced = body.reduced(&points, 4);
    let size = reduced.stiffness.nrows();
    assert!((&reduced.stiffness - DMatrix::identity(size, size)).amax() < 1e-9);
    let mut stiffness = DMatrix::zeros(body.coordinates.len(), body.coordinates.len());
    body.stiffness
        .iter()
        .for_each(|&(row, column, value)| stiffness[(row as usize, column as usize)] += value);
    let weights = contact_weights(&body, &points);
    let expected = &weights * stiffness.cholesky().expect("it is held").solve(&weights.transpose());
    let found = &reduced.contacts * reduced.contacts.transpose();
    assert!((found - &expected).amax() < 1e-9 * expected.amax());
}

#[test]
fn contacts_that_say_the_same_count_once() {
    let body = beam(false);
    let [one, other] = points(&body);
    let twice = body.reduced(&[one, one, other, one], 2);
    assert_eq!(twice.stiffness.nrows(), 12);
    assert_eq!(twice.contacts.rows(0, 3), twice.contacts.rows(3, 3));
}
