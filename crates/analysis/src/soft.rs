//! Hands on local models of a slowly simulated soft body: haptic loop and simulation loop together, over a network.
//!
//! The paper leaves this open (§5). One pattern of ticks, network steps and slow periods maps the state exactly:
//!
//! ```text
//! every tick     e_c = x_surface,c − x_finger,c                                  for every contact c, about rest
//!   p            F_c = K_h·e_c                                                   (3)
//!   pi           F_c = K_h·e_c + n_c·I_c,   I_c⁺ = I_c + INT/N·n_c·e_c           (6)
//!   hold         F_c = K_h·e_c of the period's first tick
//!   compliance   (1/K_h + W)·f = W·f_frame − e,   F = −f                         all contacts of a host together
//! every period   z⁺ = A·z + B·f,   y⁺ = C·z + D·f                                f the returned force, y the contacts
//! surface        y of the period 1 + d before, or from the one before that to it linearly (first-order hold)
//! ```
//!
//! Contacts stick; thresholds only shift where things come to rest. The body is its step linearised at rest, in as few
//! coordinates as it takes for its contacts to see no difference.

mod compile;
mod contacts;
mod layout;
mod ratios;
mod reduction;
mod slow_body;
mod stepping;
mod verdict;

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{LocalModelKind, ReturnedForce, SurfaceHold};
use cotouch_scene::time::Schedule;
use cotouch_soft::SoftError;
use glam::DVec3;
use nalgebra::DMatrix;

use crate::lift::layout::Registers;
use crate::loop_spec::{Body, Delay};
use layout::Layout;

pub use compile::compile_unreduced;
pub(crate) use compile::{Bodies, modes};
pub use layout::SoftCoordinate;
pub use ratios::{ratios, worst_radius};
pub use slow_body::{SingularStep, SlowBody};
pub(crate) use verdict::{analyze, point_verdict};

/// Why a session with a soft body has no verdict.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SoftAnalysisError {
    /// There is no body.
    #[error(transparent)]
    Body(#[from] SoftError),
    /// The step of the body has no solution.
    #[error(transparent)]
    Step(#[from] SingularStep),
    /// Not of this technique.
    #[error("the technique of this soft body cannot tell its compliance, and so neither what K_o is")]
    NoCompliance,
    /// Likewise.
    #[error("the technique of this soft body cannot tell its linear step, so the loop cannot be analysed")]
    NoLinearisation,
    /// A body that forces do not move.
    #[error("the soft body does not give way where it is touched: a region of soft.fixed holds it there")]
    Rigid,
    /// Too much to compute.
    #[error(
        "the loop has {states} states and its ticks, network steps and slow periods repeat every {ticks} ticks only; choose rates whose ratios are simpler, fewer users or a shorter delay"
    )]
    TooLarge {
        /// n.
        states: usize,
        /// p.
        ticks: u64,
    },
}

/// A session with a soft body while a given set of fingers touches it.
#[derive(Clone, Debug, PartialEq)]
pub struct SoftLoop {
    /// Which tick does which network step.
    pub network: Schedule,
    /// Which tick begins which period of the slow simulation.
    pub slow: Schedule,
    /// Between fingers and surface.
    pub kind: LocalModelKind,
    /// Which force of a period goes to the simulation.
    pub returned_force: ReturnedForce,
    /// How the surface moves between two results.
    pub hold: SurfaceHold,
    /// Slow periods between the end of the period whose forces are simulated and the use of the result.
    pub result_delay_periods: u32,
    /// World axes along which nothing ever moves: fingers cannot, and the body does not when it is pressed along the
    /// others.
    pub idle_axes: [bool; 3],
    /// The fingers.
    pub hands: Vec<Hand>,
    /// The hosts that have a body: all of them, or the server.
    pub worlds: Vec<World>,
}

/// A finger with its arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Hand {
    /// Whose.
    pub user: HostIndex,
    /// Which of the user's fingers.
    pub finger: u8,
    /// The finger slot: counted over all users' fingers.
    pub slot: u8,
    /// How it moves.
    pub body: Body,
    /// What the governor brakes it with.
    pub damping_n_s_per_m: f64,
}

/// A host's body and everything that touches it.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// Whose body.
    pub host: HostIndex,
    /// The fingers that touch, m of them.
    pub touches: Vec<Touch>,
    /// Its step, seen from them.
    pub body: SlowBody,
    /// K_h, one a touch.
    pub kh_n_per_m: Vec<f64>,
    /// INT, one a touch.
    pub int_n_per_m: Vec<f64>,
    /// W, m/N, 3m × 3m; of the kind `compliance`.
    pub compliance: Option<DMatrix<f64>>,
}

/// A finger that touches.
#[derive(Clone, Debug, PartialEq)]
pub struct Touch {
    /// Which of [`SoftLoop::hands`].
    pub hand: usize,
    /// How this host knows where the finger is.
    pub way: Way,
    /// Centralized: how the force gets back to a client's finger.
    pub force_back: Option<Delay>,
    /// Of the contact, outward, unit.
    pub normal: DVec3,
}

/// How a host knows where a finger is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    /// It is its own.
    Own,
    /// By samples.
    Samples(Delay),
}

/// `z(k+1) = matrix·z(k)` over one pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct SoftMap {
    /// n × n.
    pub matrix: DMatrix<f64>,
    /// What the n numbers are.
    pub coordinates: Vec<SoftCoordinate>,
}

impl SoftLoop {
    /// Ticks after which ticks, network steps and slow periods repeat.
    #[must_use]
    pub fn ticks_per_pattern(&self) -> u64 {
        least_common_multiple(self.network.ticks_per_pattern(), self.slow.ticks_per_pattern())
    }

    /// The map over one pattern. Every receiver has its own copy of each sample, as the running hosts do.
    #[must_use]
    pub fn lift(&self) -> SoftMap {
        self.lift_with(Registers::PerReceiver)
    }

    /// The same with receivers sharing samples: the same eigenvalues other than 0.
    #[must_use]
    pub fn lift_shared(&self) -> SoftMap {
        self.lift_with(Registers::Shared)
    }

    /// Numbers in the state of [`SoftLoop::lift_shared`].
    #[must_use]
    pub fn states(&self) -> usize {
        Layout::new(self, Registers::Shared).size()
    }

    fn lift_with(&self, registers: Registers) -> SoftMap {
        let layout = Layout::new(self, registers);
        SoftMap { matrix: stepping::lift(self, &layout), coordinates: layout.coordinates }
    }
}

impl World {
    /// (1/K_h + W)⁻¹, where contacts share their forces.
    fn sharing(&self, kind: LocalModelKind) -> Option<DMatrix<f64>> {
        let compliance = self.compliance.as_ref().filter(|_| kind == LocalModelKind::Compliance)?;
        let mut sum = compliance.clone();
        for row in 0..sum.nrows() {
            sum[(row, row)] += self.kh_n_per_m[row / 3].recip();
        }
        sum.try_inverse()
    }
}

fn least_common_multiple(one: u64, other: u64) -> u64 {
    let (mut a, mut b) = (one, other);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    one / a * other
}

#[cfg(test)]
mod tests;
