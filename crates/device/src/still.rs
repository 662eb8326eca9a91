//! A device that stays where it is, whatever it renders: the smallest that there is, to be copied by who adds a driver.

use std::sync::Arc;

use cotouch_scene::geometry::{Reading, Readings, Wrench, Wrenches};
use glam::DVec3;

use crate::device::{Device, DeviceLimits};
use crate::error::{DeviceError, DeviceOpenError, no_parameters};
use crate::setup::DeviceSetup;
use crate::switch::{ForceSwitch, HeldWrenches};

/// What `--device` says before the colon.
pub(crate) const NAME: &str = "still";

/// The device of a spec `still`, which takes no parameters.
pub(crate) fn open(parameters: &str, setup: DeviceSetup<'_>) -> Result<Box<dyn Device>, DeviceOpenError> {
    no_parameters(NAME, parameters)?;
    Ok(Box::new(StillDevice::new(setup.rest_positions())))
}

/// Fingers that stay at rest where they are.
#[derive(Clone, Debug)]
pub struct StillDevice {
    readings: Readings,
    force: HeldWrenches,
}

impl StillDevice {
    /// With one finger at each of `positions` (m, world).
    #[must_use]
    pub fn new(positions: impl IntoIterator<Item = DVec3>) -> Self {
        let at_rest = |position| Reading::point(position, DVec3::ZERO);
        let readings: Readings = positions.into_iter().map(at_rest).collect();
        Self { force: HeldWrenches::new(readings.len()), readings }
    }
}

impl Device for StillDevice {
    fn name(&self) -> &str {
        NAME
    }

    fn fingers(&self) -> usize {
        self.readings.len()
    }

    fn limits(&self) -> DeviceLimits {
        DeviceLimits::POINT
    }

    fn force_switch(&self) -> Arc<dyn ForceSwitch> {
        self.force.switch()
    }

    fn recentre(&mut self, position: DVec3) {
        let shift = self.readings.first().map_or(DVec3::ZERO, |first| position - first.pose.position);
        self.readings.iter_mut().for_each(|reading| reading.pose.position += shift);
    }

    fn read(&mut self, _tick: u64) -> Result<Readings, DeviceError> {
        Ok(self.readings.clone())
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        self.force.write(wrenches)
    }

    fn rendered(&self) -> Wrenches {
        self.force.rendered()
    }
}
