//! One finger's force above 8 Hz: how strong, for how long, and whether it grows.

use arrayvec::ArrayVec;
use cotouch_device::Acted;
use cotouch_scene::time::Rate;
use glam::DVec3;

use super::band::{Band, BandState};
use super::told::{Rendered, Shaking};

/// A force above 8 Hz below this is no shaking, N rms.
const LEAST_RMS_N: f64 = 0.05;
/// For how long it stays above that where a finger shakes, s.
const LEAST_S: f64 = 0.5;
/// Blocks a second: the mean square is known for each.
const BLOCKS_HZ: f64 = 64.0;
/// Blocks over which the rms is taken: a sixteenth of a second, in which the square of what is just fast enough repeats.
const WINDOW: usize = 4;
/// Blocks in a quarter of a second.
const QUARTER: u32 = 16;
/// From one quarter of a second to the next, where the force grows.
const GROWTH: f64 = 1.2;
/// So many times on end.
const TIMES: u32 = 4;
/// Limits of the governor may act for so long on end, s.
const MAX_LIMITED_S: f64 = 0.02;
/// Growth is not looked for below this, N rms.
const FLOOR_N: f64 = 1e-3;
/// Within growth no eighth of a second is weaker than this share of the one before: a touch is strongest when it begins.
const STEADY: f64 = 0.95;
/// After so many quarters without growth, and without a limit, what grew has levelled off.
const LEVEL_QUARTERS: u32 = 4;
/// Stretches of shaking that are told apart; later ones are added to the last.
const MAX_STRETCHES: usize = 16;

/// Observes one finger.
#[derive(Clone, Debug)]
pub(super) struct FingerObserver {
    filter: Option<BandState>,
    block_ticks: u32,
    /// Blocks for which a finger is above the least rms where it shakes.
    least_blocks: u64,
    /// What passed the band at the tick before.
    last: DVec3,
    block: Sums,
    /// The newest blocks, around the ring.
    ring: [Sums; WINDOW],
    blocks: u64,
    /// While the rms is above the least one.
    above: Option<Stretch>,
    /// Those that were long enough.
    stretches: ArrayVec<Stretch, MAX_STRETCHES>,
    growth: GrowthWatch,
    /// For how long limits have acted on end, and for how long they may.
    limited_ticks: u64,
    max_limited_ticks: u64,
    /// The last tick at which that was too long.
    limited_at: Option<u64>,
}

/// Of what passes the band: squares, and squares of the change from tick to tick.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    ticks: u64,
    squares: f64,
    changes: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.ticks += other.ticks;
        self.squares += other.squares;
        self.changes += other.changes;
    }

    fn rms(&self) -> f64 {
        if self.ticks == 0 { 0.0 } else { (self.squares / self.ticks as f64).sqrt() }
    }
}

/// A stretch of time in which the rms stayed above the least one.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    from: u64,
    to: u64,
    blocks: u64,
    sums: Sums,
}

impl FingerObserver {
    pub(super) fn new(control: Rate) -> Self {
        let block_ticks = (control.hz() / BLOCKS_HZ).round().max(1.0);
        Self {
            filter: None,
            block_ticks: block_ticks as u32,
            least_blocks: (LEAST_S * control.hz() / block_ticks).ceil() as u64,
            last: DVec3::ZERO,
            block: Sums::default(),
            ring: [Sums::default(); WINDOW],
            blocks: 0,
            above: None,
            stretches: ArrayVec::new(),
            growth: GrowthWatch::default(),
            limited_ticks: 0,
            // Whole ticks within that time: one more is longer.
            max_limited_ticks: (MAX_LIMITED_S * control.hz() * (1.0 + 1e-12)) as u64,
            limited_at: None,
        }
    }

    /// One tick. What comes before the end of the first soft start is not looked at.
    pub(super) fn observe(&mut self, band: &Band, tick: u64, rendered: Rendered) {
        let Rendered { force_n, acted } = rendered;
        // Limits that act while forces fade in or out are no fault of the loop.
        let limited = acted.intersects(Acted::LIMITS) && !acted.intersects(Acted::FADING);
        if self.filter.is_none() && acted.contains(Acted::SOFT_START) {
            return;
        }
        let state = self.filter.get_or_insert_with(|| band.settled_at(force_n));
        let fast = band.step(state, force_n);
        let change = fast - self.last;
        self.last = fast;
        self.block.add(&Sums { ticks: 1, squares: fast.length_squared(), changes: change.length_squared() });
        self.growth.limited |= limited;
        self.limited_ticks = if limited { self.limited_ticks + 1 } else { 0 };
        if self.is_limited_for_long() {
            self.limited_at = Some(tick);
        }
        if self.block.ticks == u64::from(self.block_ticks) {
            let block = std::mem::take(&mut self.block);
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

    /// The rms of what passes the band over the last sixteenth of a second, N.
    pub(super) fn fast_force_n(&self) -> f64 {
        let mut window = Sums::default();
        self.ring.iter().for_each(|block| window.add(block));
        window.rms()
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
        // Of a sinusoid of frequency f, changes are 4·sin²(π·f·T) times the squares.
        let share = (self.sums.changes / self.sums.squares).sqrt() / 2.0;
        let hz = share.min(1.0).asin() / (std::f64::consts::PI * period_s);
        Shaking { finger, from: self.from, to: self.to, rms_n: self.sums.rms(), hz }
    }
}

/// Looks for growth from quarter to quarter of a second.
#[derive(Clone, Copy, Debug, Default)]
struct GrowthWatch {
    quarter: Sums,
    eighth: Sums,
    blocks: u32,
    /// Of the quarter and of the eighth of a second before, N.
    last_quarter_n: f64,
    last_eighth_n: f64,
    /// Whether no eighth of this quarter is weaker than the one before.
    is_steady: bool,
    /// Quarters on end in which the force grew, and in which it did not.
    grown: u32,
    level: u32,
    /// Whether a limit acts in this quarter.
    limited: bool,
    grew_at: Option<u64>,
    /// The last tick at which it was growing.
    grows_at: Option<u64>,
    met_limits: bool,
}

impl GrowthWatch {
    fn observe(&mut self, tick: u64, block: &Sums) {
        self.quarter.add(block);
        self.eighth.add(block);
        self.blocks += 1;
        if self.blocks.is_multiple_of(QUARTER / 2) {
            let eighth_n = std::mem::take(&mut self.eighth).rms();
            self.is_steady &= eighth_n >= STEADY * self.last_eighth_n;
            self.last_eighth_n = eighth_n;
        }
        if self.blocks == QUARTER {
            let quarter_n = std::mem::take(&mut self.quarter).rms();
            self.end_quarter(tick, quarter_n);
        }
    }

    fn end_quarter(&mut self, tick: u64, quarter_n: f64) {
        let grows =
            self.is_steady && self.last_quarter_n > FLOOR_N && quarter_n >= GROWTH * self.last_quarter_n;
        (self.grown, self.level) = if grows { (self.grown + 1, 0) } else { (0, self.level + 1) };
        if self.grown >= TIMES && quarter_n > LEAST_RMS_N {
            (self.grew_at, self.grows_at) = (self.grew_at.or(Some(tick)), Some(tick));
        }
        self.met_limits |= self.grew_at.is_some() && self.limited;
        if self.level >= LEVEL_QUARTERS && !self.met_limits {
            self.grew_at = None;
        }
        (self.last_quarter_n, self.is_steady, self.blocks, self.limited) = (quarter_n, true, 0, false);
    }
}
