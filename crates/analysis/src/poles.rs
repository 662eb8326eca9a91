//! The eigenvalues of a loop, and what they say.

use nalgebra::{Complex, DMatrix, DVector};

use crate::check::check;
use crate::deflate::deflate;
use crate::dominant::{EnergyShares, is_as_large};
use crate::lift::layout::{Layout, Registers};
use crate::lift::stepping;
use crate::loop_spec::LoopSpec;
use crate::rigid::Structure;
use crate::soft::SoftAnalysisError;
use crate::symmetry::{Share, split};
use crate::toppling;
use crate::verdict::{AnalysisError, LoopStability, is_stable};
use cotouch_matrix::{EigenvalueError, balance, of_balanced};

/// Beyond this, in SI units, sums of squares would overflow.
const LARGEST_GROWTH: f64 = 1e120;

/// Numbers in a state: some ten seconds of work for eigenvalues.
const MAX_STATES: usize = 2000;

/// States squared times ticks of a pattern: some seconds of stepping.
const MAX_WORK: f64 = 1e9;

/// Of a loop with blocks, states times ticks: some ten seconds of stepping.
const MAX_BLOCK_WORK: f64 = 1e8;

/// Analyses one linear loop.
///
/// # Errors
/// When the description is inconsistent, or the eigenvalue iteration does not converge (never seen).
pub fn analyze_loop(spec: &LoopSpec) -> Result<LoopStability, AnalysisError> {
    judge(spec, true)
}

/// The same; without a look for the axis if that is not wanted.
pub(crate) fn judge(spec: &LoopSpec, with_axis: bool) -> Result<LoopStability, AnalysisError> {
    check_size(spec)?;
    let poles = split(spec).into_iter().map(|share| poles(&share, with_axis));
    let Some(shares) = poles.collect::<Result<Option<Vec<_>>, _>>()? else { return Ok(outgrown()) };
    Ok(together(shares))
}

/// Whether a loop can be analysed.
pub(crate) fn check_size(spec: &LoopSpec) -> Result<(), AnalysisError> {
    check(spec)?;
    let layout = Layout::new(spec, Registers::Shared);
    let (states, ticks) = (layout.coordinates.len(), spec.ticks_per_pattern());
    let (size, pattern) = (states as f64, ticks as f64);
    if spec.blocks.is_empty() {
        return if states > MAX_STATES || size * size * pattern > MAX_WORK {
            Err(AnalysisError::TooLarge { states, ticks })
        } else {
            Ok(())
        };
    }
    if states > MAX_STATES || size * pattern > MAX_BLOCK_WORK {
        return Err(SoftAnalysisError::TooLarge { states, ticks }.into());
    }
    Ok(())
}

/// The eigenvalues of one share of a loop.
struct Poles {
    eigenvalues: Vec<Complex<f64>>,
    copies: usize,
    rigid: usize,
    dragged: usize,
    loose: usize,
    /// As in [`LoopStability`].
    toppling_per_s: Vec<f64>,
    /// Of the motions of the largest one.
    motions: EnergyShares,
}

/// Nothing where the state outgrows floating point.
fn poles(share: &Share, with_axis: bool) -> Result<Option<Poles>, EigenvalueError> {
    let spec = &share.spec;
    let layout = Layout::new(spec, Registers::Shared);
    let mut matrix = stepping::lift(spec, &layout);
    if has_outgrown(&matrix) {
        return Ok(None);
    }
    let structure = structure(share, &layout, &matrix);
    let (rigid, dragged, loose) = (structure.rigid.len(), structure.dragged, structure.loose.len());
    let scales = balance(&mut matrix);
    let mut eigenvalues = eigenvalues_of_rest(matrix.clone(), &scales, &structure)?;
    let toppling_per_s = toppling::take_out(spec, &mut eigenvalues);
    let motions = match EnergyShares::along_only_axis(spec) {
        _ if !with_axis => EnergyShares::default(),
        Some(motions) => motions,
        None => EnergyShares::of_largest(spec, &layout, &matrix, &scales, &eigenvalues),
    };
    Ok(Some(Poles { eigenvalues, copies: share.copies, rigid, dragged, loose, toppling_per_s, motions }))
}

/// What of a share's map is 1 by structure.
pub(crate) fn structure(share: &Share, layout: &Layout, map: &DMatrix<f64>) -> Structure {
    if share.opposed { Structure::default() } else { Structure::new(&share.spec, layout, map) }
}

pub(crate) fn has_outgrown(map: &DMatrix<f64>) -> bool {
    map.iter().any(|value| !value.is_finite() || value.abs() > LARGEST_GROWTH)
}

