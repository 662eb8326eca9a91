//! Meshes of soft objects: tetrahedra, or the skin of a balloon; from files, generators, and closed surfaces that are filled.

use glam::DVec3;

/// A checked mesh of a soft object.
#[derive(Clone, Debug, PartialEq)]
pub struct SoftMesh {
    /// Where each node rests, m, world frame.
    pub nodes_m: Vec<DVec3>,
    /// Four nodes each, of positive volume: `(b − a)·((c − a) × (d − a)) > 0`. None in a balloon or a spring.
    pub tetrahedra: Vec<[u32; 4]>,
    /// The surface: three nodes each, counter-clockwise seen from outside. Closed, except a spring's.
    pub triangles: Vec<[u32; 3]>,
    /// N/m: every node is tied to where it rests by an equal share of this stiffness, in every direction (the generator
    /// `spring`); 0 in all others.
    pub tied_n_per_m: f64,
}
