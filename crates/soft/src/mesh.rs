//! Sums over a mesh that several techniques need.

use glam::DVec3;

/// The volume of a tetrahedron.
pub(crate) fn volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).dot((c - a).cross(d - a)) / 6.0
}

/// A quarter of the volume of each tetrahedron that a node is part of, m³.
pub(crate) fn node_volumes(nodes_m: &[DVec3], tetrahedra: &[[u32; 4]]) -> Vec<f64> {
    let mut volumes = vec![0.0; nodes_m.len()];
    for tetrahedron in tetrahedra {
        let share = 0.25 * volume(tetrahedron.map(|node| nodes_m[node as usize]));
        tetrahedron.iter().for_each(|&node| volumes[node as usize] += share);
    }
    volumes
}

/// A third of the area of each triangle that a node is part of, m².
pub(crate) fn node_areas(nodes_m: &[DVec3], triangles: &[[u32; 3]]) -> Vec<f64> {
    let mut areas = vec![0.0; nodes_m.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|node| nodes_m[node as usize]);
        let share = (b - a).cross(c - a).length() / 6.0;
        triangle.iter().for_each(|&node| areas[node as usize] += share);
    }
    areas
}

/// The six edges of a tetrahedron, each with its lesser node first.
pub(crate) fn edges(&[a, b, c, d]: &[u32; 4]) -> [[u32; 2]; 6] {
    [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]].map(|[a, b]| [a.min(b), a.max(b)])
}
