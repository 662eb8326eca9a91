//! Where a finger that comes from outside meets a body, and which of a body's corners meet a wall.

use cotouch_scene::geometry::Pose;
use cotouch_scene::scene::{Body, Shape, ShapeKind, Space, WallPlane};
use glam::{DMat3, DVec3};

use crate::contact::outer;

/// Whether fingers meet a surface; otherwise they are coupled to the body's centre.
pub(crate) fn has_surface(shape: &Shape) -> bool {
    match shape.kind {
        ShapeKind::Point => false,
        ShapeKind::Ball | ShapeKind::Box | ShapeKind::Capsule => true,
        ShapeKind::Hull | ShapeKind::Mesh => shape.surface.is_some(),
    }
}

/// A place on a surface, in the body's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// On the surface, m.
    pub(super) point: DVec3,
    /// Outward, of length 1.
    pub(super) normal: DVec3,
    /// The directions in which the surface curves, and its radius there, m; zero for flat.
    curved: DMat3,
    radius_m: f64,
}

impl Place {
    /// The centre of a sphere that reaches `depth_m` beneath the surface here.
    pub(super) fn centre(&self, sphere_radius_m: f64, depth_m: f64) -> DVec3 {
        self.point + self.normal * (sphere_radius_m - depth_m)
    }

    /// Whether the surface is curved as much as at another place with the same normal but for a reflection.
    pub(super) fn is_curved_like(&self, other: &Self) -> bool {
        let trace = |place: &Self| place.curved.x_axis.x + place.curved.y_axis.y + place.curved.z_axis.z;
        self.radius_m == other.radius_m && (trace(self) - trace(other)).abs() < 1e-9
    }

    /// How the normal turns as that centre moves, 1/m.
    pub(super) fn curvature(&self, sphere_radius_m: f64, depth_m: f64) -> DMat3 {
        let distance_m = self.radius_m + sphere_radius_m - depth_m;
        if distance_m > 0.0 { self.curved * distance_m.recip() } else { DMat3::ZERO }
    }
}

/// Where a finger that starts at `from` (body frame, m) and goes straight to the side that it is at meets the surface.
pub(super) fn place(shape: &Shape, from: DVec3, space: Space) -> Option<Place> {
    match shape.kind {
        ShapeKind::Point => None,
        ShapeKind::Box => Some(of_box(shape.size_m * 0.5, from, space)),
        ShapeKind::Ball => of_round(shape.radius_m, DVec3::ZERO, DMat3::IDENTITY, from, space),
        ShapeKind::Capsule => {
            let half = 0.5 * shape.length_m;
            let along = from.y.clamp(-half, half);
            let around = DMat3::IDENTITY - outer(DVec3::Y, DVec3::Y);
            let curved = if from.y.abs() < half { around } else { DMat3::IDENTITY };
            of_round(shape.radius_m, DVec3::Y * along, curved, from, space)
        }
        ShapeKind::Hull | ShapeKind::Mesh => of_mesh(shape, from),
    }
}

/// No point of a shape is farther than this from its centre, m.
pub(crate) fn reach_m(shape: &Shape) -> f64 {
    match shape.kind {
        ShapeKind::Point => 0.0,
        ShapeKind::Box => 0.5 * shape.size_m.length(),
        ShapeKind::Ball => shape.radius_m,
        ShapeKind::Capsule => 0.5 * shape.length_m + shape.radius_m,
        ShapeKind::Hull | ShapeKind::Mesh => shape
            .surface
            .as_ref()
            .map_or(0.0, |mesh| mesh.vertices.iter().map(|at| at.length()).fold(0.0, f64::max)),
    }
}

/// Places that stand for a whole surface, where a finger's arm about the body's centre or the direction in which it
/// presses is an extreme or in between: of a box the middles and corners of its faces, its edges and its corners; of a
/// round body what lies in the directions of these; of a mesh what is nearest to its vertices and to points around it.
pub(super) fn places(shape: &Shape, space: Space) -> Vec<Place> {
    match shape.kind {
        ShapeKind::Point => Vec::new(),
        ShapeKind::Box => places_on_box(shape.size_m * 0.5, space),
        ShapeKind::Ball => directions(space)
            .filter_map(|direction| place(shape, direction * 2.0 * shape.radius_m, space))
            .collect(),
        ShapeKind::Capsule => {
            let ends = [-0.5, 0.0, 0.5].map(|share| DVec3::Y * (share * shape.length_m));
            let around =
                |end: DVec3| directions(space).map(move |direction| end + direction * 2.0 * shape.radius_m);
            ends.into_iter().flat_map(around).filter_map(|from| place(shape, from, space)).collect()
        }
        ShapeKind::Hull | ShapeKind::Mesh => places_on_mesh(shape, space),
    }
}

