//! `cotouch local-model check`, `step` and `choose`.

use crate::arguments::LocalModel;
use crate::failure::{Failure, Verdict};
use crate::output::Output;

/// Does what was asked for with a local model.
pub(super) fn local_model(_what: &LocalModel, _output: &Output) -> Result<Verdict, Failure> {
    todo!("helper 5")
}
