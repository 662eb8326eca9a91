//! `cotouch local-model check`, `step`, `choose` and `compare`.

mod check;
mod choose;
mod compare;
mod step;
mod words;

use cotouch_analysis::local_model::LocalModelError;
use cotouch_scene::Override;

use crate::arguments::LocalModel;
use crate::failure::{Failure, Verdict};
use crate::output::Output;

/// Does what was asked for with a local model.
pub(super) fn local_model(
    what: &LocalModel,
    overrides: &[Override],
    output: &Output,
) -> Result<Verdict, Failure> {
    match what {
        LocalModel::Check(check) => check::check(check, output),
        LocalModel::Step(step) => step::step(step, output),
        LocalModel::Choose(choose) => choose::choose(choose, output),
        LocalModel::Compare { scene, duration_s } => compare::compare(scene, *duration_s, overrides, output),
    }
}

impl From<LocalModelError> for Failure {
    fn from(error: LocalModelError) -> Self {
        match error {
            LocalModelError::Eigenvalues(error) => Self::Running(error.into()),
            refused => Self::usage(refused),
        }
    }
}
