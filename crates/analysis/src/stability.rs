//! Whether a loop is stable, and how nearly.

use cotouch_scene::scene::Scene;
use nalgebra::{Complex, DMatrix, DVector};
use serde::Serialize;

use crate::check::{SpecError, check};
use crate::compile::modes;
use crate::deflate::deflate;
use crate::dominant::{Dominant, dominant_axis};
use crate::eigenvalues::{self, EigenvalueError, balance, of_balanced};
use crate::lift::layout::{Layout, Registers};
use crate::lift::stepping;
use crate::loop_spec::LoopSpec;
use crate::rigid::Structure;
use crate::soft::{self, SoftAnalysisError};
use crate::symmetry::{Share, split};
use crate::warnings::warnings;

/// The verdict on a scene; serialises to the document of `cotouch analyze stability`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stability {
    /// Largest absolute eigenvalue over one pattern, in the worst contact mode, without the rigid-body poles.
    /// Infinite where the state grows more than 10¹²⁰-fold within one pattern.
    pub spectral_radius: f64,
    /// Whether every contact mode's spectral radius is below 1, or 1 but for rounding (within 1e-11): neutral.
    pub stable: bool,
    /// Eigenvalues at exactly 1 by structure, of the settled mode (every finger that presses on something in contact, no
    /// wall touched): for each part that drifts by itself and each direction in which it does, 1, or 2 where its
    /// momentum is conserved.
    pub rigid_body_poles: u8,
    /// The real eigenvalue nearest 1 that remains, of the same mode: how held data damp the drift of the whole
    /// (above 1: drive it). `None` where a stiffness grounds the loop or momentum is conserved.
    pub drag_pole: Option<f64>,
    /// Numbers in the state of the running session's loop, in the same mode; of a soft body, those to which it was reduced.
    pub states: usize,
    /// Duration of one pattern of ticks and network steps.
    pub period_s: f64,
    /// Every contact mode.
    pub modes: Vec<ModeStability>,
    /// What is known about switching between the modes.
    pub switching: Switching,
    /// What the linear analysis leaves out, in plain sentences.
    pub warnings: Vec<String>,
}

/// The verdict on one contact mode.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModeStability {
    /// The switching contacts that are closed.
    pub contacts: Vec<String>,
    /// As in [`Stability`].
    pub spectral_radius: f64,
    /// As in [`Stability`].
    pub stable: bool,
    /// Which way things mostly move in the motion that belongs to the largest eigenvalue, by kinetic energy: "x", "y",
    /// "z", or "rx", "ry", "rz" for turning. `None` where that motion cannot be told.
    pub axis: Option<&'static str>,
}

/// A pole that is 1 but for rounding neither grows nor dies out: a body that pivots about what holds it. Something that
/// grew by less than this a period would take years to be seen.
const NEUTRAL: f64 = 1e-11;

/// What is known about switching between contact modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Switching {
    /// There is one linear mode, and nothing to switch.
    None,
    /// Modes were analysed one by one.
    Unproven,
}

/// The verdict on one linear loop.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopStability {
    /// Largest absolute eigenvalue over one pattern, without the rigid-body poles.
    pub spectral_radius: f64,
    /// Whether that is below 1, or 1 but for rounding (within 1e-11): neutral.
    pub stable: bool,
    /// Eigenvalues at exactly 1 by structure, as in [`Stability`].
    pub rigid_body_poles: u8,
    /// As in [`Stability`].
    pub drag_pole: Option<f64>,
    /// Parts that no stiffness ties to the rest: each has a pole at 1, which counts.
    pub loose_parts: usize,
    /// As in [`ModeStability`].
    pub axis: Option<&'static str>,
    /// The eigenvalues, without the rigid-body poles, of the state in which receivers share samples
    /// ([`LoopSpec::lift_shared`]).
    pub eigenvalues: Vec<Complex<f64>>,
}

/// Beyond this, in SI units, sums of squares would overflow.
const LARGEST_GROWTH: f64 = 1e120;

