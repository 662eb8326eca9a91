//! A triangle mesh that can be touched: still, or taking new shapes.

use std::ops::ControlFlow;

use arrayvec::ArrayVec;
use glam::DVec3;
use thiserror::Error;

use super::half_space::{self, Foot, HalfSpace};
use super::tree::Tree;
use super::triangle;

/// Most triangles that are looked at as a list; more are looked for in the tree, again and again.
const MAX_LISTED: usize = 256;

/// Why triangles are not a surface.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SurfaceError {
    /// A coordinate is infinite or not a number.
    #[error("vertex {0} is not finite")]
    NotFinite(usize),
    /// A triangle has a vertex that does not exist.
    #[error("triangle {triangle} has the vertex {vertex}; there are {vertices}, counted from 0")]
    NoSuchVertex {
        /// Which triangle, from 0.
        triangle: usize,
        /// The vertex that it asks for.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// A new shape has another number of vertices.
    #[error("the new shape has {given} vertices; the surface has {expected}")]
    OtherCount {
        /// How many were given.
        given: usize,
        /// How many there are.
        expected: usize,
    },
}

/// A point of a surface, as a part of its triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Which triangle, counted as given.
    pub triangle: u32,
    /// The three vertices of the triangle.
    pub vertices: [u32; 3],
    /// How much each of them counts; they sum to 1.
    pub weights: [f64; 3],
    /// Where the point is in the body's frame, m.
    pub point: DVec3,
    /// Outward, unit; zero where there is no direction.
    pub outward: DVec3,
}

/// A triangle mesh in its body's frame, in a tree of boxes.
///
/// Triangles are counter-clockwise seen from outside. An open mesh is touched from the side that a proxy starts at,
/// which has to be the outside of the nearest triangle.
#[derive(Clone, Debug)]
pub struct MeshSurface {
    vertices: Vec<DVec3>,
    /// As they were before the last [`MeshSurface::deform`].
    previous: Vec<DVec3>,
    /// In the tree's order, as all that follows.
    triangles: Vec<[u32; 3]>,
    /// Their corners, once more, next to each other.
    corners: Vec<[DVec3; 3]>,
    /// Their places in the list that the surface was made from.
    given_as: Vec<u32>,
    /// The other way round.
    place_of: Vec<u32>,
    tree: Tree,
    /// How many times the surface was deformed.
    generation: u32,
    /// The furthest (m) that a vertex moved at the last time.
    displacement_m: f64,
}

/// The half-spaces that keep some triangles out.
pub(super) type HalfSpaces = ArrayVec<HalfSpace, MAX_LISTED>;

/// More triangles than fit into the list.
pub(super) struct TooMany;

impl MeshSurface {
    /// From vertices (m) and triangles of three vertices each.
    ///
    /// # Errors
    /// Vertices that are not finite, triangles of vertices that do not exist.
    pub fn new(vertices: Vec<DVec3>, triangles: &[[u32; 3]]) -> Result<Self, SurfaceError> {
        check_finite(&vertices)?;
        for (at, triangle) in triangles.iter().enumerate() {
            if let Some(&vertex) = triangle.iter().find(|&&vertex| vertex as usize >= vertices.len()) {
                return Err(SurfaceError::NoSuchVertex { triangle: at, vertex, vertices: vertices.len() });
            }
        }
        let corners_of = |triangle: &[u32; 3]| triangle.map(|vertex| vertices[vertex as usize]);
        let (tree, given_as) = Tree::new(&triangles.iter().map(corners_of).collect::<Vec<_>>());
        let triangles: Vec<[u32; 3]> = given_as.iter().map(|&at| triangles[at as usize]).collect();
        let corners = triangles.iter().map(corners_of).collect();
        let previous = vertices.clone();
        let mut place_of = vec![0; given_as.len()];
        for (place, &given) in (0..).zip(&given_as) {
            place_of[given as usize] = place;
        }
        Ok(Self {
            vertices,
            previous,
            triangles,
            corners,
            given_as,
            place_of,
            tree,
            generation: 0,
            displacement_m: 0.0,
        })
    }

