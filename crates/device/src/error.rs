//! Why a device did not do what was asked, and why there is none.

use std::error::Error;
use std::fmt::{self, Write as _};

use arrayvec::ArrayString;
use cotouch_scene::geometry::Wrench;

use crate::finger::FingerError;

/// Why a device did not do what was asked at a tick. Making, copying and showing one allocates nothing: a device may fail
/// at every tick.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// A wrench with a NaN or an infinity.
    #[error("a wrench must consist of finite numbers; found force {} N, torque {} N·m", .wrench.force, .wrench.torque)]
    NotFinite {
        /// What was to be written.
        wrench: Wrench,
    },
    /// A tick that the device cannot answer for.
    #[error(
        "asked for tick {asked}, but the device is at tick {at} and can answer for up to {max_ahead} ticks more"
    )]
    TickOutOfReach {
        /// The tick that was asked for.
        asked: u64,
        /// The tick at which the device is.
        at: u64,
        /// How far ahead it can go at once.
        max_ahead: u64,
    },
    /// Fewer readings than the device has fingers.
    #[error("it reports {found} of its {expected} fingers")]
    MissingFingers {
        /// How many readings came.
        found: usize,
        /// Fingers that the device had at the start.
        expected: usize,
    },
    /// A reading with a NaN or an infinity.
    #[error("what it reports of finger {finger} is no number")]
    ReadingNotFinite {
        /// Which finger, from 1.
        finger: usize,
    },
    /// What the driver, the system or the device itself says.
    #[error("{0}")]
    Driver(DriverReason),
}

impl DeviceError {
    /// What `reason` says, such as an [`io::Error`](std::io::Error) or a sentence.
    #[must_use]
    pub fn driver(reason: impl fmt::Display) -> Self {
        Self::Driver(DriverReason::new(reason))
    }
}

/// A driver's reason in words, of which the first 108 bytes are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DriverReason(ArrayString<108>);

impl DriverReason {
    fn new(reason: impl fmt::Display) -> Self {
        let mut text = Self::default();
        // Too long a text is no error: its beginning is kept.
        let _: fmt::Result = write!(text, "{reason}");
        text
    }
}

impl fmt::Write for DriverReason {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.chars().try_for_each(|letter| self.0.try_push(letter).map_err(|_| fmt::Error))
    }
}

impl fmt::Display for DriverReason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// Why a device cannot be had.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceOpenError {
    /// No driver has this name.
    #[error("there is no device \"{name}\"; there are {known}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// The names of all drivers.
        known: String,
    },
    /// What stands after the driver's name is not what it takes, whatever there is on this machine: no port number, say.
    #[error("the device {driver} takes {allowed}; found \"{found}\"")]
    Parameters {
        /// The driver's name in the table.
        driver: &'static str,
        /// What stands there.
        found: String,
        /// What may stand there.
        allowed: &'static str,
    },
    /// The scene's hand cannot be simulated.
    #[error(transparent)]
    Hand(#[from] FingerError),
    /// The device is not there, or does not work; also a file that the parameters name and that cannot be read or means
    /// nothing. The source is any error, or a sentence: `"line 3: 7 numbers, not 6".into()`.
    #[error("{driver}: {source}")]
    Driver {
        /// The driver's name in the table.
        driver: &'static str,
        /// What it, the system or the device says.
        source: Box<dyn Error + Send + Sync>,
    },
}

/// Refuses parameters of a driver that takes none.
pub(crate) fn no_parameters(driver: &'static str, found: &str) -> Result<(), DeviceOpenError> {
    let error = || DeviceOpenError::Parameters { driver, found: found.to_owned(), allowed: "no parameters" };
    found.is_empty().then_some(()).ok_or_else(error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drivers_reason_is_kept_and_cut_at_a_letter() {
        let gone = std::io::Error::from_raw_os_error(19);
        assert_eq!(DeviceError::driver(&gone).to_string(), gone.to_string());
        let long = DeviceError::driver("ü".repeat(80)).to_string();
        assert_eq!(long, "ü".repeat(54));
    }
}