/// To the middles of the faces, to the edges and to the corners of a cube, in the directions that a space has.
fn directions(space: Space) -> impl Iterator<Item = DVec3> {
    let along = move |axis: usize| if axis < number_of_axes(space) { -1..=1 } else { 0..=0 };
    let all = along(0).flat_map(move |x| {
        along(1)
            .flat_map(move |y| along(2).map(move |z| DVec3::new(f64::from(x), f64::from(y), f64::from(z))))
    });
    all.filter_map(DVec3::try_normalize)
}

const fn number_of_axes(space: Space) -> usize {
    match space {
        Space::Line => 1,
        Space::Plane => 2,
        Space::Space => 3,
    }
}

fn places_on_box(half: DVec3, space: Space) -> Vec<Place> {
    let axes = number_of_axes(space);
    let mut places = Vec::new();
    for direction in directions(space) {
        // Of length 1 along each axis that it has a part in.
        let signs =
            DVec3::from_array(direction.to_array().map(|part| if part == 0.0 { 0.0 } else { part.signum() }));
        let parts = signs.to_array().iter().filter(|&&part| part != 0.0).count();
        let along = outer(signs, signs) * (parts as f64).recip();
        if parts == 1 {
            places.push(Place { point: half * signs, normal: signs, curved: DMat3::ZERO, radius_m: 0.0 });
            continue;
        }
        // On an edge or a corner a sphere turns about it: across the edge's own direction.
        let edge = DMat3::from_diagonal(DVec3::ONE - signs.abs());
        let curved = DMat3::IDENTITY - edge - along;
        places.push(Place { point: half * signs, normal: direction, curved, radius_m: 0.0 });
        if parts == axes {
            let faces = (0..axes).map(|axis| DVec3::AXES[axis] * signs[axis]);
            let at_corner =
                |normal| Place { point: half * signs, normal, curved: DMat3::ZERO, radius_m: 0.0 };
            places.extend(faces.map(at_corner));
        }
    }
    places
}

/// So many places stand for a mesh.
const PLACES_ON_MESH: usize = 32;

fn places_on_mesh(shape: &Shape, space: Space) -> Vec<Place> {
    let Some(mesh) = &shape.surface else { return Vec::new() };
    let around_m = 2.0 * reach_m(shape);
    let flat = |at: DVec3| if space == Space::Plane { DVec3::new(at.x, at.y, 0.0) } else { at };
    // A little further out than each vertex, and from far around.
    let near = mesh.vertices.iter().map(|&at| flat(at) * (1.0 + 1e-3));
    let far = directions(space).map(|direction| direction * around_m);
    let candidates = far.chain(near).filter_map(|from| {
        let place = of_mesh(shape, from)?;
        let normal = flat(place.normal).try_normalize()?;
        (normal.dot(place.normal) > 0.5).then_some(Place { normal, ..place })
    });
    spread(candidates.collect(), PLACES_ON_MESH)
}

/// So many of the places that they lie far from each other, in position or direction.
fn spread(places: Vec<Place>, count: usize) -> Vec<Place> {
    let size_m = places.iter().map(|place| place.point.length()).fold(0.0, f64::max);
    let apart = |one: &Place, other: &Place| {
        one.point.distance(other.point) + size_m * one.normal.distance(other.normal)
    };
    let mut chosen: Vec<Place> = places.first().copied().into_iter().collect();
    let mut nearest: Vec<f64> = vec![f64::INFINITY; places.len()];
    while chosen.len() < count {
        let last = chosen[chosen.len() - 1];
        for (distance, place) in nearest.iter_mut().zip(&places) {
            *distance = distance.min(apart(&last, place));
        }
        let farthest = nearest.iter().zip(&places).max_by(|one, other| one.0.total_cmp(other.0));
        match farthest {
            Some((&distance, place)) if distance > 1e-3 * size_m => chosen.push(*place),
            _ => break,
        }
    }
    chosen
}

fn of_box(half: DVec3, from: DVec3, space: Space) -> Place {
    let outside = from.abs() - half;
    let face = (0..number_of_axes(space))
        .max_by(|&one, &other| outside[one].total_cmp(&outside[other]))
        .unwrap_or(0);
    let mut normal = DVec3::ZERO;
    normal[face] = 1.0f64.copysign(from[face]);
    let mut point = from.clamp(-half, half);
    point[face] = half[face] * normal[face];
    Place { point, normal, curved: DMat3::ZERO, radius_m: 0.0 }
}

