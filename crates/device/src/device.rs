//! What the rest of cotouch knows about a haptic device: read where it is, write what it renders.
//!
//! # How to write a device
//!
//! A device is one file in `crates/device/src` and one line in the table of [`drivers`](crate::DRIVERS); from then on
//! `--device SPEC` reaches it from `run`, `serve` and `join`, and the conformance tests run over it. Copy `still.rs`, the
//! smallest device that there is, and go through the methods of [`Device`]:
//!
//! - **Open.** A function `open(parameters, setup) -> Result<Box<dyn Device>, DeviceOpenError>` gets what stands behind the colon
//!   of `NAME:PARAMETERS`, and a [`DeviceSetup`](crate::DeviceSetup): the scene (its haptic rate, where fingers rest) and
//!   whose device it is. It may block, allocate and start threads. Parameters that are none are
//!   [`DeviceOpenError::Parameters`](crate::DeviceOpenError::Parameters); what is not there, cannot be read or means
//!   nothing, a file too, is [`DeviceOpenError::Driver`](crate::DeviceOpenError::Driver).
//! - **Fingers.** As many as the user has in the scene, `setup.rest_positions().count()`, in the same order. Fingers beyond
//!   these are left out. A device with fewer runs, and a note of the session says so: the prediction is of all fingers.
//! - **Time.** A tick's instant in session time is `scene.rates.control_hz.instant(tick)`. The first tick need not be 0: a
//!   host that joins late begins where the session is. A device whose own time begins with it keeps the tick of
//!   [`start`](Device::start); one that is a function of session time has nothing to start.
//! - **Read.** Where the haptic interface points are, in SI units, in the world frame, finite. Twice at one tick is the
//!   same twice. A device that cannot say says why: `DeviceError::driver(reason)`; that does not allocate, and stands in
//!   the session's notes, its summary and its recording, with the device's name.
//! - **Write.** The wrenches are held until the next write. The governor has seen to it that they are finite, within
//!   [`limits`](Device::limits) and free of jumps; a device that is asked for anything else refuses all of it.
//! - **Between the two** there is no allocation, no lock that another thread may hold for long, and bounded work; a driver
//!   with a slow bus has a thread of its own and a latest-value exchange.
//! - **Switch.** [`force_switch`](Device::force_switch) takes the force away from any thread, at once and for good. A
//!   [`SoftwareSwitch`](crate::SoftwareSwitch), or [`HeldWrenches`](crate::HeldWrenches) with one in it, is enough where this
//!   program makes the force; a driver goes further and tells the hardware.
//! - **Only where it means something:** [`start`](Device::start), [`observe`](Device::observe), and
//!   [`is_guided`](Device::is_guided) with [`pointer_targets`](Device::pointer_targets).
//!
//! The analysis predicts the scene's hand (`hand`, `device`) at the device's port, not the device. With a real or a recorded
//! hand its verdict is of the session that the scene describes; where a run ends otherwise, that hand may be why.
//!
//! Nothing else in cotouch asks what a device is. Recordings keep what a device reported and its limits, so that a session
//! with any device replays without it. Devices may wrap devices: pass on what is not changed.
//!
//! ```
//! use std::sync::Arc;
//! use cotouch_device::{Device, DeviceError, DeviceLimits, ForceSwitch, HeldWrenches};
//! use cotouch_scene::geometry::{Reading, Readings, Wrench, Wrenches};
//! use glam::DVec3;
//!
//! /// A point that goes round in circles, whatever it renders.
//! struct Circling { centre: DVec3, force: HeldWrenches }
//!
//! impl Device for Circling {
//!     fn name(&self) -> &str { "circling" }
//!     fn limits(&self) -> DeviceLimits { DeviceLimits::POINT }
//!     fn recentre(&mut self, position: DVec3) { self.centre = position }
//!     fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
//!         let (sine, cosine) = (tick as f64 * 1e-3).sin_cos();
//!         let position = self.centre + DVec3::new(cosine - 1.0, sine, 0.0) * 0.02;
//!         let velocity = DVec3::new(-sine, cosine, 0.0) * 0.02; // at 1 kHz
//!         Ok([Reading::point(position, velocity)].into_iter().collect())
//!     }
//!     fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> { self.force.write(wrenches) }
//!     fn rendered(&self) -> Wrenches { self.force.rendered() }
//!     fn force_switch(&self) -> Arc<dyn ForceSwitch> { self.force.switch() }
//! }
//! ```

use std::sync::Arc;

use cotouch_scene::geometry::{Pose, Readings, Wrench, Wrenches};
use glam::DVec3;
use serde::Serialize;

use crate::error::DeviceError;
use crate::guide::Targets;
use crate::switch::ForceSwitch;

