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

fn of_box(half: DVec3, from: DVec3, space: Space) -> Place {
    let outside = from.abs() - half;
    let axes = match space {
        Space::Line => 1,
        Space::Plane => 2,
        Space::Space => 3,
    };
    let face = (0..axes).max_by(|&one, &other| outside[one].total_cmp(&outside[other])).unwrap_or(0);
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

/// The radius of the spheres that stand for a box's corners, as a share of its shortest edge.
const CORNER_RADIUS: f64 = 0.1;

/// Centres (body frame, m) and radii (m) of the spheres that stand for a body where it meets a wall. `None` for shapes
/// whose corners are not analysed.
fn corners(shape: &Shape, space: Space) -> Option<Vec<(DVec3, f64)>> {
    match shape.kind {
        ShapeKind::Box => {
            let planar = space == Space::Plane;
            let size = shape.size_m;
            let radius_m = CORNER_RADIUS * if planar { size.x.min(size.y) } else { size.min_element() };
            let mut inset = size * 0.5 - DVec3::splat(radius_m);
            let count = if planar { 4 } else { 8 };
            if planar {
                inset.z = 0.0;
            }
            let sign = |bit: u32| if bit == 0 { -1.0 } else { 1.0 };
            let corner = |i: u32| inset * DVec3::new(sign(i & 1), sign(i & 2), sign(i & 4));
            Some((0..count).map(|i| (corner(i), radius_m)).collect())
        }
        ShapeKind::Ball => Some(vec![(DVec3::ZERO, shape.radius_m)]),
        ShapeKind::Capsule => {
            let end = DVec3::Y * (0.5 * shape.length_m);
            Some(vec![(-end, shape.radius_m), (end, shape.radius_m)])
        }
        ShapeKind::Point => Some(vec![(DVec3::ZERO, 0.0)]),
        ShapeKind::Hull | ShapeKind::Mesh => None,
    }
}

/// The corners with which a body at `pose` lies against a wall when it is moved up to it: those nearest to the wall, m.
pub(super) fn corners_at_wall(
    body: &Body,
    pose: &Pose,
    wall: &WallPlane,
    space: Space,
) -> Option<Vec<DVec3>> {
    const SAME_HEIGHT_M: f64 = 1e-6;
    let normal = wall.normal.normalize();
    let corners = corners(&body.shape, space)?;
    let height = |&(centre, radius_m): &(DVec3, f64)| pose.to_world(centre).dot(normal) - radius_m;
    let least = corners.iter().map(height).fold(f64::INFINITY, f64::min);
    Some(
        corners
            .iter()
            .filter(|corner| height(corner) <= least + SAME_HEIGHT_M)
            .map(|corner| corner.0)
            .collect(),
    )
}
