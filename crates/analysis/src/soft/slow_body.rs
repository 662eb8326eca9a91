//! A soft body's step as its contacts see it: a linear system.

use cotouch_soft::{LinearBody, MaterialPoint, ReducedBody};
use nalgebra::{DMatrix, SymmetricEigen};

use cotouch_world::LinearBlock;

/// A body over a slow period: the input is the forces on m contacts (3m, N), the output how far the contacts are from where
/// they were about which the body is linear, after the step (3m, m).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SlowBody {
    /// n states, 3m inputs and outputs.
    pub(crate) law: LinearBlock,
    /// `y = shown·z` at any time, where the state says where the contacts are. 3m × n.
    pub(crate) shown: Option<DMatrix<f64>>,
}

/// Why a body has no step.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the soft body's step has no solution: its matrix of {0} coordinates is singular")]
pub struct SingularStep(pub usize);

impl SlowBody {
    /// A body that springs to where its forces balance, with the joint compliance `w` (m/N) of its contacts.
    pub(crate) fn quasi_static(w: DMatrix<f64>) -> Self {
        Self { law: LinearBlock::gain(w), shown: None }
    }

    /// The exact step of all coordinates: displacements, then velocities of the free coordinates.
    ///
    /// # Errors
    /// When the step's matrix is singular.
    pub(crate) fn exact(body: &LinearBody, points: &[MaterialPoint]) -> Result<Self, SingularStep> {
        let (size, h) = (body.coordinates.len(), body.period_s);
        let jacobian = jacobian(body, points);
        let stiffness = dense(size, &body.stiffness);
        let step_stiffness =
            body.step_stiffness.as_ref().map_or_else(|| stiffness.clone(), |entries| dense(size, entries));
        let mass = DMatrix::from_diagonal(&body.mass_kg.clone().into());
        let matrix = if body.quasi_static {
            stiffness.clone()
        } else {
            &mass * (1.0 + h * body.mass_damping_per_s)
                + step_stiffness * (h * body.stiffness_damping_s + h * h)
        };
        let gradient = body.volume_gradient.as_deref();
        if body.quasi_static {
            let solved =
                constrained(matrix, gradient, jacobian.transpose(), None).ok_or(SingularStep(size))?;
            return Ok(Self::quasi_static(&jacobian * solved));
        }
        // Right sides for q, v and f, side by side.
        let columns = 2 * size + jacobian.nrows();
        let mut right = DMatrix::zeros(size, columns);
        right.columns_mut(0, size).copy_from(&(&stiffness * -h));
        right.columns_mut(size, size).copy_from(&mass);
        right.columns_mut(2 * size, jacobian.nrows()).copy_from(&(jacobian.transpose() * h));
        let velocities = constrained(matrix, gradient, right, Some(h)).ok_or(SingularStep(size))?;
        Ok(Self::from_velocities(&velocities, &jacobian, h))
    }

    /// `v⁺` as a function of q, v and f; `q⁺ = q + h·v⁺`.
    fn from_velocities(velocities: &DMatrix<f64>, jacobian: &DMatrix<f64>, h: f64) -> Self {
        let (contacts, size) = jacobian.shape();
        let mut next = DMatrix::zeros(2 * size, 2 * size + contacts);
        next.rows_mut(0, size).copy_from(&(velocities * h));
        (0..size).for_each(|index| next[(index, index)] += 1.0);
        next.rows_mut(size, size).copy_from(velocities);
        let mut shown = DMatrix::zeros(contacts, 2 * size);
        shown.columns_mut(0, size).copy_from(jacobian);
        let (a, b) = (next.columns(0, 2 * size).into_owned(), next.columns(2 * size, contacts).into_owned());
        let (c, d) = (&shown * &a, &shown * &b);
        Self { law: LinearBlock { a, b, c, d }, shown: Some(shown) }
    }

