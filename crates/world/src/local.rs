//! Local models: what is between a finger and a slowly simulated soft body, at the haptic rate (the paper, §2–4).
//!
//! A finger is a sphere. Where it meets the surface, the surface's point that it touches becomes its *anchor* `x_a`, a
//! point of the material, so that the surface carries it along; the finger's centre `x_h` is held at `x_a + o`. Nothing
//! of this needs to know how the body is simulated.
//!
//! ```text
//! error         e = x_a + o − x_h                   into the body counts along the outward normal n: e_n = e·n
//! hold          F = K_h·e of the first tick of a slow period, held
//! p             F = K_h·e                                                             (4), (5)
//! pi            F = K_h·e + n·I,  I⁺ = I + (INT/N)·(e_n − θ)                          (6), θ of (10), (11)
//! compliance    (1/K_h + W)·f = −e + W·f_frame,  F = −f                               all contacts together
//! ```
//!
//! While a finger sticks, anchor, offset and normal are constant. Where the force would leave the cone of friction, the
//! anchor slides along the surface, just so far that it does not. A finger comes off where `e_n ≤ 0`; what `pi` has
//! integrated then drains linearly (§3.5). A two-sided contact does neither, has no thresholds, and is linear.

pub mod compliance;
mod contact;
mod integral;
mod surface;

use cotouch_scene::scene::{LocalModelKind, Scene, WallSides};
use cotouch_soft::MaterialPoint;
use glam::DVec3;
use serde::{Deserialize, Serialize};

pub use surface::SurfaceInUse;

/// Where a finger touches a soft body, and what its local model remembers: a plain value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LocalContact {
    /// Whether it touches.
    pub touching: bool,
    /// Whether it slid in the last tick.
    pub sliding: bool,
    /// The point of the surface that holds it; where it came off, the last one.
    pub anchor: MaterialPoint,
    /// The triangle of the anchor.
    pub triangle: u32,
    /// From the anchor to where the finger's centre is held, m.
    pub offset: DVec3,
    /// Outward, unit. While the integral's force drains: its direction.
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

/// The constants of local models: those of `[local_model]` that no gain scales.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalLaw {
    /// Which.
    pub kind: LocalModelKind,
    /// Whether contacts also pull.
    pub two_sided: bool,
    /// μ.
    pub friction: f64,
    /// Of a finger, m.
    pub radius_m: f64,
    /// θ̄₁ of (11), m.
    pub exit_threshold_m: f64,
    /// θ̄₂ of (11), m.
    pub entry_threshold_m: f64,
    /// Ī_tot of (11), N; 0: the threshold is always fully there.
    pub threshold_force_n: f64,
}

impl LocalLaw {
    /// That of a scene.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let model = &scene.local_model;
        Self {
            kind: model.kind,
            two_sided: model.sides == WallSides::Two,
            friction: model.friction,
            radius_m: scene.hand.finger_radius_m,
            exit_threshold_m: model.exit_threshold_m,
            entry_threshold_m: model.entry_threshold_m,
            threshold_force_n: model.threshold_force_n,
        }
    }
}

/// What a local model is in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalGains {
    /// K_h, N/m.
    pub stiffness_n_per_m: f64,
    /// INT/N = T·I, N/m.
    pub integral_per_tick_n_per_m: f64,
    /// In how many ticks an integral's force drains.
    pub drain_ticks: f64,
}
