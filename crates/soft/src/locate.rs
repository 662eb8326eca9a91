//! Which material point is at a place.

use glam::DVec3;

use crate::body::SoftError;
use crate::point::MaterialPoint;

/// A place so far from the surface still counts as on it, as a part of the body's size.
const ON_SURFACE: f64 = 1e-6;

/// The material point that is at `point` when the nodes are at `nodes`: a mean of four nodes in a tetrahedron, of three on the
/// surface (`triangles`) or within a millionth of the body's size from it.
///
/// # Errors
/// When the point is further from the body; or when there is no body.
pub fn material_point_at(
    nodes: &[DVec3],
    tetrahedra: &[[u32; 4]],
    triangles: &[[u32; 3]],
    point: DVec3,
) -> Result<MaterialPoint, SoftError> {
    let at = |node: u32| nodes[node as usize];
    let surface = triangles.iter().map(|&corners| {
        let (nearest, weights) = nearest_on_triangle(corners.map(at), point);
        (nearest.distance(point), MaterialPoint::on_triangle(corners, weights))
    });
    let nearest = surface.min_by(|(a, _), (b, _)| a.total_cmp(b));
    let (distance_m, on_surface) = nearest.unwrap_or((f64::INFINITY, MaterialPoint::default()));
    if distance_m <= ON_SURFACE * extent(nodes) {
        return Ok(on_surface);
    }
    let inside = tetrahedra.iter().find_map(|&corners| {
        let weights = barycentric(corners.map(at), point);
        let is_inside = weights.iter().all(|&weight| weight >= -1e-12);
        is_inside.then_some(MaterialPoint { nodes: corners, weights })
    });
    inside.ok_or(SoftError::Outside { point_m: point, distance_m })
}

/// The four nodes' weights at a place; NaN in a flat tetrahedron.
fn barycentric([a, b, c, d]: [DVec3; 4], point: DVec3) -> [f64; 4] {
    let volume = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (b - a).dot((c - a).cross(d - a));
    let whole = volume(a, b, c, d);
    let [first, second, third] = [volume(point, b, c, d), volume(a, point, c, d), volume(a, b, point, d)];
    let [wa, wb, wc] = [first / whole, second / whole, third / whole];
    [wa, wb, wc, 1.0 - wa - wb - wc]
}

/// The nearest point of a triangle, and the corners' weights there: in a corner, on an edge, or in the face.
fn nearest_on_triangle([a, b, c]: [DVec3; 3], point: DVec3) -> (DVec3, [f64; 3]) {
    let normal = (b - a).cross(c - a);
    let area = normal.length_squared();
    let wb = (point - a).cross(c - a).dot(normal) / area;
    let wc = (b - a).cross(point - a).dot(normal) / area;
    let wa = 1.0 - wb - wc;
    let candidates = [
        (area > 0.0 && wa >= 0.0 && wb >= 0.0 && wc >= 0.0).then_some([wa, wb, wc]),
        Some(on_edge(a, b, point)).map(|t| [1.0 - t, t, 0.0]),
        Some(on_edge(b, c, point)).map(|t| [0.0, 1.0 - t, t]),
        Some(on_edge(c, a, point)).map(|t| [t, 0.0, 1.0 - t]),
    ];
    let place = |[wa, wb, wc]: [f64; 3]| (wa * a + wb * b + wc * c, [wa, wb, wc]);
    let distance = |(place, _): &(DVec3, [f64; 3])| place.distance_squared(point);
    let nearest = candidates.into_iter().flatten().map(place);
    nearest
        .min_by(|one, other| distance(one).total_cmp(&distance(other)))
        .expect("three of them always exist")
}

/// How far along an edge (0 to 1) its nearest point is.
fn on_edge(from: DVec3, to: DVec3, point: DVec3) -> f64 {
    let along = to - from;
    let length_squared = along.length_squared();
    if length_squared > 0.0 { ((point - from).dot(along) / length_squared).clamp(0.0, 1.0) } else { 0.0 }
}

fn extent(nodes: &[DVec3]) -> f64 {
    let least = nodes.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let most = nodes.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    (most - least).max_element()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Two tetrahedra on the two sides of a triangle, and their surface.
    fn mesh() -> (Vec<DVec3>, Vec<[u32; 4]>, Vec<[u32; 3]>) {
        let nodes = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, -DVec3::Z];
        let tetrahedra = vec![[0, 1, 2, 3], [0, 2, 1, 4]];
        let triangles = vec![[0, 1, 3], [1, 2, 3], [2, 0, 3], [1, 0, 4], [2, 1, 4], [0, 2, 4]];
        (nodes, tetrahedra, triangles)
    }

    proptest! {
        #[test]
        fn a_mean_of_corners_is_found_again(
            parts in prop::array::uniform4(0.01..1.0_f64), which in 0..2_usize, on_surface: bool,
        ) {
            let (nodes, tetrahedra, triangles) = mesh();
            let mut parts = parts;
            if on_surface {
                parts[0] = 0.0; // The face of the other three corners is the slanted one of the surface.
            }
            let corners = tetrahedra[which];
            let sum: f64 = parts.iter().sum();
            let place = (0..4).map(|i| nodes[corners[i] as usize] * parts[i] / sum).sum();
            let found = material_point_at(&nodes, &tetrahedra, &triangles, place).unwrap();
            prop_assert!(found.at(&nodes).distance(place) < 1e-14);
            prop_assert!((found.weights.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            prop_assert_eq!(on_surface, found.nodes[3] == found.nodes[0]);
        }

        #[test]
        fn no_corner_of_a_fine_grid_on_the_triangle_is_nearer(
            corners in prop::array::uniform9(-1.0..1.0_f64), point in prop::array::uniform3(-2.0..2.0_f64),
        ) {
            let [a, b, c] = [0, 3, 6].map(|i| DVec3::new(corners[i], corners[i + 1], corners[i + 2]));
            let point = DVec3::from_array(point);
            let (nearest, _) = nearest_on_triangle([a, b, c], point);
            for (i, j) in (0..=20).flat_map(|i| (0..=20 - i).map(move |j| (i, j))) {
                let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                let other = a + u * (b - a) + v * (c - a);
                prop_assert!(nearest.distance(point) <= other.distance(point) + 1e-12);
            }
        }
    }

    #[test]
    fn a_point_outside_is_told_with_its_distance() {
        let (nodes, tetrahedra, triangles) = mesh();
        let error =
            material_point_at(&nodes, &tetrahedra, &triangles, DVec3::new(0.2, -0.5, 0.1)).unwrap_err();
        assert_eq!(error.to_string(), "the point (0.2, -0.5, 0.1) m is 0.5 m outside of the body");
        let near = DVec3::new(0.25, -5e-7, 0.25);
        let found = material_point_at(&nodes, &tetrahedra, &triangles, near).unwrap();
        assert!(found.at(&nodes).distance(DVec3::new(0.25, 0.0, 0.25)) < 1e-12);
        assert!(material_point_at(&[], &[], &[], DVec3::ZERO).is_err());
    }
}
