//! Triangle meshes: checked, centred, with their volume and inertia; from files, hulls and [`generators`].

mod bytes;
mod error;
mod files;
pub mod generators;
mod gltf;
mod topology;
mod triangle_mesh;
mod triangles;

pub(crate) use bytes::{LONGEST_FILE, read_bytes};
pub use error::{EXTENT_M, MAX_TRIANGLES, MeshError};
pub use files::MeshFormat;
pub use triangle_mesh::TriangleMesh;
pub use triangles::Triangles;
pub(crate) use triangles::bounds;
