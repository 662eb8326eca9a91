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
//! The loop is linear: constant forces (a rest position, a wall's place, a script) do not enter.

use cotouch_scene::names::{Coordinate, HostIndex, Part, Quantity};
use cotouch_scene::scene::{Integrator, SpringDamper};
use cotouch_scene::time::Schedule;
use nalgebra::{DMatrix, DVector};

/// A body of a [`LoopSpec`], by its place in [`LoopSpec::bodies`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BodyId(pub usize);

/// A delay line of a [`LoopSpec`], by its place in [`LoopSpec::lines`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LineId(pub usize);

/// A linear sampled-data loop.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopSpec {
    /// Which tick does which network step.
    pub schedule: Schedule,
    /// Everything with a state that forces act on.
    pub bodies: Vec<Body>,
    /// The ways of samples between hosts.
    pub lines: Vec<Line>,
    /// Every force on every body.
    pub actions: Vec<Action>,
}

/// Something that a force moves, with a position and a velocity.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// The names of its states, in the order of its vectors.
    pub states: Vec<Coordinate>,
    /// How it steps.
    pub dynamics: Dynamics,
}

/// How a body steps under a force that is held over the tick.
#[derive(Clone, Debug, PartialEq)]
pub enum Dynamics {
    /// Continuous dynamics, discretised exactly.
    Plant(Plant),
    /// A point mass that software integrates; its states are position and velocity.
    Mass {
        /// kg, positive.
        mass_kg: f64,
        /// The software's integrator.
        integrator: Integrator,
    },
}

/// `ẋ = A·x + B·f`, `(position, velocity) = C·x`, with the force `f` (N) held over each tick.
///
/// Translation and uniform motion are recognised where position and velocity are states of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// n × n.
    pub a: DMatrix<f64>,
    /// n.
    pub b: DVector<f64>,
    /// 2 × n: position (m) in the first row, velocity (m/s) in the second.
    pub c: DMatrix<f64>,
}

impl Plant {
    /// A mass on a spring and a damper to the ground: states position (m) and velocity (m/s).
    #[must_use]
    pub fn mass(mass_kg: f64, to_ground: SpringDamper) -> Self {
        let SpringDamper { stiffness_n_per_m: k, damping_n_s_per_m: b } = to_ground;
        Self {
            a: DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -k / mass_kg, -b / mass_kg]),
            b: DVector::from_column_slice(&[0.0, 1.0 / mass_kg]),
            c: DMatrix::identity(2, 2),
        }
    }
}

/// Samples of one signal on their way from one host to another, taken at network steps and held until the next one
/// plays out.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// The receiver.
    pub host: HostIndex,
    /// The sender.
    pub from: HostIndex,
    /// What the samples are called.
    pub part: Part,
    /// What is sampled.
    pub signal: Signal,
    /// When a sample is used.
    pub delay: Delay,
}

impl Line {
    /// The name of one number of the sample of age `age` (network steps, 1 or more).
    #[must_use]
    pub fn coordinate(&self, quantity: Quantity, age: u32) -> Coordinate {
        Coordinate::Held { host: self.host, from: self.from, part: self.part, quantity, age }
    }
}

/// What a line samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Signal {
    /// Position and velocity of a body.
    Motion(BodyId),
    /// The force of a spring-damper, computed where it is sampled.
    Force(Coupling),
}

/// When a sample that was taken at a network step is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delay {
    /// At the first network step that is `periods` steps later and not before the sample's arrival.
    Scheduled {
        /// n of the seeds.
        periods: u32,
        /// Ticks from sampling to the first tick at or after arrival.
        transit_ticks: u64,
    },
    /// At the first tick at or after arrival.
    OnArrival {
        /// Ticks from sampling to the first tick at or after arrival; 0 means the very instant of sampling.
        transit_ticks: u64,
    },
}

