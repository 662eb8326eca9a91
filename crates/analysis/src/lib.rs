//! x
pub mod check;
pub mod compile;
mod discretise;
pub mod eigenvalues;
pub mod lift;
pub mod loop_spec;
mod rigid;
pub mod stability;
