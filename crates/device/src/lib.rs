//! Haptic devices: what one is, which there are, simulated users that hold them, and the governor that every force passes.
//!
//! A haptic tick reads a [`Device`], computes a wrench for each finger, has them governed and writes them. [`open`] gives the
//! device of a spec from the table [`DRIVERS`]; the trait's own page says how to write one (`device.rs`).
//!
//! - [`SimulatedUser`]: a simulated user of one or more fingers. Each is
//!   `m·x″ = u − (k_h + k_track)·(x − rest) − (b_h + b_track)·v` with
//!   `u = f_script + k_track·(x_target − rest) + b_track·v_target + f_device` held from tick to tick, exact in between
//!   ([`SecondOrderPlant`]), on a mechanism with encoders, motors, stops, and links that may have inertia
//!   ([`FingerModel`]). A [`Script`] says what the user does; paths are those of minimum jerk;
//! - [`GuidedUser`]: the same, whose fingers a pointer draws, while there is one;
//! - [`StillDevice`], [`TrajectoryDevice`]: fingers that stay, and that follow prescribed trajectories;
//! - [`FaultyDevice`]: any device with a fault that is made on purpose;
//! - [`Governor`]: finite, `|f| ≤ F_max`, `|Δf| ≤ slew·T`, soft start and release, whatever comes in; and bit for bit
//!   what was requested when nothing acts ([`Acted`]); one a finger;
//! - [`ForceSwitch`]: takes a device's force away from any thread;
//! - [`PortEnergy`]: the energy that a user puts into the session, `−Σ f·Δx`.
//!
//! Constants ([`UserModel`], [`Governor`]) are apart from states ([`UserState`], [`GovernorState`]), which are plain values.
//! Nothing here reads a clock, and nothing in a tick allocates.
//!
//! ```
//! use cotouch_device::{Device as _, Governor, GovernorInput, SimulatedUser};
//! use cotouch_scene::geometry::Wrench;
//! use cotouch_scene::{names::HostIndex, scene::Action};
//! # use glam::DVec3;
//! let scene = cotouch_scene::load("single-axis", &[])?.edit(|scene| {
//!     scene.hand.stiffness_n_per_m = 0.0;
//!     scene.users[0].tracking.stiffness_n_per_m = 400.0;
//!     scene.users[0].tracking.damping_n_s_per_m = 10.0;
//!     scene.users[0].script = vec![Action::Reach { to_m: DVec3::X * 0.1, duration_s: 0.5 }];
//!     scene.governor.max_force_n = 8.0;
//! })?;
//!
//! let mut ada = SimulatedUser::new(&scene, HostIndex::FIRST)?;
//! let governor = Governor::new(&scene, ada.limits());
//! let mut state = governor.start();
//! for tick in 0..2000 {
//!     let reading = ada.read(tick)?[0];
//!     let wall = Wrench::force(DVec3::X * (-2000.0 * (reading.pose.position.x - 0.05).max(0.0)));
//!     let output = governor.govern(&mut state, &GovernorInput::healthy(wall, reading));
//!     ada.write(&[output.commanded])?;
//! }
//! assert!((ada.states()[0].position.x - (400.0 * 0.1 - 8.0) / 400.0).abs() < 1e-3); // F_max is 8 N
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod acted;
mod device;
mod drivers;
mod energy;
mod error;
mod faulty;
mod finger;
mod governor;
mod guide;
mod guided;
mod linked;
mod plant;
mod script;
mod setup;
mod still;
mod switch;
mod target;
mod trajectory;
mod tremor;
mod user;

pub use acted::Acted;
pub use device::{Device, DeviceLimits, ScriptProgress, WorldView};
pub use drivers::{DEFAULT_DEVICE, DRIVERS, Driver, driver, open};
pub use energy::PortEnergy;
pub use error::{DeviceError, DeviceOpenError, DriverReason};
pub use faulty::{Fault, FaultyDevice};
pub use finger::{FingerError, FingerModel, FingerState, SensorState};
pub use governor::{Governor, GovernorFault, GovernorInput, GovernorOutput, GovernorPhase, GovernorState};
pub use guide::{Guide, Targets};
pub use guided::{GuidedUser, POINTER_FADE_S, POINTER_REACH_M, POINTER_STOP_S, guided_scene, pointer_spring};
pub use plant::SecondOrderPlant;
pub use script::{Drive, Drives, FingerPath, PlaceInScript, Script, ScriptState, TRANSITION_S, Touch};
pub use setup::DeviceSetup;
pub use still::StillDevice;
pub use switch::{ForceSwitch, HeldWrenches, SoftwareSwitch, check_finite};
pub use target::{Target, Transition};
pub use trajectory::TrajectoryDevice;
pub use user::{MAX_TICKS_AHEAD, SimulatedUser, UserModel, UserState};
