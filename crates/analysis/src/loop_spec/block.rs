//! Sampled blocks.

use cotouch_scene::names::Coordinate;
use cotouch_scene::time::Schedule;
use cotouch_world::LinearBlock;

use super::coupling::ForceGains;
use super::delay::Delay;

/// A sampled linear system with a clock of its own: a filter, a local model, a slowly simulated body.
///
/// From step j of its clock on, which is a tick, it gathers its input: `u_j = Σ_i w_i·input(tick of j + i)`. With the
/// last of that it steps: `y_j = C·x_j + D·u_j`, `x_{j+1} = A·x_j + B·u_j`. Its output y_j is used from the tick on that its
/// delay says.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// The names of its states.
    pub states: Vec<Coordinate>,
    /// The names of its outputs of age 1; none are needed where no output of the past is used at the start of a pattern.
    pub outputs: Vec<Coordinate>,
    /// Which tick does which step.
    pub clock: Schedule,
    /// u: evaluated at the ticks at which it is gathered.
    pub input: ForceGains,
    /// For step j, at `j mod` their number: w, one element a tick from the step's own on. None reaches the next step.
    /// A phase is written as weights that begin with zeros.
    pub weights: Vec<Vec<f64>>,
    /// From input to output.
    pub law: LinearBlock,
    /// When an output is used: where it depends on an input that is gathered over several ticks, after the last of them.
    pub delay: Delay,
    /// What is used between two outputs.
    pub hold: Hold,
}

/// How an output is used until the next one is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// As it is.
    Zero,
    /// Linearly from the output before it to itself, which is reached when the next one is used (Barbagli et al. 2003, §3.4).
    First,
}

impl Block {
    /// A block whose input is sampled once a step.
    #[must_use]
    pub fn sampled(clock: Schedule, input: ForceGains, law: LinearBlock, delay: Delay) -> Self {
        let (states, outputs, weights) = (Vec::new(), Vec::new(), vec![vec![1.0]]);
        Self { states, outputs, clock, input, weights, law, delay, hold: Hold::Zero }
    }

    /// The weights of a step's input.
    pub(crate) fn weights_of_step(&self, step: i64) -> &[f64] {
        &self.weights[step.rem_euclid(self.weights.len() as i64) as usize]
    }

    /// How many outputs are used, held or on their way just before time 0: those of ages 1 to this number.
    pub(crate) fn past_outputs(&self) -> u32 {
        self.delay.samples(&self.clock) + u32::from(self.hold == Hold::First)
    }

    /// Whether an output that depends on an input can be used at the very tick at which that is sampled.
    pub(crate) fn is_direct(&self) -> bool {
        self.delay.is_at_once() && self.law.d.iter().any(|&gain| gain != 0.0)
    }

    /// Ticks after which all that it does repeats.
    pub(crate) fn ticks_per_pattern(&self) -> u64 {
        let (steps, lists) = (self.clock.steps_per_pattern(), self.weights.len().max(1) as u64);
        self.clock.ticks_per_pattern() * (least_common_multiple(steps, lists) / steps)
    }
}

/// Of two whole numbers above 0.
pub(crate) const fn least_common_multiple(one: u64, other: u64) -> u64 {
    let (mut a, mut b) = (one, other);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    one / a * other
}