/// Why there is no verdict.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AnalysisError {
    /// The loop's description is inconsistent.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// Too much to compute.
    #[error(
        "the loop has {states} states and a pattern of {ticks} ticks; at most {MOST_WORK:.0e} state·state·ticks are analysed: choose rates whose ratio is simpler, fewer users or a shorter delay"
    )]
    TooLarge {
        /// n.
        states: usize,
        /// p.
        ticks: u64,
    },
    /// No eigenvalues.
    #[error(transparent)]
    Eigenvalues(#[from] EigenvalueError),
    /// Of a session with a soft body.
    #[error(transparent)]
    Soft(#[from] SoftAnalysisError),
}

impl AnalysisError {
    /// Whether there is too much to compute.
    #[must_use]
    pub const fn is_too_large(&self) -> bool {
        matches!(self, Self::TooLarge { .. } | Self::Soft(SoftAnalysisError::TooLarge { .. }))
    }
}

/// States squared times ticks of a pattern: some seconds of work.
const MOST_WORK: f64 = 1e9;

/// Analyses every contact mode of a scene.
///
/// # Errors
/// When a loop is too large, or the eigenvalue iteration does not converge (never seen).
pub fn analyze(scene: &Scene) -> Result<Stability, AnalysisError> {
    if scene.soft.exists() {
        return soft::analyze(scene, &soft::Bodies::default());
    }
    let (modes, notes) = modes(scene);
    let verdicts = modes.iter().map(|mode| analyze_loop(&mode.spec)).collect::<Result<Vec<_>, _>>()?;
    let settled = modes.iter().position(|mode| mode.settled).unwrap_or(0);
    let (headline, spec) = (&verdicts[settled], &modes[settled].spec);
    let switching = if modes.len() > 1 { Switching::Unproven } else { Switching::None };
    Ok(Stability {
        spectral_radius: verdicts.iter().map(|verdict| verdict.spectral_radius).fold(0.0, f64::max),
        stable: verdicts.iter().all(|verdict| verdict.stable),
        rigid_body_poles: headline.rigid_body_poles,
        drag_pole: headline.drag_pole,
        states: spec.coordinates()?.len(),
        period_s: period_s(spec),
        warnings: warnings(scene, &modes, &verdicts, notes),
        switching,
        modes: modes
            .into_iter()
            .zip(verdicts)
            .map(|(mode, LoopStability { spectral_radius, stable, axis, .. })| ModeStability {
                contacts: mode.contacts,
                spectral_radius,
                stable,
                axis,
            })
            .collect(),
    })
}

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
    let (states, ticks) = (layout.coordinates.len(), spec.schedule.ticks_per_pattern());
    if (states * states) as f64 * ticks as f64 > MOST_WORK {
        return Err(AnalysisError::TooLarge { states, ticks });
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
    axis: Option<&'static str>,
}

/// Nothing where the state outgrows floating point.
fn poles(share: &Share, with_axis: bool) -> Result<Option<Poles>, EigenvalueError> {
    let spec = &share.spec;
    let layout = Layout::new(spec, Registers::Shared);
    let matrix = stepping::lift(spec, &layout).matrix;
    if has_outgrown(&matrix) {
        return Ok(None);
    }
    let structure = structure(share, &layout, &matrix);
    let (rigid, dragged, loose) = (structure.rigid.len(), structure.dragged, structure.loose.len());
    let Remaining { eigenvalues, dominant } = if with_axis {
        remaining_eigenvalues(spec, &layout, matrix, &structure)?
    } else {
        Remaining { eigenvalues: poles_of(matrix, &structure)?, dominant: None }
    };
    Ok(Some(Poles { eigenvalues, copies: share.copies, rigid, dragged, loose, axis: dominant }))
}

/// What of a share's map is 1 by structure.
pub(crate) fn structure(share: &Share, layout: &Layout, map: &DMatrix<f64>) -> Structure {
    if share.opposed { Structure::default() } else { Structure::new(&share.spec, layout, map) }
}

pub(crate) fn has_outgrown(map: &DMatrix<f64>) -> bool {
    map.iter().any(|value| !value.is_finite() || value.abs() > LARGEST_GROWTH)
}

fn together(shares: Vec<Poles>) -> LoopStability {
    let radius = |share: &Poles| eigenvalues::spectral_radius(&share.eigenvalues);
    let axis = shares.iter().max_by(|one, other| radius(one).total_cmp(&radius(other)));
    let axis = axis.and_then(|share| share.axis);
    let sum = |count: fn(&Poles) -> usize| shares.iter().map(count).sum::<usize>();
    let (rigid, dragged, loose_parts) =
        (sum(|share| share.rigid), sum(|share| share.dragged), sum(|share| share.loose));
    let mut eigenvalues = Vec::new();
    for share in shares {
        (0..share.copies).for_each(|_| eigenvalues.extend_from_slice(&share.eigenvalues));
    }
    let drag_pole = (dragged > 0).then(|| nearest_to_one(&eigenvalues)).flatten();
    eigenvalues.extend(std::iter::repeat_n(Complex::new(1.0, 0.0), loose_parts));
    let spectral_radius = eigenvalues::spectral_radius(&eigenvalues);
    LoopStability {
        spectral_radius,
        stable: is_stable(spectral_radius, loose_parts),
        rigid_body_poles: rigid as u8,
        drag_pole,
        loose_parts,
        axis,
        eigenvalues,
    }
}

/// The verdict on a loop.
pub(crate) fn is_stable(spectral_radius: f64, loose_parts: usize) -> bool {
    loose_parts == 0 && spectral_radius < 1.0 + NEUTRAL
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
        eigenvalues: Vec::new(),
    }
}

