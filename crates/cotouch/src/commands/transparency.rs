//! `cotouch analyze damping`, `admittance` and `stiffness`: what users perceive of the object.

use cotouch_analysis::sweep::Grid;
use cotouch_scene::Override;

use crate::failure::{Failure, Verdict};
use crate::output::Output;

/// Says what held data add to the damping that a user feels; `user` is a name, or a number from 1.
pub(super) fn damping(
    _name: &str,
    _user: &str,
    _overrides: &[Override],
    _output: &Output,
) -> Result<Verdict, Failure> {
    todo!("helper 2")
}

/// Says what users feel over frequency.
pub(super) fn admittance(
    _name: &str,
    _frequencies: &Grid,
    _overrides: &[Override],
    _output: &Output,
) -> Result<Verdict, Failure> {
    todo!("helper 2")
}

/// Says what users feel at rest.
pub(super) fn stiffness(_name: &str, _overrides: &[Override], _output: &Output) -> Result<Verdict, Failure> {
    todo!("helper 2")
}
