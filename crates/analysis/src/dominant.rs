//! Which way things move in the motion that belongs to the largest eigenvalue.
//!
//! Where several eigenvalues are the largest, as those of equal hands are, it is all their motions together: any one of
//! them would be a matter of rounding.

use std::collections::BTreeMap;

use faer::linalg::solvers::Solve;
use faer::{Mat, c64};
use nalgebra::{Complex, DMatrix};

use crate::discretise::per_inertia;
use crate::lift::layout::Layout;
use crate::loop_spec::{Body, Dof, Dynamics, LoopSpec};

/// Eigenvalues are equally large up to this share of them.
const EQUAL: f64 = 1e-9;
/// Shares of the energy are alike up to this share of them.
const ALIKE: f64 = 1e-6;
/// Bodies that move less than this in an eigenvector of length 1 do not take part in it.
const STILL: f64 = 1e-10;

/// How much of the kinetic energy of the dominant motions is along and about each axis: 1 for each motion in all.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct EnergyShares(BTreeMap<Dof, f64>);

impl EnergyShares {
    /// Of a loop in which everything moves along or about one axis, whatever its eigenvalues are; nothing where there are
    /// several axes.
    pub(crate) fn along_only_axis(spec: &LoopSpec) -> Option<Self> {
        let mut axes = spec.bodies.iter().flat_map(|body| body.axes);
        let first = *axes.next()?;
        axes.all(|axis| *axis == first).then(|| Self(BTreeMap::from([(first, 1.0)])))
    }

    /// In the eigenvectors of the largest eigenvalues of `balanced` = D⁻¹·A·D.
    pub(crate) fn of_largest(
        spec: &LoopSpec,
        layout: &Layout,
        balanced: &DMatrix<f64>,
        scales: &[f64],
        eigenvalues: &[Complex<f64>],
    ) -> Self {
        let speeds = speeds(spec, layout);
        let mut shares = Self::default();
        for (eigenvalue, count) in largest(eigenvalues) {
            if let Some(vectors) = eigenvectors(balanced, eigenvalue, count) {
                shares.add_motions(&speeds, &vectors, scales);
            }
        }
        shares
    }

    fn add_motions(&mut self, speeds: &[Speed], vectors: &Mat<c64>, scales: &[f64]) {
        let count = vectors.ncols();
        let is_still = |speed: &Speed| (0..count).all(|column| vectors[(speed.state, column)].norm() < STILL);
        if speeds.iter().all(is_still) {
            return;
        }
        let motions = Mat::from_fn(speeds.len(), count, |row, column| {
            let Speed { state, mass, .. } = speeds[row];
            vectors[(state, column)] * (scales[state] * mass.sqrt())
        });
        let Ok(svd) = motions.thin_svd() else { return };
        let largest = svd.S()[0].re;
        for column in (0..svd.U().ncols()).take_while(|&column| svd.S()[column].re > ALIKE * largest) {
            for (row, speed) in speeds.iter().enumerate() {
                *self.0.entry(speed.axis).or_default() += svd.U()[(row, column)].norm_sqr();
            }
        }
    }

    /// With the motions of another part of the same loop, which it has so many times.
    pub(crate) fn add(&mut self, other: &Self, copies: usize) {
        for (axis, share) in &other.0 {
            *self.0.entry(*axis).or_default() += copies as f64 * share;
        }
    }

    /// The axis with the largest share; of those that are alike, the first of x, y, z, rx, ry, rz.
    pub(crate) fn axis(&self) -> Option<&'static str> {
        let largest = self.0.values().copied().fold(0.0, f64::max);
        let is_largest = |(_, share): &(&Dof, &f64)| **share > 0.0 && **share >= (1.0 - ALIKE) * largest;
        self.0.iter().find(is_largest).map(|(axis, _)| name(*axis))
    }
}

/// Whether an eigenvalue of this absolute value is as large as another one.
pub(crate) fn is_as_large(one: f64, other: f64) -> bool {
    one >= (1.0 - EQUAL) * other
}

fn name(axis: Dof) -> &'static str {
    const MOVES: [&str; 3] = ["x", "y", "z"];
    const TURNS: [&str; 3] = ["rx", "ry", "rz"];
    let names = if axis.turns() { TURNS } else { MOVES };
    names[axis.axis().index()]
}

/// The largest eigenvalues, one of each conjugate pair, and how many there are of each.
fn largest(eigenvalues: &[Complex<f64>]) -> Vec<(Complex<f64>, usize)> {
    let radius = eigenvalues.iter().map(|value| value.norm()).fold(0.0, f64::max);
    let mut largest: Vec<(Complex<f64>, usize)> = Vec::new();
    let is_one = |value: &&Complex<f64>| value.im >= 0.0 && is_as_large(value.norm(), radius);
    for value in eigenvalues.iter().filter(is_one).filter(|_| radius > 0.0) {
        match largest.iter_mut().find(|(other, _)| (other - value).norm() <= EQUAL * radius) {
            Some((_, count)) => *count += 1,
            None => largest.push((*value, 1)),
        }
    }
    largest
}

/// A velocity: which way it is, which number of the state it is, and what moves so, kg or kg·m².
struct Speed {
    axis: Dof,
    state: usize,
    mass: f64,
}

fn speeds(spec: &LoopSpec, layout: &Layout) -> Vec<Speed> {
    let mut speeds = Vec::new();
    for (body, &first) in spec.bodies.iter().zip(&layout.bodies) {
        let (masses, velocities) = masses(body);
        let of_body = body.axes.iter().zip(masses).zip(first + velocities..);
        speeds.extend(of_body.map(|((&axis, mass), state)| Speed { axis, state, mass }));
    }
    speeds
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

/// Orthonormal vectors of the space that belongs to an eigenvalue which is there `count` times, by inverse iteration next to
/// it.
fn eigenvectors(matrix: &DMatrix<f64>, eigenvalue: Complex<f64>, count: usize) -> Option<Mat<c64>> {
    const BESIDE: f64 = 1e-9;
    let size = matrix.nrows();
    let shift = eigenvalue * (1.0 + BESIDE) + BESIDE * BESIDE;
    let shifted = Mat::from_fn(size, size, |row, column| {
        let shift = if row == column { c64::new(shift.re, shift.im) } else { c64::new(0.0, 0.0) };
        c64::new(matrix[(row, column)], 0.0) - shift
    });
    let decomposition = shifted.partial_piv_lu();
    // Aligned with nothing.
    let start = |row: usize, column: usize| {
        let place = (row + 1) as f64 * (column + 1) as f64;
        c64::new(1.0 + (place * 0.754_877_666_2).fract(), 0.3 + (place * 0.569_840_290_9).fract())
    };
    let mut vectors = Mat::from_fn(size, count, start);
    for _ in 0..3 {
        decomposition.solve_in_place(&mut vectors);
        if !vectors.norm_l2().is_finite() {
            return None;
        }
        vectors = vectors.qr().compute_thin_Q();
    }
    Some(vectors)
}