fn of_round(radius_m: f64, middle: DVec3, curved: DMat3, from: DVec3, space: Space) -> Option<Place> {
    let mut away = from - middle;
    if space == Space::Plane {
        away.z = 0.0;
    }
    let normal = away.try_normalize()?;
    let curved = curved - outer(normal, normal);
    Some(Place { point: middle + normal * radius_m, normal, curved, radius_m })
}

/// The nearest triangle, taken as flat.
fn of_mesh(shape: &Shape, from: DVec3) -> Option<Place> {
    let mesh = shape.surface.as_ref()?;
    let corner = |index: u32| mesh.vertices[index as usize];
    let places = mesh.triangles.iter().filter_map(|&[a, b, c]| {
        let [a, b, c] = [a, b, c].map(corner);
        let normal = (b - a).cross(c - a).try_normalize()?;
        Some(Place {
            point: nearest_of_triangle([a, b, c], from),
            normal,
            curved: DMat3::ZERO,
            radius_m: 0.0,
        })
    });
    let faces = places.filter(|place| (from - place.point).dot(place.normal) >= 0.0);
    faces.min_by(|one, other| from.distance_squared(one.point).total_cmp(&from.distance_squared(other.point)))
}

/// The point of a triangle that is nearest to `from` (Ericson 2005, 5.1.5, by its regions).
fn nearest_of_triangle([a, b, c]: [DVec3; 3], from: DVec3) -> DVec3 {
    let normal = (b - a).cross(c - a);
    let inside = |p: DVec3, q: DVec3| (q - p).cross(from - p).dot(normal) >= 0.0;
    if inside(a, b) && inside(b, c) && inside(c, a) {
        return from - normal * ((from - a).dot(normal) / normal.length_squared());
    }
    let on_edge =
        |p: DVec3, q: DVec3| p + (q - p) * ((from - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
    let edges = [on_edge(a, b), on_edge(b, c), on_edge(c, a)];
    let mut nearest = edges[0];
    for edge in edges {
        if from.distance_squared(edge) < from.distance_squared(nearest) {
            nearest = edge;
        }
    }
    nearest
}

/// Centres (body frame, m) and radii (m) of the spheres that stand for a body where it meets a wall: those of a running session;
/// of a body without a surface its centre.
fn corners(shape: &Shape, space: Space) -> Vec<(DVec3, f64)> {
    if !has_surface(shape) {
        return vec![(DVec3::ZERO, 0.0)];
    }
    let spheres = cotouch_world::corners(shape, space == Space::Plane);
    spheres.iter().map(|corner| (corner.centre, corner.radius_m)).collect()
}

/// Faces of one body that are laid on a wall.
const MAX_FACES: usize = 12;
/// Unit vectors nearer to each other than this point in one direction.
const SAME_DIRECTION: f64 = 1e-6;

/// The corners with which a body at `pose` lies against a wall when it is moved up to it: those nearest to the wall, m.
pub(super) fn corners_at_wall(body: &Body, pose: &Pose, wall: &WallPlane, space: Space) -> Vec<DVec3> {
    const SAME_HEIGHT_M: f64 = 1e-6;
    let normal = wall.normal.normalize();
    let corners = corners(&body.shape, space);
    let height = |&(centre, radius_m): &(DVec3, f64)| pose.to_world(centre).dot(normal) - radius_m;
    let least = corners.iter().map(height).fold(f64::INFINITY, f64::min);
    let nearest = corners.iter().filter(|corner| height(corner) <= least + SAME_HEIGHT_M);
    nearest.map(|corner| corner.0).collect()
}

/// Outward normals (body frame) of the flat faces on which a body can lie, largest first, at most [`MAX_FACES`]: of a hull's or a
/// mesh's triangles, each direction once. Of other shapes none: they are turned onto their faces by parts of a full turn.
pub(super) fn face_normals(shape: &Shape, space: Space) -> Vec<DVec3> {
    let Some(mesh) = shape.surface.as_ref().filter(|_| space != Space::Line) else { return Vec::new() };
    let corner = |index: u32| mesh.vertices[index as usize];
    let doubled_area = |&[a, b, c]: &[u32; 3]| (corner(b) - corner(a)).cross(corner(c) - corner(a));
    let mut faces: Vec<DVec3> = mesh.triangles.iter().map(doubled_area).collect();
    faces.sort_by(|one, other| other.length_squared().total_cmp(&one.length_squared()));
    let mut normals: Vec<DVec3> = Vec::new();
    for normal in faces.into_iter().filter_map(DVec3::try_normalize) {
        let lies_in_space = space == Space::Space || normal.z.abs() < SAME_DIRECTION;
        let is_new = || normals.iter().all(|known| known.distance(normal) > SAME_DIRECTION);
        if normals.len() < MAX_FACES && lies_in_space && is_new() {
            normals.push(normal);
        }
    }
    normals
}
