//! The laws of local models as blocks of a loop: what each says of itself ([`cotouch_world::local`]), taken apart by when it
//! acts.

use cotouch_scene::scene::LocalModelKind;
use cotouch_world::LinearBlock;
use cotouch_world::local::{LawClock, LawState, StickingContacts, local_law};
use nalgebra::DMatrix;

use crate::linear::Linear;

/// The law of all contacts of a host.
pub(super) struct LawBlocks {
    /// Forces on fingers per `[e; f]`, f being the forces with which the body in use was stepped; or per e.
    pub(super) direct: DMatrix<f64>,
    /// Whether these forces are those of the first tick of a slow period.
    pub(super) held: bool,
    /// From the same input to forces on fingers, by what the law remembers.
    pub(super) memory: Option<Linear>,
    /// What the law remembers of each contact.
    pub(super) states: &'static [LawState],
}

impl LawBlocks {
    /// The law of a kind, with gains for slow periods of one tick: the input of an integral is gathered over a period with
    /// weights that sum to 1.
    pub(super) fn new(kind: LocalModelKind, contacts: &StickingContacts<'_>) -> Self {
        let law = local_law(kind);
        let LinearBlock { a, b, c, d } = law.linear(contacts);
        let remembers = !law.states().is_empty();
        let memory = remembers.then(|| Linear { a, b, c, d: DMatrix::zeros(d.nrows(), d.ncols()) });
        Self { direct: d, held: law.clock() == LawClock::SlowPeriod, memory, states: law.states() }
    }

    /// Whether a tick of a slow period of N ticks counts 1/N in what the law remembers.
    pub(super) fn gathers_over_period(&self) -> bool {
        self.states.contains(&LawState::Integral)
    }
}
