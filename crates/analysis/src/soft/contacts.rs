//! Where fingers touch a soft body.

use cotouch_scene::scene::Scene;
use cotouch_soft::MaterialPoint;
use glam::DVec3;

/// A finger's contact about rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Anchor {
    pub(super) point: MaterialPoint,
    /// Outward, unit.
    pub(super) normal: DVec3,
    /// From the point to where the finger starts, m.
    pub(super) distance_m: f64,
}

/// The nearest point of the surface at rest, for every finger where it starts.
pub(super) fn anchors(scene: &Scene, rest_m: &[DVec3], triangles: &[[u32; 3]]) -> Vec<Anchor> {
    let fingers = scene.users.iter().flat_map(|user| &user.fingers);
    fingers.filter_map(|finger| nearest(rest_m, triangles, finger.position_m)).collect()
}

fn nearest(nodes_m: &[DVec3], triangles: &[[u32; 3]], from: DVec3) -> Option<Anchor> {
    let on = |&nodes: &[u32; 3]| {
        let [a, b, c] = nodes.map(|node| nodes_m[node as usize]);
        let weights = nearest_weights(from, a, b, c);
        let point = a * weights[0] + b * weights[1] + c * weights[2];
        let outward = (b - a).cross(c - a).normalize_or_zero();
        let away = from - point;
        let normal = if away.dot(outward) > 1e-9 { away.normalize() } else { outward };
        Anchor { point: MaterialPoint::on_triangle(nodes, weights), normal, distance_m: away.length() }
    };
    triangles.iter().map(on).min_by(|one, other| one.distance_m.total_cmp(&other.distance_m))
}

/// Barycentric weights of the point of a triangle that is nearest to `p` (Ericson 2005, 5.1.5).
fn nearest_weights(p: DVec3, a: DVec3, b: DVec3, c: DVec3) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (ab.dot(p - a), ac.dot(p - a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let beside_ab = d1 * d4 - d3 * d2;
    if beside_ab <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let share = d1 / (d1 - d3);
        return [1.0 - share, share, 0.0];
    }
    let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let beside_ac = d5 * d2 - d1 * d6;
    if beside_ac <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let share = d2 / (d2 - d6);
        return [1.0 - share, 0.0, share];
    }
    let beside_bc = d3 * d6 - d5 * d4;
    if beside_bc <= 0.0 && d4 >= d3 && d5 >= d6 {
        let share = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - share, share];
    }
    let sum = beside_ab + beside_ac + beside_bc;
    [beside_bc / sum, beside_ac / sum, beside_ab / sum]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_points_are_no_farther_than_any_other_point_of_the_triangle() {
        let (a, b, c) = (DVec3::ZERO, DVec3::new(1.0, 0.1, 0.0), DVec3::new(0.3, 0.9, 0.2));
        let at = |weights: [f64; 3]| a * weights[0] + b * weights[1] + c * weights[2];
        for index in 0..400 {
            let place = |by: f64| (f64::from(index) * by).fract() * 3.0 - 1.0;
            let from = DVec3::new(place(0.754_877), place(0.569_840), place(0.324_718));
            let nearest = at(nearest_weights(from, a, b, c)).distance(from);
            for i in 0..=20 {
                for j in 0..=20 - i {
                    let weights = [f64::from(i) / 20.0, f64::from(j) / 20.0, f64::from(20 - i - j) / 20.0];
                    assert!(nearest <= at(weights).distance(from) + 1e-12);
                }
            }
        }
    }
}
