//! Where a session with contact is linearised.
//!
//! A scene's own operating point is its settled grasp ([`OperatingPoint::settled_grasp`]): bodies are where they start,
//! all copies in the same place; every finger that a script sends to a body presses on the side that it starts from, with
//! the force of its script. What that leaves unbalanced (a weight; a finger that only stands its ground) is balanced with
//! the smallest change of forces.
//!
//! To analyse a running session, fill in what it has. [`OperatingPoint`] is plain values: every copy's pose, and for each
//! contact that sticks the finger's centre as the copy's host knows it, the normal and the anchor in the body's frame, and
//! the force on the finger:
//!
//! ```no_run
//! # use cotouch_analysis::{FingerContact, OperatingPoint, compile_at};
//! # use cotouch_scene::names::HostIndex;
//! # use glam::{DMat3, DVec3};
//! # let scene = cotouch_scene::load("single-axis", &[])?;
//! # let (centre, anchor, force) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
//! let mut point = OperatingPoint::free(&scene); // then the measured poses
//! point.fingers.push(FingerContact {
//!     host: HostIndex(0), // whose copy
//!     user: HostIndex(1), // whose finger: here one that host 1 holds
//!     finger: 0,
//!     body: 0,
//!     centre,
//!     normal: DVec3::Y,
//!     anchor,
//!     curvature: DMat3::ZERO, // a flat face
//!     force,
//!     slides: None,
//! });
//! let map = compile_at(&scene, &point).lift()?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod faces;
mod point;
mod reach;
mod settled;
mod statics;

pub(crate) use faces::has_surface;
pub use point::{CornerContact, FingerContact, OperatingPoint};
pub(crate) use reach::{Arrangement, Copies, Reach};
pub(crate) use settled::{Grip, Settled, gains, hosts_with_copies};
