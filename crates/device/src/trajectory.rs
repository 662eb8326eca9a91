//! A device whose fingers follow prescribed trajectories, whatever it renders: for open-loop comparisons.

use std::sync::Arc;

use cotouch_scene::geometry::{Readings, Wrench, Wrenches};
use cotouch_scene::time::Rate;
use glam::DVec3;

use crate::device::{Device, DeviceLimits};
use crate::error::DeviceError;
use crate::switch::{ForceSwitch, HeldWrenches};

/// Readings as a function of session time (s), one a finger, always as many. Whichever tick is the first, a trajectory is
/// where it is at that time: [`Device::start`] changes nothing.
pub struct TrajectoryDevice<F> {
    control: Rate,
    trajectory: F,
    fingers: usize,
    force: HeldWrenches,
}

impl<F: FnMut(f64) -> Readings> TrajectoryDevice<F> {
    /// On `trajectory`, looked at `control` times a second.
    #[must_use]
    pub fn new(control: Rate, mut trajectory: F) -> Self {
        let fingers = trajectory(0.0).len();
        Self { control, trajectory, fingers, force: HeldWrenches::new(fingers) }
    }
}

impl<F: FnMut(f64) -> Readings + Send> Device for TrajectoryDevice<F> {
    fn name(&self) -> &str {
        "trajectory"
    }

    fn fingers(&self) -> usize {
        self.fingers
    }

    fn limits(&self) -> DeviceLimits {
        DeviceLimits::POINT
    }

    fn force_switch(&self) -> Arc<dyn ForceSwitch> {
        self.force.switch()
    }

    /// A prescribed trajectory stays where it is.
    fn recentre(&mut self, _: DVec3) {}

    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
        Ok((self.trajectory)(self.control.instant(tick).as_secs_f64()))
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        self.force.write(wrenches)
    }

    fn rendered(&self) -> Wrenches {
        self.force.rendered()
    }
}
