//! What all fingers of a host did over a stretch of the run.

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::time::Rate;

use super::finger::Seen;
use super::force::ForceWatch;
use super::told::{Diverged, Divergence, RunVerdict, Shaking};

/// Watches all fingers from a tick on.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    period_s: f64,
    judged_from: u64,
    fingers: ArrayVec<ForceWatch, MAX_FINGERS>,
    /// By limits, or by the world; growth is looked at when asked.
    diverged: Option<Diverged>,
    /// The last tick at which the world was out of its bounds.
    lost_at: Option<u64>,
}

impl Watch {
    /// Of so many fingers; what comes before tick `judged_from` does not count.
    pub(super) fn new(control: Rate, fingers: usize, judged_from: u64) -> Self {
        Self {
            period_s: control.period_s(),
            judged_from,
            fingers: std::iter::repeat_n(ForceWatch::new(control), fingers).collect(),
            diverged: None,
            lost_at: None,
        }
    }

    pub(super) fn observe_world(&mut self, tick: u64, lost: bool) {
        if lost && tick >= self.judged_from {
            self.lost_at = Some(tick);
            self.diverge(Divergence::OutOfBounds, tick, None);
        }
    }

    pub(super) fn observe_finger(&mut self, tick: u64, index: usize, seen: &Seen) {
        let Some(finger) = self.fingers.get_mut(index).filter(|_| tick >= self.judged_from) else { return };
        finger.observe(tick, seen);
        if finger.is_limited_for_long() {
            self.diverge(Divergence::GovernorLimit, tick, Some(index as u8));
        }
    }

    fn diverge(&mut self, cause: Divergence, tick: u64, finger: Option<u8>) {
        self.diverged = self.diverged.or(Some(Diverged { cause, tick, finger }));
    }

    /// Ticks for which every finger was watched.
    pub(super) fn judged_ticks(&self) -> u64 {
        self.fingers.iter().map(ForceWatch::ticks).min().unwrap_or(0)
    }

    pub(super) fn verdict(&self) -> RunVerdict {
        if self.diverged().is_some() {
            RunVerdict::Diverging
        } else if self.shaking().next().is_some() {
            RunVerdict::Shaking
        } else {
            RunVerdict::Quiet
        }
    }

    /// When and why it diverged first, where it did.
    pub(super) fn diverged(&self) -> Option<Diverged> {
        let growth = |(index, finger): (usize, &ForceWatch)| {
            let tick = finger.grew_at()?;
            Some(Diverged { cause: Divergence::Growth, tick, finger: Some(index as u8) })
        };
        let grown = self.fingers.iter().enumerate().filter_map(growth);
        grown.chain(self.diverged).min_by_key(|diverged| diverged.tick)
    }

    /// When fingers shook, finger by finger.
    pub(super) fn shaking(&self) -> impl Iterator<Item = Shaking> {
        let fingers = self.fingers.iter().enumerate();
        fingers.flat_map(|(index, finger)| finger.shaking(index as u8, self.period_s))
    }

    pub(super) fn last_diverging_tick(&self) -> Option<u64> {
        let fingers = self.fingers.iter().map(ForceWatch::last_diverging_tick).max();
        self.lost_at.max(fingers.flatten())
    }

    pub(super) fn last_shaking_tick(&self) -> Option<u64> {
        self.fingers.iter().map(ForceWatch::last_shaking_tick).max().flatten()
    }

    /// The largest rms at a finger over the last sixteenth of a second, N.
    pub(super) fn fast_force_n(&self) -> f64 {
        self.fingers.iter().map(ForceWatch::fast_force_n).fold(0.0, f64::max)
    }
}
