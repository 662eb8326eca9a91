//! What users perceive of the object: admittance, added damping, equivalent stiffness (Fotoohi Ghiam 2006, ch. 6).
//!
//! One user moves the object while the others are absent, their hosts' copies of it still there (Fig 6.1 (a)–(c)). The
//! user's force acts on the hand; what the hand does is the answer.
//!
//! - [`admittance`]: over frequency, twice. The *slow-rate response* is Fotoohi Ghiam 2006, (6.1): the force is held
//!   over each network period and the hand is read at network instants only, `G(z) = C·(zI − A)⁻¹·B`, `z = e^(jωT_t)`. The
//!   *fundamental* is what a continuous sinusoidal force meets: the hand answers with `e^(jωt)` times something that repeats
//!   with every pattern, of which this is the mean. It is exact too: force and Fourier filter are part of the plant whose
//!   matrix exponential is taken.
//! - [`added_damping`]: (6.2), the limit of F/V for z → 1, from the structure of the loop and not from small frequencies.
//! - [`equivalent_stiffness`]: F/X at rest.
//!
//! Scenes with several directions are looked at along one line ([`Reduction`]), as in Fotoohi Ghiam 2006. On a soft object
//! every finger of the user touches, pushes and answers along the normal of the surface there; the object is held to the ground,
//! so that positions answer.
//!
//! # Example
//! Held data brake: the remote user of a centralized session feels (B.10).
//!
//! ```
//! use cotouch_analysis::transparency::{added_damping, closed_forms};
//! use cotouch_scene::names::HostIndex;
//! let settings = ["rates.network_hz=512", "link.delay_periods=0"].map(|setting| setting.parse().unwrap());
//! let scene = cotouch_scene::load("single-axis-centralized", &settings).unwrap();
//! let local = added_damping(&scene, HostIndex(0)).unwrap();
//! let remote = added_damping(&scene, HostIndex(1)).unwrap();
//! assert_eq!(local.damping_n_s_per_m, Some(0.0));
//! let expected = closed_forms::centralized_remote_damping(&scene);
//! assert!((remote.damping_n_s_per_m.unwrap() - expected).abs() < 1e-9);
//! ```

mod admittance;
mod alone;
pub mod closed_forms;
mod damping;
mod drift;
mod error;
mod one_line;
mod response;
mod source;
mod statics;
mod stiffness;
mod turning;
mod user_loops;
mod viscous;

pub use admittance::{Admittance, IdealAdmittance, UserAdmittance, admittance};
pub use damping::{AddedDamping, added_damping};
pub use error::TransparencyError;
pub use one_line::Reduction;
pub use stiffness::{EquivalentStiffness, UserStiffness, equivalent_stiffness};
pub use turning::TurningDamping;
pub use user_loops::AdmittanceQuantity;
