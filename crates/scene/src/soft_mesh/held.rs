//! Whether what is fixed keeps every piece of a mesh from moving and turning as a whole.

use glam::DVec3;

use super::body::SoftMesh;
use super::error::SoftMeshError;
use super::region::FixedRegion;
use super::topology;

impl SoftMesh {
    /// Every piece has three fixed nodes that are not on a line, and some node is free.
    pub(crate) fn check_held(&self, regions: &[FixedRegion]) -> Result<(), SoftMeshError> {
        let fixed = self.fixed_nodes(regions);
        if fixed.iter().all(|&fixed| fixed) {
            return Err(SoftMeshError::AllFixed { nodes: fixed.len() });
        }
        for nodes in self.pieces() {
            let held: Vec<DVec3> = (nodes.iter().filter(|&&node| fixed[node as usize]))
                .map(|&node| self.nodes_m[node as usize])
                .collect();
            if !spans_a_triangle(&held) {
                let near_m = self.nodes_m[nodes[0] as usize];
                return Err(SoftMeshError::NotHeld { near_m, fixed: held.len() });
            }
        }
        Ok(())
    }

    /// The nodes of each piece: of the tetrahedra that hang together by faces, or the triangles that do by edges.
    fn pieces(&self) -> Vec<Vec<u32>> {
        let (count, neighbours) = if self.tetrahedra.is_empty() {
            (self.triangles.len(), topology::neighbouring_triangles(&self.triangles))
        } else {
            (self.tetrahedra.len(), topology::neighbours(&self.tetrahedra))
        };
        let mut roots: Vec<u32> = (0..count as u32).collect();
        for (one, other) in neighbours {
            let (one, other) = (root(&mut roots, one), root(&mut roots, other));
            roots[one.max(other) as usize] = one.min(other);
        }
        let mut pieces = vec![Vec::new(); count];
        for element in 0..count {
            let piece = &mut pieces[root(&mut roots, element as u32) as usize];
            match self.tetrahedra.get(element) {
                Some(tetrahedron) => piece.extend(tetrahedron),
                None => piece.extend(self.triangles[element]),
            }
        }
        pieces.retain(|piece| !piece.is_empty());
        for piece in &mut pieces {
            piece.sort_unstable();
            piece.dedup();
        }
        pieces
    }
}

/// The first element of an element's piece; the way there becomes shorter.
fn root(roots: &mut [u32], mut element: u32) -> u32 {
    while roots[element as usize] != element {
        roots[element as usize] = roots[roots[element as usize] as usize];
        element = roots[element as usize];
    }
    element
}

fn spans_a_triangle(points: &[DVec3]) -> bool {
    let Some(&first) = points.first() else { return false };
    let farthest = points.iter().map(|&point| point - first).max_by(|a, b| a.length().total_cmp(&b.length()));
    let along = farthest.unwrap_or_default();
    let off_line = |&point: &DVec3| (point - first).cross(along).length() > 1e-6 * along.length_squared();
    along != DVec3::ZERO && points.iter().any(off_line)
}
