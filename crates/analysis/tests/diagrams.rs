//! Diagrams written by hand, against closed forms; and what is refused.

use cotouch_analysis::diagram::{
    Block, BlockId, Clock, Diagram, DiagramError, Element, Law, Linear, Plant, Route, Sampled, Time,
    hand_on_local_model, hand_on_weighted_local_model,
};
use cotouch_analysis::eigenvalues::{eigenvalues, spectral_radius};
use cotouch_analysis::local_model::{ReturnedForce, SurfaceHold};
use cotouch_analysis::loop_spec::Estimate;
use cotouch_scene::scene::SpringDamper;
use cotouch_scene::time::Rate;
use nalgebra::{Complex, DMatrix, dmatrix};

const ROUTES: [Route; 3] = [Route::Stepping, Route::StateSpace, Route::Resampling];

fn time(text: &str) -> Time {
    text.parse().unwrap()
}

fn rate(text: &str) -> Rate {
    text.parse().unwrap()
}

/// Roots of z² + p·z + q.
fn roots(p: f64, q: f64) -> [Complex<f64>; 2] {
    let root = Complex::new(p * p / 4.0 - q, 0.0).sqrt();
    [root - p / 2.0, -root - p / 2.0]
}

/// Each of the wanted values is an eigenvalue.
fn assert_has(matrix: &DMatrix<f64>, wanted: &[Complex<f64>], tolerance: f64) {
    let mut left = eigenvalues(matrix).unwrap();
    for value in wanted {
        let distance = |other: &Complex<f64>| (other - value).norm();
        let nearest =
            (0..left.len()).min_by(|&a, &b| distance(&left[a]).total_cmp(&distance(&left[b]))).unwrap();
        assert!(distance(&left[nearest]) < tolerance, "{value} is not among {left:?}");
        left.swap_remove(nearest);
    }
}

#[test]
fn a_hand_held_still_leaves_the_simulation_loop_of_the_paper() {
    let still = [1e12, 0.0, 0.0];
    let (kh, int, ko) = (0.5, 0.3, 1.0);
    for ratio in [1, 2, 5, 50] {
        let n = f64::from(ratio);
        let cases = [
            (ReturnedForce::First, 0.0),
            (ReturnedForce::Mean, (n - 1.0) / (2.0 * n)),
            (ReturnedForce::Last, (n - 1.0) / n),
        ];
        for (returned, share) in cases {
            let (h, i) = ((kh + share * int) / ko, int / ko);
            let diagram =
                hand_on_local_model(still, kh, int, ko, ratio, rate("1000"), returned, SurfaceHold::Zero);
            for route in ROUTES {
                let map = diagram.lift(route).unwrap();
                assert_eq!(map.states, ["hand.x", "hand.v", "local_model.x1", "returned_force.x1"]);
                assert!((map.period_s - 1e-3 * n).abs() < 1e-15);
                assert_has(&map.matrix, &roots(h - 1.0, i - h), 1e-9);
            }
        }
    }
}
