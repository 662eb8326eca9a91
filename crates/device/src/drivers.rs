//! The table of devices that `--device SPEC` can name. A device is one file and one line here; `device.rs` says how to write
//! one.

use crate::device::Device;
use crate::error::DeviceOpenError;
use crate::setup::DeviceSetup;
use crate::{faulty, guided, still};

/// One kind of device.
#[derive(Clone, Copy, Debug)]
pub struct Driver {
    /// What a spec begins with.
    pub name: &'static str,
    /// What the device is, in one sentence.
    pub summary: &'static str,
    open: Open,
}

type Open = fn(parameters: &str, setup: DeviceSetup<'_>) -> Result<Box<dyn Device>, DeviceOpenError>;

/// All kinds of devices.
#[rustfmt::skip]
pub const DRIVERS: &[Driver] = &[
    Driver { name: guided::NAME, summary: "The simulated hand of the scene: it follows its script, and a pointer on the page may take it.", open: guided::open },
    Driver { name: still::NAME, summary: "Fingers that stay where the scene has them start, whatever they feel.", open: still::open },
    Driver { name: faulty::NAME, summary: "The simulated hand with a fault on purpose, to see that a session is safe: faulty:panic@S, block@S+S, nan@S+S or fail@S+S, at which second and for how long.", open: faulty::open },
];

/// The spec of the device that a user has where nothing else is said.
pub const DEFAULT_DEVICE: &str = guided::NAME;

/// Opens the device of `spec`, which is `NAME` or `NAME:PARAMETERS`. It may take as long as the device needs.
///
/// # Errors
/// When there is no such device, or it cannot be had.
pub fn open(spec: &str, setup: DeviceSetup<'_>) -> Result<Box<dyn Device>, DeviceOpenError> {
    let parameters = spec.split_once(':').map_or("", |(_, parameters)| parameters);
    (driver(spec)?.open)(parameters, setup)
}

/// The driver of `spec`; nothing is opened.
///
/// # Errors
/// When there is none of this name.
pub fn driver(spec: &str) -> Result<&'static Driver, DeviceOpenError> {
    let name = spec.split_once(':').map_or(spec, |(name, _)| name);
    DRIVERS.iter().find(|driver| driver.name == name).ok_or_else(|| DeviceOpenError::Unknown {
        name: name.to_owned(),
        known: DRIVERS.iter().map(|driver| driver.name).collect::<Vec<_>>().join(", "),
    })
}
