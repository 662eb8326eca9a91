//! Every copy is coupled to every other one: Fotoohi Ghiam 2006, (4.28)–(4.29), for any number of users.

use glam::DVec3;

use super::scheme::{CouplingGains, Scheme, TickMotion};
use crate::linear_block::LinearBlock;

/// A spring and a damper from each held copy to the own one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pairwise {
    gains: CouplingGains,
}

impl Pairwise {
    pub(super) const fn new(gains: CouplingGains) -> Self {
        Self { gains }
    }
}

impl Scheme for Pairwise {
    fn tick(&self, _memory: &mut [DVec3], at: &TickMotion<'_>) -> DVec3 {
        self.gains.force(at.apart)
    }

    fn tick_block(&self) -> LinearBlock {
        self.gains.block()
    }
}
