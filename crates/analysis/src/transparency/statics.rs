//! What a user feels at rest: Hooke's and Newton's laws, with everything held equal to what is current.

use nalgebra::{DMatrix, DVector};

use super::alone::Held;
use crate::loop_spec::{Dynamics, LoopSpec, Motion};

/// Force over displacement, N/m; 0 where nothing resists.
pub(super) fn stiffness(held: &Held) -> f64 {
    /// A balance that holds but for rounding.
    const BALANCED: f64 = 1e-9;
    /// Relative to the largest singular value: nothing that resists.
    const NOTHING: f64 = 1e-14;
    let balance = Balance::new(&held.spec);
    let mut force = DVector::zeros(balance.matrix.nrows());
    for &(body, share) in &held.pushed {
        balance.add_force(&held.spec, body.0, share, |row, value| force[row] -= value);
    }
    // Rows of plants are accelerations: all rows are brought to one size.
    let mut matrix = balance.matrix;
    for row in 0..matrix.nrows() {
        let size = matrix.row(row).amax();
        if size > 0.0 {
            matrix.row_mut(row).unscale_mut(size);
            force[row] /= size;
        }
    }
    let decomposition = matrix.clone().svd(true, true);
    let threshold = decomposition.singular_values.max() * NOTHING;
    let Ok(state) = decomposition.solve(&force, threshold) else { return 0.0 };
    if (&matrix * &state - &force).norm() > BALANCED * force.norm() {
        return 0.0;
    }
    let answer = held.answer(0).into_iter();
    let displacement: f64 =
        answer.map(|(body, number, factor)| state[balance.first[body.0] + number] * factor).sum();
    if displacement == 0.0 { 0.0 } else { displacement.recip() }
}

/// The laws of rest: for plants `A·s + B·f = 0`, for masses `f = 0`, in the plants' states and the masses' positions.
struct Balance {
    matrix: DMatrix<f64>,
    /// The first unknown of each body.
    first: Vec<usize>,
}

impl Balance {
    fn new(spec: &LoopSpec) -> Self {
        let mut first = Vec::new();
        let mut size = 0;
        for body in &spec.bodies {
            first.push(size);
            size += match &body.dynamics {
                Dynamics::Plant(plant) | Dynamics::Sensed { plant, .. } => plant.a.nrows(),
                Dynamics::Mass { .. } | Dynamics::Rigid { .. } => body.axes.len(),
            };
        }
        let mut balance = Self { matrix: DMatrix::zeros(size, size), first };
        balance.add_plants(spec);
        balance.add_couplings(spec);
        balance
    }

    fn add_plants(&mut self, spec: &LoopSpec) {
        for (body, &first) in spec.bodies.iter().zip(&self.first) {
            if let Dynamics::Plant(plant) | Dynamics::Sensed { plant, .. } = &body.dynamics {
                let size = plant.a.nrows();
                let mut own = self.matrix.view_mut((first, first), (size, size));
                own += &plant.a;
            }
        }
    }

    fn add_couplings(&mut self, spec: &LoopSpec) {
        let mut matrix = std::mem::take(&mut self.matrix);
        for action in &spec.actions {
            for term in spec.coupling_of(action).into_iter().flat_map(|coupling| &coupling.terms) {
                for (column, factor) in self.motion(spec, term.motion, term.number) {
                    self.add_force(spec, action.body.0, term.gain * factor, |row, value| {
                        matrix[(row, column)] += value;
                    });
                }
            }
        }
        self.matrix = matrix;
    }

    /// A force on a body on a line, in the rows of the body.
    fn add_force(&self, spec: &LoopSpec, body: usize, force: f64, mut add: impl FnMut(usize, f64)) {
        let first = self.first[body];
        match &spec.bodies[body].dynamics {
            Dynamics::Plant(plant) | Dynamics::Sensed { plant, .. } => {
                plant.b.column(0).iter().enumerate().for_each(|(row, b)| add(first + row, b * force));
            }
            Dynamics::Mass { .. } | Dynamics::Rigid { .. } => add(first, force),
        }
    }

    /// A number of a motion, at rest.
    fn motion(&self, spec: &LoopSpec, motion: Motion, number: usize) -> Vec<(usize, f64)> {
        let Some(body) = spec.body_of(motion) else { return Vec::new() };
        let first = self.first[body.0];
        match &spec.bodies[body.0].dynamics {
            Dynamics::Plant(plant) | Dynamics::Sensed { plant, .. } => {
                plant.c.row(number).iter().enumerate().map(|(state, &c)| (first + state, c)).collect()
            }
            // Nothing moves.
            Dynamics::Mass { .. } | Dynamics::Rigid { .. } if number > 0 => Vec::new(),
            Dynamics::Mass { .. } | Dynamics::Rigid { .. } => vec![(first, 1.0)],
        }
    }
}
