//! The point nearest to a goal within an intersection of half-spaces.

use arrayvec::ArrayVec;
use glam::{DMat3, DVec3};

/// By how much (m) a point may be outside a half-space and count as within it.
pub(super) const TOLERANCE_M: f64 = 1e-9;

/// Most times that a plane is added before the search gives up. Two or three are usual.
const MAX_PIVOTS: usize = 32;

/// Planes closer to parallel than this (squared sine of their angle) have no corner.
const MIN_SQUARED_SINE: f64 = 1e-14;

/// The points `y` with `normal·y ≥ offset`.
#[derive(Clone, Copy, Debug)]
pub(super) struct HalfSpace {
    /// Unit normal, towards the inside of the half-space.
    pub(super) normal: DVec3,
    /// Distance of the plane from the origin along the normal, m.
    pub(super) offset: f64,
    /// The triangle that the half-space keeps out.
    pub(super) triangle: u32,
    /// Whether another plane was looked for.
    pub(super) settled: bool,
}

impl HalfSpace {
    /// How far (m) `point` is outside; negative within.
    #[inline]
    pub(super) fn excess(&self, point: DVec3) -> f64 {
        self.offset - self.normal.dot(point)
    }
}

/// A plane that holds the nearest point, and how hard (m): goal + Σ hold·normal = the nearest point.
pub(super) type HeldPlane = (HalfSpace, f64);

/// The nearest point, and the planes, three at most, that keep it from the goal.
#[derive(Clone, Debug)]
pub(super) struct Foot {
    pub(super) point: DVec3,
    pub(super) held: ArrayVec<HeldPlane, 3>,
}

/// The point nearest to `goal` within all half-spaces, of which `worst` tells the one that a point is most outside
/// of, if any by more than [`TOLERANCE_M`]. None where they have no point in common.
///
/// A dual active-set method (Goldfarb & Idnani 1983) in three dimensions: the distance from the goal grows with
/// every plane that is added, so that no set of planes comes twice.
pub(super) fn nearest(goal: DVec3, mut worst: impl FnMut(DVec3) -> Option<HalfSpace>) -> Option<Foot> {
    let mut foot = Foot { point: goal, held: ArrayVec::new() };
    for _ in 0..MAX_PIVOTS {
        let Some(plane) = worst(foot.point) else { return Some(foot) };
        foot = with(goal, plane, &foot.held)?;
    }
    None
}

/// The nearest point within `plane`, on which it lies, and the up to three of `held`.
fn with(goal: DVec3, plane: HalfSpace, held: &[HeldPlane]) -> Option<Foot> {
    let allowed = |foot: &Foot| held.iter().all(|(other, _)| other.excess(foot.point) <= TOLERANCE_M);
    let one = foot(goal, &[plane]);
    let two = || held.iter().filter_map(|(other, _)| foot(goal, &[plane, *other]));
    let three = || {
        [(0, 1), (0, 2), (1, 2)]
            .into_iter()
            .filter_map(|(first, second)| foot(goal, &[plane, held.get(first)?.0, held.get(second)?.0]))
    };
    one.into_iter().find(allowed).or_else(|| two().find(allowed)).or_else(|| three().find(allowed))
}

/// The point of all `planes` nearest to `goal`; None unless each of them holds it back.
#[inline]
fn foot(goal: DVec3, planes: &[HalfSpace]) -> Option<Foot> {
    let mut holds = [0.0; 3];
    match *planes {
        [a] => holds[0] = a.excess(goal),
        [a, b] => {
            let determinant = a.normal.cross(b.normal).length_squared();
            if determinant < MIN_SQUARED_SINE {
                return None;
            }
            let (cosine, p, q) = (a.normal.dot(b.normal), a.excess(goal), b.excess(goal));
            holds[0] = (p - cosine * q) / determinant;
            holds[1] = (q - cosine * p) / determinant;
        }
        [a, b, c] => {
            let normals = DMat3::from_cols(a.normal, b.normal, c.normal);
            if normals.determinant().powi(2) < MIN_SQUARED_SINE {
                return None;
            }
            // (Nᵀ·N)·hold = excess, through the corner itself: Nᵀ·step = excess, N·hold = step.
            let excess = DVec3::new(a.excess(goal), b.excess(goal), c.excess(goal));
            let inverse = normals.inverse();
            holds = (inverse * (inverse.transpose() * excess)).to_array();
        }
        _ => return None,
    }
    let holds = &holds[..planes.len()];
    if !holds.iter().all(|&hold| hold >= 0.0) {
        return None;
    }
    let held: ArrayVec<HeldPlane, 3> = planes.iter().copied().zip(holds.iter().copied()).collect();
    let point = held.iter().fold(goal, |point, (plane, hold)| point + plane.normal * *hold);
    Some(Foot { point, held })
}

/// For [`nearest`]: the place of the half-space in a list that `point` is most outside of.
#[inline]
pub(super) fn worst_of(spaces: &[HalfSpace], point: DVec3) -> Option<usize> {
    let mut worst = (TOLERANCE_M, None);
    for (at, space) in spaces.iter().enumerate() {
        let excess = space.excess(point);
        if excess > worst.0 {
            worst = (excess, Some(at));
        }
    }
    worst.1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn space(normal: DVec3, offset: f64) -> HalfSpace {
        HalfSpace { normal: normal.normalize(), offset, triangle: 0, settled: false }
    }

    fn solve(goal: DVec3, planes: &[HalfSpace]) -> Option<Foot> {
        nearest(goal, |point| Some(planes[worst_of(planes, point)?]))
    }

    #[test]
    fn faces_edges_and_corners_of_a_box() {
        let octant = [space(DVec3::X, 0.0), space(DVec3::Y, 0.0), space(DVec3::Z, 0.0)];
        for goal in [
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::new(-1.0, 2.0, 3.0),
            DVec3::new(-1.0, -2.0, 3.0),
            DVec3::new(-1.0, -2.0, -3.0),
        ] {
            let foot = solve(goal, &octant).unwrap();
            assert!(foot.point.distance(goal.max(DVec3::ZERO)) < 1e-15);
            assert_eq!(foot.held.len(), (0..3).filter(|&axis| goal[axis] < 0.0).count());
        }
    }

    #[test]
    fn nothing_is_nearer_than_what_is_found() {
        // Tangent planes of a ball, seen from within: the nearest point of a polyhedron, against projected descent.
        let planes: Vec<HalfSpace> = (0..60)
            .map(|i| {
                let (height, turn) = (1.0 - f64::from(i) / 30.0, f64::from(i) * 2.399_963);
                let ring = (1.0 - height * height).sqrt();
                space(-DVec3::new(ring * turn.cos(), ring * turn.sin(), height), -1.0)
            })
            .collect();
        for i in 0..100 {
            let turn = f64::from(i);
            let goal = 3.0 * DVec3::new(turn.cos(), turn.sin(), (0.3 * turn).sin());
            let foot = solve(goal, &planes).unwrap();
            assert!(worst_of(&planes, foot.point).is_none());
            // Optimal: what is left to the goal is a sum of held normals, each pushing away from it.
            let push: DVec3 = foot.held.iter().map(|(plane, hold)| plane.normal * *hold).sum();
            assert!(
                foot.held.iter().all(|(plane, hold)| *hold >= 0.0 && plane.excess(foot.point).abs() < 1e-9)
            );
            assert!((goal + push).distance(foot.point) < 1e-12);
        }
    }

    #[test]
    fn what_has_no_point_in_common_is_told() {
        assert!(solve(DVec3::ZERO, &[space(DVec3::X, 1.0), space(-DVec3::X, 1.0)]).is_none());
    }
}
