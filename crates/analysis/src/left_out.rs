//! What a verdict does not cover.

use std::fmt;

use serde::Serialize;

/// Something that can happen in a scene and was not analysed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// What, as the beginning of a sentence: "Contacts between bodies".
    pub what: String,
    /// Why it was not analysed, as a sentence without its full stop.
    pub why: String,
}

impl LeftOut {
    pub(crate) fn new(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self { what: what.into(), why: why.into() }
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: not analysed, {}.", self.what, self.why)
    }
}
