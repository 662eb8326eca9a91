//! What the last seconds of a run were like, whatever came before them.
//!
//! They were unstable where, in the last second, a governor limit acted for over 20 ms on end or for over a tenth of the
//! time, or where the couplers' energy above 8 Hz, in the median over the last second, was more than 1.5 times that of
//! the second before and more than 20 µJ.
//!
//! A share of the time, because an oscillation that has grown into the governor's limits grows no more, and meets them
//! only at its peaks. And 20 µJ, a third of a millimetre across a coupler of 400 N/m, because a knock, such as a box
//! that is set down, rings for long enough to be in the median of so short a time.

use cotouch_device::{Acted, LimitWatch};
use cotouch_scene::time::Schedule;

use super::growth::{CORNER_HZ, grows_over, median};
use crate::snapshot::Lately;

/// A stretch holds whole swings of the energy of whatever is faster than the corner, s.
const STRETCH_S: f64 = 0.5 / CORNER_HZ;
/// Stretches in a second, in the half second whose energy is shown, and kept.
const SECOND: usize = (1.0 / STRETCH_S) as usize;
const HALF_SECOND: usize = SECOND / 2;
const KEPT: usize = 2 * SECOND;
/// Limits that act for a larger share of a second count, however briefly each time.
const MAX_LIMITED: f64 = 0.1;
/// An oscillation energy below this is not called unstable, J.
const LEAST_ENERGY_J: f64 = 20e-6;

/// The last seconds at one host. Bounded memory, no allocation.
#[derive(Clone, Debug)]
pub struct LatelyMonitor {
    ticks_per_stretch: u32,
    /// The newest whole stretch is the last one before `next`, around the ring.
    ring: [Stretch; KEPT],
    next: usize,
    whole: usize,
    current: Stretch,
    on_end_ticks: u64,
    longest_ticks: u64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Stretch {
    energy_j: f64,
    ticks: u32,
    limited_ticks: u32,
    limited_for_long: bool,
}

impl LatelyMonitor {
    /// For a host with this schedule.
    #[must_use]
    pub fn new(schedule: &Schedule) -> Self {
        let hz = schedule.control().hz();
        Self {
            ticks_per_stretch: ((STRETCH_S * hz) as u32).max(1),
            ring: [Stretch::default(); KEPT],
            next: 0,
            whole: 0,
            current: Stretch::default(),
            on_end_ticks: 0,
            longest_ticks: (LimitWatch::LONGEST_MS as f64 * 1e-3 * hz) as u64,
        }
    }

    /// Takes one tick: what the couplers hold above 8 Hz, J, and what acted where no force fades in or out.
    pub fn observe(&mut self, energy_j: f64, acted: Acted) {
        let limited = acted.intersects(Acted::LIMITS);
        self.on_end_ticks = if limited { self.on_end_ticks + 1 } else { 0 };
        let current = &mut self.current;
        current.energy_j += energy_j;
        current.ticks += 1;
        current.limited_ticks += u32::from(limited);
        current.limited_for_long |= self.on_end_ticks > self.longest_ticks;
        if current.ticks == self.ticks_per_stretch {
            self.ring[self.next] = *current;
            self.next = (self.next + 1) % KEPT;
            self.whole = (self.whole + 1).min(KEPT);
            *current = Stretch::default();
        }
    }

    /// What the last seconds were like at all hosts together. Too early to say anything before there are two seconds.
    #[must_use]
    pub fn combine<'a>(monitors: impl Iterator<Item = &'a Self> + Clone, diverged: bool) -> Lately {
        let sum = |energy_j: fn(&Self) -> f64| monitors.clone().map(energy_j).sum::<f64>();
        let last_j = sum(|monitor| median(&monitor.energies_j::<SECOND>(0)));
        let before_j = sum(|monitor| median(&monitor.energies_j::<SECOND>(SECOND)));
        let limited = monitors.clone().any(Self::is_limited);
        let is_early = monitors.clone().any(|monitor| monitor.whole < KEPT);
        Lately {
            stable: (diverged || !is_early)
                .then(|| !(diverged || limited || grows_over(LEAST_ENERGY_J, before_j, last_j))),
            oscillation_j: sum(|monitor| median(&monitor.energies_j::<HALF_SECOND>(0))),
        }
    }

    /// Mean energy of the newest stretches, from the newest, J; only whole ones.
    fn energies_j<const COUNT: usize>(&self, skipped: usize) -> [f64; COUNT] {
        std::array::from_fn(|back| {
            let stretch = self.newest(skipped + back);
            stretch.energy_j / f64::from(self.ticks_per_stretch)
        })
    }

