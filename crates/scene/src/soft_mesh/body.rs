//! The mesh of a soft object as it is used.

use glam::DVec3;

use super::error::{MAX_ELEMENTS, SoftMeshError};
use super::region::FixedRegion;
use super::topology;
use crate::mesh::{TriangleMesh, Triangles};

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

impl SoftMesh {
    /// The body of these tetrahedra, with its surface. Nodes that no tetrahedron has are left out. Where all tetrahedra are
    /// turned inside out, they are turned back: some programs write them so.
    ///
    /// # Errors
    /// When a tetrahedron is inverted, flat, or names a node that does not exist, or they do not make a body.
    pub fn from_tetrahedra(nodes_m: Vec<DVec3>, tetrahedra: Vec<[u32; 4]>) -> Result<Self, SoftMeshError> {
        let tetrahedra = topology::checked_tetrahedra(&nodes_m, tetrahedra)?;
        let triangles = topology::surface(&tetrahedra)?;
        topology::check_extent(&nodes_m, tetrahedra.iter().flatten())?;
        let mut mesh = Self { nodes_m, tetrahedra, triangles, tied_n_per_m: 0.0 };
        mesh.drop_unused();
        Ok(mesh)
    }

    /// A closed skin, without anything inside.
    ///
    /// # Errors
    /// When it is not closed, or has too many triangles; otherwise as [`TriangleMesh::closed`].
    pub fn from_skin(triangles: &Triangles) -> Result<Self, SoftMeshError> {
        if triangles.triangles.len() > MAX_ELEMENTS {
            return Err(SoftMeshError::TooLarge { found: triangles.triangles.len() });
        }
        let (nodes_m, triangles) = TriangleMesh::closed_in_place(triangles)?;
        Ok(Self { nodes_m, tetrahedra: Vec::new(), triangles, tied_n_per_m: 0.0 })
    }

    /// The surface alone, without the tetrahedra.
    #[must_use]
    pub fn skin(mut self) -> Self {
        self.tetrahedra.clear();
        self.drop_unused();
        self
    }

    /// Within the surface, m³; 0 of a spring.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        if self.tied_n_per_m > 0.0 {
            return 0.0;
        }
        let middle = self.nodes_m.iter().sum::<DVec3>() / self.nodes_m.len().max(1) as f64;
        let at = |node: u32| self.nodes_m[node as usize] - middle;
        self.triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))) / 6.0).sum()
    }

    /// Which nodes rest in a fixed region.
    #[must_use]
    pub fn fixed_nodes(&self, regions: &[FixedRegion]) -> Vec<bool> {
        let is_fixed = |&node: &DVec3| regions.iter().any(|region| region.contains(node));
        self.nodes_m.iter().map(is_fixed).collect()
    }

    /// Removes the nodes that neither a tetrahedron nor a triangle has.
    fn drop_unused(&mut self) {
        let mut used = vec![false; self.nodes_m.len()];
        let all = self.tetrahedra.iter().flatten().chain(self.triangles.iter().flatten());
        all.for_each(|&node| used[node as usize] = true);
        let mut next = 0;
        let renumbered: Vec<u32> = used
            .iter()
            .map(|&used| {
                next += u32::from(used);
                next.wrapping_sub(1)
            })
            .collect();
        let mut left = used.iter();
        self.nodes_m.retain(|_| left.next() == Some(&true));
        let nodes = self.tetrahedra.iter_mut().flatten().chain(self.triangles.iter_mut().flatten());
        nodes.for_each(|node| *node = renumbered[*node as usize]);
    }
}
