//! Sums over a mesh that several techniques need.

use cotouch_scene::scene::FixedRegion;
use cotouch_scene::soft_mesh::SoftMesh;
use glam::DVec3;

/// Which nodes rest in one of the regions.
pub(crate) fn fixed_nodes(mesh: &SoftMesh, regions: &[FixedRegion]) -> Vec<bool> {
    mesh.nodes_m.iter().map(|&node| regions.iter().any(|region| region.contains(node))).collect()
}

/// Why a body that keeps its shape could still move, if it could: fewer than three fixed nodes, or all of them in a line.
pub(crate) fn not_held(rest_m: &[DVec3], fixed: &[bool]) -> Option<String> {
    let held: Vec<DVec3> = rest_m.iter().zip(fixed).filter(|(_, fixed)| **fixed).map(|(at, _)| *at).collect();
    let Some(&first) = held.first() else { return Some("no node is fixed".into()) };
    let far =
        held.iter().map(|&at| at - first).max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
    let beside = held.iter().map(|&at| (at - first).cross(far).length()).fold(0.0, f64::max);
    let in_line = beside <= 1e-9 * far.length_squared();
    in_line.then(|| format!("its {} fixed nodes are in one line", held.len()))
}

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

/// Whether every edge of a surface belongs to exactly two triangles, which go along it in opposite directions.
pub(crate) fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let mut edges: Vec<[u32; 2]> = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    edges.sort_unstable();
    let single = edges.windows(2).all(|pair| pair[0] != pair[1]);
    single && edges.iter().all(|&[a, b]| edges.binary_search(&[b, a]).is_ok())
}