    fn newest(&self, back: usize) -> &Stretch {
        &self.ring[(self.next + 2 * KEPT - 1 - back) % KEPT]
    }

    fn is_limited(&self) -> bool {
        let last = || (0..SECOND).map(|back| self.newest(back));
        let limited_ticks: u32 = last().map(|stretch| stretch.limited_ticks).sum();
        let all_ticks = f64::from(self.ticks_per_stretch) * SECOND as f64;
        last().any(|stretch| stretch.limited_for_long) || f64::from(limited_ticks) > MAX_LIMITED * all_ticks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HZ: u32 = 1024;

    fn monitor() -> LatelyMonitor {
        let rate = |text: &str| text.parse().expect("a rate");
        LatelyMonitor::new(&Schedule::new(rate("1024"), rate("128")).expect("they fit"))
    }

    /// So many ticks with an energy (J) and limits as they are at a time (s) from here on.
    fn run(monitor: &mut LatelyMonitor, ticks: u32, at: impl Fn(f64) -> (f64, bool)) {
        for tick in 0..ticks {
            let (energy_j, limited) = at(f64::from(tick) / f64::from(HZ));
            monitor.observe(energy_j, if limited { Acted::FORCE_LIMIT } else { Acted::empty() });
        }
    }

    fn stable(monitor: &LatelyMonitor) -> Option<bool> {
        LatelyMonitor::combine(std::iter::once(monitor), false).stable
    }

    #[test]
    fn two_seconds_are_too_early_but_for_a_world_that_is_lost() {
        let mut monitor = monitor();
        run(&mut monitor, 2 * HZ - 1, |_| (0.0, false));
        assert_eq!(stable(&monitor), None);
        assert_eq!(LatelyMonitor::combine(std::iter::once(&monitor), true).stable, Some(false));
        run(&mut monitor, 1, |_| (0.0, false));
        assert_eq!(stable(&monitor), Some(true));
    }

    #[test]
    fn growth_counts_and_what_stays_or_decays_does_not() {
        let mut monitor = monitor();
        run(&mut monitor, 3 * HZ, |_| (1e-3, false));
        assert_eq!(stable(&monitor), Some(true));
        run(&mut monitor, HZ, |_| (2e-3, false));
        assert_eq!(stable(&monitor), Some(false));
        assert!((LatelyMonitor::combine(std::iter::once(&monitor), false).oscillation_j - 2e-3).abs() < 1e-9);
        let two = [monitor.clone(), monitor.clone()];
        assert!(
            (LatelyMonitor::combine(two.iter(), false).oscillation_j - 4e-3).abs() < 1e-9,
            "the sum over hosts"
        );
        run(&mut monitor, HZ, |_| (2e-3, false));
        assert_eq!(stable(&monitor), Some(true));
        run(&mut monitor, HZ, |_| (f64::NAN, false));
        assert_eq!(stable(&monitor), Some(false));
        run(&mut monitor, 2 * HZ, |t| (2e-3 * (-t).exp(), false));
        assert_eq!(stable(&monitor), Some(true), "what is over is forgotten");
    }

    #[test]
    fn too_little_to_matter_and_a_short_knock_do_not_count() {
        let mut monitor = monitor();
        run(&mut monitor, 2 * HZ, |_| (0.0, false));
        run(&mut monitor, HZ, |_| (19e-6, false));
        assert_eq!(stable(&monitor), Some(true));
        run(&mut monitor, 2 * HZ, |_| (0.0, false));
        run(&mut monitor, HZ, |t| (if t < 0.3 { 1.0 } else { 0.0 }, false));
        assert_eq!(stable(&monitor), Some(true));
    }

    #[test]
    fn limits_on_end_or_for_a_tenth_of_the_time_count_for_a_second() {
        for (on_end, of, expected) in [(20, 1024, true), (21, 1024, false), (6, 64, true), (7, 64, false)] {
            let mut monitor = monitor();
            run(&mut monitor, 2 * HZ, |_| (0.0, false));
            let tick = |t: f64| (t * f64::from(HZ)).round() as u32;
            run(&mut monitor, HZ, |t| (0.0, tick(t) % of < on_end));
            assert_eq!(stable(&monitor), Some(expected), "{on_end} of {of} ticks");
            run(&mut monitor, HZ, |_| (0.0, false));
            assert_eq!(stable(&monitor), Some(true), "what is over is forgotten");
        }
    }
}
