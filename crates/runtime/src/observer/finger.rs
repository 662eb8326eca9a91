//! One finger's force above 8 Hz, block by block.

use cotouch_device::Acted;
use cotouch_scene::time::Rate;
use glam::DVec3;

use super::band::{Band, BandState};
use super::sums::Sums;
use super::told::Rendered;

/// Blocks a second: the mean square is known for each.
const BLOCKS_HZ: f64 = 64.0;

/// Filters what one finger renders.
#[derive(Clone, Debug)]
pub(super) struct FingerFilter {
    filter: Option<BandState>,
    block_ticks: u64,
    /// What passed the band at the tick before.
    last: DVec3,
    block: Sums,
}

/// What is seen of a finger at a tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// The block that ends with this tick, where one does.
    pub(super) block: Option<Sums>,
    /// Whether a limit of the governor acted.
    pub(super) is_limited: bool,
}

/// Ticks of a block at this rate.
pub(super) fn block_ticks(control: Rate) -> u64 {
    (control.hz() / BLOCKS_HZ).round().max(1.0) as u64
}

impl FingerFilter {
    pub(super) fn new(control: Rate) -> Self {
        let block_ticks = block_ticks(control);
        Self { filter: None, block_ticks, last: DVec3::ZERO, block: Sums::default() }
    }

    /// One tick. What comes before the end of the first soft start is not looked at.
    pub(super) fn observe(&mut self, band: &Band, rendered: Rendered) -> Option<Seen> {
        let Rendered { force_n, acted } = rendered;
        if self.filter.is_none() && acted.contains(Acted::SOFT_START) {
            return None;
        }
        let state = self.filter.get_or_insert_with(|| band.settled_at(force_n));
        let fast = band.step(state, force_n);
        self.block.add(&Sums::of_tick(fast, fast - self.last));
        self.last = fast;
        let is_full = self.block.ticks == self.block_ticks;
        Some(Seen {
            block: is_full.then(|| std::mem::take(&mut self.block)),
            // Limits that act while forces fade in or out are no fault of the loop.
            is_limited: acted.intersects(Acted::LIMITS) && !acted.intersects(Acted::FADING),
        })
    }
}