    /// Gives every vertex a new position (m); triangles stay what they are, and move there in straight lines as
    /// far as a proxy is concerned. Allocates nothing, and takes time in proportion to the number of triangles.
    ///
    /// # Errors
    /// Another number of vertices, or one that is not finite: the surface stays as it was.
    pub fn deform(&mut self, vertices: &[DVec3]) -> Result<(), SurfaceError> {
        if vertices.len() != self.vertices.len() {
            let (given, expected) = (vertices.len(), self.vertices.len());
            return Err(SurfaceError::OtherCount { given, expected });
        }
        check_finite(vertices)?;
        std::mem::swap(&mut self.vertices, &mut self.previous);
        self.vertices.copy_from_slice(vertices);
        let moved = self.vertices.iter().zip(&self.previous).map(|(to, from)| to.distance_squared(*from));
        self.displacement_m = moved.fold(0.0, f64::max).sqrt();
        for (corners, triangle) in self.corners.iter_mut().zip(&self.triangles) {
            *corners = triangle.map(|vertex| self.vertices[vertex as usize]);
        }
        self.tree.refit(&self.corners);
        self.generation = self.generation.wrapping_add(1);
        Ok(())
    }

    /// Takes the shape and the history of another surface of as many vertices and the same triangles. Allocates nothing
    /// then.
    pub fn copy_from(&mut self, other: &Self) {
        self.vertices.clone_from(&other.vertices);
        self.previous.clone_from(&other.previous);
        self.triangles.clone_from(&other.triangles);
        self.corners.clone_from(&other.corners);
        self.given_as.clone_from(&other.given_as);
        self.place_of.clone_from(&other.place_of);
        self.tree.clone_from(&other.tree);
        self.generation = other.generation;
        self.displacement_m = other.displacement_m;
    }

    /// Takes the present shape for the one that it had all along, deformed `generation` times: proxies of that time stay.
    pub fn forget_motion(&mut self, generation: u32) {
        self.previous.clone_from(&self.vertices);
        self.displacement_m = 0.0;
        self.generation = generation;
    }

    /// Where the vertices are now, m.
    #[must_use]
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// How many times it was deformed.
    #[must_use]
    pub fn generation(&self) -> u32 {
        self.generation
    }

    /// The radius (m) of the ball about the frame's origin that just holds all of it, now.
    #[must_use]
    pub fn bounding_radius_m(&self) -> f64 {
        self.vertices.iter().map(|vertex| vertex.length_squared()).fold(0.0, f64::max).sqrt()
    }

    /// The signed distance (m) of `point` from the surface, negative inside, and the surface's nearest point;
    /// None without triangles.
    ///
    /// The sign is that of the angle-weighted normal at the nearest point (Bærentzen & Aanæs 2005).
    #[must_use]
    pub fn signed_distance(&self, point: DVec3) -> Option<(f64, DVec3)> {
        let (nearest, outward) = self.nearest(point)?;
        let distance = nearest.distance(point);
        Some((if outward.dot(point - nearest) < 0.0 { -distance } else { distance }, nearest))
    }

    /// The surface's point nearest to `point` (m); None without triangles.
    #[must_use]
    pub fn nearest_point(&self, point: DVec3) -> Option<SurfacePoint> {
        let (at, nearest, outward) = self.nearest_at(point)?;
        Some(SurfacePoint { outward, ..self.point_of(at, nearest) })
    }

    /// The point nearest to `point` (m) of one triangle, counted as given, and that triangle's normal; None where there is
    /// no such triangle.
    #[must_use]
    pub fn nearest_on(&self, triangle: u32, point: DVec3) -> Option<SurfacePoint> {
        let at = *self.place_of.get(triangle as usize)? as usize;
        Some(self.point_of(at, triangle::closest_point(&self.corners[at], point)))
    }

    /// A point of a triangle, in the tree's order.
    fn point_of(&self, at: usize, point: DVec3) -> SurfacePoint {
        SurfacePoint {
            triangle: self.given_as[at],
            vertices: self.triangles[at],
            weights: triangle::weights(&self.corners[at], point),
            point,
            outward: triangle::normal(&self.corners[at]),
        }
    }

    /// The surface's point nearest to `point`, and the outward direction there.
    pub(super) fn nearest(&self, point: DVec3) -> Option<(DVec3, DVec3)> {
        self.nearest_at(point).map(|(_, nearest, outward)| (nearest, outward))
    }

