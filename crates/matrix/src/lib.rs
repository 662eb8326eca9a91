//! Eigenvalues, eigenvectors, singular values and triangular factors of dense matrices, in the types of nalgebra.
//!
//! What is behind it is faer, and for eigenvalues an iteration of our own, which ends. It is a crate by itself because a library that is
//! generic in its numbers is compiled anew wherever it is used: here once.

mod eigenvalues;
mod eigenvectors;
mod singular_values;
mod triangle;

pub use eigenvalues::{EigenvalueError, balance, check, eigenvalues, of_balanced, spectral_radius};
pub use eigenvectors::eigenvectors;
pub use singular_values::{SingularValues, principal_directions};
pub use triangle::upper_triangle;
