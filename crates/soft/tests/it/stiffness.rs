//! K_o of contacts that move each other.

use cotouch_soft::{contact_stiffnesses, largest_eigenvalue};
use nalgebra::DMatrix;

/// Symmetric and positive, with one contact much softer than the other, m/N.
fn compliance() -> DMatrix<f64> {
    let scale = |place: usize| if place < 3 { 0.05 } else { 0.004 };
    let root = DMatrix::from_fn(6, 6, |row, column| scale(row) * ((row * 7 + column * 5 + 1) as f64).sin());
    &root * root.transpose() + DMatrix::identity(6, 6) * 1e-5
}

#[test]
fn alone_it_is_the_stiffness_in_the_softest_direction() {
    let alone = DMatrix::from_diagonal(&[0.002, 0.01, 0.005].to_vec().into());
    let found = contact_stiffnesses(&alone).unwrap();
    assert!(found.len() == 1 && (found[0] - 100.0).abs() < 1e-10);
}

#[test]
fn springs_of_these_stiffnesses_answer_no_move_with_more_than_itself() {
    let compliance = compliance();
    let found = contact_stiffnesses(&compliance).unwrap();
    let root = DMatrix::from_fn(6, 6, |row, column| {
        compliance[(row, column)] * (found[row / 3] * found[column / 3]).sqrt()
    });
    assert!((largest_eigenvalue(&root) - 1.0).abs() < 1e-12, "the eigenvalues of K·W end at 1");
    assert!(found[1] > 10.0 * found[0], "a stiff place stays stiff: {found:?}");
}

#[test]
fn what_does_not_give_way_has_none() {
    assert_eq!(contact_stiffnesses(&DMatrix::zeros(0, 0)), Some(Vec::new()));
    let mut wrong = compliance();
    wrong.view_mut((3, 3), (3, 3)).fill(0.0);
    assert_eq!(contact_stiffnesses(&wrong), None);
    wrong[(0, 1)] = f64::NAN;
    assert_eq!(contact_stiffnesses(&wrong), None);
}
