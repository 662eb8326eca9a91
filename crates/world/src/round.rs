//! Balls and capsules: everything within a radius of a segment along y.

use glam::DVec3;

use crate::approach::ApproachSide;
use crate::probe::Probe;

/// So near to the axis, as a share of the radius, the side from which the centre came answers.
const CORE: f64 = 0.25;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Round {
    /// Distance of the surface from the segment, m.
    pub(crate) radius: f64,
    /// Half of the segment, m; zero for a ball.
    pub(crate) half_length: f64,
}

impl Round {
    /// From the nearest point of the segment to `point`.
    fn beside_axis(&self, point: DVec3) -> DVec3 {
        point - DVec3::Y * point.y.clamp(-self.half_length, self.half_length)
    }

    /// Where a sphere of `radius` about `centre` is. Close to the axis the direction away from it would turn round; there
    /// the side from which the centre came answers, until the centre is back or out at the side.
    pub(crate) fn probe(&self, proxy: &mut ApproachSide, centre: DVec3, radius: f64) -> Option<Probe> {
        let away = self.beside_axis(centre);
        let known = proxy.seen.then(|| self.beside_axis(proxy.point).try_normalize()).flatten();
        if let Some(side) = known.filter(|side| self.holds(proxy, *side, centre)) {
            proxy.face = Some(0);
            let height = away.dot(side);
            let point = centre + (self.radius - height) * side;
            return Some(Probe { normal: side, depth_m: radius + self.radius - height, point });
        }
        let distance = away.length();
        let normal = if distance > 0.0 { away / distance } else { DVec3::X };
        if distance >= CORE * self.radius {
            *proxy = ApproachSide { seen: true, face: None, point: centre };
        }
        let point = centre + (self.radius - distance) * normal;
        Some(Probe { normal, depth_m: radius + self.radius - distance, point })
    }

    /// Whether a centre that was last on `side` of the axis is near the axis, or past it and came there through the solid.
    fn holds(&self, proxy: &ApproachSide, side: DVec3, centre: DVec3) -> bool {
        let away = self.beside_axis(centre);
        let height = away.dot(side);
        if away.length() < CORE * self.radius {
            return true;
        }
        if height >= 0.0 {
            return false;
        }
        let out = if proxy.face.is_some() {
            (away - height * side).length()
        } else {
            let way = centre - proxy.point;
            (away - away.dot(way) / way.length_squared() * way).length()
        };
        out < self.radius
    }
}
