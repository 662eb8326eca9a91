//! What an experiment is, and what comes of one.

use serde::Serialize;
use serde_json::Value as Json;

/// An experiment that can be repeated.
pub(crate) struct Experiment {
    /// As on the command line.
    pub(crate) id: &'static str,
    /// What the seed shows there.
    pub(crate) title: &'static str,
    /// Does it.
    pub(crate) run: fn() -> anyhow::Result<Outcome>,
}

/// What came of an experiment.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    /// What the seed prints.
    pub(crate) published_value: Json,
    /// What comes out here.
    pub(crate) value: Json,
    /// Whether the two are the same, within what the seed prints.
    pub(crate) agrees: bool,
    /// Why not, or what to know about it.
    pub(crate) note: String,
    /// What the seed says in words, and whether it holds here.
    pub(crate) claims: Vec<Claim>,
    /// Rows for people: name, seed, here.
    pub(crate) rows: Vec<[String; 3]>,
    /// The figure, as SVG.
    pub(crate) figure: Option<String>,
    /// Its numbers, as CSV.
    pub(crate) table: Option<String>,
    /// Commands that show the same.
    pub(crate) commands: Vec<String>,
}

/// A sentence of a seed.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Claim {
    /// In words.
    pub(crate) text: String,
    /// Whether it holds.
    pub(crate) holds: bool,
}

impl Claim {
    pub(super) fn new(text: impl Into<String>, holds: bool) -> Self {
        Self { text: text.into(), holds }
    }
}

/// Columns of equal length as CSV.
pub(crate) fn csv(header: &[String], columns: &[&[f64]]) -> String {
    let rows = columns.iter().map(|column| column.len()).max().unwrap_or(0);
    let mut text = header.join(",") + "\n";
    for row in 0..rows {
        let cells = columns
            .iter()
            .map(|column| column.get(row).map_or_else(String::new, |value| format!("{value:?}")));
        text.push_str(&cells.collect::<Vec<_>>().join(","));
        text.push('\n');
    }
    text
}

/// A row for people: its name, what is printed and what comes out here.
pub(super) fn row(name: &str, printed: &str, here: String) -> [String; 3] {
    [name.to_owned(), printed.to_owned(), here]
}
