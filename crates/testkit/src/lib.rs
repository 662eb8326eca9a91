//! What the tests of several crates need. Only ever a dev-dependency.

mod allocation;
pub mod meshes;
pub mod scenes;

pub use allocation::{allocations, deallocations};
