//! What is said of a scene and of its loops.

use nalgebra::Complex;
use serde::Serialize;

use crate::check::SpecError;
use crate::eigenvalues::EigenvalueError;
use crate::soft::SoftAnalysisError;

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
    /// ([`crate::loop_spec::LoopSpec::lift_shared`]).
    pub eigenvalues: Vec<Complex<f64>>,
}

/// The verdict at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointVerdict {
    /// As in [`Stability`].
    pub spectral_radius: f64,
    /// As in [`Stability`].
    pub stable: bool,
}

impl PointVerdict {
    /// Of no mode at all.
    pub(crate) const NONE: Self = Self { spectral_radius: 0.0, stable: true };

    /// The worse of two modes.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            spectral_radius: self.spectral_radius.max(other.spectral_radius),
            stable: self.stable && other.stable,
        }
    }
}

/// The verdict on a loop.
pub(crate) fn is_stable(spectral_radius: f64, loose_parts: usize) -> bool {
    loose_parts == 0 && spectral_radius < 1.0 + NEUTRAL
}

/// Why there is no verdict.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AnalysisError {
    /// The loop's description is inconsistent.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// Too much to compute.
    #[error(
        "the loop has {states} states and a pattern of {ticks} ticks; at most 1e9 state·state·ticks are analysed: choose rates whose ratio is simpler, fewer users or a shorter delay"
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
