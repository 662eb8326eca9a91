//! Why nothing can be said of what users perceive.

use crate::check::SpecError;
use crate::verdict::AnalysisError;

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TransparencyError {
    /// The loop cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// Not a frequency.
    #[error("frequencies must be positive and finite, in rad/s; found {0}")]
    Frequency(f64),
    /// Nobody of that number.
    #[error("there is no user {found}; the scene has users 1 to {users}")]
    User {
        /// From 1.
        found: u32,
        /// How many there are.
        users: u8,
    },
}

impl From<SpecError> for TransparencyError {
    fn from(error: SpecError) -> Self {
        Self::Analysis(error.into())
    }
}
