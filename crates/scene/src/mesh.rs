//! Closed triangle meshes, read from files.

use glam::{DMat3, DVec3};

/// A closed triangle mesh with outward normals: scaled to metres, its centre of mass at the origin.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    /// m.
    pub vertices: Vec<DVec3>,
    /// Three vertices each, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// m³.
    pub volume_m3: f64,
    /// Inertia about the centre of mass of a body of this shape and uniform density, per kilogram: m².
    pub inertia_per_mass_m2: DMat3,
}
