//! What a governor did at a tick.

use serde::{Deserialize, Serialize};

bitflags::bitflags! {
    /// What acted on a force at one tick. The governor's damping is not listed: it is a part of the loop like any
    /// damper. Serialised as text for people (`"FORCE_LIMIT | SLEW_LIMIT"`) and as a number for machines.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
    pub struct Acted: u16 {
        /// The force was longer than the largest.
        const FORCE_LIMIT = 1;
        /// The torque was longer than the largest.
        const TORQUE_LIMIT = 1 << 1;
        /// Force or torque changed faster than allowed.
        const SLEW_LIMIT = 1 << 2;
        /// Forces faded in after a start.
        const SOFT_START = 1 << 3;
        /// Fading out, or faded out.
        const RELEASE = 1 << 4;
        /// Asked for a release: a stop.
        const STOP = 1 << 5;
        /// Asked for a release: a lost link.
        const LINK_LOSS = 1 << 6;
        /// Asked for a release: no fresh request for longer than the watchdog waits.
        const WATCHDOG = 1 << 7;
        /// Asked for a release: a fault.
        const FAULT = 1 << 8;
        /// The passivity controller braked.
        const PASSIVITY = 1 << 9;

        /// The limits, which do not act in a stable session.
        const LIMITS = Self::FORCE_LIMIT.bits() | Self::TORQUE_LIMIT.bits() | Self::SLEW_LIMIT.bits();
        /// Soft start and release.
        const FADING = Self::SOFT_START.bits() | Self::RELEASE.bits();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_read_names_and_machines_numbers() {
        let acted = Acted::FORCE_LIMIT | Acted::WATCHDOG;
        let text = serde_json::to_string(&acted).unwrap();
        assert_eq!(text, "\"FORCE_LIMIT | WATCHDOG\"");
        assert_eq!(serde_json::from_str::<Acted>(&text).unwrap(), acted);
        assert_eq!(acted.bits(), 129);
    }
}
