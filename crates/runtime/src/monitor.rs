//! Whether a run was stable, judged from what it did.
//!
//! A run is unstable iff, after the soft start, a governor limit acted for over 20 ms on end, or the energy that its
//! couplers hold above 8 Hz is, in the median over the last quarter of the run, more than 1.5 times that of the quarter
//! before and more than 1 µJ. The median, because a knock, such as a finger's first touch, is soon over and no
//! oscillation. Bounded memory for a run of any length, and no allocation while it runs.

mod growth;
mod lately;

use cotouch_host::CouplerOutput;
use cotouch_scene::time::Schedule;
use glam::DVec3;

use self::growth::{BINS, CORNER_HZ, grows_over, median};
pub use lately::LatelyMonitor;

/// An oscillation energy below this is never called unstable, J.
const LEAST_ENERGY_J: f64 = 1e-6;
/// Collects the couplers' energy above 8 Hz at one host.
///
/// Couplers to the own fingers are looked at every tick. A coupler to a held sample is looked at once a network step: in
/// between it stretches by what its near end moves, and snaps back with the next sample, which is how fast the users
/// move and no oscillation.
#[derive(Clone, Debug)]
pub struct OscillationMonitor {
    every_tick: HighPass,
    every_step: HighPass,
    filters: Vec<Slot>,
    ticks: u64,
    steps: u64,
    /// Of the couplers to held samples, at the last network step, J.
    held_j: f64,
    /// Of all couplers at the last tick, J.
    latest_j: f64,
    energy: Bins,
}

impl OscillationMonitor {
    /// For a host with this schedule, whose couplers are numbered below `slots`.
    #[must_use]
    pub fn new(schedule: &Schedule, slots: usize) -> Self {
        Self {
            every_tick: HighPass::butterworth(CORNER_HZ, schedule.control().period_s()),
            every_step: HighPass::butterworth(CORNER_HZ, schedule.network().period_s()),
            filters: vec![Slot::default(); slots],
            ticks: 0,
            steps: 0,
            held_j: 0.0,
            latest_j: 0.0,
            // A stretch holds whole swings of the energy of whatever is faster than the corner.
            energy: Bins::new((0.5 / CORNER_HZ * schedule.control().hz()) as u64),
        }
    }

    /// Takes the couplers of one tick, which is one with a network step or not. A coupler that was not there the last
    /// time, such as that of a finger that has just touched, starts without a transient.
    pub fn observe(&mut self, couplers: &[CouplerOutput], network_step: bool) {
        let of = |held: bool| couplers.iter().filter(move |coupler| coupler.held == held);
        if network_step {
            self.steps += 1;
            self.held_j = filtered_energy_j(&self.every_step, &mut self.filters, self.steps, of(true));
        }
        self.ticks += 1;
        let own_j = filtered_energy_j(&self.every_tick, &mut self.filters, self.ticks, of(false));
        self.latest_j = own_j + self.held_j;
        self.energy.push(self.latest_j);
    }

    /// Energy above 8 Hz at the last tick, J.
    #[must_use]
    pub fn latest_j(&self) -> f64 {
        self.latest_j
    }

    /// Forgets the run so far, as if it began with the next tick. No allocation.
    pub fn begin_anew(&mut self) {
        self.filters.fill(Slot::default());
        (self.ticks, self.steps, self.held_j) = (0, 0, 0.0);
        self.energy.begin_anew();
    }

    /// Energy above 8 Hz (J), the median over time, in the third and in the last quarter of the run.
    #[must_use]
    pub fn last_two_quarters_j(&self) -> (f64, f64) {
        self.energy.last_two_quarters()
    }

    /// Whether oscillation energies (J) of the last quarter but one and of the last, summed over hosts, mean growth.
    #[must_use]
    pub fn grows(before_j: f64, last_j: f64) -> bool {
        grows_over(LEAST_ENERGY_J, before_j, last_j)
    }
}

/// The filter of one coupler, and when it ran last.
#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    /// When it was last looked at, counted from 1.
    seen: u64,
    filter: FilterState,
}

fn filtered_energy_j<'a>(
    high_pass: &HighPass,
    slots: &mut [Slot],
    now: u64,
    couplers: impl Iterator<Item = &'a CouplerOutput>,
) -> f64 {
    let mut energy_j = 0.0;
    for coupler in couplers {
        let Some(slot) = slots.get_mut(usize::from(coupler.slot)) else { continue };
        if slot.seen == 0 || slot.seen + 1 != now {
            slot.filter = high_pass.settled_at(coupler.stretch);
        }
        slot.seen = now;
        let fast = high_pass.step(&mut slot.filter, coupler.stretch);
        energy_j += 0.5 * coupler.stiffness_n_per_m * fast.length_squared();
    }
    energy_j
}

