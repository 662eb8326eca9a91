//! A sphere against any convex polyhedron.
//!
//! Outside, the closest point answers. Once the sphere's centre is beneath the surface the face through which it came
//! answers, until the centre is above it again or has gone past its edge: so a thin plate holds, however deep.

use glam::DVec3;

use crate::approach::ApproachSide;
use crate::probe::Probe;

/// How often a walk may step from a face to its neighbour in one tick.
const MAX_STEPS: usize = 16;

/// Where a point is, seen along a face's normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Over {
    /// The point lies over the face.
    Within,
    /// Past the edge that it shares with this face.
    Past(u32),
}

/// What the algorithm asks of a convex polyhedron. Faces are planes with outward unit normals.
pub(crate) trait Convex {
    /// How many faces there are.
    fn faces(&self) -> u32;
    /// A face's normal, and its distance from the origin.
    fn face(&self, face: u32) -> (DVec3, f64);
    /// Where `point` is, seen along the face's normal.
    fn over(&self, face: u32, point: DVec3) -> Over;
    /// The closest point of the surface if `centre` is outside or on it: normal, distance, point.
    fn closest_from_outside(&self, centre: DVec3) -> Option<(DVec3, f64, DVec3)>;

    /// How far `point` is above a face.
    fn height(&self, face: u32, point: DVec3) -> f64 {
        let (normal, offset) = self.face(face);
        normal.dot(point) - offset
    }

    /// The face that is nearest to a point inside.
    fn nearest_from_inside(&self, point: DVec3) -> u32 {
        let highest = |best: (u32, f64), face| {
            let height = self.height(face, point);
            if height > best.1 { (face, height) } else { best }
        };
        (0..self.faces()).fold((0, f64::NEG_INFINITY), highest).0
    }

    /// The face through which the way from `from`, outside, to `to` enters.
    fn entered(&self, from: DVec3, to: DVec3) -> Option<u32> {
        let (mut enter, mut leave, mut through) = (0.0, 1.0_f64, None);
        for face in 0..self.faces() {
            let (normal, offset) = self.face(face);
            let (before, after) = (normal.dot(from) - offset, normal.dot(to) - offset);
            match (before >= 0.0, after >= 0.0) {
                (true, true) => return None,
                (true, false) => {
                    let at = before / (before - after);
                    if through.is_none() || at > enter {
                        (enter, through) = (at, Some(face));
                    }
                }
                (false, true) => leave = leave.min(before / (before - after)),
                (false, false) => {}
            }
        }
        through.filter(|_| enter < leave)
    }
}

/// Where a sphere of `radius` about `centre` is in the polyhedron.
pub(crate) fn probe_convex(
    solid: &impl Convex,
    proxy: &mut ApproachSide,
    centre: DVec3,
    radius: f64,
) -> Option<Probe> {
    if proxy.face.is_none() && proxy.seen {
        proxy.face = solid.entered(proxy.point, centre);
    }
    if let Some(face) = proxy.face {
        proxy.face = held_face(solid, face, centre);
    }
    if proxy.face.is_none() {
        if let Some((normal, distance, point)) = solid.closest_from_outside(centre) {
            *proxy = ApproachSide { seen: true, face: None, point: centre };
            return Some(Probe { normal, depth_m: radius - distance, point });
        }
        proxy.face = Some(solid.nearest_from_inside(centre));
    }
    proxy.face.map(|face| {
        let (normal, offset) = solid.face(face);
        let height = normal.dot(centre) - offset;
        Probe { normal, depth_m: radius - height, point: centre - height * normal }
    })
}

/// The face that holds a centre which was beneath `face`; none if it is free again.
fn held_face(solid: &impl Convex, mut face: u32, centre: DVec3) -> Option<u32> {
    for _ in 0..MAX_STEPS {
        if solid.height(face, centre) >= 0.0 {
            return None;
        }
        match solid.over(face, centre) {
            Over::Within => return Some(face),
            Over::Past(neighbour) => face = neighbour,
        }
    }
    Some(face)
}
