//! Local models on a slowly simulated elastic object (Barbagli et al. 2003, §2–3): loops, regions, step responses,
//! choice of gains.
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
//! `z² + (g−1)·z + (i−g)` with `g = h + m·i`: (7)–(9) of Barbagli et al. 2003 where the first force is returned (m =
//! 0), and the same loop with a larger proportional gain where a mean (m = (N−1)/2N) or the last force (m = (N−1)/N)
//! is. Without an integral it is `z + h` (4). An integrator that is not there has no pole: radii do not tend to P's as
//! INT → 0.
//!
//! [`SimulationLoop`] gives both this closed form and an exact lift of the loop, tick by tick; [`hand_on_local_model`] is haptic
//! and simulation loop together; [`Simulation`] has the thresholds (10), (11) and the drain of §3.5.
//!
//! # Example
//! Gains that (9) of Barbagli et al. 2003 calls stable, and that its own algorithm (the mean goes to the simulation)
//! makes unstable:
//!
//! ```
//! use cotouch_analysis::local_model::{PiLocalModel, SimulationLoop};
//! use cotouch_scene::scene::{ReturnedForce, SurfaceHold};
//! let gains = PiLocalModel::new(1200.0, 600.0, 1000.0).unwrap();
//! let radius = |force| SimulationLoop::new(50, force, SurfaceHold::Zero).unwrap().spectral_radius(&gains);
//! assert!(radius(ReturnedForce::First) < 1.0);
//! assert!(radius(ReturnedForce::Mean) > 1.0);
//! ```

mod choose;
mod clip;
mod contacts;
mod error;
mod gains;
mod polynomial;
mod region;
mod simulation;
mod simulation_loop;
mod step;
mod with_hand;

pub use choose::{ChosenGains, choose};
pub use contacts::{Compliances, worst_spectral_radius};
pub use error::LocalModelError;
pub use gains::PiLocalModel;
pub use region::{StableGains, stable_int, stable_kh};
pub use simulation::{ContactSides, Simulation, SimulationSample, SimulationState, Threshold};
pub use simulation_loop::SimulationLoop;
pub use step::{HandStep, StepResponse};
pub use with_hand::{HandImpedance, hand_on_local_model, hand_spectral_radius};
