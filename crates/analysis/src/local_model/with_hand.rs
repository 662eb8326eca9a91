//! Haptic loop and simulation loop together: a hand that is free to move, on a local model, on a slow elastic object.
//!
//! Barbagli et al. 2003 leaves this open (§2.1, §5) and calls a stable slow loop, the hand held still, necessary. It
//! is, for all hands together: a hand may hold as still as it likes. For one given hand it is neither necessary (a
//! light, well damped one follows the surface) nor enough (one that swings on the local model sees a force that is a
//! slow period old).
//!
//! `crate::diagram::hand_on_local_model` describes the same loop as a diagram; the two agree.

use nalgebra::{DMatrix, Matrix3, RowDVector};

use super::{LocalModel, LocalModelError, SlowLoop};
use crate::eigenvalues::{eigenvalues, spectral_radius};

/// A hand with the device in it: `m·ẍ + b·ẋ + k·x = −F`, F held over each haptic tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// kg, above 0.
    pub mass_kg: f64,
    /// N·s/m.
    pub damping_n_s_per_m: f64,
    /// N/m, to where the hand wants to be.
    pub stiffness_n_per_m: f64,
}

impl Hand {
    /// The exact map over one haptic tick: `[x, v]⁺ = A_D·[x, v] + B_D·F`, as 3×3 with F appended.
    fn over_a_tick(&self, period_s: f64) -> Result<Matrix3<f64>, LocalModelError> {
        let all = [self.mass_kg, self.damping_n_s_per_m, self.stiffness_n_per_m, period_s];
        for (what, allowed, found, is_allowed) in [
            ("the hand's mass, kg,", "above 0", self.mass_kg, self.mass_kg > 0.0),
            ("the hand's damping, N·s/m,", "finite", self.damping_n_s_per_m, true),
            ("the hand's stiffness, N/m,", "finite", self.stiffness_n_per_m, true),
            ("the haptic period, s,", "above 0", period_s, period_s > 0.0),
        ] {
            if !(found.is_finite() && is_allowed) {
                return Err(LocalModelError::Number { what, allowed, found });
            }
        }
        let [mass, damping, stiffness, period_s] = all;
        let continuous =
            Matrix3::new(0.0, 1.0, 0.0, -stiffness / mass, -damping / mass, -1.0 / mass, 0.0, 0.0, 0.0);
        Ok((continuous * period_s).exp())
    }
}

/// The exact map over one slow period of `[x_hand, v_hand, x_now, x_before, integral]`: m, m/s, the simulation's last
/// result and the one before in m, and the integral's force in N (left out where INT = 0). The hand is sampled at every
/// haptic tick.
///
/// # Errors
/// When a number of the hand is not finite, or its mass or the haptic period T is not positive.
pub fn lifted(
    hand: Hand,
    model: &LocalModel,
    slow_loop: &SlowLoop,
    period_s: f64,
) -> Result<DMatrix<f64>, LocalModelError> {
    let tick = hand.over_a_tick(period_s)?;
    let with_integral = model.int_n_per_m > 0.0;
    let size = if with_integral { 5 } else { 4 };
    let per_tick = model.int_n_per_m / slow_loop.ratio() as f64;
    // Rows over the state at the start of the period.
    let unit = |index: usize| RowDVector::from_fn(size, |_, column| f64::from(u8::from(column == index)));
    let (mut position, mut velocity) = (unit(0), unit(1));
    let mut integral = if with_integral { unit(4) } else { RowDVector::zeros(size) };
    let mut returned = RowDVector::zeros(size);
    for (index, &weight) in slow_loop.weights().iter().enumerate() {
        let share = slow_loop.share_of_way(index);
        let error = &position - unit(2) * share - unit(3) * (1.0 - share);
        let force = &error * model.kh_n_per_m + &integral;
        returned += &force * weight;
        integral += error * per_tick;
        let next =
            |row: usize| &position * tick[(row, 0)] + &velocity * tick[(row, 1)] + &force * tick[(row, 2)];
        (position, velocity) = (next(0), next(1));
    }
    let mut rows = vec![position, velocity, returned / model.ko_n_per_m, unit(2)];
    if with_integral {
        rows.push(integral);
    }
    Ok(DMatrix::from_rows(&rows))
}

/// The largest absolute eigenvalue of [`lifted`].
///
/// # Errors
/// As there, and when the eigenvalues are not found.
pub fn hand_spectral_radius(
    hand: Hand,
    model: &LocalModel,
    slow_loop: &SlowLoop,
    period_s: f64,
) -> Result<f64, LocalModelError> {
    Ok(spectral_radius(&eigenvalues(&lifted(hand, model, slow_loop, period_s)?)?))
}
