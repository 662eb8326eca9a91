//! What of a soft body changes at a host.

use std::sync::Arc;

use cotouch_world::local::LocalContact;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::frame::SlowFrame;

/// What a host's state holds of a soft body. The frames come from outside, as samples do, and are not saved with it.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SoftHostState {
    /// One entry a finger slot.
    pub contacts: Vec<LocalContact>,
    /// Sum of the returned forces of the present period so far, one entry a finger slot, N.
    pub returned_n: Vec<DVec3>,
    /// Ticks in these sums.
    pub returned_ticks: u32,
    /// The period that they are of.
    pub period: u64,
    /// Whether the simulation was told of that period.
    pub told: bool,
    /// The tick at which the frame in use was taken over.
    pub taken_at: u64,
    /// K_o of every finger slot before and after the last take-over, N/m. Of a finger that touches it only falls.
    pub ko_n_per_m: Vec<[f64; 2]>,
    /// The frame in use.
    #[serde(skip)]
    pub frame: Option<Arc<SlowFrame>>,
    /// The frame before it.
    #[serde(skip)]
    pub previous: Option<Arc<SlowFrame>>,
}

impl PartialEq for SoftHostState {
    fn eq(&self, other: &Self) -> bool {
        let period = |frame: &Option<Arc<SlowFrame>>| frame.as_ref().map(|frame| frame.period);
        self.contacts == other.contacts
            && self.returned_n == other.returned_n
            && self.returned_ticks == other.returned_ticks
            && self.period == other.period
            && self.told == other.told
            && self.taken_at == other.taken_at
            && self.ko_n_per_m == other.ko_n_per_m
            && period(&self.frame) == period(&other.frame)
            && period(&self.previous) == period(&other.previous)
    }
}

impl SoftHostState {
    /// Before the first tick, with so many finger slots.
    pub(crate) fn new(slots: usize) -> Self {
        Self {
            contacts: vec![LocalContact::default(); slots],
            returned_n: vec![DVec3::ZERO; slots],
            ko_n_per_m: vec![[0.0; 2]; slots],
            ..Self::default()
        }
    }
}
