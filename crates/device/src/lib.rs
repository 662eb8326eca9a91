//! Haptic devices: what one is, simulated users that hold them, and the governor that every force passes.
//!
//! A haptic tick reads a [`Device`](device::Device), computes a wrench for each finger, has them governed and writes them:
//!
//! - [`device`]: the trait, and an ideal device;
//! - [`user`]: a simulated user of one or more fingers;
//! - [`finger`]: each is `m·x″ = u − (k_h + k_track)·(x − rest) − (b_h + b_track)·v` with
//!   `u = f_script + k_track·(x_target − rest) + b_track·v_target + f_device` held from tick to tick, exact in between
//!   ([`plant`]), on a mechanism with encoders, motors, stops, and links that may have inertia;
//! - [`guided`]: a user whose fingers a pointer draws, while there is one;
//! - [`script`]: what the user does; paths ([`target`]) are those of least jerk;
//! - [`governor`]: finite, `|f| ≤ F_max`, `|Δf| ≤ slew·T`, soft start and release, whatever comes in; and bit for bit
//!   what was requested when nothing acts ([`acted`]); one a finger;
//! - [`energy`]: the energy that a user puts into the session, `−Σ f·Δx`.
//!
//! Constants ([`user::UserModel`], [`governor::Governor`]) are apart from states ([`user::UserState`],
//! [`governor::GovernorState`]), which are plain values. Nothing here reads a clock, and nothing in a tick allocates.
//!
//! ```
//! use cotouch_device::device::Device as _;
//! use cotouch_device::{governor, user};
//! use cotouch_scene::geometry::Wrench;
//! use cotouch_scene::{names::HostIndex, scene::Action};
//! # use glam::DVec3;
//! let mut scene = cotouch_scene::load("single-axis", &[])?;
//! scene.hand.stiffness_n_per_m = 0.0;
//! scene.users[0].tracking.stiffness_n_per_m = 400.0;
//! scene.users[0].tracking.damping_n_s_per_m = 10.0;
//! scene.users[0].script = vec![Action::Reach { to_m: DVec3::X * 0.1, duration_s: 0.5 }];
//! scene.governor.max_force_n = 8.0;
//!
//! let mut ada = user::SimulatedUser::of_scene(&scene, HostIndex::FIRST)?;
//! let governor = governor::Governor::new(&scene.governor, ada.limits(), scene.rates.control_hz);
//! let mut state = governor.start();
//! for tick in 0..2000 {
//!     let reading = ada.read(tick)?[0];
//!     let wall = Wrench::force(DVec3::X * (-2000.0 * (reading.pose.position.x - 0.05).max(0.0)));
//!     let output = governor.govern(&mut state, &governor::GovernorInput::healthy(wall, reading));
//!     ada.write(&[output.commanded])?;
//! }
//! assert!((ada.states()[0].position.x - (400.0 * 0.1 - 8.0) / 400.0).abs() < 1e-3); // F_max is 8 N
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod acted;
pub mod device;
pub mod energy;
pub mod finger;
pub mod governor;
pub mod guided;
mod linked;
pub mod plant;
pub mod script;
pub mod target;
mod tremor;
pub mod user;
