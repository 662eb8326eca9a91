//! The one rule by which gains follow from a scene and from K_o.

use cotouch_scene::scene::LocalModel;

/// The gains of one contact's local model in one slow period: what of a law's parameters is per tick or follows from K_o.
/// Parameters that do neither are in [`SoftContactModel`](super::SoftContactModel).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalGains {
    /// Stiffness K_h of the spring, N/m.
    pub stiffness_n_per_m: f64,
    /// Integral gain a tick, INT/N = T·I, N/m.
    pub integral_per_tick_n_per_m: f64,
    /// In how many ticks an integral's force drains.
    pub drain_ticks: f64,
}

impl LocalGains {
    /// Gains in a slow period of `ticks` ticks, N: what the scene states in N/m, or else its shares of the contact's K_o.
    #[must_use]
    pub fn new(model: &LocalModel, ko_n_per_m: f64, ticks: u64) -> Self {
        let ticks = ticks as f64;
        let absolute_or =
            |absolute: f64, ratio: f64| if absolute > 0.0 { absolute } else { ratio * ko_n_per_m };
        Self {
            stiffness_n_per_m: absolute_or(model.stiffness_n_per_m, model.stiffness_ratio),
            integral_per_tick_n_per_m: absolute_or(model.integral_n_per_m, model.integral_ratio) / ticks,
            drain_ticks: model.drain_periods * ticks,
        }
    }
}
