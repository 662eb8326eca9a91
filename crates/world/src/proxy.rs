//! Contact of a sphere with a triangle mesh through a proxy: a second sphere of the same radius that stays outside.
//!
//! The *haptic sphere* is where the device is, and may be inside the surface. The *proxy* (Ruspini et al. 1997; the
//! god-object of Zilles & Salisbury 1995) follows it as near as the surface lets it:
//!
//! ```text
//! minimise |x − g|²   such that   |x − p| ≥ r for every point p of the surface,
//! ```
//!
//! along a path from where it was, so that no speed takes it through a plate however thin. Every step of that path
//! goes through a region that is known to be free: the triangles near the proxy are convex, so that each leaves a
//! half-space to the sphere, bounded by the plane across the shortest way from the triangle to it,
//! `n·(x − p) ≥ r`. The nearest point of all of these half-spaces is found exactly: one plane holds the proxy on a
//! face, two in a groove, three in a corner. From there the half-spaces are drawn again, until the proxy rests. On a
//! convex edge or corner that gives the smooth normal of the shortest way.
//!
//! All of this is in the frame of the body that has the surface, so that a body's motion is a motion of the haptic
//! sphere. A surface that changes its shape carries proxies along ([`MeshSurface::deform`]).
//!
//! ```
//! use cotouch_world::{MeshSurface, ProxyState};
//! use glam::DVec3;
//!
//! // A triangle in the plane z = 0, seen from above, and a sphere of 5 mm that is moved 2 mm into it at once.
//! let vertices = vec![DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.0), DVec3::new(0.0, 1.0, 0.0)];
//! let surface = MeshSurface::new(vertices, &[[0, 1, 2]])?;
//! let mut state = ProxyState::default();
//! assert_eq!(surface.probe(&mut state, DVec3::new(0.0, 0.0, 0.1), 0.005), None);
//! let probe = surface.probe(&mut state, DVec3::new(0.0, 0.0, 0.003), 0.005).expect("contact");
//! assert!((probe.depth_m - 0.002).abs() < 1e-12 && probe.normal == DVec3::Z);
//! # Ok::<(), cotouch_world::SurfaceError>(())
//! ```

mod half_space;
mod mesh_surface;
mod tree;
mod triangle;

use glam::DVec3;
use serde::{Deserialize, Serialize};

pub use mesh_surface::{MeshSurface, SurfaceError, SurfacePoint};

use crate::probe::Probe;

use half_space::{Foot, HalfSpace, HeldPlane, TOLERANCE_M};
use mesh_surface::HalfSpaces;

/// Smaller spheres (m) are treated as this large: a point has no side to be on.
const MIN_RADIUS_M: f64 = 1e-6;

/// A sphere that starts deeper (m) than this and than its radius is not touched until it was outside.
const MAX_START_DEPTH_M: f64 = 1e-3;

/// Coordinates and radii (m) beyond this are not taken for ones.
const FURTHEST_M: f64 = 1e6;

/// A triangle nearer (m) to the proxy's surface than this touches it.
const TOUCHES_M: f64 = 1e-12;

/// A region's least extent, as a part of the sphere's radius.
const MIN_REACH: f64 = 0.003;

/// Most regions that a proxy passes through in one probe, and most steps in each: the bound of the work.
const MAX_REGIONS: usize = 32;
const MAX_STEPS: usize = 12;

/// Where the proxy of one sphere on one surface is: a plain value. Starts, and is started again, as the default.
///
/// It is about one sphere that is probed every tick: who leaves out ticks, say because the body is far, sets it back
/// to the default, or to what [`MeshSurface::seen_outside`] tells, or the proxy will come from where it was last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProxyState {
    /// Whether the proxy exists: the sphere was outside.
    outside: bool,
    contact: bool,
    triangle: u32,
    generation: u32,
    proxy: DVec3,
    centre: DVec3,
}

impl ProxyState {
    /// The proxy's centre, m, in the body's frame; None while the sphere was never outside.
    #[must_use]
    pub fn proxy(&self) -> Option<DVec3> {
        self.outside.then_some(self.proxy)
    }

