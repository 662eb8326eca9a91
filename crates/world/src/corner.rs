//! Spheres that stand for a body where it meets other surfaces.

use arrayvec::ArrayVec;
use glam::DVec3;

/// Most spheres that stand for one body.
pub const MAX_CORNERS: usize = 32;

/// Spheres that stand for a body.
pub type Corners = ArrayVec<CornerSphere, MAX_CORNERS>;

/// A sphere, fixed to a body, that stands for it where it meets other surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerSphere {
    /// Where the centre is in the body's frame, m.
    pub centre: DVec3,
    /// Radius of the sphere, m.
    pub radius_m: f64,
}
