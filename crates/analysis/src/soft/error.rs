//! Why a session with a soft body has no verdict.

use cotouch_soft::SoftError;

use super::slow_body::SingularStep;

/// Why a session with a soft body has no verdict.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SoftAnalysisError {
    /// There is no body.
    #[error(transparent)]
    Body(#[from] SoftError),
    /// The step of the body has no solution.
    #[error(transparent)]
    Step(#[from] SingularStep),
    /// Not of this technique.
    #[error("the technique of this soft body cannot tell its compliance, and so neither what K_o is")]
    NoCompliance,
    /// Likewise.
    #[error("the technique of this soft body cannot tell its linear step, so the loop cannot be analysed")]
    NoLinearisation,
    /// A body that forces do not move.
    #[error("the soft body does not give way where it is touched: a region of soft.fixed holds it there")]
    Rigid,
    /// Too much to compute.
    #[error(
        "the loop has {states} states and its ticks, network steps and slow periods repeat every {ticks} ticks only; choose rates whose ratios are simpler, fewer users or a shorter delay"
    )]
    TooLarge {
        /// n.
        states: usize,
        /// p.
        ticks: u64,
    },
}
