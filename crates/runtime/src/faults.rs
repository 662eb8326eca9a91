//! How a host's device fails, in words that are told once for every stretch of failures.

use std::fmt::Write as _;

use arrayvec::ArrayString;
use cotouch_device::DeviceError;

/// A device's name and its reason, of fixed size: the haptic thread makes it.
pub type FaultText = ArrayString<192>;

/// Counts the ticks at which a device was not read or not written.
#[derive(Clone, Debug, Default)]
pub struct DeviceFaults {
    ticks: u64,
    stretches: u64,
    last: FaultText,
    present: Option<DeviceError>,
}

impl DeviceFaults {
    /// Takes one tick. What to tell, if that is new: of `device`, and why. No allocation.
    pub(crate) fn observe(&mut self, device: &str, fault: Option<DeviceError>) -> Option<FaultText> {
        let was_so = fault.is_some() && is_alike(self.present.as_ref(), fault.as_ref());
        self.present = fault;
        let fault = self.present.as_ref()?;
        self.ticks += 1;
        if was_so {
            return None;
        }
        self.stretches += 1;
        self.last.clear();
        // What does not fit is left out.
        let _: std::fmt::Result = write!(self.last, "{device}: {fault}");
        Some(self.last)
    }

    /// Ticks at which the device failed.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// Stretches of ticks at which it failed for one reason.
    #[must_use]
    pub fn stretches(&self) -> u64 {
        self.stretches
    }

    /// The device and its reason in the last stretch; empty when it never failed.
    #[must_use]
    pub fn last(&self) -> &FaultText {
        &self.last
    }
}

/// Whether two failures are one to a reader: the same reason of a driver, or numbers apart the same.
fn is_alike(one: Option<&DeviceError>, other: Option<&DeviceError>) -> bool {
    match (one, other) {
        (Some(DeviceError::Driver(one)), Some(DeviceError::Driver(other))) => one == other,
        (Some(one), Some(other)) => std::mem::discriminant(one) == std::mem::discriminant(other),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_is_told_once_and_every_tick_counts() {
        let mut faults = DeviceFaults::default();
        let mut observe =
            |fault: Option<DeviceError>| faults.observe("falcon", fault).map(|text| text.to_string());
        let unplugged = || Some(DeviceError::driver("unplugged"));
        let behind = |asked| Some(DeviceError::TickOutOfReach { asked, at: 9, max_ahead: 0 });
        assert_eq!(observe(unplugged()), Some("falcon: unplugged".to_owned()));
        assert_eq!(observe(unplugged()), None);
        assert_eq!(observe(None), None);
        assert_eq!(observe(unplugged()), Some("falcon: unplugged".to_owned()));
        assert!(observe(behind(3)).is_some_and(|text| text.starts_with("falcon: asked for tick 3")));
        assert_eq!(observe(behind(4)), None);
        assert_eq!((faults.ticks(), faults.stretches()), (5, 3));
        assert!(faults.last().starts_with("falcon: asked"));
    }
}