/// What does not follow from structure.
struct Remaining {
    eigenvalues: Vec<Complex<f64>>,
    /// The axis of the largest one.
    dominant: Option<&'static str>,
}

fn remaining_eigenvalues(
    spec: &LoopSpec,
    layout: &Layout,
    mut matrix: DMatrix<f64>,
    structure: &Structure,
) -> Result<Remaining, EigenvalueError> {
    let scales = balance(&mut matrix);
    let only_axis = dominant_axis(spec);
    let balanced = matches!(only_axis, Dominant::Among).then(|| matrix.clone());
    let eigenvalues = eigenvalues_of_rest(matrix, &scales, structure)?;
    let dominant = match (only_axis, balanced) {
        (Dominant::Only(axis), _) => Some(axis),
        (Dominant::Among, Some(balanced)) => {
            crate::dominant::axis_of_largest(spec, layout, &balanced, &scales, &eigenvalues)
        }
        (Dominant::Among, None) => None,
    };
    Ok(Remaining { eigenvalues, dominant })
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
    mut matrix: DMatrix<f64>,
    scales: &[f64],
    structure: &Structure,
) -> Result<Vec<Complex<f64>>, EigenvalueError> {
    let unscale = |vector: &DVector<f64>| DVector::from_fn(vector.len(), |i, _| vector[i] / scales[i]);
    let mut vectors: Vec<_> = structure.rigid.iter().chain(&structure.loose).map(unscale).collect();
    let deflated = !vectors.is_empty();
    vectors.reverse();
    // Each vector is an eigenvector once those before it are gone.
    while let Some(vector) = vectors.pop() {
        debug_assert!(
            is_eigenvector(&matrix, &vector, structure.rounding),
            "a structural vector must belong to the eigenvalue 1"
        );
        let (reduced, reflection) = deflate(&matrix, &vector);
        matrix = reduced;
        for later in &mut vectors {
            *later = reflection.deflate_vector(later);
        }
    }
    if deflated {
        balance(&mut matrix);
    }
    eigenvalues::check(&matrix)?;
    of_balanced(&matrix)
}

/// Whether `A·v = v`, to a relative `rounding`.
fn is_eigenvector(matrix: &DMatrix<f64>, vector: &DVector<f64>, rounding: f64) -> bool {
    (matrix * vector - vector).norm() <= rounding * (1.0 + matrix.norm()) * vector.norm()
}

fn nearest_to_one(eigenvalues: &[Complex<f64>]) -> Option<f64> {
    let real = eigenvalues.iter().filter(|value| value.im == 0.0).map(|value| value.re);
    real.min_by(|a, b| (a - 1.0).abs().total_cmp(&(b - 1.0).abs()))
}

fn period_s(spec: &LoopSpec) -> f64 {
    let control = spec.schedule.control();
    spec.schedule.ticks_per_pattern() as f64 * control.denominator() as f64 / control.numerator() as f64
}

#[cfg(test)]
mod tests;
