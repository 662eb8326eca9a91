//! The constants of fingers' contacts with a soft body.

use cotouch_scene::scene::{Scene, WallSides};

/// The constants of fingers' contacts with a soft body: what `[local_model]` and `[hand]` say and neither K_o nor the length
/// of a slow period scales; what these scale is in [`LocalGains`](super::LocalGains).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftContactModel {
    /// Whether contacts also pull.
    pub two_sided: bool,
    /// μ: the largest ratio of the force along the surface to the force across it.
    pub friction: f64,
    /// Radius of a finger, m.
    pub radius_m: f64,
    /// θ̄₁ of Barbagli et al. 2003, (11), m.
    pub exit_threshold_m: f64,
    /// θ̄₂ of (11), m.
    pub entry_threshold_m: f64,
    /// Ī_tot of (11), N; 0: the threshold is always fully there.
    pub threshold_force_n: f64,
    /// Length of a tick, s: for laws that difference or filter.
    pub tick_s: f64,
}

impl SoftContactModel {
    /// The constants that a scene states.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let model = &scene.local_model;
        Self {
            two_sided: model.sides == WallSides::Two,
            friction: model.friction,
            radius_m: scene.hand.finger_radius_m,
            exit_threshold_m: model.exit_threshold_m,
            entry_threshold_m: model.entry_threshold_m,
            threshold_force_n: model.threshold_force_n,
            tick_s: scene.rates.control_hz.period_s(),
        }
    }
}
