//! Whether second moments die out at a probability of loss.

use nalgebra::{DMatrix, DVector};

use super::lossy_loop::LossyLoop;
use crate::verdict::PointVerdict;
use cotouch_matrix::{EigenvalueError, eigenvalues, spectral_radius};

/// A mean map nearer to 1 than this is not told from one that never settles.
const UNSETTLED: f64 = 1e-9;

/// Whether the mean square dies out, by a number that is 1 where it just does not; `None` where the mean does not
/// settle, but for rounding.
pub(super) fn verdict(lossy: &LossyLoop, rate: f64) -> Result<Option<PointVerdict>, EigenvalueError> {
    let mean = Mean::new(lossy, rate);
    let Some(powers) = squarings(mean.a.clone()) else {
        let of_mean = spectral_radius(&eigenvalues(&mean.a)?);
        let is_unstable = of_mean > 1.0 + UNSETTLED;
        return Ok(is_unstable.then_some(PointVerdict { spectral_radius: of_mean * of_mean, stable: false }));
    };
    let blocks = Blocks::new(lossy);
    let spectral_radius = largest_eigenvalue(blocks.identity(), |moments| {
        mean.returned(&powers, &blocks, moments) * (rate * (1.0 - rate))
    })?;
    Ok(Some(PointVerdict { spectral_radius, stable: spectral_radius < 1.0 }))
}

/// The system with the mean loss inside: from δ to v.
struct Mean {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
}

impl Mean {
    fn new(lossy: &LossyLoop, rate: f64) -> Self {
        let system = &lossy.system;
        // D leads from earlier packets to later ones, so that this has an inverse at any rate.
        let within = DMatrix::identity(system.outputs(), system.outputs()) - &system.d * rate;
        let solved = within.lu();
        let through = |right: &DMatrix<f64>| solved.solve(right).unwrap_or_else(|| right.clone());
        let c = through(&system.c);
        let d = through(&system.d);
        let b = &system.b + &system.b * (&d * rate);
        Self { a: &system.a + &system.b * (&c * rate), b, c, d }
    }

    /// What an impulse of δ with these moments brings back of v, added up over all patterns.
    fn returned(&self, powers: &[DMatrix<f64>], blocks: &Blocks<'_>, moments: &DVector<f64>) -> DVector<f64> {
        let impulse = blocks.times(&self.b, moments) * self.b.transpose();
        let left = powers.iter().fold(impulse, |sum, power| power * &sum * power.transpose() + &sum);
        blocks.diagonal(&(&self.c * left), &self.c)
            + blocks.diagonal(&blocks.times(&self.d, moments), &self.d)
    }
}

/// Block-diagonal matrices, one block a packet, as vectors of their elements.
struct Blocks<'a> {
    lossy: &'a LossyLoop,
}

impl<'a> Blocks<'a> {
    const fn new(lossy: &'a LossyLoop) -> Self {
        Self { lossy }
    }

    fn identity(&self) -> DVector<f64> {
        let sizes = self.lossy.packets.iter().map(ExactSizeIterator::len);
        let elements = sizes.flat_map(|size| DMatrix::identity(size, size).as_slice().to_vec());
        DVector::from_vec(elements.collect())
    }

    /// A matrix times a block-diagonal one.
    fn times(&self, matrix: &DMatrix<f64>, blocks: &DVector<f64>) -> DMatrix<f64> {
        let mut product = DMatrix::zeros(matrix.nrows(), matrix.ncols());
        let mut first = 0;
        for packet in &self.lossy.packets {
            let size = packet.len();
            let block =
                DMatrix::from_column_slice(size, size, &blocks.as_slice()[first..first + size * size]);
            product.columns_mut(packet.start, size).copy_from(&(matrix.columns(packet.start, size) * block));
            first += size * size;
        }
        product
    }

    /// The blocks of `left·rightᵀ`.
    fn diagonal(&self, left: &DMatrix<f64>, right: &DMatrix<f64>) -> DVector<f64> {
        let block = |packet: &std::ops::Range<usize>| {
            let rows = |of: &DMatrix<f64>| of.rows(packet.start, packet.len()).into_owned();
            (rows(left) * rows(right).transpose()).as_slice().to_vec()
        };
        DVector::from_vec(self.lossy.packets.iter().flat_map(block).collect())
    }
}

/// The powers 1, 2, 4 and so on of a matrix, until nothing is left; `None` where something always is.
fn squarings(matrix: DMatrix<f64>) -> Option<Vec<DMatrix<f64>>> {
    /// Within this many, what is nearer to 1 than [`UNSETTLED`] does not die out.
    const MAX: usize = 34;
    const LARGEST: f64 = 1e30;
    let mut powers = vec![matrix];
    while let Some(last) = powers.last().filter(|last| last.norm() > 1e-9) {
        let is_small = last.norm() < LARGEST;
        if powers.len() == MAX || !is_small {
            return None;
        }
        let square = last * last;
        powers.push(square);
    }
    Some(powers)
}

/// The largest eigenvalue of an operator that keeps semidefinite blocks so, by Arnoldi's iteration: it is real (Perron,
/// Frobenius; Krein & Rutman 1948).
fn largest_eigenvalue(
    mut start: DVector<f64>,
    operator: impl Fn(&DVector<f64>) -> DVector<f64>,
) -> Result<f64, EigenvalueError> {
    const MAX_VECTORS: usize = 60;
    const RESTARTS: usize = 8;
    const RELATIVE: f64 = 1e-11;
    const FAR: f64 = 1e-6;
    let mut largest = 0.0;
    for _ in 0..RESTARTS {
        let mut basis = vec![start.normalize()];
        let mut projected = DMatrix::<f64>::zeros(MAX_VECTORS + 1, MAX_VECTORS);
        for count in 1..=MAX_VECTORS {
            let mut next = operator(&basis[count - 1]);
            let before = next.norm();
            // Twice, because once is not orthogonal enough.
            for _ in 0..2 {
                for (row, vector) in basis.iter().enumerate() {
                    let share = vector.dot(&next);
                    projected[(row, count - 1)] += share;
                    next -= vector * share;
                }
            }
            let rest = next.norm();
            let is_invariant = rest <= 1e-14 * before;
            if count.is_multiple_of(3) || is_invariant {
                let values = eigenvalues(&projected.view((0, 0), (count, count)).into_owned())?;
                let found = spectral_radius(&values);
                // What is far from 1 need not be known better than that it is.
                let enough = (FAR * (found - 1.0).abs()).max(RELATIVE * found);
                if is_invariant || (found - largest).abs() <= enough {
                    return Ok(found);
                }
                largest = found;
            }
            projected[(count, count - 1)] = rest;
            basis.push(next / rest);
        }
        // Some steps of the operator itself bring the start nearer to where it tends to.
        for _ in 0..MAX_VECTORS {
            start = operator(&start).normalize();
        }
    }
    Ok(largest)
}
