//! `cotouch analyze margin`.

use cotouch_scene::Override;

use crate::failure::{Failure, Verdict};
use crate::output::Output;

/// Says how far a scene is from instability.
pub(super) fn margin(_name: &str, _overrides: &[Override], _output: &Output) -> Result<Verdict, Failure> {
    todo!("helper 4")
}
