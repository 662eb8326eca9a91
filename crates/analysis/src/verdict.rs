//! What is said of a scene and of its loops.

mod unsettled;

use nalgebra::Complex;
use serde::Serialize;

use crate::check::SpecError;
use crate::left_out::LeftOut;
use crate::soft::SoftAnalysisError;
use cotouch_matrix::EigenvalueError;

pub use unsettled::{HandPolicy, UnsettledMotion};

/// The verdict on a scene; serialises to the document of `cotouch analyze stability`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stability {
    /// Largest absolute eigenvalue over one pattern, in the worst contact mode, without the rigid-body poles.
    /// Infinite where the state grows more than 10¹²⁰-fold within one pattern.
    pub spectral_radius: f64,
    /// True where every contact that the scene's users can make, by script, by a device or by a hand taken on the page, in
    /// every combination that their fingers allow, was analysed, every mode is stable, and switching between the modes is
    /// `none` or `searched`. False as soon as one analysed mode is unstable. `None` where all that was analysed is stable
    /// and something that can happen was not (`left_out`), or switching is unproven.
    pub stable: Option<bool>,
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
    /// The largest common factor on the springs of all contacts, alone and together with their dampers, up to which every
    /// mode stays stable, at most 4: how far the scene is from the line. Where the scene is otherwise stable, of every judged
    /// mode; else, for that costs time, of those in which each finger touches all copies or none. `None` where that was not
    /// asked, and where there is nothing to switch.
    pub switching_distance: Option<f64>,
    /// What an adversary that opens and closes contacts keeps moving.
    pub switching_found: Option<UnsettledMotion>,
    /// The mode that comes nearest to growing.
    pub worst: Option<Worst>,
    /// What can happen in this scene and was not analysed.
    pub left_out: Vec<LeftOut>,
    /// What the linear analysis leaves out, in plain sentences.
    pub warnings: Vec<String>,
}

impl Stability {
    /// Whether each analysed mode is stable: what maps and margins are about.
    #[must_use]
    pub fn each_mode_is_stable(&self) -> bool {
        self.modes.iter().all(|mode| mode.stable)
    }
}

/// The contact mode that grows fastest; where none does, that with the largest absolute eigenvalue among motions that swing at 1 Hz or
/// faster: what dies out slowly without swinging says nothing about how near a loop is to shaking. Of [`analyze_settled`](crate::analyze_settled), that with the largest
/// spectral radius.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Worst {
    /// The contacts that are closed in it.
    pub contacts: Vec<String>,
    /// Of its own part of the loop. It may be above [`Stability::spectral_radius`], which is of the modes that are listed: this
    /// one may have been found by the search from these.
    pub spectral_radius: f64,
    /// Where they touch, where this was searched for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<Vec<ContactPlace>>,
    /// The gain that moves its spectral radius most, where this was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain: Option<WorstGain>,
}

/// Where a contact touches a body.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactPlace {
    /// Which contact.
    pub contact: String,
    /// Which body.
    pub body: String,
    /// On the surface, body frame, m.
    pub at_m: [f64; 3],
}

/// The gain that moves a mode's spectral radius most.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstGain {
    /// A scene key.
    pub key: String,
    /// Its value in the scene.
    pub value: f64,
    /// The change of the spectral radius per relative change of the gain: dρ/d(ln gain).
    pub slope: f64,
}

/// The verdict on one contact mode.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModeStability {
    /// The switching contacts that are closed.
    pub contacts: Vec<String>,
    /// As in [`Stability`].
    pub spectral_radius: f64,
    /// Whether the spectral radius is below 1, or 1 but for rounding (within 1e-11): neutral.
    pub stable: bool,
    /// Which way things mostly move in the motion that belongs to the largest eigenvalue, by kinetic energy: "x", "y",
    /// "z", or "rx", "ry", "rz" for turning. `None` where that motion cannot be told.
    pub axis: Option<&'static str>,
    /// How fast a body topples, buckles or slips away in this mode by its statics alone, with perfect devices and no delay, 1/s.
    /// Such a pole is the mechanics' and not the loop's: it does not count in the spectral radius, as rigid-body poles
    /// do not. `None` where nothing does.
    pub toppling_per_s: Option<f64>,
}

/// A pole that is 1 but for rounding neither grows nor dies out: a body that pivots about what holds it. Something that
/// grew by less than this a period would take years to be seen.
pub(crate) const NEUTRAL: f64 = 1e-11;

/// What is known about switching between contact modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Switching {
    /// There is one linear mode, and nothing to switch.
    None,
    /// An adversary that opens and closes one-sided contacts found nothing, and the loop is far enough from the line for
    /// that to mean something: [`Stability::switching_distance`] says how far.
    Searched,
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
    /// How fast poles of the mechanics themselves grow, 1/s, the fastest first; they are not among the eigenvalues: what
    /// topples would do so with perfect devices and no delay as well.
    pub toppling_per_s: Vec<f64>,
    /// The eigenvalues, without the rigid-body poles, of the state in which receivers share samples
    /// ([`crate::loop_spec::LoopSpec::lift_shared`]).
    pub eigenvalues: Vec<Complex<f64>>,
}

/// The verdict at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointVerdict {
    /// As in [`Stability`].
    pub spectral_radius: f64,
    /// Whether each analysed mode is stable.
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
        "the loop has {states} states and a pattern of {ticks} ticks; at most 2000 states, and 1e9 state·state·ticks, are analysed: choose rates whose ratio is simpler, fewer users or a shorter delay"
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
