//! Meshes that need no file.

use std::collections::HashMap;

use glam::DVec3;

use super::triangles::Triangles;

/// A ball's surface: an icosahedron of which every triangle is cut into four `subdivisions` times, all vertices at
/// `radius_m` from the origin. 20·4^subdivisions triangles; 7 is the most that a mesh may have.
#[must_use]
pub fn icosphere(radius_m: f64, subdivisions: u32) -> Triangles {
    let golden = f64::midpoint(1.0, 5f64.sqrt());
    let mut vertices: Vec<DVec3> = Vec::new();
    for (small, large) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        vertices.push(DVec3::new(small, large, 0.0));
        vertices.push(DVec3::new(0.0, small, large));
        vertices.push(DVec3::new(large, 0.0, small));
    }
    let mut triangles = faces_of_icosahedron(&vertices);
    vertices.iter_mut().for_each(|vertex| *vertex = vertex.normalize());
    for _ in 0..subdivisions {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
                vertices.len() as u32 - 1
            })
        };
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    vertices.iter_mut().for_each(|vertex| *vertex *= radius_m);
    Triangles { vertices, triangles }
}

/// All triples of vertices that are next to each other, counter-clockwise seen from outside. The edge of this icosahedron
/// is 2.
fn faces_of_icosahedron(vertices: &[DVec3]) -> Vec<[u32; 3]> {
    let near = |a: usize, b: usize| vertices[a].distance(vertices[b]) < 2.5;
    let mut faces = Vec::new();
    for a in 0..vertices.len() {
        for b in a + 1..vertices.len() {
            for c in b + 1..vertices.len() {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = vertices[a].dot(vertices[b].cross(vertices[c])) > 0.0;
                    let (b, c) = if outward { (b, c) } else { (c, b) };
                    faces.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    faces
}

/// A box's surface about the origin: 12 triangles.
#[cfg(feature = "testing")]
#[must_use]
pub fn cuboid(size_m: DVec3) -> Triangles {
    let corner = |bits: u32| {
        let side = |bit: u32| if bits >> bit & 1 == 1 { 0.5 } else { -0.5 };
        DVec3::new(side(0), side(1), side(2)) * size_m
    };
    let quads: [[u32; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Triangles { vertices: (0..8).map(corner).collect(), triangles }
}

/// A ring's surface about the origin, around the z axis: 2·around·across triangles.
///
/// `ring_radius_m` is from the axis to the middle of the tube, of `tube_radius_m`; `around` steps along the ring and
/// `across` around the tube, each 3 or more.
#[cfg(feature = "testing")]
#[must_use]
pub fn torus(ring_radius_m: f64, tube_radius_m: f64, around: u32, across: u32) -> Triangles {
    use std::f64::consts::TAU;

    let vertex = |along: u32, about: u32| {
        let (u, v) = (TAU * f64::from(along) / f64::from(around), TAU * f64::from(about) / f64::from(across));
        let from_axis = ring_radius_m + tube_radius_m * v.cos();
        DVec3::new(from_axis * u.cos(), from_axis * u.sin(), tube_radius_m * v.sin())
    };
    let steps = || (0..around).flat_map(|along| (0..across).map(move |about| (along, about)));
    let at = |along: u32, about: u32| along % around * across + about % across;
    let quad = |(u, v): (u32, u32)| {
        let [a, b, c, d] = [at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)];
        [[a, b, c], [a, c, d]]
    };
    Triangles {
        vertices: steps().map(|(u, v)| vertex(u, v)).collect(),
        triangles: steps().flat_map(quad).collect(),
    }
}
