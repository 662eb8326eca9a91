//! Every copy is coupled to the average of all copies that are there, its own included undelayed.

use glam::DVec3;

use super::scheme::{CouplingGains, Scheme, TickMotion};
use crate::linear_block::LinearBlock;

/// A spring and a damper to the average: of U copies, `k_o·(mean − x_i) = Σ_j k_o/U·(x_j − x_i)`, the own copy adding
/// nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Average {
    gains: CouplingGains,
}

impl Average {
    pub(super) const fn new(gains: CouplingGains) -> Self {
        Self { gains }
    }
}

impl Scheme for Average {
    fn weight(&self, present_peers: f64) -> f64 {
        1.0 / (1.0 + present_peers)
    }

    fn tick(&self, _memory: &mut [DVec3], at: &TickMotion<'_>) -> DVec3 {
        self.gains.force(at.apart)
    }

    fn tick_block(&self) -> LinearBlock {
        self.gains.block()
    }
}
