//! How a finger meets a soft surface, sticks to it, slides along it and comes off it.

use glam::DVec3;

use super::surface::{SurfaceInUse, material};
use super::{LocalContact, LocalGains, LocalLaw};
use crate::proxy::SurfacePoint;

/// So often is the way along a curved surface corrected in one tick.
const MOST_CORRECTIONS: usize = 4;

/// Slips shorter than this (m) are none.
const LEAST_SLIP_M: f64 = 1e-12;

impl LocalContact {
    /// A contact for good: holds the surface's point that is nearest to `centre` (m).
    pub fn hold_nearest(&mut self, law: &LocalLaw, surface: &SurfaceInUse, centre: DVec3) {
        let Some(nearest) = surface.latest.nearest_point(centre) else { return };
        *self = Self { touching: true, ..Self::default() };
        self.place(law, &nearest, centre - nearest.point);
    }

    /// Looks whether a free finger at `centre` (m) touches; then it is anchored there.
    pub fn meet(&mut self, law: &LocalLaw, surface: &SurfaceInUse, centre: DVec3) {
        // The proxy knows the latest surface; the one in use may still be on its way there.
        let ahead = ahead(law, surface, centre);
        let Some(probe) = surface.latest.probe(&mut self.proxy, centre + ahead, law.radius_m) else { return };
        let held = self.proxy.triangle().and_then(|at| surface.latest.nearest_on(at, probe.point));
        let (Some(point), Some(proxy)) = (held, self.proxy.proxy()) else { return };
        let mut begun = Self { touching: true, drain_n: 0.0, ..*self };
        begun.anchor = material(&point);
        begun.triangle = point.triangle;
        begun.offset = proxy - point.point;
        begun.normal = probe.normal;
        if begun.depth_m(surface, centre) <= 0.0 {
            return;
        }
        begun.integral_n = (self.integral_n * self.normal.dot(probe.normal)).max(0.0);
        *self = begun;
    }

    /// e = x_a + o − x_h, m.
    #[must_use]
    pub fn stretch(&self, surface: &SurfaceInUse, centre: DVec3) -> DVec3 {
        surface.at(&self.anchor) + self.offset - centre
    }

    /// e_n, m.
    #[must_use]
    pub fn depth_m(&self, surface: &SurfaceInUse, centre: DVec3) -> f64 {
        self.stretch(surface, centre).dot(self.normal)
    }

    /// Comes off at `centre` (m). What the integral has drains, in the direction of the last force.
    pub fn come_off(&mut self, surface: &SurfaceInUse, gains: &LocalGains, centre: DVec3) {
        self.touching = false;
        self.sliding = false;
        // Where it is was just told by the contact; whether other parts of the surface are there, the next probe tells.
        self.proxy = surface.latest.seen_outside(centre + surface.to_latest(&self.anchor));
        if self.integral_n <= 0.0 || gains.drain_ticks < 1.0 {
            (self.integral_n, self.drain_n) = (0.0, 0.0);
            return;
        }
        let (direction, force_n) = self.force.normalize_and_length();
        if force_n > 0.0 {
            (self.normal, self.integral_n) = (direction, force_n);
        }
        self.drain_n = self.integral_n / gains.drain_ticks;
    }

    /// Lets the anchor slide along the surface, by as much as the stretch along it is more than `most_m`. The stretch that
    /// counts in this tick.
    pub fn slide(&mut self, law: &LocalLaw, surface: &SurfaceInUse, stretch: DVec3, most_m: f64) -> DVec3 {
        let (along, size) = self.along(stretch).normalize_and_length();
        self.sliding = size > most_m + LEAST_SLIP_M;
        if !self.sliding {
            return stretch;
        }
        let slip = along * (size - most_m);
        let held = surface.at(&self.anchor) + self.offset;
        self.drag(law, surface, held - slip);
        stretch - slip
    }

    /// Moves the anchor so that the finger would be held at about `target` (m), just outside the surface.
    fn drag(&mut self, law: &LocalLaw, surface: &SurfaceInUse, mut target: DVec3) {
        for _ in 0..MOST_CORRECTIONS {
            let ahead = surface.to_latest(&self.anchor);
            let Some(nearest) = surface.latest.nearest_point(target + ahead) else { return };
            self.place(law, &nearest, target + ahead - nearest.point);
            let held = surface.at(&self.anchor) + self.offset;
            let missed = self.along(target - held);
            if missed.length() <= LEAST_SLIP_M {
                return;
            }
            target = held + missed;
        }
    }

    /// Anchors at a point; `away`, from there to the finger's centre, tells the direction.
    fn place(&mut self, law: &LocalLaw, point: &SurfacePoint, away: DVec3) {
        let (direction, distance) = away.normalize_and_length();
        let outward = if direction.dot(point.outward) < 0.0 { -direction } else { direction };
        let normal = if distance > 1e-9 { outward } else { point.outward };
        self.anchor = material(point);
        self.triangle = point.triangle;
        self.normal = normal;
        self.offset = if law.two_sided { away } else { normal * law.radius_m };
    }

    fn along(&self, vector: DVec3) -> DVec3 {
        vector - self.normal * vector.dot(self.normal)
    }
}

/// From the surface in use near `centre` to the latest one, m.
fn ahead(law: &LocalLaw, surface: &SurfaceInUse, centre: DVec3) -> DVec3 {
    if surface.share >= 1.0 || surface.latest.distance_at_least(centre) > law.radius_m {
        return DVec3::ZERO;
    }
    let nearest = surface.latest.nearest_point(centre);
    nearest.map_or(DVec3::ZERO, |nearest| surface.to_latest(&material(&nearest)))
}
