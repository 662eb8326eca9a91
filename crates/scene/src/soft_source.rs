//! The mesh of a scene's soft object: generated, or from a file.

use std::path::Path;

use crate::mesh::generators::icosphere;
use crate::mesh::{MeshFormat, Triangles, bounds};
use crate::scene::{Soft, SoftMeshKind, SoftMeshSource, SoftModel};
use crate::soft_mesh::{Cells, SoftMesh, SoftMeshError, block, solids, spring};

/// The part of the largest extent that `edge_m = 0` stands for.
const EDGES_ACROSS: f64 = 8.0;

impl Soft {
    /// Its mesh: generated, or read from its file, and checked.
    ///
    /// # Errors
    /// Whatever is wrong with it; which element, counted from 1.
    pub fn make_mesh(&self) -> Result<SoftMesh, SoftMeshError> {
        let source = &self.mesh;
        let mesh = match source.generator {
            SoftMeshKind::Spring => return Ok(spring(source.stiffness_n_per_m, source.origin_m)),
            SoftMeshKind::Beam | SoftMeshKind::Block => {
                let (nodes, tetrahedra) = block(source.size_m, source.cells, source.origin_m);
                SoftMesh::from_tetrahedra(nodes, tetrahedra)?
            }
            SoftMeshKind::Balloon => balloon(source)?,
            SoftMeshKind::Ball => {
                solids::ball(source.radius_m, edge_m(source, 2.0 * source.radius_m), source.origin_m)?
            }
            SoftMeshKind::Organ => {
                let edge_m = edge_m(source, 2.0 * source.size_m.max_element());
                solids::organ(source.size_m, edge_m, source.origin_m)?
            }
            SoftMeshKind::File => from_file(self)?,
        };
        let mesh = if self.model == SoftModel::Balloon { mesh.skin() } else { mesh };
        mesh.check_held(&self.fixed)?;
        Ok(mesh)
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
    SoftMesh::from_skin(&sphere)
}

/// Tetrahedra, or a surface that is filled with them or is a balloon's skin.
fn from_file(soft: &Soft) -> Result<SoftMesh, SoftMeshError> {
    let SoftMeshSource { file, scale, origin_m, .. } = &soft.mesh;
    let path = Path::new(file);
    let surface = if MeshFormat::from_path(path).is_some() {
        let mut triangles = Triangles::read(path, *scale)?;
        triangles.vertices.iter_mut().for_each(|vertex| *vertex += *origin_m);
        triangles
    } else {
        let cells = Cells::read(path, *scale, *origin_m)?;
        if !cells.tetrahedra.is_empty() {
            return SoftMesh::from_tetrahedra(cells.nodes_m, cells.tetrahedra);
        }
        if cells.triangles.is_empty() {
            return Err(SoftMeshError::Empty);
        }
        cells.into_surface()
    };
    if soft.model == SoftModel::Balloon {
        return SoftMesh::from_skin(&surface);
    }
    surface.check()?;
    let (low, high) = bounds(&surface.vertices);
    solids::filled(&surface, edge_m(&soft.mesh, (high - low).max_element()))
}