/// What the user of a device can see: where the bodies of the own host's world are.
#[derive(Clone, Copy, Debug)]
pub struct WorldView<'a> {
    /// One pose a body, in the scene's order.
    pub bodies: &'a [Pose],
}

/// An impedance device of one or more fingers: it reports where its haptic interface points are and renders the wrenches
/// that it is given.
///
/// One haptic tick is one [`read`](Self::read) followed by one [`write`](Self::write). For simulated devices both do
/// bounded work and neither allocate nor lock; a driver says in its own documentation what it does besides its
/// system calls.
pub trait Device: Send {
    /// What the device is called in messages and recordings.
    fn name(&self) -> &str;

    /// How many fingers it has, 1 to [`MAX_FINGERS`](cotouch_scene::limits::MAX_FINGERS); constant.
    fn fingers(&self) -> usize {
        1
    }

    /// What the device can render at each finger; constant.
    fn limits(&self) -> DeviceLimits;

    /// What takes the force away, from any thread; always the same switch.
    fn force_switch(&self) -> Arc<dyn ForceSwitch>;

    /// The first tick at this device will be `tick`; called once, before the first [`read`](Self::read). A device that
    /// simulates its user begins there.
    fn start(&mut self, tick: u64) {
        let _ = tick;
    }

    /// From now on, the present place of the first haptic interface point is `position` (m, world): the frame of the
    /// device is moved, not the device. For a user who comes to a world that has moved on: it comes after a read, and the
    /// same tick is then read again, in the moved frame.
    fn recentre(&mut self, position: DVec3);

    /// What the user sees at the instant of the last read; called before each write.
    fn observe(&mut self, view: &WorldView<'_>) {
        let _ = view;
    }

    /// Whether a pointer may draw the fingers, through the guide that the device was opened with; constant.
    fn is_guided(&self) -> bool {
        false
    }

    /// How far a device that moves by itself is with what it was to do.
    fn script_progress(&self) -> ScriptProgress {
        ScriptProgress::None
    }

    /// Where a pointer draws each finger, m, world; empty when none does. For displays: nothing computes with it.
    fn pointer_targets(&self) -> Targets {
        Targets::new()
    }

    /// The readings at the instant of haptic tick `tick`, one a finger. Ticks do not decrease from call to call, but the
    /// real-time loop may skip some. Reading twice at one tick before writing gives the same answer twice.
    ///
    /// # Errors
    /// When the device cannot say where it is at that tick. The caller lets the governor release the force.
    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError>;

    /// Renders one wrench a finger (on the hand, about the haptic interface point, world frame) and holds them until the
    /// next write. While the force is switched off, nothing is rendered.
    ///
    /// # Errors
    /// When a wrench is not finite, or the device did not take them. What was rendered before stays.
    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError>;

    /// What the device renders at this moment, as far as it knows, one wrench a finger: zero while the force is switched
    /// off, and less than what was written where a motor gives less.
    fn rendered(&self) -> Wrenches;
}

impl<D: Device + ?Sized> Device for Box<D> {
    fn name(&self) -> &str {
        (**self).name()
    }

    fn fingers(&self) -> usize {
        (**self).fingers()
    }

    fn limits(&self) -> DeviceLimits {
        (**self).limits()
    }

    fn force_switch(&self) -> Arc<dyn ForceSwitch> {
        (**self).force_switch()
    }

    fn start(&mut self, tick: u64) {
        (**self).start(tick);
    }

    fn recentre(&mut self, position: DVec3) {
        (**self).recentre(position);
    }

    fn observe(&mut self, view: &WorldView<'_>) {
        (**self).observe(view);
    }

    fn is_guided(&self) -> bool {
        (**self).is_guided()
    }

    fn script_progress(&self) -> ScriptProgress {
        (**self).script_progress()
    }

    fn pointer_targets(&self) -> Targets {
        (**self).pointer_targets()
    }

    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
        (**self).read(tick)
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        (**self).write(wrenches)
    }

    fn rendered(&self) -> Wrenches {
        (**self).rendered()
    }
}

/// How far a device that moves by itself is with what it was to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScriptProgress {
    /// Somebody moves it, or nothing does.
    #[default]
    None,
    /// It goes on.
    Running,
    /// All is done; it does nothing more by itself.
    Over,
}

/// The largest wrench that a device can render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceLimits {
    /// The largest force at a finger, N.
    pub max_force_n: f64,
    /// N·m; 0 for a device that renders no torque.
    pub max_torque_n_m: f64,
}

impl DeviceLimits {
    /// Of a device without limits of its own.
    pub const NONE: Self = Self { max_force_n: f64::INFINITY, max_torque_n_m: f64::INFINITY };
    /// Of a point without limits of its own: any force, no torque.
    pub const POINT: Self = Self { max_force_n: f64::INFINITY, max_torque_n_m: 0.0 };
}
