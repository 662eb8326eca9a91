//! Local models: what is between a finger and a slowly simulated soft body, at the haptic rate (Barbagli et al. 2003, §2–4).
//!
//! A finger is a sphere. Where it meets the surface, the surface's point that it touches becomes its *anchor* `x_a`, a
//! point of the material, so that the surface carries it along; the finger's centre `x_h` is held at `x_a + o`. Nothing
//! of this needs to know how the body is simulated.
//!
//! ```text
//! error         e = x_a + o − x_h                   into the body counts along the outward normal n: e_n = e·n
//! hold          F = K_h·e of the first tick of a slow period, held
//! p             F = K_h·e                                                             (4), (5)
//! pi            F = K_h·e + n·I,  I⁺ = I + (INT/N)·(e_n − θ)                          (6), θ of (10), (11)
//! compliance    (1/K_h + W)·f = −e + W·f_frame,  F = −f                               all contacts together
//! ```
//!
//! While a finger sticks, anchor, offset and normal are constant. Where the force would leave the cone of friction, the
//! anchor slides along the surface, just so far that it does not. A finger comes off where `e_n ≤ 0`; what `pi` has
//! integrated then drains linearly (Barbagli et al. 2003, §3.5). A two-sided contact does neither, has no thresholds, and is linear.
//!
//! # Adding a law
//!
//! A law is one file here with one [`LocalLaw`] (`p.rs` is the one to copy), its line in [`local_law`], and its word and
//! variant of [`LocalModelKind`] in the scene crate. Its state numbers are in [`LocalContact::memory`]. Host and analysis
//! find it in the table; the tests of all laws (`tests/it/local_laws.rs`, and `agreement_soft.rs` of the program) take every
//! kind that there is.

mod compliance;
mod contact;
mod gains;
mod hold;
mod joint;
mod law;
mod model;
mod p;
mod pi;
mod sticking;
mod surface;

use cotouch_scene::scene::LocalModelKind;

pub use contact::{ContactInput, LAW_MEMORY, LawState, LocalContact};
pub use gains::LocalGains;
pub use joint::{JointContact, joint_forces};
pub use law::{FingerForces, FrameCompliance, LawClock, LawNeeds, LocalFinger, LocalLaw, LocalTick, Slots};
pub use model::SoftContactModel;
pub use sticking::StickingContacts;
pub use surface::SurfaceInUse;

/// The law of a kind: the table of all laws.
#[must_use]
pub fn local_law(kind: LocalModelKind) -> &'static dyn LocalLaw {
    match kind {
        LocalModelKind::Hold => &hold::HoldLaw,
        LocalModelKind::P => &p::PLaw,
        LocalModelKind::Pi => &pi::PiLaw,
        LocalModelKind::Compliance => &compliance::ComplianceLaw,
    }
}