    /// The triangle that holds the proxy most, counted as given; None without contact.
    #[must_use]
    pub fn triangle(&self) -> Option<u32> {
        self.contact.then_some(self.triangle)
    }
}

/// What the proxy does in one probe.
struct Slide {
    at: DVec3,
    /// The triangle that holds it most.
    triangle: Option<u32>,
}

impl MeshSurface {
    /// Moves the proxy after a sphere of `radius_m` that is now at `centre` (m, body's frame). None without contact.
    ///
    /// What is not a number, negative, or beyond 10⁶ m, gives None and leaves the state. A sphere that starts inside is not
    /// touched until it was outside, unless a small move takes it out (1 mm, or its radius). Probe at least once
    /// for every [`MeshSurface::deform`]: a proxy that misses one starts again. Bounded work, no allocation; where
    /// the bound is met, the proxy is late, outside the surface, and goes on at the next probe.
    pub fn probe(&self, state: &mut ProxyState, centre: DVec3, radius_m: f64) -> Option<Probe> {
        let within = centre.abs().cmple(DVec3::splat(FURTHEST_M)).all();
        if !(within && (0.0..=FURTHEST_M).contains(&radius_m)) {
            return None;
        }
        let radius = radius_m.max(MIN_RADIUS_M);
        let generation = self.generation();
        let Some((start, ahead)) = self.start(state, centre, radius) else {
            *state = ProxyState { generation, centre, ..ProxyState::default() };
            return None;
        };
        let slide = self.slide(start, centre, radius, ahead);
        let (contact, triangle) =
            (slide.triangle.is_some(), slide.triangle.map_or(0, |at| self.given_as(at)));
        *state = ProxyState { outside: true, contact, triangle, generation, proxy: slide.at, centre };
        let (normal, depth_m) = (slide.at - centre).normalize_and_length();
        let point = self.nearest_of(slide.triangle?, slide.at);
        (depth_m > 0.0).then_some(Probe { normal, depth_m, point })
    }

    /// The state of a sphere of any radius that is at `centre` (m, body's frame), known to be outside and apart from the
    /// surface: for who knows it without a probe.
    #[must_use]
    pub fn seen_outside(&self, centre: DVec3) -> ProxyState {
        let outside = centre.abs().cmple(DVec3::splat(FURTHEST_M)).all();
        let place = if outside { centre } else { DVec3::ZERO };
        ProxyState {
            outside,
            proxy: place,
            centre: place,
            generation: self.generation(),
            ..ProxyState::default()
        }
    }

    /// Where the proxy starts from, and about how far it will have to go from there.
    fn start(&self, state: &ProxyState, centre: DVec3, radius: f64) -> Option<(DVec3, DVec3)> {
        let known = state.outside && state.proxy.is_finite() && state.centre.is_finite();
        let at = match self.generation().wrapping_sub(state.generation) {
            0 if known => state.proxy,
            1 if known => self.carry(state.proxy, radius)?,
            _ => {
                let at = self.enter(centre, radius)?;
                return Some((at, centre - at));
            }
        };
        let step = centre - state.centre;
        let pressed =
            if state.contact { (state.proxy - state.centre).normalize_or_zero() } else { DVec3::ZERO };
        Some((at, step - pressed * step.dot(pressed)))
    }

    /// A place for a proxy of a sphere of which nothing is known.
    fn enter(&self, centre: DVec3, radius: f64) -> Option<DVec3> {
        if self.distance_at_least(centre) > radius {
            return Some(centre);
        }
        let (nearest, outward) = self.nearest(centre)?;
        let away = centre - nearest;
        let sign = if outward.dot(away) < 0.0 { -1.0 } else { 1.0 };
        let distance = sign * away.length();
        if distance >= radius {
            return Some(centre);
        }
        if radius - distance > radius.max(MAX_START_DEPTH_M) {
            return None;
        }
        let normal = if distance.abs() > 1e-9 { away / distance } else { outward };
        let start = nearest + normal * radius;
        // Among other faces the way out is not that short.
        self.signed_distance(start).is_some_and(|(distance, _)| distance >= 0.9 * radius).then_some(start)
    }

