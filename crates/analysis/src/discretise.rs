//! One tick of a body: `x⁺ = A_D·x + B_D·f` (thesis (3.14)).

use cotouch_scene::scene::Integrator;
use nalgebra::{DMatrix, DVector};

use crate::loop_spec::{Dynamics, Plant};

/// A body's exact step over one tick.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Step {
    /// A_D, n × n.
    pub(crate) a: DMatrix<f64>,
    /// B_D, n.
    pub(crate) b: DVector<f64>,
    /// Position and velocity in the states, 2 × n.
    pub(crate) c: DMatrix<f64>,
}

impl Step {
    pub(crate) fn new(dynamics: &Dynamics, period_s: f64) -> Self {
        match dynamics {
            Dynamics::Plant(plant) => zero_order_hold(plant, period_s),
            &Dynamics::Mass { mass_kg, integrator } => mass(mass_kg, integrator, period_s),
        }
    }
}

/// (3.15), by the exponential of the plant augmented with its held input: `exp([A B; 0 0]·T) = [A_D B_D; 0 I]`.
fn zero_order_hold(plant: &Plant, period_s: f64) -> Step {
    let size = plant.b.len();
    let mut augmented = DMatrix::zeros(size + 1, size + 1);
    augmented.view_mut((0, 0), (size, size)).copy_from(&(&plant.a * period_s));
    augmented.view_mut((0, size), (size, 1)).copy_from(&(&plant.b * period_s));
    let exponential = augmented.exp();
    Step {
        a: exponential.view((0, 0), (size, size)).into_owned(),
        b: exponential.view((0, size), (size, 1)).column(0).into_owned(),
        c: plant.c.clone(),
    }
}

fn mass(mass_kg: f64, integrator: Integrator, period_s: f64) -> Step {
    let speed = period_s / mass_kg;
    let travel = match integrator {
        Integrator::ExactHold => 0.5 * period_s * speed,
        Integrator::SemiImplicitEuler => period_s * speed,
    };
    Step {
        a: DMatrix::from_row_slice(2, 2, &[1.0, period_s, 0.0, 1.0]),
        b: DVector::from_column_slice(&[travel, speed]),
        c: DMatrix::identity(2, 2),
    }
}
