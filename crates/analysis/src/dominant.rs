//! Which way things move in the motion that belongs to the largest eigenvalue.

use nalgebra::{Complex, DMatrix, DVector};

use crate::discretise::per_inertia;
use crate::lift::layout::Layout;
use crate::loop_spec::{Body, Dof, Dynamics, LoopSpec};

/// Whether there is a question at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dominant {
    /// Everything moves along or about one axis.
    Only(&'static str),
    /// There are several.
    Among,
}

/// Of a loop without a look at its eigenvalues.
pub(crate) fn dominant_axis(spec: &LoopSpec) -> Dominant {
    let mut axes = spec.bodies.iter().flat_map(|body| body.axes);
    match axes.next() {
        Some(first) if axes.all(|axis| axis == first) => Dominant::Only(name(*first)),
        _ => Dominant::Among,
    }
}

fn name(axis: Dof) -> &'static str {
    const MOVES: [&str; 3] = ["x", "y", "z"];
    const TURNS: [&str; 3] = ["rx", "ry", "rz"];
    let names = if axis.turns() { TURNS } else { MOVES };
    names[axis.axis().index()]
}

/// The axis with the most kinetic energy in the eigenvector of the largest eigenvalue of `balanced` = D⁻¹·A·D.
pub(crate) fn axis_of_largest(
    spec: &LoopSpec,
    layout: &Layout,
    balanced: &DMatrix<f64>,
    scales: &[f64],
    eigenvalues: &[Complex<f64>],
) -> Option<&'static str> {
    let largest = eigenvalues.iter().max_by(|one, other| one.norm().total_cmp(&other.norm()))?;
    let vector = eigenvector(balanced, *largest)?;
    let speed = |state: usize| (vector[state] * scales[state]).norm_sqr();
    let mut energies: Vec<(Dof, f64)> = Vec::new();
    for (body, &first) in spec.bodies.iter().zip(&layout.bodies) {
        let (masses, velocities) = masses(body);
        for (number, &axis) in body.axes.iter().enumerate() {
            let energy = masses[number] * speed(first + velocities + number);
            match energies.iter_mut().find(|(known, _)| *known == axis) {
                Some((_, sum)) => *sum += energy,
                None => energies.push((axis, energy)),
            }
        }
    }
    let most = energies.into_iter().filter(|(_, energy)| *energy > 0.0);
    most.max_by(|one, other| one.1.total_cmp(&other.1)).map(|(axis, _)| name(axis))
}

/// A body's inertia for each degree of freedom, and the place of its first velocity among its states.
fn masses(body: &Body) -> (Vec<f64>, usize) {
    let axes = body.axes.len();
    match &body.dynamics {
        Dynamics::Mass { mass_kg, .. } => (vec![*mass_kg; axes], axes),
        Dynamics::Rigid { .. } => {
            (per_inertia(body).diagonal().iter().map(|value| value.recip()).collect(), axes)
        }
        // Of plants that are written like a mass: positions, then velocities.
        Dynamics::Plant(plant) | Dynamics::Sensed { plant, .. } => {
            let mass = |axis: usize| {
                let state = axes + axis;
                let gain = if state < plant.b.nrows() { plant.b[(state, axis)] } else { 0.0 };
                if gain > 0.0 { gain.recip() } else { 0.0 }
            };
            let known = plant.b.nrows() >= 2 * axes;
            (
                (0..axes).map(|axis| if known { mass(axis) } else { 0.0 }).collect(),
                if known { axes } else { 0 },
            )
        }
    }
}

/// By inverse iteration next to the eigenvalue.
fn eigenvector(matrix: &DMatrix<f64>, eigenvalue: Complex<f64>) -> Option<DVector<Complex<f64>>> {
    const BESIDE: f64 = 1e-9;
    let size = matrix.nrows();
    let shift = eigenvalue * (1.0 + BESIDE) + BESIDE * BESIDE;
    let mut shifted = matrix.map(|value| Complex::new(value, 0.0));
    for index in 0..size {
        shifted[(index, index)] -= shift;
    }
    let decomposition = shifted.lu();
    // Aligned with nothing.
    let start = |index: usize, _| Complex::new(1.0 + (index as f64 * 0.754_877_666_2).fract(), 0.3);
    let mut vector = DVector::from_fn(size, start);
    for _ in 0..3 {
        vector = decomposition.solve(&vector)?;
        let length = vector.norm();
        if !(length.is_finite() && length > 0.0) {
            return None;
        }
        vector /= Complex::new(length, 0.0);
    }
    Some(vector)
}
