//! The contour of a closed triangle mesh as it is seen along one direction.

use std::collections::{HashMap, HashSet};

/// The contour generator of a closed mesh, seen in the plane of `corners`: closed lines along the edges between a triangle
/// that faces the viewer and one that does not, rims of holes and folds included. Triangles are counter-clockwise seen from outside.
pub(super) fn contour(corners: &[(f64, f64)], triangles: &[[u32; 3]]) -> Vec<Vec<(f64, f64)>> {
    let at = |corner: u32| corners[corner as usize];
    let faces = |&&[a, b, c]: &&[u32; 3]| {
        let (a, b, c) = (at(a), at(b), at(c));
        (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0) > 0.0
    };
    let edges = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a)];
    let facing: Vec<(u32, u32)> = triangles.iter().filter(faces).flat_map(edges).collect();
    let known: HashSet<(u32, u32)> = facing.iter().copied().collect();
    // Every rim edge keeps the side that faces the viewer on its left, so that as many leave a corner as arrive there.
    let rim = facing.into_iter().filter(|&(from, to)| !known.contains(&(to, from)));
    let mut onwards: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut starts = Vec::new();
    for (from, to) in rim {
        onwards.entry(from).or_default().push(to);
        starts.push(from);
    }
    let mut lines = Vec::new();
    for start in starts {
        let mut line = vec![at(start)];
        let mut corner = start;
        while let Some(next) = onwards.get_mut(&corner).and_then(Vec::pop) {
            line.push(at(next));
            corner = next;
        }
        if line.len() > 1 {
            lines.push(line);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use cotouch_scene::mesh::generators::{cuboid, torus};
    use glam::DVec3;

    use super::*;

    fn seen_from_above(mesh: &cotouch_scene::mesh::Triangles) -> Vec<Vec<(f64, f64)>> {
        let corners: Vec<(f64, f64)> = mesh.vertices.iter().map(|corner| (corner.x, corner.y)).collect();
        contour(&corners, &mesh.triangles)
    }

    #[test]
    fn a_cuboid_seen_along_an_axis_is_a_rectangle() {
        let lines = seen_from_above(&cuboid(DVec3::new(0.4, 0.2, 0.1)));
        let [line] = &lines[..] else { panic!("{lines:?}") };
        assert_eq!(line.first(), line.last());
        let length: f64 =
            line.windows(2).map(|pair| (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1)).sum();
        assert!((length - 1.2).abs() < 1e-12, "{length}");
    }

    #[test]
    fn a_torus_seen_from_above_has_its_hole() {
        let lines = seen_from_above(&torus(0.1, 0.03, 48, 24));
        let radii: Vec<f64> = lines.iter().map(|line| line[0].0.hypot(line[0].1)).collect();
        assert_eq!(radii.len(), 2, "{radii:?}");
        let (least, largest) = (radii[0].min(radii[1]), radii[0].max(radii[1]));
        assert!((least - 0.07).abs() < 2e-3 && (largest - 0.13).abs() < 2e-3, "{radii:?}");
        assert!(lines.iter().all(|line| line.first() == line.last()));
    }

    #[test]
    fn nothing_has_no_contour() {
        assert!(contour(&[], &[]).is_empty());
    }
}
