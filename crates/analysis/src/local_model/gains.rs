//! The gains of a PI local model.

use super::error::LocalModelError;

/// A PI local model on an elastic object: gains that are 0 or more, a stiffness above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PiLocalModel {
    kh_n_per_m: f64,
    int_n_per_m: f64,
    ko_n_per_m: f64,
}

/// Gains beyond this many times K_o say nothing.
const LARGEST_RATIO: f64 = 1e12;

impl PiLocalModel {
    /// K_h, INT = N·T·I and K_o, all in N/m.
    ///
    /// # Errors
    /// When a gain is negative or not finite, K_o is not positive, or a gain is beyond 10¹²·K_o.
    pub fn new(kh_n_per_m: f64, int_n_per_m: f64, ko_n_per_m: f64) -> Result<Self, LocalModelError> {
        if !(ko_n_per_m.is_finite() && ko_n_per_m > 0.0) {
            return Err(LocalModelError::Stiffness(ko_n_per_m));
        }
        for (name, gain) in [("K_h", kh_n_per_m), ("INT", int_n_per_m)] {
            if !(gain >= 0.0 && gain / ko_n_per_m <= LARGEST_RATIO) {
                return Err(LocalModelError::Gain(name, gain));
            }
        }
        Ok(Self { kh_n_per_m, int_n_per_m, ko_n_per_m })
    }

    /// Gains in units of K_o.
    pub(super) const fn normalised(h: f64, i: f64) -> Self {
        Self { kh_n_per_m: h, int_n_per_m: i, ko_n_per_m: 1.0 }
    }

    /// K_h, N/m.
    #[must_use]
    pub const fn kh_n_per_m(&self) -> f64 {
        self.kh_n_per_m
    }

    /// INT, N/m.
    #[must_use]
    pub const fn int_n_per_m(&self) -> f64 {
        self.int_n_per_m
    }

    /// K_o, N/m.
    #[must_use]
    pub const fn ko_n_per_m(&self) -> f64 {
        self.ko_n_per_m
    }

    /// h = K_h/K_o.
    #[must_use]
    pub fn proportional(&self) -> f64 {
        self.kh_n_per_m / self.ko_n_per_m
    }

    /// i = INT/K_o.
    #[must_use]
    pub fn integral(&self) -> f64 {
        self.int_n_per_m / self.ko_n_per_m
    }

    /// The same gains on an object that gives way `factor` (above 0) times as much.
    #[must_use]
    pub fn on_softer(&self, factor: f64) -> Self {
        Self { ko_n_per_m: self.ko_n_per_m / factor, ..*self }
    }

    /// Share of the hand's travel that the surface makes in the end: (5), and all of it with an integral.
    #[must_use]
    pub fn steady_share(&self) -> f64 {
        if self.int_n_per_m > 0.0 { 1.0 } else { self.kh_n_per_m / (self.kh_n_per_m + self.ko_n_per_m) }
    }
}
