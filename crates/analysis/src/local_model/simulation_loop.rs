//! The loop of local model and simulation with the hand held still.

use cotouch_scene::scene::{ReturnedForce, SurfaceHold};
use nalgebra::{DMatrix, RowDVector};

use super::error::{LocalModelError, MAX_TICKS};
use super::gains::PiLocalModel;
use super::polynomial::Polynomial;

/// How the slow loop is closed: N, which force the simulation takes, and how the surface follows its results.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationLoop {
    /// w_0 … w_(N−1).
    weights: Vec<f64>,
    /// Σ w_j·j/N and Σ w_j·j·(j−1)/2N².
    moments: [f64; 2],
    hold: SurfaceHold,
}

impl SimulationLoop {
    /// `ratio` = N haptic ticks in a slow period.
    ///
    /// # Errors
    /// When `ratio` is 0 or above 10,000.
    pub fn new(ratio: u32, returned: ReturnedForce, hold: SurfaceHold) -> Result<Self, LocalModelError> {
        let ratio = ratio as usize;
        check_ratio(ratio)?;
        let mut weights = vec![0.0; ratio];
        match returned {
            ReturnedForce::First => weights[0] = 1.0,
            ReturnedForce::Mean => weights.fill((ratio as f64).recip()),
            ReturnedForce::Last => weights[ratio - 1] = 1.0,
        }
        Ok(Self::of(weights, hold))
    }

    /// Any weighted mean of the forces of a period: HandStep 3 of Barbagli et al.'s algorithm. One weight a tick, N of
    /// them.
    ///
    /// # Errors
    /// When there are none or more than 10,000, or they do not sum to 1 (within 1e-9).
    pub fn weighted(weights: Vec<f64>, hold: SurfaceHold) -> Result<Self, LocalModelError> {
        check_ratio(weights.len())?;
        let sum: f64 = weights.iter().sum();
        if (sum - 1.0).abs() <= 1e-9 {
            Ok(Self::of(weights, hold))
        } else {
            Err(LocalModelError::Weights(sum))
        }
    }

    fn of(weights: Vec<f64>, hold: SurfaceHold) -> Self {
        let n = weights.len() as f64;
        let mean = |value: fn(f64, f64) -> f64| {
            weights.iter().enumerate().map(|(j, weight)| weight * value(j as f64, n)).sum()
        };
        let moments = [mean(|j, n| j / n), mean(|j, n| 0.5 * j * (j - 1.0) / (n * n))];
        Self { weights, moments, hold }
    }

    /// N.
    #[must_use]
    pub fn ratio(&self) -> usize {
        self.weights.len()
    }

    /// w_0 … w_(N−1).
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// How the surface moves between two results.
    #[must_use]
    pub const fn hold(&self) -> SurfaceHold {
        self.hold
    }

    /// `m = Σ w_j·j/N`: INT counts `m` times as proportional gain on top of K_h.
    #[must_use]
    pub const fn first_moment(&self) -> f64 {
        self.moments[0]
    }

    /// The characteristic polynomial in closed form; its coefficients are affine functions of K_h and INT.
    ///
    /// Zero-order hold: `z + h`, or `z² + (g−1)·z + (i−g)` with `g = h + m·i`. First-order hold, where the surface within
    /// a period is `x_before + (j/N)·(x_now − x_before)`, with `m₂ = Σ w_j·j·(j−1)/2N²`, `a = (N−1)/2N`,
    /// `b₁ = h·m + i·m₂`, `b₀ = h·(1−m) + i·(m−m₂)`: `z² + b₁·z + b₀`, or
    /// `z³ + (b₁−1)·z² + (b₀−b₁+i·a)·z + (i·(1−a)−b₀)`.
    #[must_use]
    pub fn characteristic(&self, model: &PiLocalModel) -> Polynomial {
        let (h, i) = (model.proportional(), model.integral());
        let [m, m2] = self.moments;
        match (self.hold, i > 0.0) {
            (SurfaceHold::Zero, false) => Polynomial::monic(&[h]),
            (SurfaceHold::Zero, true) => {
                let g = h + m * i;
                Polynomial::monic(&[i - g, g - 1.0])
            }
            (SurfaceHold::First, false) => Polynomial::monic(&[h * (1.0 - m), h * m]),
            (SurfaceHold::First, true) => {
                let n = self.ratio() as f64;
                let a = 0.5 * (n - 1.0) / n;
                let (b1, b0) = (h * m + i * m2, h * (1.0 - m) + i * (m - m2));
                Polynomial::monic(&[i * (1.0 - a) - b0, b0 - b1 + i * a, b1 - 1.0])
            }
        }
    }

    /// The largest absolute eigenvalue of one slow period, in closed form.
    #[must_use]
    pub fn spectral_radius(&self, model: &PiLocalModel) -> f64 {
        self.characteristic(model).spectral_radius()
    }

    /// Whether a disturbance dies out: Jury's conditions, strictly. On the boundary (P with K_h = K_o) it does not.
    #[must_use]
    pub fn is_stable(&self, model: &PiLocalModel) -> bool {
        self.characteristic(model).is_stable()
    }

    /// The exact map over one slow period, tick by tick, of `[x_now, x_before, integral]`: the surface that the
    /// simulation gave last and the one before, in metres, and the integral's force over K_o, in metres. Without an
    /// integral, `[x_now, x_before]`. A second way to the radius: its eigenvalues are the roots of
    /// [`SimulationLoop::characteristic`] and, under a zero-order hold, 0.
    #[must_use]
    pub fn lifted(&self, model: &PiLocalModel) -> DMatrix<f64> {
        let (h, i) = (model.proportional(), model.integral());
        let with_integral = i > 0.0;
        let size = if with_integral { 3 } else { 2 };
        let per_tick = i / self.ratio() as f64;
        // Rows over the state at the start of the period.
        let unit = |index: usize| RowDVector::from_fn(size, |_, column| f64::from(u8::from(column == index)));
        let mut integral = if with_integral { unit(2) } else { RowDVector::zeros(size) };
        let mut returned = RowDVector::zeros(size);
        for (tick, &weight) in self.weights.iter().enumerate() {
            let share = self.share_of_way(tick);
            let error = -(unit(0) * share + unit(1) * (1.0 - share));
            returned += (&error * h + &integral) * weight;
            integral += error * per_tick;
        }
        let mut map = DMatrix::zeros(size, size);
        map.set_row(0, &returned);
        map.set_row(1, &unit(0));
        if with_integral {
            map.set_row(2, &integral);
        }
        map
    }

    /// How far the surface is, at a tick of a period, on its way from the result before to the last one.
    #[must_use]
    pub fn share_of_way(&self, tick: usize) -> f64 {
        match self.hold {
            SurfaceHold::Zero => 1.0,
            SurfaceHold::First => tick as f64 / self.ratio() as f64,
        }
    }
}

fn check_ratio(ratio: usize) -> Result<(), LocalModelError> {
    if (1..=MAX_TICKS).contains(&ratio) { Ok(()) } else { Err(LocalModelError::Ratio(ratio)) }
}
