//! Local models: what is between a finger and a slowly simulated soft body, at the haptic rate (the paper, §2–4).

use cotouch_soft::MaterialPoint;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Where a finger touches a soft body, and what its local model remembers: a plain value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LocalContact {
    /// Whether it touches.
    pub touching: bool,
    /// The point of the surface that holds it.
    pub anchor: MaterialPoint,
    /// The triangle of the anchor.
    pub triangle: u32,
    /// From the anchor to where the finger's centre is held, m.
    pub offset: DVec3,
    /// Outward, unit.
    pub normal: DVec3,
    /// The integral's force along the normal, N.
    pub integral_n: f64,
    /// How much of the integral's force a tick of draining takes away, N; 0 while it touches.
    pub drain_n: f64,
    /// The force on the finger in the last tick, N.
    pub force: DVec3,
    /// The proxy of a finger that is free.
    pub proxy: crate::proxy::ProxyState,
}
