//! Why there is no answer about a local model.

use cotouch_scene::time::{RateError, ScheduleError};

use crate::check::SpecError;
use cotouch_matrix::EigenvalueError;

/// Why there is no answer about a local model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LocalModelError {
    /// K_o.
    #[error("K_o must be a stiffness above 0 N/m; found {0}")]
    Stiffness(f64),
    /// K_h or INT.
    #[error("{0} must be 0 N/m or more, and at most 10¹² times K_o; found {1}")]
    Gain(&'static str, f64),
    /// N.
    #[error("a slow period has 1 to {MAX_TICKS} haptic ticks; found {0}")]
    Ratio(usize),
    /// Weights of the returned force.
    #[error("the weights of the returned force must be finite numbers that sum to 1; they sum to {0}")]
    Weights(f64),
    /// The step of the hand, periods, thresholds, …
    #[error("{what} must be {allowed}; found {found}")]
    Number {
        /// In words, with the unit.
        what: &'static str,
        /// Likewise.
        allowed: &'static str,
        /// What was given.
        found: f64,
    },
    /// A response of too many ticks.
    #[error("a response of {0:.3e} haptic ticks is asked for; at most {1:e} are computed")]
    TooLong(f64, f64),
    /// The compliance of contacts.
    #[error("a joint compliance must be a symmetric, positive definite matrix: {0}")]
    Compliance(String),
    /// A slow period that is the period of no rate.
    #[error(transparent)]
    Rate(#[from] RateError),
    /// A slow period that is longer than a schedule can be.
    #[error(transparent)]
    Schedule(#[from] ScheduleError),
    /// Numbers that leave no finite loop.
    #[error(transparent)]
    Loop(#[from] SpecError),
    /// No eigenvalues.
    #[error(transparent)]
    Eigenvalues(#[from] EigenvalueError),
}

/// Haptic ticks in a slow period, at most.
pub(super) const MAX_TICKS: usize = 10_000;
