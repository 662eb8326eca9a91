//! The surfaces of bodies, and what a sphere finds when it asks one of them.
//!
//! Everything is in the body's frame, whose origin is the centre of mass. A [`Surface`] is made once from a scene's
//! shape; [`Surface::probe`] is asked in every tick, allocates nothing and takes bounded time.

use std::sync::Arc;

use cotouch_scene::scene::{Shape, ShapeKind};
use glam::DVec3;

use crate::approach::Approach;
use crate::convex::probe_convex;
use crate::corner::{CornerSphere, Corners};
use crate::cuboid::Cuboid;
use crate::hull::Hull;
use crate::probe::Probe;
use crate::proxy::MeshSurface;
use crate::round::Round;

/// The radius of a box's corners, as a share of its shortest edge.
const CORNER_RADIUS_OF_BOX: f64 = 0.1;

/// The radius of a hull's corners, as a share of its bounding radius.
const CORNER_RADIUS_OF_HULL: f64 = 0.05;

/// Half of the length of a box in a plane, as a share of its longer edge's half.
const PRISM: f64 = 10.0;

#[derive(Clone, Debug)]
enum SolidShape {
    None,
    Round(Round),
    Box(Cuboid),
    Hull(Hull),
    Mesh(MeshSolid),
}

/// A closed triangle mesh, and the hull that its corners are from.
#[derive(Clone, Debug)]
struct MeshSolid {
    surface: Arc<MeshSurface>,
    hull: Hull,
}

/// The surface of a body, made once.
#[derive(Clone, Debug)]
pub struct Surface {
    solid: SolidShape,
    corners: Corners,
    bounding_radius_m: f64,
}

impl Surface {
    /// Of a scene's shape. A hull or mesh whose file holds no solid has no surface.
    #[must_use]
    pub fn new(shape: &Shape) -> Self {
        let solid = solid(shape);
        let corners = match &solid {
            SolidShape::None => Corners::new(),
            SolidShape::Round(round) => round_corners(round),
            SolidShape::Box(cuboid) => {
                let radius = 2.0 * CORNER_RADIUS_OF_BOX * cuboid.half.min_element();
                box_corners(cuboid.half, radius)
            }
            SolidShape::Hull(hull) | SolidShape::Mesh(MeshSolid { hull, .. }) => {
                hull.corners(CORNER_RADIUS_OF_HULL * hull.bounding_radius_m())
            }
        };
        let bounding_radius_m = match &solid {
            SolidShape::None => 0.0,
            SolidShape::Round(round) => round.radius + round.half_length,
            SolidShape::Box(cuboid) => cuboid.half.length(),
            SolidShape::Hull(hull) | SolidShape::Mesh(MeshSolid { hull, .. }) => hull.bounding_radius_m(),
        };
        Self { solid, corners, bounding_radius_m }
    }

    /// Of a body that stays in the plane across its own z axis, and is touched in that plane only: like
    /// [`Surface::new`], but a box has no faces across z, each corner lies in the plane, and those that fall together
    /// there are one.
    ///
    /// Hulls and meshes are still touched in space, by spheres with their centres in the plane: the normal of a face
    /// that leans has a part across the plane, which the body's guide takes.
    #[must_use]
    pub fn planar(shape: &Shape) -> Self {
        let mut surface = Self::new(shape);
        if let SolidShape::Box(cuboid) = &mut surface.solid {
            let flat = DVec3::new(cuboid.half.x, cuboid.half.y, 0.0);
            surface.bounding_radius_m = flat.length();
            surface.corners = planar_box_corners(flat);
            // A prism so long that its ends are never the nearest face.
            cuboid.half.z = PRISM * flat.max_element();
        } else {
            surface.corners = flattened(&surface.corners);
        }
        surface
    }

    /// Whether there is a surface to touch.
    #[must_use]
    pub fn exists(&self) -> bool {
        !matches!(self.solid, SolidShape::None)
    }

    /// The body fits into a sphere of this radius about its centre of mass, m.
    #[must_use]
    pub fn bounding_radius_m(&self) -> f64 {
        self.bounding_radius_m
    }

    /// The spheres that stand for the body where it meets other surfaces: a box has 8 that touch its faces from
    /// inside, a ball itself, a capsule its ends, a hull or mesh one at each vertex (at most [`MAX_CORNERS`](crate::corner::MAX_CORNERS), far
    /// from each other).
    #[must_use]
    pub fn corners(&self) -> &[CornerSphere] {
        &self.corners
    }