impl Delay {
    /// The tick from which the sample of network step `step` is used. Both may be negative.
    #[must_use]
    pub fn tick_of_use(self, schedule: &Schedule, step: i64) -> i64 {
        let sampled = tick_of_step(schedule, step);
        match self {
            Self::OnArrival { transit_ticks } => sampled + transit_ticks as i64,
            Self::Scheduled { periods, transit_ticks } => {
                let arrival = sampled + transit_ticks as i64;
                let at_arrival = first_step_from(schedule, arrival);
                tick_of_step(schedule, at_arrival.max(step + i64::from(periods)))
            }
        }
    }

    /// The network step whose sample is held at `tick`, after play-out.
    #[must_use]
    pub fn step_held_at(self, schedule: &Schedule, tick: i64) -> i64 {
        let mut step = last_step_at(schedule, tick);
        while self.tick_of_use(schedule, step) > tick {
            step -= 1;
        }
        step
    }

    /// How many samples are held, queued or in flight just before a network step: those of ages 1 to this number.
    #[must_use]
    pub fn samples(self, schedule: &Schedule) -> u32 {
        u32::try_from(-self.step_held_at(schedule, 0)).unwrap_or(u32::MAX)
    }
}

/// ⌈step·p/q⌉, for negative steps too.
pub(crate) fn tick_of_step(schedule: &Schedule, step: i64) -> i64 {
    let (p, q) = pattern(schedule);
    -(-i128::from(step) * p).div_euclid(q) as i64
}

/// ⌊tick·q/p⌋: the last network step at or before a tick.
fn last_step_at(schedule: &Schedule, tick: i64) -> i64 {
    let (p, q) = pattern(schedule);
    (i128::from(tick) * q).div_euclid(p) as i64
}

/// The first network step that falls on `tick` or later.
fn first_step_from(schedule: &Schedule, tick: i64) -> i64 {
    last_step_at(schedule, tick - 1) + 1
}

fn pattern(schedule: &Schedule) -> (i128, i128) {
    (i128::from(schedule.ticks_per_pattern()), i128::from(schedule.steps_per_pattern()))
}

/// A motion that a spring-damper can be tied to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// At rest at the origin.
    Ground,
    /// A body as it is at this instant.
    Current(BodyId),
    /// The sample that a line holds; the line carries a motion.
    Held(LineId),
}

/// A spring and a damper: the force (N) on `end` is `k·(x_anchor − x_end) + b·(v_anchor − v_end)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// k and b.
    pub spring: SpringDamper,
    /// What is pulled.
    pub end: Motion,
    /// What it is pulled towards.
    pub anchor: Motion,
}

/// One force on one body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Action {
    /// What it acts on.
    pub body: BodyId,
    /// Where it comes from.
    pub force: Force,
}

/// Where a force comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Force {
    /// A spring-damper, evaluated at every tick.
    Coupling(Coupling),
    /// The force sample that a line holds.
    Held(LineId),
}

impl LoopSpec {
    /// A loop without bodies.
    #[must_use]
    pub const fn new(schedule: Schedule) -> Self {
        Self { schedule, bodies: Vec::new(), lines: Vec::new(), actions: Vec::new() }
    }

    /// Adds a body.
    pub fn body(&mut self, body: Body) -> BodyId {
        self.bodies.push(body);
        BodyId(self.bodies.len() - 1)
    }

    /// Adds a delay line.
    pub fn line(&mut self, line: Line) -> LineId {
        self.lines.push(line);
        LineId(self.lines.len() - 1)
    }

    /// Pulls `body` towards `anchor`. Nothing acts on the anchor.
    pub fn pull(&mut self, body: BodyId, anchor: Motion, spring: SpringDamper) {
        let coupling = Coupling { spring, end: Motion::Current(body), anchor };
        self.actions.push(Action { body, force: Force::Coupling(coupling) });
    }

    /// Couples two bodies with equal and opposite forces at every tick.
    pub fn couple(&mut self, one: BodyId, other: BodyId, spring: SpringDamper) {
        self.pull(one, Motion::Current(other), spring);
        self.pull(other, Motion::Current(one), spring);
    }

    /// Lets the force that `line` holds act on `body`.
    pub fn apply_held(&mut self, body: BodyId, line: LineId) {
        self.actions.push(Action { body, force: Force::Held(line) });
    }
}
