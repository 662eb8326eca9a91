//! Why a recording cannot be read.

use std::io;
use std::path::PathBuf;

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be opened.
    #[error("cannot open the recording {}: {source}", path.display())]
    Open {
        /// The path that was asked for.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The system failed while reading.
    #[error("cannot read the recording at byte {at}: {source}")]
    Read {
        /// Offset in the file.
        at: u64,
        /// What the system said.
        source: io::Error,
    },
    /// The file is none of cotouch's recordings.
    #[error("this is no recording that this cotouch can read: found {found}, expected {expected}")]
    Foreign {
        /// What the file has.
        found: String,
        /// What a recording has there.
        expected: String,
    },
    /// Something in the file is wrong.
    #[error("the recording is damaged at byte {at}: found {found}, expected {expected}")]
    Malformed {
        /// Offset in the file.
        at: u64,
        /// What stands there in the file.
        found: String,
        /// What should be there.
        expected: String,
    },
}

impl RecordingError {
    pub(crate) fn malformed(at: u64, found: impl ToString, expected: impl ToString) -> Self {
        Self::Malformed { at, found: found.to_string(), expected: expected.to_string() }
    }

    pub(super) fn foreign(found: impl ToString, expected: impl ToString) -> Self {
        Self::Foreign { found: found.to_string(), expected: expected.to_string() }
    }
}
