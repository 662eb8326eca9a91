//! Spheres that stand for a body where it meets other surfaces.

use arrayvec::ArrayVec;
use glam::DVec3;

/// Most spheres that stand for one body.
pub const MAX_CORNERS: usize = 32;

/// Spheres that stand for a body.
pub type Corners = ArrayVec<Corner, MAX_CORNERS>;

/// A sphere, fixed to a body, that stands for it where it meets other surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Body frame, m.
    pub centre: DVec3,
    /// m.
    pub radius_m: f64,
}
