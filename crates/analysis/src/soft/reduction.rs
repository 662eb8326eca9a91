//! Bodies and loops in fewer coordinates that nobody outside can tell from the whole.

use cotouch_matrix::{SingularValues, upper_triangle};
use cotouch_soft::{LinearBody, MaterialPoint};
use cotouch_world::LinearBlock;
use nalgebra::DMatrix;

use super::slow_body::SlowBody;

/// Krylov blocks that are tried first, and by how many more each time.
const MIN_BLOCKS: usize = 4;
const MORE_BLOCKS: usize = 4;
/// The subspace is not raised beyond so many blocks.
const MAX_BLOCKS: usize = 32;
/// Two subspaces are alike when all responses to impulses differ by less than this, relative to the compliance.
const ALIKE: f64 = 1e-11;
/// Periods after an impulse that are compared.
const COMPARED_PERIODS: usize = 96;
/// Hankel singular values below this share of the largest (of a body, of its compliance) are left out: nobody can tell.
pub(super) const NEGLIGIBLE: f64 = 1e-13;
/// The same of what is in a loop with more that is left out.
pub(super) const NEGLIGIBLE_IN_LOOP: f64 = 1e-15;
/// Powers of two of the step that are summed: more periods than a session has.
const MAX_DOUBLINGS: usize = 40;

/// The body as seen from `points`, by Krylov subspaces of as many blocks as it takes; and whether it took no more than are
/// tried.
pub(super) fn by_krylov(body: &LinearBody, points: &[MaterialPoint]) -> (SlowBody, bool) {
    let of_blocks = |blocks: usize| SlowBody::from_reduced(&body.reduced(points, blocks));
    let mut known = of_blocks(MIN_BLOCKS);
    let mut blocks = MIN_BLOCKS + MORE_BLOCKS;
    while blocks <= MAX_BLOCKS {
        let finer = of_blocks(blocks);
        if known.law.states() == finer.law.states() || are_alike(&known, &finer) {
            return (finer, true);
        }
        known = finer;
        blocks += MORE_BLOCKS;
    }
    (known, false)
}

fn are_alike(one: &SlowBody, other: &SlowBody) -> bool {
    let (one, other) = (one.impulse_response(COMPARED_PERIODS), other.impulse_response(COMPARED_PERIODS));
    let size = other.iter().map(DMatrix::amax).fold(0.0, f64::max);
    one.iter().zip(&other).all(|(one, other)| (one - other).amax() <= ALIKE * size)
}

impl SlowBody {
    /// The body in its balanced coordinates: what its contacts do differs by at most twice the sum of what is left out
    /// (Glover 1984), in m/N. `d` is kept exactly.
    pub(crate) fn balanced(&self, negligible: f64) -> Self {
        let LinearBlock { a, b, c, d } = &self.law;
        if self.law.states() == 0 || self.contacts() == 0 {
            return Self { shown: None, ..self.clone() };
        }
        match Reachable::new(a, b, 1.0).balanced(c, d, negligible) {
            Some(law) => Self { law, shown: None },
            None => self.clone(),
        }
    }
}

/// What of a system's state its inputs reach.
pub(super) struct Reachable<'a> {
    a: &'a DMatrix<f64>,
    b: &'a DMatrix<f64>,
    /// Of a/growth: a, a², a⁴, …, until nothing is left.
    powers: Vec<DMatrix<f64>>,
    /// A factor of the reachability gramian.
    factor: DMatrix<f64>,
}

impl<'a> Reachable<'a> {
    /// Of `x⁺ = a·x + b·u`; what grows by less than `growth` a step, which must be more than the spectral radius, is weighed
    /// as if it died out.
    pub(super) fn new(a: &'a DMatrix<f64>, b: &'a DMatrix<f64>, growth: f64) -> Self {
        let powers = powers(a / growth);
        let factor = gramian_factor(&powers, b);
        Self { a, b, powers, factor }
    }

    /// The system with the outputs `c·x + d·u` in its balanced coordinates (Moore 1981), without those whose Hankel singular
    /// values are below the share `negligible` of the largest, or of `d`; nothing where these values are not found.
    pub(super) fn balanced(
        &self,
        c: &DMatrix<f64>,
        d: &DMatrix<f64>,
        negligible: f64,
    ) -> Option<LinearBlock> {
        let transposed: Vec<_> = self.powers.iter().map(DMatrix::transpose).collect();
        let seen = gramian_factor(&transposed, &c.transpose());
        let SingularValues { u, values, v } = SingularValues::of(&(seen.transpose() * &self.factor))?;
        let largest = values.first().copied().unwrap_or(0.0).max(d.amax());
        let kept = values.iter().take_while(|&&value| value > negligible * largest).count();
        let scale = |matrix: DMatrix<f64>| {
            DMatrix::from_fn(matrix.nrows(), kept, |row, column| {
                matrix[(row, column)] / values[column].sqrt()
            })
        };
        let (right, left) = (scale(&self.factor * v), scale(seen * u).transpose());
        Some(LinearBlock { a: &left * self.a * &right, b: &left * self.b, c: c * &right, d: d.clone() })
    }
}

/// a, a², a⁴, …, as long as they matter.
fn powers(a: DMatrix<f64>) -> Vec<DMatrix<f64>> {
    let mut powers = vec![a];
    while powers.len() < MAX_DOUBLINGS
        && let Some(last) = powers.last().filter(|last| last.norm() > 1e-17)
    {
        powers.push(last * last);
    }
    powers
}

/// L with `L·Lᵀ = Σ a^k·b·bᵀ·(a^k)ᵀ`, by doubling: never squared, so that small singular values keep their digits.
fn gramian_factor(powers: &[DMatrix<f64>], b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut factor = b.clone();
    for power in powers {
        let later = power * &factor;
        if later.norm() <= 1e-17 * factor.norm() {
            break;
        }
        let columns = factor.ncols();
        let mut both = factor.resize_horizontally(2 * columns, 0.0);
        both.columns_mut(columns, columns).copy_from(&later);
        factor = compressed(both);
    }
    factor
}

/// With no more columns than rows, and the same product with its transpose.
fn compressed(factor: DMatrix<f64>) -> DMatrix<f64> {
    if factor.ncols() <= factor.nrows() {
        return factor;
    }
    upper_triangle(&factor.transpose()).transpose()
}