    /// Of a body in few coordinates: its modes, each by itself.
    pub(crate) fn from_reduced(body: &ReducedBody) -> Self {
        if body.quasi_static {
            return Self::quasi_static(&body.contacts * body.contacts.transpose());
        }
        let h = body.period_s;
        let modes = SymmetricEigen::new(body.stiffness.clone());
        let shapes = &body.contacts * &modes.eigenvectors;
        let size = shapes.ncols();
        let mut velocities = DMatrix::zeros(size, 2 * size + shapes.nrows());
        for (mode, &stiffness) in modes.eigenvalues.iter().enumerate() {
            let step = 1.0 + h * body.mass_damping_per_s + (h * body.stiffness_damping_s + h * h) * stiffness;
            velocities[(mode, mode)] = -h * stiffness / step;
            velocities[(mode, size + mode)] = step.recip();
            for contact in 0..shapes.nrows() {
                velocities[(mode, 2 * size + contact)] = h * shapes[(contact, mode)] / step;
            }
        }
        Self::from_velocities(&velocities, &shapes, h)
    }

    /// Contacts of which it has forces and displacements.
    pub(crate) fn contacts(&self) -> usize {
        self.law.outputs() / 3
    }

    /// The same body seen from some of its contacts only.
    pub(crate) fn seen_from(&self, contacts: &[usize]) -> Self {
        let places: Vec<usize> = contacts.iter().flat_map(|contact| 3 * contact..3 * contact + 3).collect();
        let LinearBlock { a, b, c, d } = &self.law;
        Self {
            law: LinearBlock {
                a: a.clone(),
                b: b.select_columns(&places),
                c: c.select_rows(&places),
                d: d.select_rows(&places).select_columns(&places),
            },
            shown: self.shown.as_ref().map(|shown| shown.select_rows(&places)),
        }
    }

    /// How the contacts are displaced, period after period, after a unit force in the first one: `d`, `c·b`, `c·a·b`, …
    pub(crate) fn impulse_response(&self, periods: usize) -> Vec<DMatrix<f64>> {
        let LinearBlock { a, b, c, d } = &self.law;
        let mut response = vec![d.clone()];
        let mut state = b.clone();
        for _ in 1..periods {
            response.push(c * &state);
            state = a * state;
        }
        response
    }
}

/// J: displacements of the points (x, y, z each) for those of the free coordinates.
fn jacobian(body: &LinearBody, points: &[MaterialPoint]) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(3 * points.len(), body.coordinates.len());
    for (column, &(node, axis)) in body.coordinates.iter().enumerate() {
        for (index, point) in points.iter().enumerate() {
            for (&of, &weight) in point.nodes.iter().zip(&point.weights) {
                if of == node {
                    jacobian[(3 * index + usize::from(axis), column)] += weight;
                }
            }
        }
    }
    jacobian
}

fn dense(size: usize, entries: &[(u32, u32, f64)]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(size, size);
    for &(row, column, value) in entries {
        matrix[(row as usize, column as usize)] += value;
    }
    matrix
}

/// Solves `matrix·x + g·λ = right` with `gᵀ·x = 0`; or, for velocities over a period h of which the first columns belong
/// to displacements q, `h·gᵀ·x = −gᵀ·q`.
fn constrained(
    matrix: DMatrix<f64>,
    gradient: Option<&[f64]>,
    right: DMatrix<f64>,
    period_s: Option<f64>,
) -> Option<DMatrix<f64>> {
    let Some(gradient) = gradient else { return matrix.lu().solve(&right) };
    let size = matrix.nrows();
    let mut bordered = matrix.resize(size + 1, size + 1, 0.0);
    let mut right = right.resize_vertically(size + 1, 0.0);
    let scale = period_s.unwrap_or(1.0);
    for (index, &value) in gradient.iter().enumerate() {
        bordered[(index, size)] = value;
        bordered[(size, index)] = scale * value;
        if period_s.is_some() {
            right[(size, index)] = -value;
        }
    }
    Some(bordered.lu().solve(&right)?.rows(0, size).into_owned())
}