    /// The same, and its triangle in the tree's order.
    fn nearest_at(&self, point: DVec3) -> Option<(usize, DVec3, DVec3)> {
        let foot = |at: usize| triangle::closest_point(&self.corners[at], point);
        let (at, squared) = self.tree.nearest(point, |at| foot(at).distance_squared(point))?;
        let nearest = foot(at);
        let reach = squared.sqrt() * (1.0 + 1e-9) + 1e-12;
        let mut outward = DVec3::ZERO;
        let _: ControlFlow<()> = self.tree.near(point, reach, |at| {
            let corners = &self.corners[at];
            if triangle::closest_point(corners, point).distance(nearest) <= 1e-9 * (1.0 + reach) {
                outward += triangle::normal(corners) * triangle::angle_at(corners, nearest);
            }
            ControlFlow::Continue(())
        });
        Some((at, nearest, outward.normalize_or_zero()))
    }

    /// A distance (m) from `point` that the surface is not nearer than.
    #[must_use]
    pub fn distance_at_least(&self, point: DVec3) -> f64 {
        self.tree.distance(point)
    }

    /// The half-spaces in which a sphere (centre, radius) may move freely within `reach_m` of `home`. Each triangle is
    /// convex, so that the plane across its shortest way to the centre has all of it on the other side: half-spaces,
    /// and everything within all of them, can be entered in straight lines. They replace what is in `found`.
    pub(super) fn half_spaces(
        &self,
        sphere: (DVec3, f64),
        (home, reach_m): (DVec3, f64),
        found: &mut HalfSpaces,
    ) -> Result<(), TooMany> {
        found.clear();
        let (centre, radius_m) = sphere;
        // What is further from the centre is beyond reach.
        let furthest = radius_m + reach_m + centre.distance(home);
        let furthest_squared = furthest * furthest;
        let flow = self.tree.near(home, radius_m + reach_m, |at| {
            let nearest = triangle::closest_point(&self.corners[at], centre);
            if nearest.distance_squared(centre) > furthest_squared {
                return ControlFlow::Continue(());
            }
            let shortest = self.half_space_at(at, nearest, sphere);
            // A plane beyond reach is that of a triangle beyond reach.
            if shortest.excess(home) < -reach_m || found.try_push(shortest).is_ok() {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(TooMany)
            }
        });
        match flow {
            ControlFlow::Break(too_many) => Err(too_many),
            ControlFlow::Continue(()) => Ok(()),
        }
    }

    /// [`half_space::nearest`] for listed half-spaces of a sphere (centre, radius); `easily`, those that are in the way
    /// are replaced by ones that are less.
    pub(super) fn nearest_listed(
        &self,
        goal: DVec3,
        sphere: (DVec3, f64),
        spaces: &mut HalfSpaces,
        easily: bool,
    ) -> Option<Foot> {
        half_space::nearest(goal, |point| {
            let first = half_space::worst_of(spaces, point)?;
            if !easily || spaces[first].settled {
                return Some(spaces[first]);
            }
            spaces[first] = self.towards(spaces[first], sphere, goal);
            let mut worst = (half_space::TOLERANCE_M, None);
            let excess = spaces[first].excess(point);
            if excess > worst.0 {
                worst = (excess, Some(first));
            }
            for at in 0..spaces.len() {
                // A plane is never replaced by one that stops more.
                if spaces[at].excess(point) <= worst.0 {
                    continue;
                }
                if !spaces[at].settled {
                    spaces[at] = self.towards(spaces[at], sphere, goal);
                }
                let excess = spaces[at].excess(point);
                if excess > worst.0 {
                    worst = (excess, Some(at));
                }
            }
            worst.1.map(|at| spaces[at])
        })
    }

    /// [`half_space::nearest`] for all triangles within `reach_m` of `home`, listed or not, seen from the sphere.
    pub(super) fn nearest_unlisted(
        &self,
        goal: DVec3,
        (home, reach_m): (DVec3, f64),
        sphere: (DVec3, f64),
    ) -> Option<Foot> {
        half_space::nearest(goal, |point| {
            let mut worst = (half_space::TOLERANCE_M, None);
            let _: ControlFlow<()> = self.tree.near(home, reach_m, |at| {
                let space = self.half_space(at, sphere);
                if space.excess(point) > worst.0 {
                    worst = (space.excess(point), Some(space));
                }
                ControlFlow::Continue(())
            });
            worst.1
        })
    }

