//! When samples are used.

use cotouch_scene::time::Schedule;

/// When a sample that was taken at a network step is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delay {
    /// At the first network step that is `periods` steps later and not before the sample's arrival.
    Scheduled {
        /// n of the seeds.
        periods: u32,
        /// Ticks from sampling to the first tick at or after arrival.
        transit_ticks: u64,
    },
    /// At the first tick at or after arrival.
    OnArrival {
        /// Ticks from sampling to the first tick at or after arrival; 0 means the very instant of sampling.
        transit_ticks: u64,
    },
}

impl Delay {
    /// Used at the very tick of sampling.
    pub const NONE: Self = Self::OnArrival { transit_ticks: 0 };

    /// Used so many steps later.
    #[must_use]
    pub const fn periods(periods: u32) -> Self {
        Self::Scheduled { periods, transit_ticks: 0 }
    }

    /// The tick from which the sample of network step `step` is used. Both may be negative.
    pub(crate) fn tick_of_use(self, schedule: &Schedule, step: i64) -> i64 {
        let sampled = tick_of_step(schedule, step);
        match self {
            Self::OnArrival { transit_ticks } => sampled + transit_ticks as i64,
            Self::Scheduled { periods, transit_ticks } => {
                let arrival = sampled + transit_ticks as i64;
                let at_arrival = first_step_from(schedule, arrival);
                tick_of_step(schedule, at_arrival.max(step + i64::from(periods)))
            }
        }
    }

    /// Whether a sample can be used at the very tick at which it is taken.
    pub(crate) const fn is_at_once(self) -> bool {
        matches!(
            self,
            Self::OnArrival { transit_ticks: 0 } | Self::Scheduled { periods: 0, transit_ticks: 0 }
        )
    }

    /// The network step whose sample is held at `tick`, after play-out.
    pub(crate) fn step_held_at(self, schedule: &Schedule, tick: i64) -> i64 {
        let mut step = last_step_at(schedule, tick);
        while self.tick_of_use(schedule, step) > tick {
            step -= 1;
        }
        step
    }

    /// How many samples are held, queued or in flight just before a network step: those of ages 1 to this number.
    pub(crate) fn samples(self, schedule: &Schedule) -> u32 {
        u32::try_from(-self.step_held_at(schedule, 0)).unwrap_or(u32::MAX)
    }
}

/// ⌈step·p/q⌉, for negative steps too.
pub(crate) fn tick_of_step(schedule: &Schedule, step: i64) -> i64 {
    let (p, q) = pattern(schedule);
    -(-i128::from(step) * p).div_euclid(q) as i64
}

/// ⌊tick·q/p⌋: the last network step at or before a tick.
fn last_step_at(schedule: &Schedule, tick: i64) -> i64 {
    let (p, q) = pattern(schedule);
    (i128::from(tick) * q).div_euclid(p) as i64
}

/// The first network step that falls on `tick` or later.
pub(crate) fn first_step_from(schedule: &Schedule, tick: i64) -> i64 {
    last_step_at(schedule, tick - 1) + 1
}

fn pattern(schedule: &Schedule) -> (i128, i128) {
    (i128::from(schedule.ticks_per_pattern()), i128::from(schedule.steps_per_pattern()))
}
