//! The point of a triangle that is nearest to a given point.

use glam::DVec3;

/// The point of the triangle `corners` nearest to `point` (Ericson 2005, 5.1.5).
///
/// A triangle without area is treated as its three edges.
#[inline]
pub(super) fn closest_point(corners: &[DVec3; 3], point: DVec3) -> DVec3 {
    let [a, b, c] = *corners;
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = point - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let cp = point - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vc = d1 * d4 - d3 * d2;
    let vb = d5 * d2 - d1 * d6;
    let va = d3 * d6 - d5 * d4;
    let area = va + vb + vc;
    // Where rounding decides between face and edge, the three edges decide.
    if area <= 1e-12 * ab.length_squared() * ac.length_squared() {
        return closest_on_edges(corners, point);
    }
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    a + ab * (vb / area) + ac * (vc / area)
}

#[cold]
fn closest_on_edges(&[a, b, c]: &[DVec3; 3], point: DVec3) -> DVec3 {
    let mut best = a;
    for (from, to) in [(a, b), (b, c), (c, a)] {
        let edge = to - from;
        let along = edge.dot(point - from) / edge.length_squared();
        let foot = if along.is_finite() { from + edge * along.clamp(0.0, 1.0) } else { from };
        if foot.distance_squared(point) < best.distance_squared(point) {
            best = foot;
        }
    }
    best
}

/// The unit normal, counter-clockwise side; zero where there is none.
pub(super) fn normal(&[a, b, c]: &[DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// How much of each corner makes `point`, one of the triangle's points.
pub(super) fn weights(&[a, b, c]: &[DVec3; 3], point: DVec3) -> [f64; 3] {
    let whole = (b - a).cross(c - a);
    let part = |from: DVec3, to: DVec3| (from - point).cross(to - point).dot(whole) / whole.length_squared();
    let weights = [part(b, c), part(c, a), part(a, b)];
    if weights.iter().all(|weight| weight.is_finite()) { weights } else { [1.0 / 3.0; 3] }
}

/// Whether `point`, one of the triangle's points, is inside and not on an edge.
#[inline]
pub(super) fn has_inside(&[a, b, c]: &[DVec3; 3], point: DVec3) -> bool {
    let whole = (b - a).cross(c - a);
    let least = 1e-9 * whole.length_squared();
    let (a, b, c) = (a - point, b - point, c - point);
    a.cross(b).dot(whole) > least && b.cross(c).dot(whole) > least && c.cross(a).dot(whole) > least
}

/// The angle (rad) that the triangle spans at `point`, one of its points: 2π inside, π on an edge.
pub(super) fn angle_at(corners: &[DVec3; 3], point: DVec3) -> f64 {
    use std::f64::consts::{PI, TAU};
    let near = 1e-9 * corners[0].distance(corners[1]).max(corners[0].distance(corners[2]));
    for (at, &corner) in corners.iter().enumerate() {
        if corner.distance(point) <= near {
            let (to_next, to_last) = (corners[(at + 1) % 3] - corner, corners[(at + 2) % 3] - corner);
            return to_next.cross(to_last).length().atan2(to_next.dot(to_last));
        }
    }
    for at in 0..3 {
        let (from, to) = (corners[at], corners[(at + 1) % 3]);
        let along = (to - from).normalize_or_zero();
        if along.cross(point - from).length() <= near {
            return PI;
        }
    }
    TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nearest of many samples of the triangle.
    fn sampled(corners: &[DVec3; 3], point: DVec3) -> f64 {
        let steps = 200;
        let mut best = f64::INFINITY;
        for i in 0..=steps {
            for j in 0..=(steps - i) {
                let (u, v) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                let at = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
                best = best.min(at.distance(point));
            }
        }
        best
    }

    #[test]
    fn the_closest_point_is_the_closest_of_samples() {
        let corners = [DVec3::new(0.0, 0.0, 0.1), DVec3::new(1.0, 0.2, 0.0), DVec3::new(0.3, 0.9, -0.2)];
        for i in 0..300 {
            let turn = f64::from(i) * 2.399;
            let point = DVec3::new(0.4 + 1.3 * turn.cos(), 0.4 + 1.3 * turn.sin(), 0.8 * (1.7 * turn).sin());
            let exact = closest_point(&corners, point).distance(point);
            let best = sampled(&corners, point);
            assert!(exact <= best + 1e-12 && best - exact < 0.01, "{point}: {exact} against {best}");
        }
    }

    #[test]
    fn triangles_without_area_have_closest_points_too() {
        let point = DVec3::new(0.4, 1.0, 0.0);
        let line = [DVec3::ZERO, DVec3::X, DVec3::X * 0.5];
        assert!(closest_point(&line, point).distance(DVec3::X * 0.4) < 1e-12);
        assert_eq!(closest_point(&[DVec3::X; 3], point), DVec3::X);
    }

    #[test]
    fn angles_are_those_of_corner_edge_and_face() {
        use std::f64::consts::PI;
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert!((angle_at(&corners, DVec3::ZERO) - PI / 2.0).abs() < 1e-12);
        assert!((angle_at(&corners, DVec3::Y) - PI / 4.0).abs() < 1e-12);
        assert!((angle_at(&corners, DVec3::new(0.5, 0.5, 0.0)) - PI).abs() < 1e-12);
        assert!((angle_at(&corners, DVec3::new(0.2, 0.2, 0.0)) - 2.0 * PI).abs() < 1e-12);
    }
}
