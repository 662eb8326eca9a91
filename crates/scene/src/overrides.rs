//! `KEY=VALUE`: a key that is set from outside the scene's text, as `--set` does.

use std::str::FromStr;
use std::sync::Arc;

use crate::error::{Place, Problem, SceneError};
use crate::tree::{self, Node, Table, shorten};

/// A key and the value that it is to have, whatever the scene's text says.
///
/// The value is TOML; what is no TOML is a text, so that `session.architecture=centralized` and
/// `rates.network_hz=1024/10` need no quotes. An element of a list is named by its number, from 1:
/// `user.2.repeat=false`.
#[derive(Clone, Debug)]
pub struct Override {
    key: String,
    node: Node,
}

/// A text that is no override.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{found}\" is not an override; it must be KEY=VALUE, such as hand.mass_kg=0.2")]
pub struct OverrideError {
    /// The text, shortened.
    pub found: String,
}

impl Override {
    /// Sets `key` to a number.
    #[must_use]
    pub fn number(key: &str, number: f64) -> Self {
        let text = crate::value::plain(number);
        let place = Place::Override(format!("--set {key}={text}").into());
        Self { key: key.to_owned(), node: read_value(&text, place) }
    }

    /// The same, called `words` where something is wrong with it: it was not written as `--set`.
    #[must_use]
    pub fn written_as(mut self, words: &str) -> Self {
        self.node.place = Place::Override(shorten(words).into());
        self
    }

    /// The key that is set, dotted.
    #[must_use]
    pub fn key(&self) -> &str {
        &self.key
    }

    pub(crate) fn apply(&self, tree: &mut Table) -> Result<(), SceneError> {
        let path: Vec<&str> = self.key.split('.').collect();
        tree::put(tree, &path, self.node.clone()).map_err(|hint| SceneError {
            place: self.node.place.clone(),
            problem: Problem::UnknownKey { key: self.key.clone(), hint },
        })
    }
}

impl FromStr for Override {
    type Err = OverrideError;

    fn from_str(text: &str) -> Result<Self, OverrideError> {
        let error = || OverrideError { found: shorten(text) };
        let (key, value) = text.split_once('=').ok_or_else(error)?;
        let (key, value) = (key.trim(), value.trim());
        if !is_key(key) || value.is_empty() {
            return Err(error());
        }
        let label: Arc<str> = format!("--set {key}={}", shorten(value)).into();
        Ok(Self { key: key.to_owned(), node: read_value(value, Place::Override(label)) })
    }
}

/// Bare names with dots between; no scene key is nearly as long as what this lets through.
fn is_key(key: &str) -> bool {
    let is_name = |name: &str| {
        !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-')
    };
    key.len() <= 100 && key.split('.').all(is_name)
}

fn read_value(text: &str, place: Place) -> Node {
    if let Some(node) = tree::parse_value(text, &place) {
        return node;
    }
    let starts_as_number = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    if starts_as_number && text.parse::<f64>().is_ok() {
        Node::decimal(text, place)
    } else {
        Node::text(text, place)
    }
}
