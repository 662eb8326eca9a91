//! One step of a soft body, linearised: what the analysis compiles.

use std::collections::HashMap;

use faer::linalg::solvers::Solve;
use faer::reborrow::Reborrow;
use faer::sparse::linalg::solvers::{Llt, Lu};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Col, ColRef, Mat, Scale, Side};
use nalgebra::DMatrix;

use crate::point::MaterialPoint;

/// The linearisation of a step about a state, in the coordinates of the nodes that move.
///
/// With `q` the displacements and `v` the velocities of the free coordinates, `f` the change of the forces on them:
///
/// ```text
/// implicit       S·v⁺ + g·λ = M·v + h·(f − K·q),   S = (1 + h·α)·M + h·β·K_s + h²·K_s,   gᵀ·(q + h·v⁺) = 0,   q⁺ = q + h·v⁺
/// quasi-static   K·q⁺ + g·λ = f,   gᵀ·q⁺ = 0,   v⁺ = 0
/// ```
///
/// where `K` is the exact tangent stiffness, `K_s` the one that the step's matrix was made with (equal at rest), and `g` the
/// gradient of a volume that is kept (absent in most bodies).
#[derive(Clone, Debug, PartialEq)]
pub struct LinearBody {
    /// Length h of a period, s.
    pub period_s: f64,
    /// Whether the step is the quasi-static one.
    pub quasi_static: bool,
    /// The free coordinates: which node and axis (0 to 2) each is.
    pub coordinates: Vec<(u32, u8)>,
    /// Diagonal of M, kg.
    pub mass_kg: Vec<f64>,
    /// Rayleigh damping α of the mass, 1/s.
    pub mass_damping_per_s: f64,
    /// Rayleigh damping β of the stiffness, s.
    pub stiffness_damping_s: f64,
    /// K, N/m: all entries (row, column, value), both triangles; entries at the same place add.
    pub stiffness: Vec<(u32, u32, f64)>,
    /// K_s, likewise; `None` where it is K.
    pub step_stiffness: Option<Vec<(u32, u32, f64)>>,
    /// Gradient g of a volume that is kept, m²; `None` in most bodies.
    pub volume_gradient: Option<Vec<f64>>,
}

/// What a body is as seen from some contacts: the same step in a few coordinates.
///
/// M-orthonormal coordinates `z` with `q = V·z`: the mass matrix is the identity.
#[derive(Clone, Debug, PartialEq)]
pub struct ReducedBody {
    /// Length h of a period, s.
    pub period_s: f64,
    /// Whether the step is the quasi-static one. Then the coordinates are scaled so that `stiffness` is the identity.
    pub quasi_static: bool,
    /// Rayleigh damping α of the mass, 1/s.
    pub mass_damping_per_s: f64,
    /// Rayleigh damping β of the stiffness, s.
    pub stiffness_damping_s: f64,
    /// VᵀKV, k × k.
    pub stiffness: DMatrix<f64>,
    /// J·V, 3m × k: displacements of the contacts (x, y, z each), and, transposed, what forces there act on.
    pub contacts: DMatrix<f64>,
}

/// A vector that is this much shorter once the others are taken out of it adds nothing but rounding.
const DEFLATED: f64 = 1e-9;

impl LinearBody {
    /// The body as seen from `points`, by a block Krylov subspace of `blocks` blocks (of the step's matrix) that starts from
    /// their unit forces; constraints are kept exactly. Exact when the subspace is exhausted. With K_s = K. A quasi-static body
    /// is exact with one block.
    ///
    /// # Panics
    /// When the step's matrix is singular.
    #[must_use]
    pub fn reduced(&self, points: &[MaterialPoint], blocks: usize) -> ReducedBody {
        let contacts = self.contact_weights(points);
        let stiffness = sparse(self.mass_kg.len(), self.stiffness.iter().copied());
        let solver = ConstrainedSolver::new(&self.step_matrix(), self.volume_gradient.as_deref());
        let metric = |vector: ColRef<'_, f64>| match self.quasi_static {
            true => stiffness.rb() * vector,
            false => Col::from_fn(vector.nrows(), |i| self.mass_kg[i] * vector[i]),
        };
        let mut basis = Vec::new();
        let mut block = solver.solve(contacts.transpose().to_owned());
        for _ in 0..blocks {
            let begin = basis.len();
            block.col_iter().for_each(|column| append_orthonormal(&mut basis, column, &metric));
            if begin == basis.len() || self.quasi_static {
                break;
            }
            let forces: Vec<Col<f64>> = basis[begin..].iter().map(|vector| metric(vector.as_ref())).collect();
            block = solver.solve(from_columns(self.mass_kg.len(), &forces));
        }
        let basis = from_columns(self.mass_kg.len(), &basis);
        let projected = basis.transpose() * (stiffness.rb() * &basis);
        ReducedBody {
            period_s: self.period_s,
            quasi_static: self.quasi_static,
            mass_damping_per_s: self.mass_damping_per_s,
            stiffness_damping_s: self.stiffness_damping_s,
            stiffness: symmetric(&projected),
            contacts: to_nalgebra(&(contacts * &basis)),
        }
    }

    /// J: how the displacements of the points follow from the coordinates, 3m × n. Nodes that do not move count nothing.
    fn contact_weights(&self, points: &[MaterialPoint]) -> Mat<f64> {
        let column: HashMap<(u32, u8), usize> = self.coordinates.iter().copied().zip(0..).collect();
        let mut weights = Mat::zeros(3 * points.len(), self.coordinates.len());
        for (index, point) in points.iter().enumerate() {
            for (axis, (&node, &weight)) in
                (0..3_u8).flat_map(|axis| point.nodes.iter().zip(&point.weights).map(move |of| (axis, of)))
            {
                if let Some(&column) = column.get(&(node, axis)) {
                    weights[(3 * index + usize::from(axis), column)] += weight;
                }
            }
        }
        weights
    }

    /// S, with K in place of K_s; of a quasi-static body K.
    fn step_matrix(&self) -> SparseColMat<u32, f64> {
        let h = self.period_s;
        let (inertia, stiffness) = match self.quasi_static {
            true => (0.0, 1.0),
            false => (1.0 + h * self.mass_damping_per_s, h * self.stiffness_damping_s + h * h),
        };
        let masses = self.mass_kg.iter().zip(0..).map(|(mass, i)| (i, i, inertia * mass));
        let springs = self.stiffness.iter().map(|&(row, column, value)| (row, column, stiffness * value));
        sparse(self.mass_kg.len(), masses.chain(springs))
    }
}