    /// What the triangle `at` leaves to a sphere (centre, radius): beyond the plane across the shortest way.
    #[inline]
    pub(super) fn half_space(&self, at: usize, sphere: (DVec3, f64)) -> HalfSpace {
        self.half_space_at(at, triangle::closest_point(&self.corners[at], sphere.0), sphere)
    }

    /// The same, where the triangle's point that is nearest to the sphere's centre is known.
    #[inline]
    fn half_space_at(&self, at: usize, nearest: DVec3, (centre, radius_m): (DVec3, f64)) -> HalfSpace {
        let (normal, _) = direction(&self.corners[at], nearest, centre);
        HalfSpace { normal, offset: normal.dot(nearest) + radius_m, triangle: at as u32, settled: false }
    }

    /// Another half-space, where one of the same triangle keeps a sphere (centre, radius) from `goal`: every plane
    /// that has the triangle on one side and the sphere on the other will do, and another may stop it less.
    #[inline]
    pub(super) fn towards(
        &self,
        shortest: HalfSpace,
        (centre, radius_m): (DVec3, f64),
        goal: DVec3,
    ) -> HalfSpace {
        let corners = &self.corners[shortest.triangle as usize];
        // The plane touches the triangle at its point nearest to the centre.
        let nearest = centre - shortest.normal * (radius_m - shortest.excess(centre));
        let other = plane_towards(corners, (centre, nearest), goal).map(|(normal, on)| HalfSpace {
            normal,
            offset: normal.dot(on) + radius_m,
            ..shortest
        });
        let valid = other.filter(|other| other.excess(centre) <= half_space::TOLERANCE_M);
        HalfSpace { settled: true, ..valid.unwrap_or(shortest) }
    }

    /// Where a sphere at `centre` goes when the surface moves from its previous shape to the present one: as little
    /// as it has to. In `pieces` steps of equal length. None where the triangles leave it no room.
    ///
    /// A plane with a triangle's corners behind it before, and another with the same normal that has them behind it
    /// after, have the triangle behind them all along when they, too, move in a straight line.
    pub(super) fn carried(&self, centre: DVec3, radius_m: f64, pieces: u32) -> Option<DVec3> {
        let step = self.displacement_m / f64::from(pieces);
        let room = 2.0 * step;
        let mut at = centre;
        for piece in 0..pieces {
            let from = f64::from(piece) / f64::from(pieces);
            let to = f64::from(piece + 1) / f64::from(pieces);
            let reach = radius_m + room + step;
            let mut found = HalfSpaces::new();
            let flow = self.tree.near(at, reach + (1.0 - from) * self.displacement_m, |index| {
                let before = self.between(index, from);
                let nearest = triangle::closest_point(&before, at);
                let (normal, distance) = direction(&before, nearest, at);
                if distance > reach {
                    return ControlFlow::Continue(());
                }
                let after = self.between(index, to).map(|corner| normal.dot(corner));
                let offset = after.into_iter().fold(f64::NEG_INFINITY, f64::max) + radius_m;
                match found.try_push(HalfSpace { normal, offset, triangle: index as u32, settled: true }) {
                    Ok(()) => ControlFlow::Continue(()),
                    Err(_) => ControlFlow::Break(()),
                }
            });
            let foot = half_space::nearest(at, |point| Some(found[half_space::worst_of(&found, point)?]))?;
            if flow.is_break() || foot.point.distance(at) > room {
                return None;
            }
            at = foot.point;
        }
        Some(at)
    }

    /// Where a point goes that moves as the previous shape's point nearest to it does.
    pub(super) fn dragged(&self, centre: DVec3) -> Option<DVec3> {
        let before = |at: usize| triangle::closest_point(&self.between(at, 0.0), centre);
        let mut best: Option<(usize, f64)> = None;
        let within = 2.0 * self.displacement_m + self.nearest(centre)?.0.distance(centre);
        let _: ControlFlow<()> = self.tree.near(centre, within, |at| {
            let distance = before(at).distance(centre);
            if best.is_none_or(|(_, least)| distance < least) {
                best = Some((at, distance));
            }
            ControlFlow::Continue(())
        });
        let at = best?.0;
        let weights = triangle::weights(&self.between(at, 0.0), before(at));
        let after: DVec3 =
            self.corners[at].iter().zip(weights).map(|(corner, weight)| *corner * weight).sum();
        Some(centre + (after - before(at)))
    }

