//! A sampled-data loop: bodies under hold, springs and dampers between them, and delay lines of samples.
//!
//! Scenes compile to it ([`crate::compile`]); people can also write one by hand. One tick of period `T_c` does this:
//!
//! 1. where a network step falls on the tick, every line that carries a motion takes a sample of its body;
//! 2. every such line plays out: the sample that is due becomes the one that is held;
//! 3. where a network step falls on the tick, every line that carries a force samples it, from the samples now held
//!    and the bodies as they are; these lines play out;
//! 4. all forces on bodies are evaluated and held over the tick, and every body steps.
//!
//! The loop is linear: constant forces (a rest position, a wall's place, a script) do not enter. A body may move along
//! and turn about several axes ([`Dof`]); its motion is then its positions followed by its velocities, one of each for
//! every degree of freedom, and its force has as many components.

mod block;
mod body;
mod coupling;
mod delay;
mod line;

use cotouch_scene::names::{Axis, Quantity};
use cotouch_scene::scene::SpringDamper;
use cotouch_scene::time::Schedule;

use crate::dof::motion_quantities;

pub(crate) use block::least_common_multiple;
pub use block::{Block, Hold};
pub use body::{Dynamics, Estimate, LoopBody};
pub use coupling::{BlockId, BodyId, Columns, ForceGains, LineId, Motion, Rows, Term};
pub use delay::Delay;
pub(crate) use delay::{first_step_from, tick_of_step};
pub use line::{Line, Signal};

pub use crate::dof::{Dof, LINE, PLANE_BODY, PLANE_POINT, SPACE_BODY, SPACE_POINT};
pub use crate::plant::Plant;

/// A linear sampled-data loop.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopSpec {
    /// Which tick does which network step.
    pub schedule: Schedule,
    /// Everything with a state that forces act on.
    pub bodies: Vec<LoopBody>,
    /// The ways of samples between hosts.
    pub lines: Vec<Line>,
    /// What computes at clocks of its own.
    pub blocks: Vec<Block>,
    /// Every force on every body.
    pub actions: Vec<AppliedForce>,
}

/// One force on one body.
#[derive(Clone, Debug, PartialEq)]
pub struct AppliedForce {
    /// What it acts on.
    pub body: BodyId,
    /// Where it comes from.
    pub force: Force,
}

/// Where a force comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Force {
    /// Evaluated at every tick.
    Gains(ForceGains),
    /// The force sample that a line holds.
    Held(LineId),
}

impl LoopSpec {
    /// A loop without bodies.
    #[must_use]
    pub const fn new(schedule: Schedule) -> Self {
        Self { schedule, bodies: Vec::new(), lines: Vec::new(), blocks: Vec::new(), actions: Vec::new() }
    }

    /// Adds a body.
    pub fn body(&mut self, body: LoopBody) -> BodyId {
        self.bodies.push(body);
        BodyId(self.bodies.len() - 1)
    }

    /// Adds a delay line.
    pub fn line(&mut self, line: Line) -> LineId {
        self.lines.push(line);
        LineId(self.lines.len() - 1)
    }

    /// Adds a block.
    pub fn block(&mut self, block: Block) -> BlockId {
        self.blocks.push(block);
        BlockId(self.blocks.len() - 1)
    }

    /// Ticks after which ticks, network steps and the steps of all blocks repeat.
    #[must_use]
    pub fn ticks_per_pattern(&self) -> u64 {
        let patterns = self.blocks.iter().map(Block::ticks_per_pattern);
        patterns.fold(self.schedule.ticks_per_pattern(), least_common_multiple)
    }

    /// Network steps in so many ticks.
    pub(crate) fn network_steps(&self) -> u64 {
        self.ticks_per_pattern() / self.schedule.ticks_per_pattern() * self.schedule.steps_per_pattern()
    }

    /// How long a pattern is, s.
    #[must_use]
    pub fn pattern_s(&self) -> f64 {
        let control = self.schedule.control();
        self.ticks_per_pattern() as f64 * control.denominator() as f64 / control.numerator() as f64
    }

