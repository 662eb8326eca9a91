//! The convex hull of a set of points.

use std::collections::HashMap;

use glam::{DMat3, DVec3};
use parry3d_f64::transformation::try_convex_hull;

use crate::convex::{Convex, Over};
use crate::corner::{CornerSphere, Corners, MAX_CORNERS};

/// Triangles whose normals differ by less than this (rad) lie in one plane.
const FLAT: f64 = 1e-6;

/// A point so close to a triangle's edge, as a share of the bounding radius, is over the triangle.
const AT_EDGE: f64 = 1e-10;

/// What keeps the place of a corner defined where all faces at a vertex are nearly one plane.
const REGULARISATION: f64 = 1e-9;

/// One triangle of the hull, in the plane of the flat face that it is part of.
#[derive(Clone, Debug)]
struct Facet {
    /// Outward unit normal, and the plane's distance from the origin, m.
    normal: DVec3,
    offset: f64,
    vertices: [DVec3; 3],
    /// Unit normals of the edges from vertex i to i + 1, in the plane, outward, and their distances from the origin.
    edges: [(DVec3, f64); 3],
    /// The facet on the other side of each edge.
    neighbours: [u32; 3],
}

/// A convex polyhedron as triangles with their neighbours.
#[derive(Clone, Debug)]
pub(crate) struct Hull {
    facets: Vec<Facet>,
    vertices: Vec<DVec3>,
    bounding_radius_m: f64,
}

impl Hull {
    /// Of points in the body's frame, m; none if they enclose no volume.
    pub(crate) fn new(points: &[DVec3]) -> Option<Self> {
        let (vertices, triangles) = try_convex_hull(points).ok()?;
        let bounding_radius_m = vertices.iter().map(|vertex| vertex.length()).fold(0.0, f64::max);
        let planes = planes(&vertices, &triangles);
        let sides: HashMap<(u32, u32), u32> = (0_u32..)
            .zip(&triangles)
            .flat_map(|(facet, &[a, b, c])| [((a, b), facet), ((b, c), facet), ((c, a), facet)])
            .collect();
        let mut facets = Vec::with_capacity(triangles.len());
        for (&[a, b, c], (normal, offset)) in triangles.iter().zip(planes) {
            let vertices = [a, b, c].map(|vertex| vertices[vertex as usize]);
            let edge = |i: usize| {
                let outward = (vertices[(i + 1) % 3] - vertices[i]).cross(normal).normalize_or_zero();
                (outward, outward.dot(vertices[i]))
            };
            let neighbours =
                [sides.get(&(b, a))?, sides.get(&(c, b))?, sides.get(&(a, c))?].map(|side| *side);
            facets.push(Facet { normal, offset, vertices, edges: [0, 1, 2].map(edge), neighbours });
        }
        let volume: f64 = facets.iter().map(|f| f.offset * area(&f.vertices)).sum::<f64>() / 3.0;
        let solid = volume > 1e-9 * bounding_radius_m.powi(3);
        let mut is_used = vec![false; vertices.len()];
        triangles.iter().flatten().for_each(|&vertex| is_used[vertex as usize] = true);
        let used =
            vertices.iter().zip(is_used).filter(|(_, used)| *used).map(|(vertex, _)| *vertex).collect();
        solid.then_some(Self { facets, vertices: used, bounding_radius_m })
    }

    /// The farthest vertex's distance from the origin, m.
    pub(crate) fn bounding_radius_m(&self) -> f64 {
        self.bounding_radius_m
    }

    /// Spheres of `radius_m` that touch, from inside, the faces at a vertex: at every vertex, or at [`MAX_CORNERS`] of
    /// them that are far from each other.
    pub(crate) fn corners(&self, radius_m: f64) -> Corners {
        let corner = |vertex| CornerSphere { centre: self.inset(vertex, radius_m), radius_m };
        far_apart(&self.vertices).map(corner).collect()
    }

    /// Nearest to the point that is `radius` beneath every face at a vertex, by least squares.
    fn inset(&self, vertex: DVec3, radius: f64) -> DVec3 {
        let mut normals: Vec<DVec3> = Vec::new();
        for facet in self.facets.iter().filter(|facet| facet.vertices.contains(&vertex)) {
            if !normals.iter().any(|normal| normal.dot(facet.normal) > 1.0 - FLAT) {
                normals.push(facet.normal);
            }
        }
        let mut matrix = DMat3::from_diagonal(DVec3::splat(REGULARISATION));
        for normal in &normals {
            matrix += DMat3::from_cols(*normal * normal.x, *normal * normal.y, *normal * normal.z);
        }
        vertex - radius * (matrix.inverse() * normals.iter().sum::<DVec3>())
    }
}

/// At most [`MAX_CORNERS`] points: first the farthest from the origin, then always the one that is farthest from those
/// already chosen.
fn far_apart(points: &[DVec3]) -> impl Iterator<Item = DVec3> + '_ {
    let mut distance: Vec<f64> = points.iter().map(|point| f64::MAX.min(1e6 + point.length())).collect();
    (0..points.len().min(MAX_CORNERS)).map(move |_| {
        let next = (0..points.len()).max_by(|&a, &b| distance[a].total_cmp(&distance[b])).unwrap_or(0);
        for (distance, point) in distance.iter_mut().zip(points) {
            *distance = distance.min(point.distance(points[next]));
        }
        points[next]
    })
}

