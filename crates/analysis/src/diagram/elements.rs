//! The usual sampled blocks.

use cotouch_scene::scene::SpringDamper;
use cotouch_world::LinearBlock;
use nalgebra::DMatrix;

use super::clock::Clock;
use super::model::{Law, Sampled};
use super::time::Time;
use crate::loop_spec::Estimate;

impl Sampled {
    /// Any law, used at once.
    #[must_use]
    pub fn new(clock: Clock, law: Law) -> Self {
        let delays = vec![Time::ZERO; clock.offsets.len()];
        let weights = vec![vec![1.0]; clock.offsets.len()];
        Self { spacing: clock.period, clock, delays, law, weights }
    }

    /// The same, used `delay` later: a computation delay, or samples on a way; whole periods or not.
    #[must_use]
    pub fn after(mut self, delay: Time) -> Self {
        self.delays.iter_mut().for_each(|used| *used = used.plus(delay));
        self
    }

    /// `y_k = C·x_k + D·u_k`, `x_{k+1} = A·x_k + B·u_k`.
    #[must_use]
    pub fn linear(clock: Clock, linear: LinearBlock) -> Self {
        Self::new(clock, Law::Linear(linear))
    }

    /// `y = D·u`, outputs × inputs.
    #[must_use]
    pub fn gain(clock: Clock, d: DMatrix<f64>) -> Self {
        Self::linear(clock, LinearBlock::gain(d))
    }

    /// Samples and holds (Fotoohi Ghiam 2006, (3.14)).
    #[must_use]
    pub fn zero_order_hold(clock: Clock, channels: usize) -> Self {
        Self::gain(clock, DMatrix::identity(channels, channels))
    }

    /// Samples, and uses the sample `delay` later.
    #[must_use]
    pub fn delay(clock: Clock, channels: usize, delay: Time) -> Self {
        Self::zero_order_hold(clock, channels).after(delay)
    }

    /// Moves linearly from one sample to the next, one period late (Barbagli et al. 2003, §3.4).
    #[must_use]
    pub fn first_order_hold(clock: Clock, channels: usize) -> Self {
        Self::new(clock, Law::FirstOrderHold { channels })
    }

    /// `k·(x_anchor − x_end) + b·(v_anchor − v_end)`, in N, along `axes` directions; the inputs are the end's positions
    /// and velocities, then the anchor's (Fotoohi Ghiam 2006, (4.25) – (4.28)).
    #[must_use]
    pub fn coupler(clock: Clock, axes: usize, spring: SpringDamper) -> Self {
        let SpringDamper { stiffness_n_per_m: k, damping_n_s_per_m: b } = spring;
        let mut d = DMatrix::zeros(axes, 4 * axes);
        for (part, gain) in [-k, -b, k, b].into_iter().enumerate() {
            d.columns_mut(part * axes, axes).fill_diagonal(gain);
        }
        Self::gain(clock, d)
    }

    /// Tells velocities from positions that are read at the clock's instants (one a period): `axes` positions in; the
    /// same positions, then as many velocities out. The states are the positions read one period ago, then, when
    /// filtered, the velocities told then.
    #[must_use]
    pub fn velocity(clock: Clock, axes: usize, estimate: Estimate) -> Self {
        let period_s = clock.period.seconds();
        let (remembered, share) = match estimate {
            Estimate::Difference => (axes, 1.0),
            Estimate::Filtered { cutoff_rad_per_s } => (2 * axes, -(-cutoff_rad_per_s * period_s).exp_m1()),
        };
        let mut law = LinearBlock {
            a: DMatrix::zeros(remembered, remembered),
            b: DMatrix::zeros(remembered, axes),
            c: DMatrix::zeros(2 * axes, remembered),
            d: DMatrix::zeros(2 * axes, axes),
        };
        for axis in 0..axes {
            law.b[(axis, axis)] = 1.0;
            law.d[(axis, axis)] = 1.0;
            law.d[(axes + axis, axis)] = share / period_s;
            law.c[(axes + axis, axis)] = -share / period_s;
        }
        if remembered > axes {
            for axis in 0..axes {
                law.c[(axes + axis, axes + axis)] = 1.0 - share;
            }
            law.a.rows_mut(axes, axes).copy_from(&law.c.rows(axes, axes));
            law.b.rows_mut(axes, axes).copy_from(&law.d.rows(axes, axes));
        }
        Self::linear(clock, law)
    }

    /// The weighted sum of the samples of each period of `clock`, put out at its end (Barbagli et al. 2003, §4, Step 3): as many evenly
    /// spaced samples as there are weights, the first at the start of the period.
    #[must_use]
    pub fn average(clock: Clock, channels: usize, weights: Vec<f64>) -> Self {
        let spacing = clock.period.divided_by(weights.len() as u128).unwrap_or(clock.period);
        let at_end = clock.period;
        let sum = Self::zero_order_hold(clock, channels).after(at_end);
        Self { weights: vec![weights; sum.clock.offsets.len()], spacing, ..sum }
    }

    /// The mean of `samples` evenly spaced samples of each period of `clock`, put out at its end.
    #[must_use]
    pub fn mean(clock: Clock, channels: usize, samples: u32) -> Self {
        Self::average(clock, channels, vec![f64::from(samples).recip(); samples as usize])
    }
}