    /// The corners of a triangle on its way from the previous shape (0) to the present one (1).
    fn between(&self, at: usize, way: f64) -> [DVec3; 3] {
        self.triangles[at]
            .map(|vertex| self.previous[vertex as usize].lerp(self.vertices[vertex as usize], way))
    }

    /// The surface's point nearest to `point` of one triangle, in the tree's order.
    pub(super) fn nearest_of(&self, at: u32, point: DVec3) -> DVec3 {
        triangle::closest_point(&self.corners[at as usize], point)
    }

    /// A triangle's place in the list that the surface was made from.
    pub(super) fn given_as(&self, at: u32) -> u32 {
        self.given_as[at as usize]
    }
}

/// The unit vector from `nearest`, a triangle's point, to `centre`, and how far (m) that is.
#[inline]
fn direction(corners: &[DVec3; 3], nearest: DVec3, centre: DVec3) -> (DVec3, f64) {
    let away = centre - nearest;
    let distance = away.length();
    if distance > 1e-12 { (away / distance, distance) } else { (triangle::normal(corners), distance) }
}

/// Normal and point of the plane that a sphere on its way from `centre` to `goal` would touch the triangle with: its
/// own where it passes over it, so that seams between faces stop nothing; at edges and corners, where the goal is
/// outside, the plane across the goal's shortest way.
fn plane_towards(
    corners: &[DVec3; 3],
    (centre, nearest): (DVec3, DVec3),
    goal: DVec3,
) -> Option<(DVec3, DVec3)> {
    let end = triangle::closest_point(corners, goal);
    let own = triangle::normal(corners);
    let own = if own.dot(centre - nearest) < 0.0 { -own } else { own };
    if triangle::has_inside(corners, nearest.midpoint(end)) {
        return Some((own, end));
    }
    let (normal, distance) = (goal - end).normalize_and_length();
    (distance > 1e-9 && own.dot(goal - end) >= 0.0).then_some((normal, end))
}

fn check_finite(vertices: &[DVec3]) -> Result<(), SurfaceError> {
    match vertices.iter().position(|vertex| !vertex.is_finite()) {
        Some(at) => Err(SurfaceError::NotFinite(at)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> (Vec<DVec3>, [[u32; 3]; 4]) {
        (vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    }

    #[test]
    fn what_is_no_surface_is_told() {
        let (vertices, triangles) = tetrahedron();
        let error = MeshSurface::new(vertices.clone(), &[[0, 1, 4]]).unwrap_err();
        assert_eq!(error, SurfaceError::NoSuchVertex { triangle: 0, vertex: 4, vertices: 4 });
        let error = MeshSurface::new(vec![DVec3::ZERO, DVec3::NAN], &[]).unwrap_err();
        assert_eq!(error, SurfaceError::NotFinite(1));
        let mut surface = MeshSurface::new(vertices, &triangles).unwrap();
        assert!(surface.deform(&[DVec3::ZERO]).is_err());
        assert!(surface.deform(&[DVec3::INFINITY; 4]).is_err());
        assert_eq!((surface.generation(), surface.vertices()[3]), (0, DVec3::Z));
    }

    #[test]
    fn the_sign_is_right_at_faces_edges_and_corners() {
        let (vertices, triangles) = tetrahedron();
        let surface = MeshSurface::new(vertices, &triangles).unwrap();
        let signed = |x: f64, y: f64, z: f64| surface.signed_distance(DVec3::new(x, y, z)).unwrap().0;
        assert!((signed(0.1, 0.2, 0.3) + 0.1).abs() < 1e-12);
        assert!((signed(0.2, 0.3, -0.5) - 0.5).abs() < 1e-12);
        assert!((signed(0.5, -0.3, -0.4) - 0.5).abs() < 1e-12);
        assert!((signed(-2.0, -1.0, -2.0) - 3.0).abs() < 1e-12);
        assert!((signed(1.5, -0.01, -0.01) - 0.500_199_96).abs() < 1e-6);
        assert_eq!(MeshSurface::new(vec![], &[]).unwrap().signed_distance(DVec3::ZERO), None);
    }
}
