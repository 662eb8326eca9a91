//! Meshes of soft objects: tetrahedra, or the skin of a balloon; from files, generators, and closed surfaces that are filled.
//!
//! What is used is always checked: no tetrahedron is inverted or flat, the surface is closed and every edge of it is in two
//! triangles, and every piece of the mesh is held by at least three nodes that are not on a line.

mod body;
mod error;
mod files;
mod fill;
mod generators;
mod held;
mod region;
pub mod solids;
mod topology;

pub use body::SoftMesh;
pub use error::{LEAST_SHAPE, MAX_ELEMENTS, SoftMeshError};
pub use files::{Cells, TetrahedraFormat};
pub(crate) use generators::{block, spring};
pub use region::FixedRegion;
