//! What a governor did at a tick, and for how long its limits did it.

use cotouch_scene::time::Rate;
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

/// How long limits acted on end. A run in which that was over [`LONGEST_MS`](Self::LONGEST_MS) milliseconds is not stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LimitWatch {
    on_end_ticks: u64,
    longest_ticks: u64,
}

impl LimitWatch {
    /// Milliseconds for which limits may act on end.
    pub const LONGEST_MS: u64 = 20;

    /// One tick. Limits that act while forces fade in or out do not count.
    pub fn observe(&mut self, acted: Acted) {
        let counts = acted.intersects(Acted::LIMITS) && !acted.intersects(Acted::FADING);
        self.on_end_ticks = if counts { self.on_end_ticks + 1 } else { 0 };
        self.longest_ticks = self.longest_ticks.max(self.on_end_ticks);
    }

    /// The longest time for which limits acted on end, in ticks.
    #[must_use]
    pub fn longest_ticks(&self) -> u64 {
        self.longest_ticks
    }

    /// Whether limits acted for over 20 ms on end, at `control` ticks a second.
    #[must_use]
    pub fn is_exceeded(&self, control: Rate) -> bool {
        let scaled = |ticks: u64, by: u64| u128::from(ticks) * u128::from(by);
        scaled(self.longest_ticks, control.denominator()) * 1000
            > scaled(Self::LONGEST_MS, control.numerator())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn over_20_ms_on_end_is_too_long() {
        let control: Rate = "1000".parse().unwrap();
        let mut watch = LimitWatch::default();
        let mut run = |acted: Acted, ticks: u32| {
            (0..ticks).for_each(|_| watch.observe(acted));
            (watch.longest_ticks(), watch.is_exceeded(control))
        };
        assert_eq!(run(Acted::FORCE_LIMIT | Acted::SOFT_START, 1000), (0, false));
        assert_eq!(run(Acted::SLEW_LIMIT | Acted::RELEASE, 1000), (0, false));
        assert_eq!(run(Acted::FORCE_LIMIT, 20), (20, false));
        assert_eq!(run(Acted::empty(), 1), (20, false));
        assert_eq!(run(Acted::SLEW_LIMIT, 20), (20, false));
        assert_eq!(run(Acted::FORCE_LIMIT, 1), (21, true));
        assert_eq!(run(Acted::empty(), 1000), (21, true));
    }

    #[test]
    fn people_read_names_and_machines_numbers() {
        let acted = Acted::FORCE_LIMIT | Acted::WATCHDOG;
        let text = serde_json::to_string(&acted).unwrap();
        assert_eq!(text, "\"FORCE_LIMIT | WATCHDOG\"");
        assert_eq!(serde_json::from_str::<Acted>(&text).unwrap(), acted);
        assert_eq!(acted.bits(), 129);
    }
}
