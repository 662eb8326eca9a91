//! `cotouch soft`: what its documents say, as the program gives them.

use crate::program::{cotouch, folder, has_keys, json};

#[test]
fn a_joint_compliance_is_symmetric_and_points_may_lie_left_of_the_origin() {
    let words =
        ["soft", "compliance", "soft-block", "--at", "-0,0.05,0.075", "--at", "0.175,0.05,0.075", "--json"];
    let document = json(&cotouch(folder().path(), &words));
    has_keys(&document, &["points", "compliance_m_per_n"]);
    let entry = |row: usize, column: usize| document["compliance_m_per_n"][row][column].as_f64().unwrap();
    for row in 0..6 {
        for column in 0..6 {
            assert!((entry(row, column) - entry(column, row)).abs() < 1e-12, "{row} {column}");
            // The first point is in the face that is held.
            assert!(row >= 3 && column >= 3 || entry(row, column).abs() < 1e-12, "{row} {column}");
        }
    }
    assert!(entry(5, 5) > 1e-4, "the middle gives way: {}", entry(5, 5));
}

#[test]
fn a_block_sags_where_gravity_pulls_and_not_without_it() {
    let sag_m = |settings: &[&str]| {
        let words =
            [&["soft", "deflect", "soft-block", "--at", "0.35,0.05,0.0375", "--json"], settings].concat();
        let document = json(&cotouch(folder().path(), &words));
        has_keys(&document, &["max_displacement_m", "points[].at", "points[].displacement_m"]);
        -document["points"][0]["displacement_m"][2].as_f64().unwrap()
    };
    assert!(sag_m(&[]).abs() < 1e-9);
    assert!(sag_m(&["--set", "gravity_m_per_s2=[0,0,-9.81]"]) > 0.01);
}
