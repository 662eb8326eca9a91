//! Hands on local models of a slowly simulated soft body: haptic loop and simulation loop together, over a network.
//!
//! Barbagli et al. 2003 leaves this open (§5). One pattern of ticks, network steps and slow periods maps the state
//! exactly:
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
//! coordinates as it takes for its contacts to see no difference; where a host has its own copy, its part of the loop is what
//! its own fingers observe of that and of the local models of others that press on it.

mod closed;
mod closed_body;
mod compile;
mod contacts;
mod error;
mod local_laws;
mod prepared;
mod ratios;
mod reduction;
mod slow_body;
mod touched;

pub use compile::compile_unreduced;
pub(crate) use compile::{UserTouch, modes, touches_of_users};
pub use error::SoftAnalysisError;
pub(crate) use prepared::Bodies;
pub use ratios::gain_ratios;
pub use slow_body::SingularStep;

#[cfg(test)]
mod tests;
