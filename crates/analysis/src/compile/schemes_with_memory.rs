//! Coordination schemes that no scene names, as blocks.

use cotouch_world::LinearBlock;
use cotouch_world::coordination::{CouplingGains, Scheme, SchemeSize, TickMotion};
use glam::DVec3;
use nalgebra::{DMatrix, dmatrix};

/// What a scheme of memory 1 on low-passed positions does with them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Filtered {
    /// Low-passes how far the copies are apart, position and velocity.
    Apart,
    /// Sends its own position, low-passed, and is drawn from where it is to what it receives: both read places, but feel
    /// nothing when all copies are elsewhere.
    Sent,
    /// Is drawn, besides, to where it was at the start.
    ToStart,
}

/// A spring and a damper with a low pass of share σ: `z⁺ = z + σ·(input − z)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WithMemory {
    pub(crate) gains: CouplingGains,
    pub(crate) share: f64,
    pub(crate) filtered: Filtered,
}

impl Scheme for WithMemory {
    fn size(&self) -> SchemeSize {
        match self.filtered {
            Filtered::Apart | Filtered::ToStart => SchemeSize { tick_memory: 2, step_memory: 0, sent: 0 },
            Filtered::Sent => SchemeSize { tick_memory: 0, step_memory: 1, sent: 1 },
        }
    }

    fn tick(&self, _memory: &mut [DVec3], _at: &TickMotion<'_>) -> DVec3 {
        unreachable!("only the analysis knows this scheme")
    }

    fn tick_block(&self) -> LinearBlock {
        let Self { gains: CouplingGains { stiffness, damping }, share, filtered } = *self;
        if filtered == Filtered::Sent {
            return LinearBlock::gain(dmatrix![0.0, damping, -stiffness, 0.0, stiffness]);
        }
        let own = if filtered == Filtered::ToStart { -10.0 } else { 0.0 };
        LinearBlock {
            a: DMatrix::identity(2, 2) * (1.0 - share),
            b: DMatrix::from_fn(2, 4, |row, column| if row == column { share } else { 0.0 }),
            c: dmatrix![stiffness, damping] * (1.0 - share),
            d: dmatrix![stiffness * share, damping * share, own, 0.0],
        }
    }

    fn step_block(&self) -> LinearBlock {
        let Self { share, filtered, .. } = *self;
        if filtered != Filtered::Sent {
            return LinearBlock::gain(DMatrix::zeros(0, 4));
        }
        LinearBlock {
            a: dmatrix![1.0 - share],
            b: dmatrix![share, 0.0],
            c: dmatrix![1.0 - share],
            d: dmatrix![share, 0.0],
        }
    }
}
