//! What a control is set to.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Values of controls, by key: numbers or choices.
pub(crate) type Settings = BTreeMap<String, Setting>;

/// What a control is set to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub(crate) enum Setting {
    /// Of a number or a whole number.
    Number(f64),
    /// The word that is chosen of a choice.
    Choice(String),
}

/// A text from outside, short enough to be said back: at most so many letters.
pub(crate) fn shortened(text: &str, max: usize) -> String {
    text.chars().filter(|letter| !letter.is_control()).take(max).collect()
}
