//! Triangles that nobody has checked yet, and what must hold of all.

use glam::DVec3;

use super::error::{EXTENT_M, MAX_TRIANGLES, MeshError};

/// Triangles as they are in a file, in metres: vertices may come several times, and nothing need be closed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangles {
    /// Corners, m.
    pub vertices: Vec<DVec3>,
    /// Three places in `vertices` each.
    pub triangles: Vec<[u32; 3]>,
}

impl Triangles {
    /// What every mesh must be, closed or not.
    pub(crate) fn check(&self) -> Result<(), MeshError> {
        if self.triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        if self.triangles.len() > MAX_TRIANGLES {
            return Err(MeshError::TooLarge);
        }
        if let Some(index) = self.vertices.iter().position(|vertex| !vertex.is_finite()) {
            return Err(MeshError::NotFinite { vertex: index + 1 });
        }
        for (index, triangle) in self.triangles.iter().enumerate() {
            if let Some(vertex) = triangle.iter().find(|&&vertex| vertex as usize >= self.vertices.len()) {
                let (vertex, vertices) = (u64::from(*vertex) + 1, self.vertices.len());
                return Err(MeshError::OutOfRange { triangle: index + 1, vertex, vertices });
            }
        }
        let used = self.triangles.iter().flatten().map(|&vertex| self.vertices[vertex as usize]);
        let (low, high) = bounds(&used.collect::<Vec<_>>());
        let extent_m = (high - low).max_element();
        if !(EXTENT_M.0..=EXTENT_M.1).contains(&extent_m) {
            return Err(MeshError::Extent { extent_m });
        }
        Ok(())
    }

    /// Adds a triangle, unless there are too many.
    pub(super) fn push(&mut self, triangle: [u32; 3]) -> Result<(), MeshError> {
        if self.triangles.len() == MAX_TRIANGLES {
            return Err(MeshError::TooLarge);
        }
        self.triangles.push(triangle);
        Ok(())
    }
}

/// The lowest and the highest corner of the box around `vertices`.
pub(crate) fn bounds(vertices: &[DVec3]) -> (DVec3, DVec3) {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    vertices.iter().fold(start, |(low, high), &vertex| (low.min(vertex), high.max(vertex)))
}