/// A second-order Butterworth high pass, by the bilinear transform with the corner pre-warped.
#[derive(Clone, Copy, Debug)]
struct HighPass {
    b: [f64; 3],
    a: [f64; 2],
}

/// Transposed direct form II.
#[derive(Clone, Copy, Debug, Default)]
struct FilterState([DVec3; 2]);

impl HighPass {
    fn butterworth(corner_hz: f64, period_s: f64) -> Self {
        // Below about four ticks a cycle the corner cannot be told from the tick itself.
        let warped = (std::f64::consts::PI * (corner_hz * period_s).min(0.25)).tan();
        let norm = 1.0 / (1.0 + std::f64::consts::SQRT_2 * warped + warped * warped);
        Self {
            b: [norm, -2.0 * norm, norm],
            a: [
                2.0 * (warped * warped - 1.0) * norm,
                (1.0 - std::f64::consts::SQRT_2 * warped + warped * warped) * norm,
            ],
        }
    }

    /// The state after a constant input for ever, where the output is zero.
    fn settled_at(&self, input: DVec3) -> FilterState {
        FilterState([-self.b[0] * input, self.b[2] * input])
    }

    fn step(&self, state: &mut FilterState, input: DVec3) -> DVec3 {
        let output = self.b[0] * input + state.0[0];
        state.0[0] = self.b[1] * input - self.a[0] * output + state.0[1];
        state.0[1] = self.b[2] * input - self.a[1] * output;
        output
    }
}

/// Means over equal stretches of time; when full, neighbours merge.
#[derive(Clone, Debug)]
struct Bins {
    sums: Vec<f64>,
    samples_per_bin: u64,
    samples_per_bin_at_first: u64,
    in_last: u64,
}

impl Bins {
    /// With so many samples in a stretch at first, 1 or more.
    fn new(samples_per_bin: u64) -> Self {
        let samples_per_bin = samples_per_bin.max(1);
        Self {
            sums: Vec::with_capacity(BINS),
            samples_per_bin,
            samples_per_bin_at_first: samples_per_bin,
            in_last: 0,
        }
    }

    fn begin_anew(&mut self) {
        self.sums.clear();
        self.samples_per_bin = self.samples_per_bin_at_first;
        self.in_last = 0;
    }

    fn push(&mut self, value: f64) {
        if self.sums.is_empty() || self.in_last == self.samples_per_bin {
            if self.sums.len() == BINS {
                self.merge_neighbours();
            }
            self.sums.push(0.0);
            self.in_last = 0;
        }
        if let Some(last) = self.sums.last_mut() {
            *last += value;
        }
        self.in_last += 1;
    }

    fn merge_neighbours(&mut self) {
        for index in 0..BINS / 2 {
            self.sums[index] = self.sums[2 * index] + self.sums[2 * index + 1];
        }
        self.sums.truncate(BINS / 2);
        self.samples_per_bin *= 2;
    }

