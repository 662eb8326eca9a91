//! Which tetrahedra share which faces, and what is a usable tetrahedron.

use glam::DVec3;

use super::error::{LEAST_SHAPE, MAX_ELEMENTS, SoftMeshError};
use crate::mesh::EXTENT_M;

/// Six times the signed volume, m³.
fn determinant([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).dot((c - a).cross(d - a))
}

/// 6·√2 times the signed volume over the cube of the longest edge: 1 for a regular tetrahedron.
pub(super) fn shape(corners: [DVec3; 4]) -> f64 {
    let [a, b, c, d] = corners;
    let edges = [b - a, c - a, d - a, c - b, d - b, d - c];
    let longest = edges.iter().map(|edge| edge.length_squared()).fold(0.0, f64::max).sqrt();
    if longest == 0.0 { 0.0 } else { 2f64.sqrt() * determinant(corners) / longest.powi(3) }
}

/// The tetrahedra, all of positive volume.
pub(super) fn checked_tetrahedra(
    nodes: &[DVec3],
    mut tetrahedra: Vec<[u32; 4]>,
) -> Result<Vec<[u32; 4]>, SoftMeshError> {
    if tetrahedra.is_empty() {
        return Err(SoftMeshError::Empty);
    }
    if tetrahedra.len() > MAX_ELEMENTS {
        return Err(SoftMeshError::TooLarge { found: tetrahedra.len() });
    }
    if let Some(index) = nodes.iter().position(|node| !node.is_finite()) {
        return Err(SoftMeshError::NotFinite { node: index + 1 });
    }
    for (index, tetrahedron) in tetrahedra.iter().enumerate() {
        if let Some(&node) = tetrahedron.iter().find(|&&node| node as usize >= nodes.len()) {
            let (tetrahedron, node) = (index + 1, u64::from(node) + 1);
            return Err(SoftMeshError::OutOfRange { tetrahedron, node, nodes: nodes.len() });
        }
    }
    let shapes: Vec<f64> = tetrahedra.iter().map(|&four| shape(corners(nodes, four))).collect();
    // Of coordinates near the largest numbers it is not a number.
    let is_flat = |&shape: &f64| shape.is_nan() || shape.abs() < LEAST_SHAPE;
    if let Some(index) = shapes.iter().position(is_flat) {
        return Err(SoftMeshError::Flat { tetrahedron: index + 1, shape: shapes[index].abs() });
    }
    let negative = shapes.iter().filter(|&&shape| shape < 0.0).count();
    let mostly_turned = 2 * negative > shapes.len();
    if let Some(index) = shapes.iter().position(|&shape| (shape < 0.0) != mostly_turned) {
        let volume_m3 = -(determinant(corners(nodes, tetrahedra[index])) / 6.0).abs();
        return Err(SoftMeshError::Inverted { tetrahedron: index + 1, volume_m3 });
    }
    if mostly_turned {
        tetrahedra.iter_mut().for_each(|four| four.swap(2, 3));
    }
    Ok(tetrahedra)
}

fn corners(nodes: &[DVec3], tetrahedron: [u32; 4]) -> [DVec3; 4] {
    tetrahedron.map(|node| nodes[node as usize])
}

/// The faces of a tetrahedron of positive volume, counter-clockwise seen from outside.
pub(super) fn faces([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 4] {
    [[b, c, d], [a, d, c], [a, b, d], [a, c, b]]
}

/// Every face with its nodes in ascending order, its nodes as they run, and its tetrahedron; equal faces side by side.
fn sorted_faces(tetrahedra: &[[u32; 4]]) -> Vec<([u32; 3], [u32; 3], u32)> {
    let mut all: Vec<_> = tetrahedra
        .iter()
        .enumerate()
        .flat_map(|(index, &four)| {
            faces(four).map(|face| {
                let mut ascending = face;
                ascending.sort_unstable();
                (ascending, face, index as u32)
            })
        })
        .collect();
    all.sort_unstable();
    all
}

/// The surface: the faces that are in one tetrahedron only, in the order of their nodes.
pub(super) fn surface(tetrahedra: &[[u32; 4]]) -> Result<Vec<[u32; 3]>, SoftMeshError> {
    let mut outer: Vec<([u32; 3], u32)> = Vec::new();
    for group in sorted_faces(tetrahedra).chunk_by(|one, other| one.0 == other.0) {
        match *group {
            [(_, face, tetrahedron)] => outer.push((face, tetrahedron)),
            [(_, face, one), (_, same, other)] if is_even(face) == is_even(same) => {
                let [one, other] = [one, other].map(|index| index as usize + 1);
                return Err(SoftMeshError::Overlap { tetrahedron: one, other });
            }
            [_, _] => (),
            _ => {
                let tetrahedron = group[2].2 as usize + 1;
                return Err(SoftMeshError::NotManifold { tetrahedron, count: group.len() });
            }
        }
    }
    check_hinges(&outer)?;
    Ok(outer.into_iter().map(|(face, _)| face).collect())
}

/// Whether three different numbers run in ascending order, but for where they begin. Two tetrahedra on either side of a face
/// see it run in opposite directions.
fn is_even([a, b, c]: [u32; 3]) -> bool {
    [a < b, b < c, c < a].into_iter().filter(|&rises| rises).count() == 2
}

/// Every edge of the surface is in two triangles, if none is in more: the surface of tetrahedra is closed.
fn check_hinges(outer: &[([u32; 3], u32)]) -> Result<(), SoftMeshError> {
    let mut edges: Vec<(u32, u32, u32)> = outer
        .iter()
        .flat_map(|&([a, b, c], tetrahedron)| {
            [(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to), tetrahedron))
        })
        .collect();
    edges.sort_unstable();
    for group in edges.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1)) {
        if group.len() > 2 {
            let (from, to, tetrahedron) = group[0];
            let [from, to, tetrahedron] = [from, to, tetrahedron].map(|index| index as usize + 1);
            return Err(SoftMeshError::Hinge { tetrahedron, from, to });
        }
    }
    Ok(())
}

/// Pairs of tetrahedra that share a face.
pub(super) fn neighbours(tetrahedra: &[[u32; 4]]) -> Vec<(u32, u32)> {
    let sorted = sorted_faces(tetrahedra);
    let pair = |two: &[([u32; 3], [u32; 3], u32)]| (two[0].0 == two[1].0).then_some((two[0].2, two[1].2));
    sorted.windows(2).filter_map(pair).collect()
}

/// Pairs of triangles that share an edge.
pub(super) fn neighbouring_triangles(triangles: &[[u32; 3]]) -> Vec<(u32, u32)> {
    let mut edges: Vec<(u32, u32, u32)> = triangles
        .iter()
        .enumerate()
        .flat_map(|(index, &[a, b, c])| {
            [(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to), index as u32))
        })
        .collect();
    edges.sort_unstable();
    let same_edge = |two: &&[(u32, u32, u32)]| (two[0].0, two[0].1) == (two[1].0, two[1].1);
    edges.windows(2).filter(same_edge).map(|two| (two[0].2, two[1].2)).collect()
}

/// The extent of the nodes that are used is that of an object.
pub(super) fn check_extent<'a>(
    nodes: &[DVec3],
    used: impl Iterator<Item = &'a u32>,
) -> Result<(), SoftMeshError> {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = used.fold(start, |(low, high), &node| {
        let at = nodes[node as usize];
        (low.min(at), high.max(at))
    });
    let extent_m = (high - low).max_element();
    if (EXTENT_M.0..=EXTENT_M.1).contains(&extent_m) {
        Ok(())
    } else {
        Err(SoftMeshError::Extent { extent_m })
    }
}
