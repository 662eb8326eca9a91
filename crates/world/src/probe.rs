//! What a sphere finds when it asks a surface.

use glam::DVec3;

/// Where and how deep a sphere is in a surface, in the body's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// Outward unit normal; on a triangle mesh from the haptic sphere to its proxy.
    pub normal: DVec3,
    /// How far the sphere reaches beneath the surface, m; positive.
    pub depth_m: f64,
    /// The point of the surface, m; of several that a proxy touches, the one on which it presses most.
    pub point: DVec3,
}
