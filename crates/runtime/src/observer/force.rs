//! What one finger's force above 8 Hz did over a stretch of the run: how strong, for how long, and whether it grew.

use arrayvec::ArrayVec;
use cotouch_scene::time::Rate;

use super::finger::{Seen, block_ticks};
use super::growth::GrowthWatch;
use super::sums::{LEAST_RMS_N, Sums};
use super::told::Shaking;

/// For how long it stays above that where a finger shakes, s.
pub(super) const LEAST_S: f64 = 0.5;
/// Blocks over which the rms is taken: a sixteenth of a second, in which the square of what is just fast enough repeats.
const WINDOW: usize = 4;
/// Limits of the governor may act for so long on end, s.
const MAX_LIMITED_S: f64 = 0.02;
/// Stretches of shaking that are told apart; later ones are added to the last.
const MAX_STRETCHES: usize = 16;

/// Watches one finger.
#[derive(Clone, Debug)]
pub(super) struct ForceWatch {
    /// Blocks for which a finger is above the least rms where it shakes.
    least_blocks: u64,
    /// The newest blocks, around the ring.
    ring: [Sums; WINDOW],
    blocks: u64,
    /// While the rms is above the least one.
    above: Option<Stretch>,
    /// Those that were long enough.
    stretches: ArrayVec<Stretch, MAX_STRETCHES>,
    growth: GrowthWatch,
    ticks: u64,
    /// For how long limits have acted on end, and for how long they may.
    limited_ticks: u64,
    max_limited_ticks: u64,
    /// The last tick at which that was too long.
    limited_at: Option<u64>,
}

/// A stretch of time in which the rms stayed above the least one.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    from: u64,
    to: u64,
    blocks: u64,
    sums: Sums,
}

impl ForceWatch {
    pub(super) fn new(control: Rate) -> Self {
        Self {
            least_blocks: (LEAST_S * control.hz() / block_ticks(control) as f64).ceil() as u64,
            ring: [Sums::default(); WINDOW],
            blocks: 0,
            above: None,
            stretches: ArrayVec::new(),
            growth: GrowthWatch::default(),
            ticks: 0,
            limited_ticks: 0,
            // Whole ticks within that time: one more is longer.
            max_limited_ticks: (MAX_LIMITED_S * control.hz() * (1.0 + 1e-12)) as u64,
            limited_at: None,
        }
    }

    /// One tick.
    pub(super) fn observe(&mut self, tick: u64, seen: &Seen) {
        self.ticks += 1;
        self.growth.limited |= seen.is_limited;
        self.limited_ticks = if seen.is_limited { self.limited_ticks + 1 } else { 0 };
        if self.is_limited_for_long() {
            self.limited_at = Some(tick);
        }
        // What began before this watch is not its own.
        if let Some(block) = seen.block.filter(|block| block.ticks <= self.ticks) {
            self.end_block(tick, &block);
        }
    }

    fn end_block(&mut self, tick: u64, block: &Sums) {
        self.ring[(self.blocks % WINDOW as u64) as usize] = *block;
        self.blocks += 1;
        self.growth.observe(tick, block);
        if self.fast_force_n() > LEAST_RMS_N {
            let begin = Stretch { from: tick + 1 - block.ticks, to: tick, blocks: 0, sums: Sums::default() };
            let stretch = self.above.get_or_insert(begin);
            (stretch.to, stretch.blocks) = (tick, stretch.blocks + 1);
            stretch.sums.add(block);
        } else if let Some(stretch) = self.above.take().filter(|stretch| stretch.blocks >= self.least_blocks)
        {
            self.keep(stretch);
        }
    }

    fn keep(&mut self, stretch: Stretch) {
        let Err(full) = self.stretches.try_push(stretch) else { return };
        let stretch = full.element();
        if let Some(last) = self.stretches.last_mut() {
            (last.to, last.blocks) = (stretch.to, last.blocks + stretch.blocks);
            last.sums.add(&stretch.sums);
        }
    }

    /// Ticks that were watched.
    pub(super) fn ticks(&self) -> u64 {
        self.ticks
    }

    /// The rms of what passes the band over the last sixteenth of a second, N.
    pub(super) fn fast_force_n(&self) -> f64 {
        let mut window = Sums::default();
        self.ring.iter().for_each(|block| window.add(block));
        window.rms_n()
    }

    /// The stretches of time in which this finger, the host's `finger`, shook.
    pub(super) fn shaking(&self, finger: u8, period_s: f64) -> impl Iterator<Item = Shaking> {
        let now = self.above.iter().filter(|stretch| stretch.blocks >= self.least_blocks);
        self.stretches.iter().chain(now).map(move |stretch| stretch.told(finger, period_s))
    }

    pub(super) fn last_shaking_tick(&self) -> Option<u64> {
        let now = self.above.as_ref().filter(|stretch| stretch.blocks >= self.least_blocks);
        now.or(self.stretches.last()).map(|stretch| stretch.to)
    }

    /// Since when it has been known to grow: until it levels off by itself, or for good where a limit acted on it.
    pub(super) fn grew_at(&self) -> Option<u64> {
        self.growth.grew_at
    }

    /// Whether limits have acted for longer than they may, without a break until now.
    pub(super) fn is_limited_for_long(&self) -> bool {
        self.limited_ticks > self.max_limited_ticks
    }

    /// The last tick at which it diverged in either way.
    pub(super) fn last_diverging_tick(&self) -> Option<u64> {
        self.limited_at.max(self.growth.grows_at)
    }
}

impl Stretch {
    fn told(&self, finger: u8, period_s: f64) -> Shaking {
        let Self { from, to, ref sums, .. } = *self;
        Shaking { finger, from, to, rms_n: sums.rms_n(), hz: sums.hz(period_s) }
    }
}
