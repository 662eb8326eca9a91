//! What is said of keys whose values do not go together.

/// Keys whose values do not go together.
pub(crate) struct Conflict {
    /// The first is the one to name; all of them are involved.
    pub(crate) keys: Vec<String>,
    pub(crate) found: String,
    /// Follows "it must be".
    pub(crate) allowed: String,
}

pub(super) fn conflict(keys: &[&str], found: impl Into<String>, allowed: impl Into<String>) -> Conflict {
    Conflict {
        keys: keys.iter().map(|&key| key.to_owned()).collect(),
        found: found.into(),
        allowed: allowed.into(),
    }
}
