//! What the tests of several crates need. Only ever a dev-dependency.

mod allocation;
pub mod meshes;
mod random;
pub mod scenes;

pub use allocation::{allocations, deallocations};
pub use random::Random;
pub use scenes::built_in;
