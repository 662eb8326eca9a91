//! The integral of `pi`: its thresholds (10), (11), and how it drains when the finger comes off (§3.5).
//!
//! The paper writes the error as `x_proxy − x_haptic` and calls `e > 0` contact; here `e_n` is that distance, counted from
//! the finger to where it is held, so that all conditions read the same. The third line of (11) as printed, `θ̄₂/I_tot`,
//! falls as the integral grows, while the text says that θ "grows linearly … up to a certain limit"; it is taken as
//! `θ̄₂·I_tot/Ī_tot`, which meets the fourth line.

use glam::DVec3;

use super::{LocalContact, LocalGains, LocalLaw, SurfaceInUse};

impl LocalContact {
    /// One tick of a finger that touches: the integral at the next tick. `depth_m` is e_n, `velocity` (m/s) the finger's.
    pub fn integrate(
        &mut self,
        law: &LocalLaw,
        gains: &LocalGains,
        surface: &SurfaceInUse,
        (depth_m, velocity): (f64, DVec3),
    ) {
        let opening_m_per_s = (surface.velocity(&self.anchor) - velocity).dot(self.normal);
        let threshold_m = self.threshold_m(law, depth_m, opening_m_per_s);
        self.integral_n += gains.integral_per_tick_n_per_m * (depth_m - threshold_m);
        if !law.two_sided {
            self.integral_n = self.integral_n.max(0.0);
        }
    }

    /// One tick of a finger that came off.
    pub fn drain(&mut self) {
        self.integral_n = (self.integral_n - self.drain_n).max(0.0);
        if self.integral_n <= 1e-9 * self.drain_n {
            (self.integral_n, self.drain_n) = (0.0, 0.0);
        }
    }

    /// θ, m, with ė, m/s. A finger that stays where it is counts as one that goes in.
    fn threshold_m(&self, law: &LocalLaw, depth_m: f64, opening_m_per_s: f64) -> f64 {
        if law.two_sided || depth_m <= 0.0 {
            return 0.0;
        }
        if opening_m_per_s < 0.0 {
            return law.exit_threshold_m;
        }
        let there = if law.threshold_force_n > 0.0 { self.integral_n / law.threshold_force_n } else { 1.0 };
        law.entry_threshold_m * there.clamp(0.0, 1.0)
    }
}
