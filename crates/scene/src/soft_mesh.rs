//! Meshes of soft objects: tetrahedra, or the skin of a balloon; from files, generators, and closed surfaces that are filled.
//!
//! What is used is always checked: no tetrahedron is inverted or flat, the surface is closed and every edge of it is in two
//! triangles, and every piece of the mesh is held by at least three nodes that are not on a line.

use std::path::Path;

use glam::DVec3;

use crate::mesh::generators::icosphere;
use crate::mesh::{TriangleMesh, Triangles, bounds};
use crate::scene::{FixedRegion, Soft, SoftMeshKind, SoftMeshSource, SoftModel};

mod error;
pub mod files;
mod fill;
pub mod generators;
mod held;
pub mod solids;
mod topology;

pub use error::SoftMeshError;

/// Most tetrahedra, or triangles of a balloon.
pub const MAX_ELEMENTS: usize = 200_000;
/// The least shape of a tetrahedron: 6·√2 times its volume over the cube of its longest edge; 1 is a regular one.
pub const LEAST_SHAPE: f64 = 1e-3;
/// The part of the largest extent that `edge_m = 0` stands for.
const EDGES_ACROSS: f64 = 8.0;

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
    /// The mesh of a scene's soft object: generated, or read from its file, and checked.
    ///
    /// # Errors
    /// Whatever is wrong with it; which element, counted from 1.
    pub fn of(soft: &Soft) -> Result<Self, SoftMeshError> {
        let source = &soft.mesh;
        let mesh = match source.generator {
            SoftMeshKind::Spring => return Ok(generators::spring(source.stiffness_n_per_m, source.origin_m)),
            SoftMeshKind::Beam | SoftMeshKind::Block => {
                let (nodes, tetrahedra) = generators::block(source.size_m, source.cells, source.origin_m);
                Self::of_tetrahedra(nodes, tetrahedra)?
            }
            SoftMeshKind::Balloon => balloon(source)?,
            SoftMeshKind::Ball => {
                solids::ball(source.radius_m, edge_m(source, 2.0 * source.radius_m), source.origin_m)?
            }
            SoftMeshKind::Organ => {
                let edge_m = edge_m(source, 2.0 * source.size_m.max_element());
                solids::organ(source.size_m, edge_m, source.origin_m)?
            }
            SoftMeshKind::File => of_file(soft)?,
        };
        let mesh = if soft.model == SoftModel::Balloon { mesh.skin() } else { mesh };
        mesh.check_held(&soft.fixed)?;
        Ok(mesh)
    }

    /// The body of these tetrahedra, with its surface. Nodes that no tetrahedron has are left out. Where all tetrahedra are
    /// turned inside out, they are turned back: some programs write them so.
    ///
    /// # Errors
    /// When a tetrahedron is inverted, flat, or names a node that does not exist, or they do not make a body.
    pub fn of_tetrahedra(nodes_m: Vec<DVec3>, tetrahedra: Vec<[u32; 4]>) -> Result<Self, SoftMeshError> {
        let tetrahedra = topology::checked_tetrahedra(&nodes_m, tetrahedra)?;
        let triangles = topology::surface(&tetrahedra)?;
        topology::check_extent(&nodes_m, tetrahedra.iter().flatten())?;
        let mut mesh = Self { nodes_m, tetrahedra, triangles, tied_n_per_m: 0.0 };
        mesh.drop_unused();
        Ok(mesh)
    }

    /// A closed skin.
    ///
    /// # Errors
    /// When it is not closed, or has too many triangles; otherwise as [`TriangleMesh::closed`].
    pub fn of_skin(triangles: &Triangles) -> Result<Self, SoftMeshError> {
        if triangles.triangles.len() > MAX_ELEMENTS {
            return Err(SoftMeshError::TooLarge { found: triangles.triangles.len() });
        }
        let (nodes_m, triangles) = TriangleMesh::closed_in_place(triangles)?;
        Ok(Self { nodes_m, tetrahedra: Vec::new(), triangles, tied_n_per_m: 0.0 })
    }

    /// The surface alone.
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

/// The edge length that a mesh of this extent has.
fn edge_m(source: &SoftMeshSource, largest_extent_m: f64) -> f64 {
    if source.edge_m > 0.0 { source.edge_m } else { largest_extent_m / EDGES_ACROSS }
}

fn balloon(source: &SoftMeshSource) -> Result<SoftMesh, SoftMeshError> {
    let edge = edge_m(source, 2.0 * source.radius_m);
    // The edges of an icosahedron are 1.05 times its radius; every subdivision halves them.
    let halvings = (1.05 * source.radius_m / edge).log2().round().max(0.0);
    // 6: 81 920 triangles.
    if halvings > 6.0 {
        return Err(SoftMeshError::TooLarge { found: 20 * 4usize.saturating_pow(halvings as u32) });
    }
    let mut sphere = icosphere(source.radius_m, halvings as u32);
    sphere.vertices.iter_mut().for_each(|vertex| *vertex += source.origin_m);
    SoftMesh::of_skin(&sphere)
}

/// Tetrahedra, or a surface that is filled with them or is a balloon's skin.
fn of_file(soft: &Soft) -> Result<SoftMesh, SoftMeshError> {
    let SoftMeshSource { file, scale, origin_m, .. } = &soft.mesh;
    let path = Path::new(file);
    let surface = if crate::mesh::files::Format::of(path).is_some() {
        let mut triangles = Triangles::read(path, *scale)?;
        triangles.vertices.iter_mut().for_each(|vertex| *vertex += *origin_m);
        triangles
    } else {
        let cells = files::Cells::read(path, *scale, *origin_m)?;
        if !cells.tetrahedra.is_empty() {
            return SoftMesh::of_tetrahedra(cells.nodes_m, cells.tetrahedra);
        }
        if cells.triangles.is_empty() {
            return Err(SoftMeshError::Empty);
        }
        cells.into_surface()
    };
    if soft.model == SoftModel::Balloon {
        return SoftMesh::of_skin(&surface);
    }
    surface.check()?;
    let (low, high) = bounds(&surface.vertices);
    solids::filled(&surface, edge_m(&soft.mesh, (high - low).max_element()))
}