fn together(shares: Vec<Poles>) -> LoopStability {
    let axis = dominant_axis(&shares);
    let sum = |count: fn(&Poles) -> usize| shares.iter().map(count).sum::<usize>();
    let (rigid, dragged, loose_parts) =
        (sum(|share| share.rigid), sum(|share| share.dragged), sum(|share| share.loose));
    let (mut eigenvalues, mut toppling_per_s) = (Vec::new(), Vec::new());
    for share in shares {
        (0..share.copies).for_each(|_| eigenvalues.extend_from_slice(&share.eigenvalues));
        (0..share.copies).for_each(|_| toppling_per_s.extend_from_slice(&share.toppling_per_s));
    }
    toppling_per_s.sort_by(|one, other| other.total_cmp(one));
    let drag_pole = (dragged > 0).then(|| nearest_to_one(&eigenvalues)).flatten();
    eigenvalues.extend(std::iter::repeat_n(Complex::new(1.0, 0.0), loose_parts));
    let spectral_radius = cotouch_matrix::spectral_radius(&eigenvalues);
    LoopStability {
        spectral_radius,
        stable: is_stable(spectral_radius, loose_parts),
        rigid_body_poles: rigid as u8,
        drag_pole,
        loose_parts,
        axis,
        toppling_per_s,
        eigenvalues,
    }
}

/// Of the shares that have the largest eigenvalue.
fn dominant_axis(shares: &[Poles]) -> Option<&'static str> {
    let radius = |share: &Poles| cotouch_matrix::spectral_radius(&share.eigenvalues);
    let largest = shares.iter().map(radius).fold(0.0, f64::max);
    let mut motions = EnergyShares::default();
    for share in shares.iter().filter(|share| is_as_large(radius(share), largest)) {
        motions.add(&share.motions, share.copies);
    }
    motions.axis()
}

/// A state that outgrows [`LARGEST_GROWTH`] within one pattern: no eigenvalues are needed to call it unstable.
fn outgrown() -> LoopStability {
    LoopStability {
        spectral_radius: f64::INFINITY,
        stable: false,
        rigid_body_poles: 0,
        drag_pole: None,
        loose_parts: 0,
        axis: None,
        toppling_per_s: Vec::new(),
        eigenvalues: Vec::new(),
    }
}

/// The eigenvalues of a map that do not follow from structure.
pub(crate) fn poles_of(
    mut map: DMatrix<f64>,
    structure: &Structure,
) -> Result<Vec<Complex<f64>>, EigenvalueError> {
    let scales = balance(&mut map);
    eigenvalues_of_rest(map, &scales, structure)
}

/// Of a map that was balanced with `scales`.
fn eigenvalues_of_rest(
    balanced: DMatrix<f64>,
    scales: &[f64],
    structure: &Structure,
) -> Result<Vec<Complex<f64>>, EigenvalueError> {
    let unscale = |vector: &DVector<f64>| DVector::from_fn(vector.len(), |i, _| vector[i] / scales[i]);
    let known: Vec<_> = structure.rigid.iter().chain(&structure.loose).collect();
    let mut vectors: Vec<_> = known.iter().copied().map(unscale).collect();
    let deflated = !vectors.is_empty();
    vectors.reverse();
    let mut gone = Vec::new();
    let mut matrix = balanced.clone();
    // Each vector is an eigenvector once those before it are gone.
    while let Some(vector) = vectors.pop() {
        let index = known.len() - vectors.len() - 1;
        // What follows from those before it is gone with them, and what the map does not have stays among the poles.
        let is_one = is_eigenvector(&matrix, &vector, structure.rounding)
            || is_eigenvector_in_units(&balanced, scales, &gone, known[index], structure.rounding);
        if !is_one {
            continue;
        }
        gone.push(known[index]);
        let (reduced, reflection) = deflate(&matrix, &vector);
        matrix = reduced;
        for later in &mut vectors {
            *later = reflection.deflate_vector(later);
        }
    }
    if deflated {
        balance(&mut matrix);
    }
    cotouch_matrix::check(&matrix)?;
    of_balanced(&matrix)
}

/// Whether `A·v = v`, to a relative `rounding`.
fn is_eigenvector(matrix: &DMatrix<f64>, vector: &DVector<f64>, rounding: f64) -> bool {
    (matrix * vector - vector).norm() <= rounding * (1.0 + matrix.norm()) * vector.norm()
}

/// Whether `A·v = v` but for what lies along the vectors that are `gone`, in the units of the states: where a pattern lets all else die
/// out, balancing magnifies the rounding errors of what has died.
fn is_eigenvector_in_units(
    balanced: &DMatrix<f64>,
    scales: &[f64],
    gone: &[&DVector<f64>],
    vector: &DVector<f64>,
    rounding: f64,
) -> bool {
    let size = balanced.nrows();
    let map = DMatrix::from_fn(size, size, |i, j| balanced[(i, j)] * (scales[i] / scales[j]));
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for &one in gone {
        let rest = without(&basis, one.clone());
        basis.push(rest.normalize());
    }
    let vector = without(&basis, vector.clone());
    let residual = without(&basis, &map * &vector - &vector);
    vector.norm() > 0.0 && residual.norm() <= rounding * (1.0 + map.norm()) * vector.norm()
}

/// What of a vector is orthogonal to an orthonormal basis.
fn without(basis: &[DVector<f64>], mut vector: DVector<f64>) -> DVector<f64> {
    for direction in basis {
        let along = direction.dot(&vector);
        vector.axpy(-along, direction, 1.0);
    }
    vector
}

fn nearest_to_one(eigenvalues: &[Complex<f64>]) -> Option<f64> {
    let real = eigenvalues.iter().filter(|value| value.im == 0.0).map(|value| value.re);
    real.min_by(|a, b| (a - 1.0).abs().total_cmp(&(b - 1.0).abs()))
}

#[cfg(test)]
mod tests;
