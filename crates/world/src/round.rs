//! Balls and capsules: everything within a radius of a segment along y.

use glam::DVec3;

use crate::shape::{Probe, ProxyState};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Round {
    /// m.
    pub(crate) radius: f64,
    /// Half of the segment, m; zero for a ball.
    pub(crate) half_length: f64,
}

impl Round {
    /// From the nearest point of the segment to `point`.
    fn beside_axis(&self, point: DVec3) -> DVec3 {
        point - DVec3::Y * point.y.clamp(-self.half_length, self.half_length)
    }

    /// Where a sphere of `radius` about `centre` is. Were the centre pushed past the axis, the normal would turn
    /// round; then the side from which it came answers until the centre is back or out at the side.
    pub(crate) fn probe(&self, proxy: &mut ProxyState, centre: DVec3, radius: f64) -> Option<Probe> {
        let away = self.beside_axis(centre);
        let known = proxy.seen.then(|| self.beside_axis(proxy.point).try_normalize()).flatten();
        if let Some(side) = known.filter(|side| self.holds(proxy, *side, centre)) {
            proxy.face = Some(0);
            let height = away.dot(side);
            let point = centre + (self.radius - height) * side;
            return Some(Probe { normal: side, depth_m: radius + self.radius - height, point });
        }
        let distance = away.length();
        let normal = if distance > 0.0 { away / distance } else { known.unwrap_or(DVec3::X) };
        if distance > 0.0 {
            *proxy = ProxyState { seen: true, face: None, point: centre };
        }
        let point = centre + (self.radius - distance) * normal;
        Some(Probe { normal, depth_m: radius + self.radius - distance, point })
    }

    /// Whether a centre that was last on `side` of the axis is past it, having gone through the solid.
    fn holds(&self, proxy: &ProxyState, side: DVec3, centre: DVec3) -> bool {
        let away = self.beside_axis(centre);
        let height = away.dot(side);
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
