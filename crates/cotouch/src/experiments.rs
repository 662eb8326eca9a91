//! The seeds' experiments: what was printed, what comes out here, and whether they agree.

mod grasp;
mod link;
mod local_regions;
mod local_steps;
mod outcome;
mod push_wall;
mod regions;
mod runs;
mod sinusoid;
mod transparency;

pub(crate) use outcome::{Claim, Experiment, Outcome, csv};

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