    fn last_two_quarters(&self) -> (f64, f64) {
        // An unfinished last bin is left out, unless it is the only kind there is.
        let whole = if self.in_last == self.samples_per_bin {
            self.sums.len()
        } else {
            self.sums.len().saturating_sub(1)
        };
        let quarter = whole / 4;
        let per_sample = |bins: &[f64]| median(bins) / self.samples_per_bin as f64;
        let (before, last) = self.sums[whole - 2 * quarter..whole].split_at(quarter);
        (per_sample(before), per_sample(last))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 1.0 / 1024.0;

    fn run(seconds: f64, stretch: impl Fn(f64) -> f64) -> (f64, f64) {
        let rate = |text: &str| text.parse().expect("a rate");
        let schedule = Schedule::new(rate("1024"), rate("128")).expect("they fit");
        let mut monitor = OscillationMonitor::new(&schedule, 4);
        for tick in 0..(seconds / T) as u32 {
            let stretch = DVec3::X * stretch(f64::from(tick) * T);
            let coupler = CouplerOutput { slot: 0, held: false, stiffness_n_per_m: 1000.0, stretch };
            monitor.observe(&[coupler], false);
        }
        monitor.last_two_quarters_j()
    }

    #[test]
    fn a_vibration_above_the_corner_has_its_own_energy() {
        let amplitude = 1e-3;
        let (before, last) = run(8.0, |t| amplitude * (t * 40.0 * std::f64::consts::TAU).sin());
        let expected = 0.25 * 1000.0 * amplitude * amplitude;
        assert!((last / expected - 1.0).abs() < 0.01 && (before / expected - 1.0).abs() < 0.01);
        assert!(!OscillationMonitor::grows(before, last));
    }

    #[test]
    fn slow_motion_and_a_constant_load_do_not_count() {
        let (_, slow) = run(8.0, |t| 0.01 * (t * 0.5 * std::f64::consts::TAU).sin());
        assert!(slow < 1e-6, "{slow}");
        let (_, constant) = run(8.0, |_| 0.01);
        assert!(constant < 1e-20, "{constant}");
    }

    #[test]
    fn moving_against_held_samples_is_no_oscillation() {
        let schedule = Schedule::new("1024".parse().unwrap(), "128".parse().unwrap()).unwrap();
        let mut monitor = OscillationMonitor::new(&schedule, 4);
        for tick in 0..8 * 1024_u32 {
            let speed = if tick < 4096 { 0.1 } else { 1.0 };
            let stretch = DVec3::X * (speed * f64::from(tick % 8) * T);
            let own = CouplerOutput { slot: 0, held: false, stiffness_n_per_m: 3000.0, stretch: DVec3::ZERO };
            let held = CouplerOutput { slot: 3, held: true, stiffness_n_per_m: 400.0, stretch };
            monitor.observe(&[own, held], tick % 8 == 0);
        }
        let (before, last) = monitor.last_two_quarters_j();
        assert!(!OscillationMonitor::grows(before, last), "{before} {last}");
    }

    #[test]
    fn a_touch_is_no_oscillation_and_buzzing_in_touch_is() {
        let touch = |t: f64| if t < 6.5 { 0.0 } else { 2e-3 * (1.0 - (-(t - 6.5) * 30.0).exp()) };
        let (before, last) = run(8.0, touch);
        assert!(!OscillationMonitor::grows(before, last), "{before} {last}");
        let (before, last) = run(8.0, |t| touch(t) + if t < 6.5 { 0.0 } else { 2e-4 * (t * 300.0).sin() });
        assert!(OscillationMonitor::grows(before, last), "{before} {last}");
    }

    #[test]
    fn a_coupler_that_comes_and_goes_starts_without_a_transient() {
        let schedule = Schedule::new("1024".parse().unwrap(), "128".parse().unwrap()).unwrap();
        let mut monitor = OscillationMonitor::new(&schedule, 4);
        for tick in 0..8 * 1024_u32 {
            let stretch = DVec3::X * 1e-3;
            let own = CouplerOutput { slot: 1, held: false, stiffness_n_per_m: 3000.0, stretch };
            let held = CouplerOutput { slot: 3, held: true, ..own };
            let there = if tick / 1000 % 2 == 0 { 0 } else { 2 };
            monitor.observe(&[own, held][..there], tick % 8 == 0);
        }
        let (before, last) = monitor.last_two_quarters_j();
        assert!(before < 1e-15 && last < 1e-15, "{before} {last}");
    }

    #[test]
    fn growth_is_growth_and_decay_is_not() {
        let vibration = |rate: f64| move |t: f64| 1e-3 * (rate * t).exp() * (t * 200.0).sin();
        let (before, last) = run(8.0, vibration(0.3));
        assert!(OscillationMonitor::grows(before, last));
        let (before, last) = run(8.0, vibration(-0.3));
        assert!(!OscillationMonitor::grows(before, last));
        assert!(!OscillationMonitor::grows(0.0, 9e-7), "too little to matter");
        assert!(OscillationMonitor::grows(0.0, f64::NAN));
    }

    #[test]
    fn memory_is_bounded_and_the_quarters_stay_right() {
        let mut bins = Bins::new(1);
        let total = 100_000_u32;
        for sample in 0..total {
            bins.push(if sample >= total / 4 * 3 { 4.0 } else { 1.0 });
        }
        assert!(bins.sums.capacity() <= BINS);
        let (before, last) = bins.last_two_quarters();
        assert!((before - 1.0).abs() < 0.01 && (last - 4.0).abs() < 0.01);
    }
}