    /// Where the change of the surface's shape takes a proxy.
    fn carry(&self, proxy: DVec3, radius: f64) -> Option<DVec3> {
        let carried = [1, 4, 16, 64].into_iter().find_map(|pieces| self.carried(proxy, radius, pieces));
        carried.or_else(|| {
            // It is between faces that leave it no room: with the nearest, as long as it stays outside.
            let dragged = self.dragged(proxy)?;
            (self.signed_distance(dragged)?.0 >= 0.0).then_some(dragged)
        })
    }

    /// From `at` as near to `goal` as the surface lets a proxy slide, by about `ahead`.
    fn slide(&self, mut at: DVec3, goal: DVec3, radius: f64, ahead: DVec3) -> Slide {
        let least = MIN_REACH * radius;
        let (mut home, mut reach) = (at + 0.5 * ahead, 0.6 * ahead.length() + least);
        let mut spaces = HalfSpaces::new();
        let mut triangle = None;
        for _ in 0..MAX_REGIONS {
            let listed = self.half_spaces((at, radius), (home, reach), &mut spaces).is_ok();
            if !listed && reach > least {
                (home, reach) = (at, (0.5 * reach).max(least));
                continue;
            }
            let mut left = false;
            let mut easy = listed;
            for step in 0..MAX_STEPS {
                if listed && step > 0 {
                    for space in &mut spaces {
                        *space = self.half_space(space.triangle as usize, (at, radius));
                    }
                }
                let foot = if listed {
                    self.nearest_listed(goal, (at, radius), &mut spaces, easy)
                        .or_else(|| nearest_of_larger(at, goal, &spaces))
                } else {
                    self.nearest_unlisted(goal, (home, radius + reach), (at, radius))
                };
                let Some(foot) = foot else {
                    let nearest = half_space::worst_of(&spaces, goal).map(|worst| spaces[worst].triangle);
                    triangle = triangle.or(nearest);
                    break;
                };
                triangle = most_held(&foot);
                let next = within(home, reach, at, foot.point);
                left = next != foot.point;
                let rests = next.distance(at) <= TOLERANCE_M;
                at = next;
                // What is held by triangles that it touches is as near as it gets; planes may also hold where their
                // triangles are not.
                let touches = |(space, _): &HeldPlane| {
                    self.nearest_of(space.triangle, at).distance(at) <= radius + TOUCHES_M
                };
                if left || foot.held.iter().all(touches) || (rests && !easy) {
                    break;
                }
                easy = listed && !rests;
            }
            if !left {
                break;
            }
            (home, reach) = (at, 2.0 * reach);
        }
        Slide { at, triangle }
    }
}

/// The point nearest to `goal` of half-spaces that are just so much larger that `at` is in all of them: for where they
/// leave no room.
fn nearest_of_larger(at: DVec3, goal: DVec3, spaces: &[HalfSpace]) -> Option<Foot> {
    half_space::nearest(goal, |point| {
        let excess = |space: &HalfSpace| space.excess(point);
        let relaxed =
            |space: &HalfSpace| HalfSpace { offset: space.offset.min(space.normal.dot(at)), ..*space };
        let worst = spaces.iter().map(relaxed).max_by(|a, b| excess(a).total_cmp(&excess(b)))?;
        (excess(&worst) > TOLERANCE_M).then_some(worst)
    })
}

/// The triangle that holds a proxy most.
fn most_held(foot: &Foot) -> Option<u32> {
    let most = foot.held.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    most.map(|(space, _)| space.triangle)
}

/// `to`, or the last point on the way there from `from` that is within `reach` (m) of `home`, as `from` is.
fn within(home: DVec3, reach: f64, from: DVec3, to: DVec3) -> DVec3 {
    if to.distance_squared(home) <= reach * reach {
        return to;
    }
    // |from + s·way − home| = reach
    let (way, offset) = (to - from, from - home);
    let (a, b) = (way.length_squared(), offset.dot(way));
    let c = (offset.length_squared() - reach * reach).min(0.0);
    let share = ((b * b - a * c).sqrt() - b) / a;
    from + way * share.clamp(0.0, 1.0)
}
