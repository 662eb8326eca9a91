//! What can be wrong with a scene, where, and what is allowed instead.

use std::fmt;
use std::sync::Arc;

/// Where something was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// In a file or a text.
    File {
        /// The file's path, or the label of the text.
        label: Arc<str>,
        /// Counted from 1; none when the file as a whole is meant.
        line: Option<usize>,
    },
    /// In an override, as it was written: `--set KEY=VALUE`.
    Override(Arc<str>),
    /// In a number that a program gives to a key: `KEY=VALUE`.
    Number(Arc<str>),
}

impl Place {
    /// A file or text as a whole.
    pub(crate) fn file(label: &str) -> Self {
        Self::File { label: label.into(), line: None }
    }

    /// A reader expects a file's problems from top to bottom, and those of the overrides after them.
    pub(crate) fn order(&self) -> (bool, Option<usize>) {
        match self {
            Self::File { line, .. } => (false, *line),
            Self::Override(_) | Self::Number(_) => (true, None),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { label, line: Some(line) } => write!(formatter, "{label}:{line}"),
            Self::File { label, line: None } => formatter.write_str(label),
            Self::Override(text) | Self::Number(text) => formatter.write_str(text),
        }
    }
}

/// One problem of a scene, in one sentence: place, key, what was found and what is allowed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}")]
pub struct SceneError {
    /// Where it was found.
    pub place: Place,
    /// What is wrong there.
    pub problem: Problem,
}

/// What is wrong at some place of a scene.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// A value of the wrong kind, out of its range, or in conflict with another.
    #[error("{key} is {found}; it must be {allowed}")]
    NotAllowed {
        /// Dotted; elements of lists are counted from 1 (`user.2.script.1.duration_s`).
        key: String,
        /// The value as written, shortened.
        found: String,
        /// Follows "it must be".
        allowed: String,
    },
    /// A key that must be written was not.
    #[error("{key} is missing; it must be {allowed}")]
    Missing {
        /// The key, dotted.
        key: String,
        /// Follows "it must be".
        allowed: String,
    },
    /// No scene has such a key.
    #[error("{key} is not a scene key; {hint}")]
    UnknownKey {
        /// The key as written, dotted.
        key: String,
        /// The nearest key, or the keys that are allowed there.
        hint: String,
    },
    /// The text is not TOML.
    #[error("this is not TOML: {0}")]
    Syntax(String),
    /// A file could not be read, is too long, or is not UTF-8.
    #[error("{0}")]
    Unreadable(String),
}

/// Everything that is wrong with a scene; at least one problem. Displayed one a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneErrors(Vec<SceneError>);

impl SceneErrors {
    /// Sorts the problems for reading; nothing when there is none.
    pub(crate) fn from_list(mut errors: Vec<SceneError>) -> Option<Self> {
        errors.sort_by_key(|error| error.place.order());
        (!errors.is_empty()).then_some(Self(errors))
    }

    /// The problems, in the order of the file, those of overrides last.
    pub fn iter(&self) -> impl Iterator<Item = &SceneError> {
        self.0.iter()
    }
}

impl From<SceneError> for SceneErrors {
    fn from(error: SceneError) -> Self {
        Self(vec![error])
    }
}

impl std::error::Error for SceneErrors {}

impl fmt::Display for SceneErrors {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, error) in self.0.iter().enumerate() {
            let line_break = if index == 0 { "" } else { "\n" };
            write!(formatter, "{line_break}{error}")?;
        }
        Ok(())
    }
}