/// Solves `A·x + g·λ = b, gᵀ·x = 0`.
struct ConstrainedSolver<'a> {
    factor: SymmetricFactor,
    /// g, and `A⁻¹·g / (gᵀ·A⁻¹·g)`.
    constraint: Option<(&'a [f64], Col<f64>)>,
}

/// Of a matrix that is symmetric, and positive definite unless a body is pressed beyond its strength.
enum SymmetricFactor {
    Positive(Llt<u32, f64>),
    Indefinite(Box<Lu<u32, f64>>),
}

impl<'a> ConstrainedSolver<'a> {
    fn new(matrix: &SparseColMat<u32, f64>, gradient: Option<&'a [f64]>) -> Self {
        let factor = match matrix.sp_cholesky(Side::Lower) {
            Ok(factor) => SymmetricFactor::Positive(factor),
            Err(_) => {
                SymmetricFactor::Indefinite(Box::new(matrix.sp_lu().expect("the step's matrix is regular")))
            }
        };
        let mut solver = Self { factor, constraint: None };
        solver.constraint = gradient.map(|gradient| {
            let moved = solver.solve(Mat::from_fn(gradient.len(), 1, |i, _| gradient[i]));
            let along: f64 = gradient.iter().enumerate().map(|(i, part)| part * moved[(i, 0)]).sum();
            (gradient, Col::from_fn(gradient.len(), |i| moved[(i, 0)] / along))
        });
        solver
    }

    fn solve(&self, mut right: Mat<f64>) -> Mat<f64> {
        match &self.factor {
            SymmetricFactor::Positive(factor) => factor.solve_in_place(right.as_mut()),
            SymmetricFactor::Indefinite(factor) => factor.solve_in_place(right.as_mut()),
        }
        if let Some((gradient, moved)) = &self.constraint {
            for mut column in right.col_iter_mut() {
                let along: f64 = gradient.iter().enumerate().map(|(i, part)| part * column[i]).sum();
                for i in 0..gradient.len() {
                    column[i] -= along * moved[i];
                }
            }
        }
        right
    }
}

/// Appends a vector without what the others hold of it, of length one in a metric; or nothing.
fn append_orthonormal(
    basis: &mut Vec<Col<f64>>,
    vector: ColRef<'_, f64>,
    metric: &impl Fn(ColRef<'_, f64>) -> Col<f64>,
) {
    let mut rest = vector.to_owned();
    let length = |vector: &Col<f64>| vector.transpose() * metric(vector.as_ref());
    let before = length(&rest).sqrt();
    // Once more for what rounding left behind.
    for _ in 0..2 {
        for other in basis.iter() {
            let part = metric(other.as_ref()).transpose() * &rest;
            rest -= other * Scale(part);
        }
    }
    let after = length(&rest).sqrt();
    if after > DEFLATED * before {
        basis.push(rest * Scale(1.0 / after));
    }
}

fn sparse(size: usize, entries: impl Iterator<Item = (u32, u32, f64)>) -> SparseColMat<u32, f64> {
    let triplets: Vec<_> = entries.map(|(row, column, value)| Triplet::new(row, column, value)).collect();
    SparseColMat::try_new_from_triplets(size, size, &triplets).expect("a matrix of the body's coordinates")
}

fn from_columns(rows: usize, columns: &[Col<f64>]) -> Mat<f64> {
    Mat::from_fn(rows, columns.len(), |row, column| columns[column][row])
}

fn to_nalgebra(matrix: &Mat<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| matrix[(row, column)])
}

fn symmetric(matrix: &Mat<f64>) -> DMatrix<f64> {
    let matrix = to_nalgebra(matrix);
    0.5 * (&matrix + matrix.transpose())
}
