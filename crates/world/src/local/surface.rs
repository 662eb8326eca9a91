//! The surface as a tick uses it: the latest result of the simulation, or a shape on the way there.

use cotouch_soft::MaterialPoint;
use glam::DVec3;

use crate::proxy::{MeshSurface, SurfacePoint};

/// A surface between two results of the simulation; its vertices are the nodes of the body.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceInUse<'a> {
    /// The latest result of the simulation.
    pub latest: &'a MeshSurface,
    /// Where the nodes were in the result before, m.
    pub before_m: &'a [DVec3],
    /// How far on the way from there to the latest it is: 0 to 1; 1 under a zero-order hold.
    pub share: f64,
    /// How much of that way it goes in a second, 1/s; 0 where it stands still.
    pub speed_per_s: f64,
}

impl SurfaceInUse<'_> {
    /// Where a point of the material is, m.
    #[must_use]
    pub fn at(&self, point: &MaterialPoint) -> DVec3 {
        let latest = point.at(self.latest.vertices());
        // Exactly the latest at the end of the way, whatever was before.
        if self.share >= 1.0 { latest } else { point.at(self.before_m).lerp(latest, self.share) }
    }

    /// How fast it moves, m/s. A jump is no speed.
    #[must_use]
    pub fn velocity(&self, point: &MaterialPoint) -> DVec3 {
        if self.speed_per_s == 0.0 {
            return DVec3::ZERO;
        }
        (point.at(self.latest.vertices()) - point.at(self.before_m)) * self.speed_per_s
    }

    /// From where a point of the material is to where it is in the latest result, m.
    #[must_use]
    pub fn to_latest(&self, point: &MaterialPoint) -> DVec3 {
        if self.share >= 1.0 { DVec3::ZERO } else { point.at(self.latest.vertices()) - self.at(point) }
    }
}

/// The point of the material that is there.
pub(super) fn material(point: &SurfacePoint) -> MaterialPoint {
    MaterialPoint::on_triangle(point.vertices, point.weights)
}
