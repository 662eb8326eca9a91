//! Where a soft object is fixed.

use glam::DVec3;
use serde::Serialize;

/// `[[soft.fixed]]`: a box; nodes in it do not move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FixedRegion {
    /// Its least corner, m.
    pub from_m: DVec3,
    /// Its largest corner, m.
    pub to_m: DVec3,
}

impl FixedRegion {
    /// Whether a point is in it, but for rounding (1 nm).
    #[must_use]
    pub fn contains(&self, point: DVec3) -> bool {
        let slack = DVec3::splat(1e-9);
        point.cmpge(self.from_m - slack).all() && point.cmple(self.to_m + slack).all()
    }
}
