//! What `cotouch-scene` promises from outside, in one program.

mod errors;
mod mechanism;
mod meshes;
mod properties;
mod reading;
mod soft;
mod soft_files;
