//! The sparse factor against dense linear algebra.

use std::sync::Arc;

use cotouch_soft::factor::{BlockMatrix, Factor, NotPositive, Symbolic};
use cotouch_testkit::Random;
use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

/// A box of nodes joined to their neighbours, diagonal ones included, every seventh one fixed.
fn grid(cells: [usize; 3]) -> (Vec<DVec3>, Vec<bool>, Vec<[u32; 2]>) {
    let [nx, ny, nz] = cells;
    let index = |x: usize, y: usize, z: usize| ((x * ny + y) * nz + z) as u32;
    let (mut places, mut edges) = (Vec::new(), Vec::new());
    for (x, y, z) in (0..nx).flat_map(|x| (0..ny).flat_map(move |y| (0..nz).map(move |z| (x, y, z)))) {
        places.push(DVec3::new(x as f64, y as f64, z as f64));
        for (dx, dy, dz) in [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1), (1, 1, 1)] {
            let (to_x, to_y, to_z) = (x + dx, y + dy, z + dz);
            if to_x < nx && to_y < ny && to_z < nz {
                edges.push([index(to_x, to_y, to_z), index(x, y, z)]);
            }
        }
    }
    let fixed = (0..places.len()).map(|node| node % 7 == 3).collect();
    (places, fixed, edges)
}

/// Springs of random strength and direction along the edges, tied a little to the ground.
fn springs(
    symbolic: &Arc<Symbolic>,
    edges: &[[u32; 2]],
    numbers: &mut impl Iterator<Item = f64>,
) -> BlockMatrix {
    let mut matrix = BlockMatrix::new(symbolic.clone());
    for &[a, b] in edges {
        let mut number = || numbers.next().expect("numbers do not end");
        let along = DVec3::new(number(), number(), number());
        let block = DMat3::from_cols(along.x * along, along.y * along, along.z * along);
        for (row, column, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0)] {
            if let Some(slot) = symbolic.slot(row, column) {
                matrix.add(slot, sign * block);
            }
        }
    }
    for position in 0..symbolic.free_nodes() {
        matrix.add_to_diagonal(position, 0.1);
    }
    matrix
}

fn numbers(seed: u64) -> impl Iterator<Item = f64> {
    let mut random = Random::new(seed | 1);
    std::iter::repeat_with(move || random.unit() - 0.5)
}

fn dense(matrix: &BlockMatrix) -> DMatrix<f64> {
    let size = matrix.symbolic().coordinates();
    let mut dense = DMatrix::zeros(size, size);
    for (row, column, value) in matrix.entries() {
        dense[(row as usize, column as usize)] += value;
    }
    dense
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn solutions_are_those_of_dense_cholesky(cells in prop::array::uniform3(1_usize..6), seed: u64) {
        let (places, fixed, edges) = grid(cells);
        let symbolic = Arc::new(Symbolic::new(&places, &fixed, &edges));
        let mut numbers = numbers(seed);
        let mut factor = Factor::new(symbolic.clone());
        for _ in 0..2 {
            let matrix = springs(&symbolic, &edges, &mut numbers);
            let whole = dense(&matrix);
            prop_assert_eq!(&whole, &whole.transpose());
            factor.refactor(&matrix).unwrap();
            let right = DMatrix::from_iterator(whole.nrows(), 2, numbers.by_ref().take(2 * whole.nrows()));
            let expected = whole.clone().cholesky().unwrap().solve(&right);
            let mut solved = right.clone();
            factor.clone().solve_columns_in_place(&mut solved);
            prop_assert!((&solved - &expected).amax() <= 1e-10 * (1.0 + expected.amax()));
            let mut product = DVector::zeros(whole.nrows());
            matrix.multiply(solved.column(1).as_slice(), product.as_mut_slice());
            prop_assert!((product - right.column(1)).amax() <= 1e-11 * (1.0 + expected.amax()));
            let mut one = right.column(0).into_owned();
            factor.solve_in_place(one.as_mut_slice());
            prop_assert!((one - solved.column(0)).amax() <= 1e-12 * (1.0 + expected.amax()));
        }
    }
}

#[test]
fn the_order_keeps_the_factor_small() {
    let (places, fixed, edges) = grid([12, 12, 12]);
    let factor = Factor::new(Arc::new(Symbolic::new(&places, &fixed, &edges)));
    // Node by node, the factor is a band: one layer, one row and a node wide.
    let free_part = factor.symbolic().free_nodes() as f64 / places.len() as f64;
    let band = factor.symbolic().coordinates() as f64 * 3.0 * 157.0 * free_part;
    assert!((factor.entries() as f64) < 0.6 * band, "{} entries, {band} in a band", factor.entries());
}

#[test]
fn a_matrix_that_is_not_positive_has_no_factor() {
    let (places, fixed, edges) = grid([3, 3, 3]);
    let symbolic = Arc::new(Symbolic::new(&places, &fixed, &edges));
    let mut matrix = springs(&symbolic, &edges, &mut numbers(5));
    let mut factor = Factor::new(symbolic);
    matrix.add_to_diagonal(4, -100.0);
    assert_eq!(factor.refactor(&matrix), Err(NotPositive));
    matrix.add_to_diagonal(4, f64::NAN);
    assert_eq!(factor.refactor(&matrix), Err(NotPositive));
    matrix.clear();
    (0..matrix.symbolic().free_nodes()).for_each(|position| matrix.add_to_diagonal(position, 2.0));
    assert_eq!(factor.refactor(&matrix), Ok(()));
    let mut vector = vec![1.0; matrix.symbolic().coordinates()];
    factor.solve_in_place(&mut vector);
    assert!(vector.iter().all(|value| (value - 0.5).abs() < 1e-15));
}

#[test]
fn fixed_nodes_are_left_out() {
    let (places, fixed, edges) = grid([3, 2, 2]);
    let symbolic = Symbolic::new(&places, &fixed, &edges);
    assert_eq!(symbolic.position(3), None);
    assert_eq!(symbolic.slot(3, 2), None);
    let mut moved = places.clone();
    let doubled: Vec<f64> = symbolic.gather(&places).iter().map(|value| 2.0 * value).collect();
    symbolic.scatter(&doubled, &mut moved);
    for node in 0..places.len() {
        assert_eq!(moved[node], if fixed[node] { places[node] } else { 2.0 * places[node] });
    }
}
