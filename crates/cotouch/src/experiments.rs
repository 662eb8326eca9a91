//! The seeds' experiments: what was printed, what comes out here, and whether they agree.

mod grasp;
mod link;
mod local_regions;
mod local_steps;
mod push_wall;
mod regions;
mod runs;
mod sinusoid;
mod transparency;

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

/// All of them, in the order of the seeds.
pub(crate) const ALL: &[Experiment] = &[
    link::TABLE_1_1,
    regions::FIGURE_5_1,
    regions::FIGURE_5_2,
    regions::FIGURE_5_3,
    regions::FIGURE_5_4,
    transparency::FIGURE_6_2,
    transparency::EQUATION_6_3,
    transparency::TABLE_6_2,
    transparency::FIGURE_6_4,
    transparency::FIGURE_6_5,
    transparency::EQUATION_6_4,
    transparency::EQUATION_B_10,
    transparency::EQUATION_B_11,
    grasp::FIGURE_8_1,
    sinusoid::FIGURE_8_3,
    push_wall::FIGURE_8_4,
    local_steps::FIGURE_7,
    local_steps::FIGURE_8,
    local_steps::FIGURE_9,
    local_regions::FIGURE_10,
    local_regions::FIGURE_11,
    local_steps::EQUATION_4,
    local_steps::EQUATION_5,
    local_regions::EQUATION_9,
];

/// What came of an experiment.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    /// What the seed prints.
    pub(crate) seed_value: Json,
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
    fn new(text: impl Into<String>, holds: bool) -> Self {
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
