//! Bodies in fewer coordinates that their contacts cannot tell from the whole.

use cotouch_soft::{LinearBody, MaterialPoint};
use cotouch_world::LinearBlock;
use faer::Mat;
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
/// Hankel singular values below this share of the compliance are left out: contacts cannot tell.
const NEGLIGIBLE: f64 = 1e-13;
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
    /// The body in its balanced coordinates (Moore 1981), without those whose Hankel singular values are negligible: what
    /// its contacts do differs by at most twice the sum of what is left out (Glover 1984), in m/N. `d` is kept exactly.
    pub(crate) fn balanced(&self) -> Self {
        let LinearBlock { a, b, c, d } = &self.law;
        if self.law.states() == 0 || self.contacts() == 0 {
            return Self { shown: None, ..self.clone() };
        }
        let reached = gramian_factor(a, b);
        let seen = gramian_factor(&a.transpose(), &c.transpose());
        let Some((u, values, v)) = singular_values(&(seen.transpose() * &reached)) else {
            return self.clone();
        };
        let largest = values.first().copied().unwrap_or(0.0).max(d.amax());
        let kept = values.iter().take_while(|&&value| value > NEGLIGIBLE * largest).count();
        let scale = |matrix: DMatrix<f64>| {
            DMatrix::from_fn(matrix.nrows(), kept, |row, column| {
                matrix[(row, column)] / values[column].sqrt()
            })
        };
        let (right, left) = (scale(reached * v), scale(seen * u).transpose());
        let law = LinearBlock { a: &left * a * &right, b: &left * b, c: c * &right, d: d.clone() };
        Self { law, shown: None }
    }
}

/// L with `L·Lᵀ = Σ a^k·b·bᵀ·(a^k)ᵀ`, by doubling: never squared, so that small singular values keep their digits.
fn gramian_factor(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let (mut power, mut factor) = (a.clone(), b.clone());
    for _ in 0..MAX_DOUBLINGS {
        let later = &power * &factor;
        if later.norm() <= 1e-17 * factor.norm() {
            break;
        }
        let columns = factor.ncols();
        let mut both = factor.resize_horizontally(2 * columns, 0.0);
        both.columns_mut(columns, columns).copy_from(&later);
        factor = compressed(both);
        power = &power * &power;
    }
    factor
}

/// With no more columns than rows, and the same product with its transpose.
fn compressed(factor: DMatrix<f64>) -> DMatrix<f64> {
    if factor.ncols() <= factor.nrows() {
        return factor;
    }
    factor.transpose().qr().r().transpose()
}

/// U, the singular values from the largest on, and V.
fn singular_values(matrix: &DMatrix<f64>) -> Option<(DMatrix<f64>, Vec<f64>, DMatrix<f64>)> {
    let dense = Mat::from_fn(matrix.nrows(), matrix.ncols(), |row, column| matrix[(row, column)]);
    let svd = dense.thin_svd().ok()?;
    let (u, v) = (svd.U(), svd.V());
    let count = matrix.nrows().min(matrix.ncols());
    let values = (0..count).map(|index| svd.S()[index]).collect();
    let own =
        |of: faer::MatRef<'_, f64>| DMatrix::from_fn(of.nrows(), of.ncols(), |row, column| of[(row, column)]);
    Some((own(u), values, own(v)))
}
