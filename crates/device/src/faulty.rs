//! A device with a fault that is made on purpose, to see what a session does about it.

use std::ops::Range;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use cotouch_scene::geometry::{Readings, Wrench, Wrenches};
use cotouch_scene::time::Rate;
use glam::DVec3;

use crate::device::{Device, DeviceLimits, ScriptProgress, WorldView};
use crate::error::{DeviceError, DeviceOpenError};
use crate::guide::Targets;
use crate::guided;
use crate::setup::DeviceSetup;
use crate::switch::ForceSwitch;

/// What `--device` says before the colon.
pub(crate) const NAME: &str = "faulty";

const ALLOWED: &str = "FAULT@SECONDS or FAULT@SECONDS+DURATION, where FAULT is panic, block, nan or fail";

/// Where a fault without a duration ends, s.
const FOR_EVER_S: f64 = 1e6;

/// The device of a spec `faulty:FAULT@SECONDS+DURATION`: the simulated hand of the scene, and a fault in its reads.
pub(crate) fn open(parameters: &str, setup: DeviceSetup<'_>) -> Result<Box<dyn Device>, DeviceOpenError> {
    let refused =
        || DeviceOpenError::Parameters { driver: NAME, found: parameters.to_owned(), allowed: ALLOWED };
    let (fault, from_s, duration_s) = parse(parameters).ok_or_else(refused)?;
    let control = setup.scene.rates.control_hz;
    let hand = guided::open("", setup)?;
    Ok(Box::new(FaultyDevice::new(hand, fault, from_s, duration_s, control)))
}

fn parse(parameters: &str) -> Option<(Fault, f64, f64)> {
    let (fault, times) = parameters.split_once('@')?;
    let (from, duration) =
        times.split_once('+').map_or((times, None), |(from, duration)| (from, Some(duration)));
    let seconds = |text: &str| text.parse().ok().filter(|seconds| (0.0..=FOR_EVER_S).contains(seconds));
    Some((Fault::parse(fault)?, seconds(from)?, duration.map_or(Some(FOR_EVER_S), seconds)?))
}

/// What is wrong with a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// It panics.
    Panic,
    /// It does not come back for as long as the fault lasts, in real time.
    Block,
    /// It reports places that are no numbers.
    Nan,
    /// It says that it cannot be read.
    Fail,
}

impl Fault {
    fn parse(word: &str) -> Option<Self> {
        match word {
            "panic" => Some(Self::Panic),
            "block" => Some(Self::Block),
            "nan" => Some(Self::Nan),
            "fail" => Some(Self::Fail),
            _ => None,
        }
    }
}

/// Another device, which is as it is until its reads have a fault.
pub struct FaultyDevice<D> {
    inner: D,
    fault: Fault,
    /// Ticks of the fault.
    ticks: Range<u64>,
    /// How long a device that blocks does so.
    blocks_for: Option<Duration>,
}

impl<D: Device> FaultyDevice<D> {
    /// `inner` with a fault from `from_s` of session time on, for `duration_s`; ticks come at `control`.
    #[must_use]
    pub fn new(inner: D, fault: Fault, from_s: f64, duration_s: f64, control: Rate) -> Self {
        let from = control.ticks_in(from_s);
        let ticks = from..from.saturating_add(control.ticks_in(duration_s).max(1));
        let blocks_for = (fault == Fault::Block).then(|| Duration::from_secs_f64(duration_s));
        Self { inner, fault, ticks, blocks_for }
    }
}

impl<D: Device> Device for FaultyDevice<D> {
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn fingers(&self) -> usize {
        self.inner.fingers()
    }

    fn limits(&self) -> DeviceLimits {
        self.inner.limits()
    }

    fn force_switch(&self) -> Arc<dyn ForceSwitch> {
        self.inner.force_switch()
    }

    fn start(&mut self, tick: u64) {
        self.inner.start(tick);
    }

    fn recentre(&mut self, position: DVec3) {
        self.inner.recentre(position);
    }

    fn observe(&mut self, view: &WorldView<'_>) {
        self.inner.observe(view);
    }

    fn is_guided(&self) -> bool {
        self.inner.is_guided()
    }

    fn script_progress(&self) -> ScriptProgress {
        self.inner.script_progress()
    }

    fn pointer_targets(&self) -> Targets {
        self.inner.pointer_targets()
    }

    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
        let mut readings = self.inner.read(tick)?;
        if !self.ticks.contains(&tick) {
            return Ok(readings);
        }
        match self.fault {
            Fault::Panic => panic!("the device panics on purpose"),
            Fault::Block => {
                if let Some(duration) = self.blocks_for.take() {
                    thread::sleep(duration);
                }
                Ok(readings)
            }
            Fault::Nan => {
                readings.iter_mut().for_each(|reading| reading.pose.position = DVec3::NAN);
                Ok(readings)
            }
            Fault::Fail => Err(DeviceError::driver("it fails on purpose")),
        }
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        self.inner.write(wrenches)
    }

    fn rendered(&self) -> Wrenches {
        self.inner.rendered()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_named_with_its_times() {
        assert_eq!(parse("panic@1.5"), Some((Fault::Panic, 1.5, FOR_EVER_S)));
        assert_eq!(parse("block@2+0.25"), Some((Fault::Block, 2.0, 0.25)));
        assert_eq!(parse("nan@0+1"), Some((Fault::Nan, 0.0, 1.0)));
        for wrong in ["", "fail", "fail@", "fail@x", "fail@-1", "fail@1+", "fail@nan", "melt@1", "fail@1+2+3"]
        {
            assert_eq!(parse(wrong), None, "{wrong}");
        }
    }
}