    /// What there is to remember of a sphere that is about to come near: its centre is at `centre` (body frame, m), beyond
    /// the [bounding radius](Self::bounding_radius_m). On a mesh no speed takes it in from there unseen.
    #[must_use]
    pub fn seen_far(&self, centre: DVec3) -> Approach {
        match &self.solid {
            SolidShape::Mesh(mesh) => Approach::Mesh(mesh.surface.seen_outside(centre)),
            _ => Approach::default(),
        }
    }

    /// Where a sphere of `radius` (m) with its centre at `centre` (body frame, m) is in the surface; `None` if it does
    /// not touch. Ask in every tick in which the sphere is near, or give a default `proxy`: it remembers from which
    /// side the sphere came.
    #[must_use]
    pub fn probe(&self, proxy: &mut Approach, centre: DVec3, radius: f64) -> Option<Probe> {
        let mut side = proxy.side();
        let probe = match &self.solid {
            SolidShape::None => return None,
            SolidShape::Round(round) => round.probe(&mut side, centre, radius),
            SolidShape::Box(cuboid) => probe_convex(cuboid, &mut side, centre, radius),
            SolidShape::Hull(hull) => probe_convex(hull, &mut side, centre, radius),
            SolidShape::Mesh(mesh) => {
                let mut state = proxy.mesh();
                let probe = mesh.surface.probe(&mut state, centre, radius);
                *proxy = Approach::Mesh(state);
                return probe;
            }
        };
        *proxy = Approach::Side(side);
        probe.filter(|probe| probe.depth_m > 0.0)
    }
}

/// The spheres that stand for a scene's shape where it meets other surfaces, as [`Surface::corners`] has them of
/// [`Surface::planar`] (`planar`) or of [`Surface::new`], m; none where it has no surface. Nothing but these is made, which of a
/// large mesh takes far less time.
#[must_use]
pub fn corners(shape: &Shape, planar: bool) -> Corners {
    // A mesh has the corners of its hull.
    let kind = if shape.kind == ShapeKind::Mesh { ShapeKind::Hull } else { shape.kind };
    let shape = Shape { kind, ..shape.clone() };
    if planar { Surface::planar(&shape).corners } else { Surface::new(&shape).corners }
}

/// What a shape is to be asked as.
fn solid(shape: &Shape) -> SolidShape {
    let of_mesh = || {
        let mesh = shape.surface.as_ref()?;
        Some((mesh, Hull::new(&mesh.vertices)?))
    };
    match shape.kind {
        ShapeKind::Point => SolidShape::None,
        ShapeKind::Ball => SolidShape::Round(Round { radius: shape.radius_m, half_length: 0.0 }),
        ShapeKind::Capsule => {
            SolidShape::Round(Round { radius: shape.radius_m, half_length: 0.5 * shape.length_m })
        }
        ShapeKind::Box => SolidShape::Box(Cuboid { half: 0.5 * shape.size_m }),
        ShapeKind::Hull => of_mesh().map_or(SolidShape::None, |(_, hull)| SolidShape::Hull(hull)),
        ShapeKind::Mesh => of_mesh()
            .and_then(|(mesh, hull)| {
                let surface = Arc::new(MeshSurface::new(mesh.vertices.clone(), &mesh.triangles).ok()?);
                Some(SolidShape::Mesh(MeshSolid { surface, hull }))
            })
            .unwrap_or(SolidShape::None),
    }
}

fn round_corners(round: &Round) -> Corners {
    let corner = |y: f64| CornerSphere { centre: DVec3::Y * y, radius_m: round.radius };
    if round.half_length > 0.0 {
        [corner(-round.half_length), corner(round.half_length)].into_iter().collect()
    } else {
        std::iter::once(corner(0.0)).collect()
    }
}

fn planar_box_corners(half: DVec3) -> Corners {
    let radius_m = 2.0 * CORNER_RADIUS_OF_BOX * half.x.min(half.y);
    box_corners(DVec3::new(half.x, half.y, radius_m), radius_m).into_iter().take(4).collect()
}

fn box_corners(half: DVec3, radius_m: f64) -> Corners {
    let inset = half - DVec3::splat(radius_m);
    let sign = |bit: u32| if bit == 0 { -1.0 } else { 1.0 };
    let corner = |i: u32| inset * DVec3::new(sign(i & 1), sign(i & 2), sign(i & 4));
    (0..8).map(|i| CornerSphere { centre: corner(i), radius_m }).collect()
}

fn flattened(corners: &[CornerSphere]) -> Corners {
    let mut flat = Corners::new();
    for corner in corners {
        let centre = DVec3::new(corner.centre.x, corner.centre.y, 0.0);
        let known = |other: &CornerSphere| (other.centre - centre).length() < 0.1 * corner.radius_m;
        if !flat.iter().any(known) {
            flat.push(CornerSphere { centre, ..*corner });
        }
    }
    flat
}