    /// The body of a motion; none for the ground and for blocks.
    pub(crate) fn body_of(&self, motion: Motion) -> Option<BodyId> {
        match motion {
            Motion::Ground | Motion::Output(_) => None,
            Motion::Current(body) => Some(body),
            Motion::Held(line) => self.lines[line.0].signal.body(),
        }
    }

    /// The degrees of freedom of a motion; none for the ground and for blocks.
    pub(crate) fn axes_of(&self, motion: Motion) -> &'static [Dof] {
        self.body_of(motion).map_or(&[], |body| self.bodies[body.0].axes)
    }

    /// How many numbers a motion has.
    pub(crate) fn numbers_of(&self, motion: Motion) -> usize {
        match motion {
            Motion::Ground => 0,
            Motion::Current(body) => 2 * self.bodies[body.0].axes.len(),
            Motion::Held(line) => self.quantities(&self.lines[line.0]).len(),
            Motion::Output(block) => self.blocks[block.0].law.outputs(),
        }
    }

    /// What the numbers of a line's samples are.
    pub(crate) fn quantities(&self, line: &Line) -> Vec<Quantity> {
        match &line.signal {
            Signal::Motion(body) => motion_quantities(self.bodies[body.0].axes).collect(),
            Signal::Position(body) => self.bodies[body.0].axes.iter().map(|dof| dof.position()).collect(),
            Signal::Force(coupling) => {
                Axis::ALL.into_iter().take(coupling.components).map(Quantity::Force).collect()
            }
        }
    }

    /// A spring and a damper along every direction in which `end` moves: the force on `end` is
    /// `k·(x_anchor − x_end) + b·(v_anchor − v_end)`. It turns nothing.
    #[must_use]
    pub fn spring(&self, end: Motion, anchor: Motion, spring: SpringDamper) -> ForceGains {
        let components = self.axes_of(end).len();
        let mut terms = Vec::with_capacity(4 * components);
        let gains = [spring.stiffness_n_per_m, spring.damping_n_s_per_m];
        for (motion, sign) in [(anchor, 1.0), (end, -1.0)] {
            let axes = self.axes_of(motion);
            for (order, gain) in gains.into_iter().enumerate().filter(|&(_, gain)| gain != 0.0) {
                let moves = axes.iter().take(components).take_while(|dof| !dof.turns());
                for (component, _) in moves.enumerate() {
                    let number = order * axes.len() + component;
                    terms.push(Term { component, motion, number, gain: sign * gain });
                }
            }
        }
        ForceGains { components, terms }
    }

    /// Lets a force act on `body`.
    pub fn act(&mut self, body: BodyId, coupling: ForceGains) {
        self.actions.push(AppliedForce { body, force: Force::Gains(coupling) });
    }

    /// Pulls `body` towards `anchor`. Nothing acts on the anchor.
    pub fn pull(&mut self, body: BodyId, anchor: Motion, spring: SpringDamper) {
        let coupling = self.spring(Motion::Current(body), anchor, spring);
        self.act(body, coupling);
    }

    /// Lets the force that `line` holds act on `body`.
    pub fn apply_held(&mut self, body: BodyId, line: LineId) {
        self.actions.push(AppliedForce { body, force: Force::Held(line) });
    }

    /// Every force that something computes.
    pub(crate) fn couplings(&self) -> impl Iterator<Item = &ForceGains> {
        let acting = self.actions.iter().filter_map(|action| match &action.force {
            Force::Gains(coupling) => Some(coupling),
            Force::Held(_) => None,
        });
        let sampled = self.lines.iter().filter_map(|line| line.signal.force());
        acting.chain(sampled)
    }

    /// The force behind an action, computed here or where it was sampled.
    pub(crate) fn coupling_of<'a>(&'a self, action: &'a AppliedForce) -> Option<&'a ForceGains> {
        match &action.force {
            Force::Gains(coupling) => Some(coupling),
            Force::Held(line) => self.lines[line.0].signal.force(),
        }
    }
}