fn area(&[a, b, c]: &[DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// The plane of each triangle; triangles of one flat face have the plane of the largest of them.
fn planes(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Vec<(DVec3, f64)> {
    let corners = |triangle: &[u32; 3]| triangle.map(|vertex| vertices[vertex as usize]);
    let mut by_area: Vec<usize> = (0..triangles.len()).collect();
    by_area.sort_by(|&a, &b| area(&corners(&triangles[b])).total_cmp(&area(&corners(&triangles[a]))));
    let size = vertices.iter().map(|vertex| vertex.length()).fold(0.0, f64::max);
    let mut known = KnownPlanes::default();
    let mut planes = vec![(DVec3::ZERO, 0.0); triangles.len()];
    for index in by_area {
        let [a, b, c] = corners(&triangles[index]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let same = |plane: &(DVec3, f64)| {
            let inside = [a, b, c].iter().all(|corner| (plane.0.dot(*corner) - plane.1).abs() < FLAT * size);
            inside && (plane.0.dot(normal) > 0.9 || normal == DVec3::ZERO)
        };
        let is_sliver = area(&[a, b, c]) < SLIVER * size * size;
        let found = if is_sliver { known.anywhere(same) } else { known.near(normal, same) };
        planes[index] = found.unwrap_or_else(|| known.add((normal, normal.dot(a))));
    }
    planes
}

/// A triangle of less area than this share of the squared bounding radius may have any normal.
const SLIVER: f64 = 1e-8;

/// Planes that can be found by their normal, so that a hull of many thousand faces is not compared face by face.
#[derive(Default)]
struct KnownPlanes {
    planes: Vec<(DVec3, f64)>,
    by_normal: HashMap<[i32; 3], Vec<usize>>,
}

impl KnownPlanes {
    /// Normals this close to each other are in neighbouring cells.
    const CELL: f64 = 0.02;

    fn cell(normal: DVec3) -> [i32; 3] {
        (normal / Self::CELL).floor().to_array().map(|number| number as i32)
    }

    fn add(&mut self, plane: (DVec3, f64)) -> (DVec3, f64) {
        self.by_normal.entry(Self::cell(plane.0)).or_default().push(self.planes.len());
        self.planes.push(plane);
        plane
    }

    fn anywhere(&self, same: impl Fn(&(DVec3, f64)) -> bool) -> Option<(DVec3, f64)> {
        self.planes.iter().copied().find(same)
    }

    /// The first that was added of those with nearly this normal.
    fn near(&self, normal: DVec3, same: impl Fn(&(DVec3, f64)) -> bool) -> Option<(DVec3, f64)> {
        let [x, y, z] = Self::cell(normal);
        let cells = (0..27).map(|n| [x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1]);
        let indices = cells.filter_map(|cell| self.by_normal.get(&cell)).flatten();
        indices.copied().filter(|&index| same(&self.planes[index])).min().map(|index| self.planes[index])
    }
}

impl Facet {
    /// The edge beyond which `point` lies farthest, if it is not over the facet.
    fn edge_past(&self, point: DVec3, tolerance: f64) -> Option<usize> {
        let past = |edge: usize| self.edges[edge].0.dot(point) - self.edges[edge].1;
        let farthest = (0..3).max_by(|&a, &b| past(a).total_cmp(&past(b)))?;
        (past(farthest) > tolerance).then_some(farthest)
    }

    /// The closest point of the triangle's outline.
    fn closest_on_outline(&self, point: DVec3) -> DVec3 {
        let on_edge = |edge: usize| {
            let (from, to) = (self.vertices[edge], self.vertices[(edge + 1) % 3]);
            let way = to - from;
            from + way * ((point - from).dot(way) / way.length_squared()).clamp(0.0, 1.0)
        };
        let [a, b, c] = [0, 1, 2].map(on_edge);
        let nearer = |p: DVec3, q: DVec3| if p.distance(point) <= q.distance(point) { p } else { q };
        nearer(a, nearer(b, c))
    }
}

impl Convex for Hull {
    fn faces(&self) -> u32 {
        self.facets.len() as u32
    }

    fn face(&self, face: u32) -> (DVec3, f64) {
        let facet = &self.facets[face as usize];
        (facet.normal, facet.offset)
    }

    fn over(&self, face: u32, point: DVec3) -> Over {
        let facet = &self.facets[face as usize];
        let past = facet.edge_past(point, AT_EDGE * self.bounding_radius_m);
        past.map_or(Over::Within, |edge| Over::Past(facet.neighbours[edge]))
    }

    fn closest_from_outside(&self, centre: DVec3) -> Option<(DVec3, f64, DVec3)> {
        let mut best: Option<(DVec3, f64, DVec3)> = None;
        for facet in &self.facets {
            let height = facet.normal.dot(centre) - facet.offset;
            if height < 0.0 || best.is_some_and(|best| height >= best.1) {
                continue;
            }
            if facet.edge_past(centre, AT_EDGE * self.bounding_radius_m).is_none() {
                best = Some((facet.normal, height, centre - height * facet.normal));
                continue;
            }
            let point = facet.closest_on_outline(centre);
            let distance = point.distance(centre);
            if best.is_none_or(|best| distance < best.1) {
                let normal = if distance > 0.0 { (centre - point) / distance } else { facet.normal };
                best = Some((normal, distance, point));
            }
        }
        best
    }
}
