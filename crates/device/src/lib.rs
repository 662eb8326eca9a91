//! Haptic devices: what one is, simulated hands that hold them, and the governor that every force passes.
//!
//! A haptic tick reads a [`Device`](device::Device), computes a wrench, has it governed and writes it:
//!
//! - [`device`]: the trait, and an ideal device;
//! - [`hand`]: a simulated hand, `m·x″ = u − (k_h + k_track)·x − (b_h + b_track)·v` with
//!   `u = f_script + k_track·x_target + b_track·v_target + f_device` held from tick to tick, exact in between
//!   ([`plant`]);
//! - [`script`]: what the hand does; its paths ([`target`]) are those of least jerk;
//! - [`governor`]: finite, `|f| ≤ F_max`, `|Δf| ≤ slew·T`, soft start and release, whatever comes in; and bit for bit
//!   what was requested when nothing acts ([`acted`]);
//! - [`energy`]: the energy that a user puts into the session, `−Σ f·Δx`.
//!
//! Constants ([`hand::HandModel`], [`governor::Governor`]) are apart from states ([`hand::HandState`],
//! [`governor::GovernorState`]), which are plain values. Nothing here reads a clock, and nothing in a tick allocates.
//!
//! ```
//! use cotouch_device::device::Device as _;
//! # use cotouch_device::{device, governor, hand, script};
//! use cotouch_scene::geometry::Wrench;
//! # use cotouch_scene::{names::HostIndex, scene::*, time::Rate};
//! # use glam::DVec3;
//! # let control: Rate = "1000".parse()?;
//! # let tracking = SpringDamper { stiffness_n_per_m: 400.0, damping_n_s_per_m: 10.0 };
//! # let reach = Action::Reach { to_m: DVec3::X * 0.1, duration_s: 0.5 };
//! # let user = User { name: "ada".into(), tracking, script: vec![reach], repeat: false };
//! # let arm = Hand { mass_kg: 0.3, damping_n_s_per_m: 2.0, stiffness_n_per_m: 0.0 };
//! # let limits = GovernorLimits { max_force_n: 8.0, max_slew_n_per_s: 8e3, watchdog_s: 0.02, soft_start_s: 0.5,
//! #     release_s: 0.1, damping_n_s_per_m: 0.0 };
//! let script = script::Script::new(&user, 1, HostIndex(0), control);
//! let model = hand::HandModel::new(&arm, hand::Freedom::Line(DVec3::X), script)?;
//! let mut hand = hand::SimulatedHand::new("ada", model, DVec3::ZERO);
//! let governor = governor::Governor::new(&limits, hand.limits(), control);
//! let mut state = governor.start();
//! for tick in 0..2000 {
//!     let reading = hand.read(tick)?;
//!     let wall = Wrench::force(DVec3::X * (-2000.0 * (reading.pose.position.x - 0.05).max(0.0)));
//!     let output = governor.govern(&mut state, &governor::GovernorInput::healthy(wall, reading));
//!     hand.write(output.commanded)?;
//! }
//! assert!((hand.state().position.x - (400.0 * 0.1 - 8.0) / 400.0).abs() < 1e-3); // F_max is 8 N
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod acted;
pub mod device;
pub mod energy;
pub mod governor;
pub mod hand;
pub mod plant;
pub mod script;
pub mod target;
mod tremor;
