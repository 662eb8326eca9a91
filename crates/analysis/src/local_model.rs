//! Local models on a slowly simulated elastic object (the paper, §2–3): loops, regions, step responses, choice of gains.
//!
//! The haptic loop ticks every `T`; the simulation answers every `N·T`. All positions count into the object, from its
//! surface at rest, so that the error `e` is how deep the hand is inside the surface:
//!
//! ```text
//! every tick     e(k) = x_h(k) − x_surface(k)          F(k) = K_h·e(k) + integral(k)              (6)
//!                integral(k+1) = integral(k) + T·I·e(k)                    INT = N·T·I, in N/m
//! every period   x_o = (Σ w_j·F_j) / K_o, the weights w_j summing to 1     first, mean, last, or any
//! zero hold      the next period's surface is x_o                                                 (1), (2)
//! first hold     the surface moves from the result before to x_o during the next period           §3.4, end
//! ```
//!
//! All of it scales with K_o: only `h = K_h/K_o` and `i = INT/K_o` matter. With the first moment of the weights,
//! `m = Σ w_j·j/N`, the loop with the hand held still has, under a zero-order hold, the characteristic polynomial
//! `z² + (g−1)·z + (i−g)` with `g = h + m·i`: the paper's (7)–(9) where the first force is returned (m = 0), and the same
//! loop with a larger proportional gain where a mean (m = (N−1)/2N) or the last force (m = (N−1)/N) is. Without an
//! integral it is `z + h` (4). An integrator that is not there has no pole: radii do not tend to P's as INT → 0.
//!
//! [`SlowLoop`] gives both this closed form and an exact lift of the loop, tick by tick; [`with_hand`] lifts haptic and
//! simulation loop together; [`simulation`] has the thresholds (10), (11) and the drain of §3.5.
//!
//! # Example
//! Gains that the paper's (9) calls stable, and that its own algorithm (the mean goes to the simulation) makes unstable:
//!
//! ```
//! use cotouch_analysis::local_model::{LocalModel, ReturnedForce, SlowLoop, SurfaceHold};
//! let gains = LocalModel::new(1200.0, 600.0, 1000.0).unwrap();
//! let radius = |force| SlowLoop::new(50, force, SurfaceHold::Zero).unwrap().spectral_radius(&gains);
//! assert!(radius(ReturnedForce::First) < 1.0);
//! assert!(radius(ReturnedForce::Mean) > 1.0);
//! ```

pub mod choose;
mod clip;
pub mod contacts;
pub mod polynomial;
pub mod region;
pub mod simulation;
mod slow_loop;
pub mod step;
pub mod with_hand;

pub use slow_loop::SlowLoop;

use crate::eigenvalues::EigenvalueError;

/// Which force of a slow period goes to the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReturnedForce {
    /// Of its first tick: the paper's equations.
    First,
    /// The mean of all ticks: the paper's algorithm, Step 3.
    Mean,
    /// Of its last tick.
    Last,
}

/// How the surface moves between two results of the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceHold {
    /// It jumps (2).
    Zero,
    /// It moves linearly, one period late (§3.4).
    First,
}

/// A PI local model on an elastic object: gains that are 0 or more, a stiffness above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalModel {
    kh_n_per_m: f64,
    int_n_per_m: f64,
    ko_n_per_m: f64,
}

/// Gains beyond this many times K_o say nothing.
const LARGEST_RATIO: f64 = 1e12;

impl LocalModel {
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

/// Why there is no answer about a local model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LocalModelError {
    /// K_o.
    #[error("K_o must be a stiffness above 0 N/m; found {0}")]
    Stiffness(f64),
    /// K_h or INT.
    #[error("{0} must be 0 N/m or more, and at most 10¹² times K_o; found {1}")]
    Gain(&'static str, f64),
    /// N.
    #[error("a slow period has 1 to {MAX_TICKS} haptic ticks; found {0}")]
    Ratio(usize),
    /// Weights of the returned force.
    #[error("the weights of the returned force must be finite numbers that sum to 1; they sum to {0}")]
    Weights(f64),
    /// The step of the hand, periods, thresholds, …
    #[error("{what} must be {allowed}; found {found}")]
    Number {
        /// In words, with the unit.
        what: &'static str,
        /// Likewise.
        allowed: &'static str,
        /// What was given.
        found: f64,
    },
    /// A response of too many ticks.
    #[error("a response of {0:.3e} haptic ticks is asked for; at most {1:e} are computed")]
    TooLong(f64, f64),
    /// The compliance of contacts.
    #[error("a joint compliance must be a symmetric, positive definite matrix: {0}")]
    Compliance(String),
    /// No eigenvalues.
    #[error(transparent)]
    Eigenvalues(#[from] EigenvalueError),
}

/// Haptic ticks in a slow period, at most.
const MAX_TICKS: usize = 10_000;
