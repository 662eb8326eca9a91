//! One tick of a body: `x⁺ = A_D·x + B_D·f` (Fotoohi Ghiam 2006, (3.14)).

use cotouch_scene::scene::Integrator;
use nalgebra::DMatrix;

use crate::dof::Dof;
use crate::loop_spec::{Dynamics, Estimate, LoopBody, Plant};

/// The exact step over one tick of a body with d degrees of freedom.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BodyStep {
    /// A_D, n × n.
    pub(crate) a: DMatrix<f64>,
    /// B_D, n × d.
    pub(crate) b: DMatrix<f64>,
    /// Positions and velocities in the states, 2d × n.
    pub(crate) c: DMatrix<f64>,
}

impl BodyStep {
    pub(crate) fn new(body: &LoopBody, period_s: f64) -> Self {
        let axes = body.axes.len();
        match &body.dynamics {
            Dynamics::Plant(plant) => zero_order_hold(plant, period_s),
            Dynamics::Sensed { plant, estimate } => sensed(plant, *estimate, period_s),
            &Dynamics::Mass { mass_kg, integrator } => {
                mass(&DMatrix::from_diagonal_element(axes, axes, mass_kg.recip()), integrator, period_s)
            }
            Dynamics::Rigid { integrator, .. } => mass(&per_inertia(body), *integrator, period_s),
        }
    }
}

/// (3.15), by the exponential of the plant augmented with its held inputs: `exp([A B; 0 0]·T) = [A_D B_D; 0 I]`.
fn zero_order_hold(plant: &Plant, period_s: f64) -> BodyStep {
    let (states, inputs) = plant.b.shape();
    let size = states + inputs;
    let mut augmented = DMatrix::zeros(size, size);
    augmented.view_mut((0, 0), (states, states)).copy_from(&(&plant.a * period_s));
    augmented.view_mut((0, states), (states, inputs)).copy_from(&(&plant.b * period_s));
    let exponential = augmented.exp();
    BodyStep {
        a: exponential.view((0, 0), (states, states)).into_owned(),
        b: exponential.view((0, states), (states, inputs)).into_owned(),
        c: plant.c.clone(),
    }
}

/// The plant with what its sensor remembers: positions read at the last tick, and velocities told then.
fn sensed(plant: &Plant, estimate: Estimate, period_s: f64) -> BodyStep {
    let BodyStep { a, b, c } = zero_order_hold(plant, period_s);
    let (states, axes) = b.shape();
    let (remembered, share) = match estimate {
        Estimate::Difference => (axes, 1.0),
        Estimate::Filtered { cutoff_rad_per_s } => (2 * axes, -(-cutoff_rad_per_s * period_s).exp_m1()),
    };
    let size = states + remembered;
    let read = c.rows(0, axes).into_owned();
    let mut told = DMatrix::zeros(axes, size);
    told.columns_mut(0, states).copy_from(&(&read * (share / period_s)));
    for axis in 0..axes {
        told[(axis, states + axis)] = -share / period_s;
        if remembered > axes {
            told[(axis, states + axes + axis)] = 1.0 - share;
        }
    }
    let mut next = DMatrix::zeros(size, size);
    next.view_mut((0, 0), (states, states)).copy_from(&a);
    next.view_mut((states, 0), (axes, states)).copy_from(&read);
    if remembered > axes {
        next.rows_mut(states + axes, axes).copy_from(&told);
    }
    let mut input = DMatrix::zeros(size, axes);
    input.rows_mut(0, states).copy_from(&b);
    let mut output = DMatrix::zeros(2 * axes, size);
    output.view_mut((0, 0), (axes, states)).copy_from(&read);
    output.rows_mut(axes, axes).copy_from(&told);
    BodyStep { a: next, b: input, c: output }
}

/// M⁻¹ of a rigid body about rest, d × d.
pub(crate) fn per_inertia(body: &LoopBody) -> DMatrix<f64> {
    let axes = body.axes;
    let Dynamics::Rigid { mass_kg, inertia, .. } = &body.dynamics else {
        return DMatrix::zeros(axes.len(), axes.len());
    };
    let element = |one: Dof, other: Dof| match (one, other) {
        (Dof::Move(one), Dof::Move(other)) if one == other => *mass_kg,
        (Dof::Turn(one), Dof::Turn(other)) => inertia.col(other.index())[one.index()],
        _ => 0.0,
    };
    let full = DMatrix::from_fn(axes.len(), axes.len(), |row, column| element(axes[row], axes[column]));
    full.try_inverse().unwrap_or_else(|| DMatrix::from_element(axes.len(), axes.len(), f64::NAN))
}

fn mass(per_mass: &DMatrix<f64>, integrator: Integrator, period_s: f64) -> BodyStep {
    let axes = per_mass.nrows();
    let speed = per_mass * period_s;
    let travel = match integrator {
        Integrator::ExactHold => &speed * (0.5 * period_s),
        Integrator::SemiImplicitEuler => &speed * period_s,
    };
    let mut a = DMatrix::identity(2 * axes, 2 * axes);
    let mut b = DMatrix::zeros(2 * axes, axes);
    for axis in 0..axes {
        a[(axis, axes + axis)] = period_s;
    }
    b.rows_mut(0, axes).copy_from(&travel);
    b.rows_mut(axes, axes).copy_from(&speed);
    BodyStep { a, b, c: DMatrix::identity(2 * axes, 2 * axes) }
}
