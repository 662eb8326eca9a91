//! `cotouch analyze stability --sweep …`.

use cotouch_analysis::sweep::Sweep;
use cotouch_scene::Override;

use crate::failure::{Failure, Verdict};
use crate::output::Output;

/// Says where in the plane of two keys a scene is stable.
pub(super) fn map(
    _name: &str,
    _x: &Sweep,
    _y: Option<&Sweep>,
    _with_radius: bool,
    _overrides: &[Override],
    _output: &Output,
) -> Result<Verdict, Failure> {
    todo!("helper 4")
}
