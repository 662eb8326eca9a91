//! What the rest of cotouch knows about a haptic device: read where it is, write what it renders.

use arrayvec::ArrayVec;
use cotouch_scene::geometry::{Pose, Reading, Readings, Wrench};
use cotouch_scene::limits::MAX_FINGERS;
use glam::DVec3;

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

    /// How many fingers it has, 1 to [`MAX_FINGERS`]; constant.
    fn fingers(&self) -> usize {
        1
    }

    /// What the device can render at each finger; constant.
    fn limits(&self) -> DeviceLimits;

    /// The first tick at this device will be `tick`. A device that simulates its user begins there.
    fn start(&mut self, tick: u64) {
        let _ = tick;
    }

    /// From now on, the present place of the first haptic interface point is `position` (m, world): the frame of the
    /// device is moved, not the device. For a user who comes to a world that has moved on.
    fn recentre(&mut self, position: DVec3);

    /// What the user sees at the instant of the last read; called before each write.
    fn observe(&mut self, view: &WorldView<'_>) {
        let _ = view;
    }

    /// Where a pointer draws each finger, m, world; empty when none does. For displays: nothing computes with it.
    fn drawn_to(&self) -> ArrayVec<DVec3, MAX_FINGERS> {
        ArrayVec::new()
    }

    /// The readings at the instant of haptic tick `tick`, one a finger. Ticks do not decrease from call to call, but the
    /// real-time loop may skip some. Reading twice at one tick before writing gives the same answer twice.
    ///
    /// # Errors
    /// When the device cannot say where it is at that tick. The caller lets the governor release the force.
    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError>;

    /// Renders one wrench a finger (on the hand, about the haptic interface point, world frame) and holds them until the
    /// next write.
    ///
    /// # Errors
    /// When a wrench is not finite, or the device did not take them. What was rendered before stays.
    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError>;
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

    fn start(&mut self, tick: u64) {
        (**self).start(tick);
    }

    fn recentre(&mut self, position: DVec3) {
        (**self).recentre(position);
    }

    fn observe(&mut self, view: &WorldView<'_>) {
        (**self).observe(view);
    }

    fn drawn_to(&self) -> ArrayVec<DVec3, MAX_FINGERS> {
        (**self).drawn_to()
    }

    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
        (**self).read(tick)
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        (**self).write(wrenches)
    }
}

/// The largest wrench that a device can render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceLimits {
    /// N.
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

/// Why a device did not do what was asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// A wrench with a NaN or an infinity.
    #[error("{device}: a wrench must consist of finite numbers; found force {} N, torque {} N·m", .wrench.force, .wrench.torque)]
    NotFinite {
        /// The device's name.
        device: String,
        /// What was to be written.
        wrench: Wrench,
    },
    /// A tick that the device cannot answer for.
    #[error(
        "{device}: asked for tick {asked}, but the device is at tick {at} and can answer for up to {most_ahead} ticks more"
    )]
    TickOutOfReach {
        /// The device's name.
        device: String,
        /// The tick that was asked for.
        asked: u64,
        /// The tick at which the device is.
        at: u64,
        /// How far ahead it can go at once.
        most_ahead: u64,
    },
}

/// Refuses a wrench that is not finite.
pub(crate) fn checked(device: &str, wrench: Wrench) -> Result<Wrench, DeviceError> {
    if wrench.is_finite() {
        Ok(wrench)
    } else {
        Err(DeviceError::NotFinite { device: device.to_owned(), wrench })
    }
}

/// A device without dynamics: its reading is set from outside, and it remembers what was written.
///
/// For tests, and for pointers whose motion comes from elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct IdealDevice {
    name: String,
    limits: DeviceLimits,
    reading: Reading,
    written: Wrench,
}

impl IdealDevice {
    /// A device at the origin, at rest, that renders nothing yet.
    #[must_use]
    pub fn new(name: impl Into<String>, limits: DeviceLimits) -> Self {
        Self { name: name.into(), limits, reading: Reading::default(), written: Wrench::default() }
    }

    /// Sets what the next reads report. It is not checked: a bad reading is what a governor must survive.
    pub fn set_reading(&mut self, reading: Reading) {
        self.reading = reading;
    }

    /// What was written last (zero before the first write).
    #[must_use]
    pub fn written(&self) -> Wrench {
        self.written
    }
}

impl Device for IdealDevice {
    fn name(&self) -> &str {
        &self.name
    }

    fn limits(&self) -> DeviceLimits {
        self.limits
    }

    fn recentre(&mut self, position: DVec3) {
        self.reading.pose.position = position;
    }

    fn read(&mut self, _tick: u64) -> Result<Readings, DeviceError> {
        Ok([self.reading].into_iter().collect())
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        for &wrench in wrenches.iter().take(1) {
            self.written = checked(&self.name, wrench)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ideal_device_reports_and_remembers() {
        let mut device = IdealDevice::new("pointer", DeviceLimits::POINT);
        let reading = Reading::point(DVec3::new(0.1, 0.0, -0.2), DVec3::X);
        device.set_reading(reading);
        assert_eq!(device.read(7).unwrap()[..], [reading]);
        device.write(&[Wrench::force(DVec3::Y)]).unwrap();
        let error = device.write(&[Wrench::force(DVec3::NAN)]).unwrap_err();
        assert!(error.to_string().starts_with("pointer: a wrench must consist of finite numbers"), "{error}");
        assert_eq!(device.written(), Wrench::force(DVec3::Y), "a refused wrench changes nothing");
    }
}
