//! Which triangles share which vertices and edges.

use std::collections::HashMap;

use glam::DVec3;

use super::error::MeshError;
use super::triangles::Triangles;

/// A triangle that was kept, with its number in the file, from 1.
pub(super) type Kept = (usize, [u32; 3]);

/// Makes one vertex of those that are at the same place; leaves out triangles without an area and vertices without a
/// triangle. Nothing left is an error.
pub(super) fn weld(triangles: &Triangles) -> Result<(Vec<DVec3>, Vec<Kept>), MeshError> {
    let (mut vertices, mut at) = (Vec::new(), HashMap::new());
    let mut index_of = |vertex: DVec3| {
        // -0 is 0.
        let bits = (vertex + DVec3::ZERO).to_array().map(f64::to_bits);
        *at.entry(bits).or_insert_with(|| {
            vertices.push(vertex);
            vertices.len() as u32 - 1
        })
    };
    let mut kept = Vec::new();
    for (index, triangle) in triangles.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|vertex| triangles.vertices[vertex as usize]);
        let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
        if (b - a).cross(c - a).length() > 1e-12 * longest {
            kept.push((index + 1, [a, b, c].map(&mut index_of)));
        }
    }
    if kept.is_empty() { Err(MeshError::Empty) } else { Ok((vertices, kept)) }
}

/// An edge of a triangle: its ends, the lower first, whether the triangle runs from the lower to the higher, and the
/// triangle's number.
type Edge = (u32, u32, bool, usize);

/// Every edge must be in two triangles that run through it in opposite directions.
pub(super) fn check_edges(vertices: &[DVec3], kept: &[Kept]) -> Result<(), MeshError> {
    let mut edges: Vec<Edge> = kept
        .iter()
        .flat_map(|&(number, [a, b, c])| {
            [(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to), from < to, number))
        })
        .collect();
    edges.sort_unstable();
    for group in edges.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1)) {
        let (from, to, forward, triangle) = group[0];
        let (from, to) = (vertices[from as usize], vertices[to as usize]);
        match *group {
            [_] => return Err(MeshError::Open { triangle, from, to }),
            [_, (.., other_forward, other)] if forward == other_forward => {
                return Err(MeshError::Turned { triangle, other, from, to });
            }
            [_, _] => (),
            _ => return Err(MeshError::NotManifold { triangle, from, to, count: group.len() }),
        }
    }
    Ok(())
}
