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

use cotouch_scene::names::{Coordinate, HostIndex, Part, Quantity};
use cotouch_scene::scene::{Integrator, SpringDamper};
use cotouch_scene::time::Schedule;
use glam::DMat3;
use nalgebra::DMatrix;

pub use crate::dof::{Dof, LINE, PLANE_BODY, PLANE_POINT, SPACE_BODY, SPACE_POINT};

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
    /// How it can move: d degrees of freedom. [`Dof::Move`] comes before [`Dof::Turn`].
    pub axes: &'static [Dof],
    /// How it steps.
    pub dynamics: Dynamics,
}

/// How a body with d degrees of freedom steps under a force that is held over the tick.
#[derive(Clone, Debug, PartialEq)]
pub enum Dynamics {
    /// Continuous dynamics, discretised exactly.
    Plant(Plant),
    /// Continuous dynamics, of which only positions at ticks are measured; velocities are told from them. The states
    /// are the plant's, then the d positions that were read at the last tick, then, for [`Estimate::Filtered`], the d
    /// velocities that were told at the last tick.
    Sensed {
        /// What moves.
        plant: Plant,
        /// How velocities are told.
        estimate: Estimate,
    },
    /// A point mass that software integrates; its states are d positions and d velocities.
    Mass {
        /// kg, positive.
        mass_kg: f64,
        /// The software's integrator.
        integrator: Integrator,
    },
    /// A rigid body about rest, integrated by software; its states are d positions (turns: rotation vector) and d
    /// velocities. About rest gyroscopic forces vanish to first order.
    Rigid {
        /// kg, positive.
        mass_kg: f64,
        /// About the centre of mass, world frame, kg·m²; positive definite in the directions in which it turns.
        inertia: DMat3,
        /// The software's integrator.
        integrator: Integrator,
    },
}

/// How a velocity is told from positions x(k) that are read at ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Estimate {
    /// v(k) = (x(k) − x(k−1))/T.
    Difference,
    /// v(k) = v(k−1) + (1 − e^(−ω·T))·((x(k) − x(k−1))/T − v(k−1)).
    Filtered {
        /// ω.
        cutoff_rad_per_s: f64,
    },
}

/// `ẋ = A·x + B·f`, `(positions, velocities) = C·x`, with the force `f` held over each tick.
///
/// Translation and uniform motion are recognised where positions and velocities are states of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// n × n.
    pub a: DMatrix<f64>,
    /// n × d.
    pub b: DMatrix<f64>,
    /// 2d × n: positions (m), then velocities (m/s).
    pub c: DMatrix<f64>,
}

impl Plant {
    /// A mass on a spring and a damper to the ground: states position (m) and velocity (m/s).
    #[must_use]
    pub fn mass(mass_kg: f64, to_ground: SpringDamper) -> Self {
        let SpringDamper { stiffness_n_per_m: k, damping_n_s_per_m: b } = to_ground;
        Self {
            a: DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -k / mass_kg, -b / mass_kg]),
            b: DMatrix::from_column_slice(2, 1, &[0.0, 1.0 / mass_kg]),
            c: DMatrix::identity(2, 2),
        }
    }

    /// The same along the first `axes` axes of the world, with a mass (kg) that may differ from direction to direction:
    /// states are positions, then velocities.
    #[must_use]
    pub fn endpoint(mass: &DMat3, axes: usize, to_ground: SpringDamper) -> Self {
        let full = DMatrix::from_fn(axes, axes, |row, column| mass.col(column)[row]);
        let Some(per_mass) = full.try_inverse().filter(|_| axes > 1) else {
            return Self::mass(mass.x_axis.x, to_ground);
        };
        let mut a = DMatrix::zeros(2 * axes, 2 * axes);
        a.view_mut((0, axes), (axes, axes)).fill_with_identity();
        a.view_mut((axes, 0), (axes, axes)).copy_from(&(&per_mass * -to_ground.stiffness_n_per_m));
        a.view_mut((axes, axes), (axes, axes)).copy_from(&(&per_mass * -to_ground.damping_n_s_per_m));
        let mut b = DMatrix::zeros(2 * axes, axes);
        b.view_mut((axes, 0), (axes, axes)).copy_from(&per_mass);
        Self { a, b, c: DMatrix::identity(2 * axes, 2 * axes) }
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
#[derive(Clone, Debug, PartialEq)]
pub enum Signal {
    /// Positions and velocities of a body.
    Motion(BodyId),
    /// A force, computed where it is sampled; its components lie along the world's axes x, y, z.
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

/// A motion that a force can depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// At rest at the origin.
    Ground,
    /// A body as it is at this instant.
    Current(BodyId),
    /// The sample that a line holds; the line carries a motion.
    Held(LineId),
}

/// A force that is a linear function of motions: `Σ K_m·q_m + B_m·v_m`, written as its elements that are not 0.
///
/// A spring and a damper are the special case of [`LoopSpec::spring`]; preload adds terms that are neither symmetric nor
/// relative.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coupling {
    /// Components of the force.
    pub components: usize,
    /// Their elements.
    pub terms: Vec<Term>,
}

/// One element of a gain matrix: `gain` times one number of a motion adds to one component of the force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// Which component of the force, N or N·m.
    pub component: usize,
    /// What is read; never the ground.
    pub motion: Motion,
    /// Which of its numbers: with d degrees of freedom, positions are 0 to d − 1 and velocities d to 2d − 1.
    pub number: usize,
    /// N/m, N·s/m and their likes for turns.
    pub gain: f64,
}

/// One force on one body.
#[derive(Clone, Debug, PartialEq)]
pub struct Action {
    /// What it acts on.
    pub body: BodyId,
    /// Where it comes from.
    pub force: Force,
}

/// Where a force comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Force {
    /// Evaluated at every tick.
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

    /// The body of a motion.
    #[must_use]
    pub fn body_of(&self, motion: Motion) -> Option<BodyId> {
        match motion {
            Motion::Ground => None,
            Motion::Current(body) => Some(body),
            Motion::Held(line) => match self.lines[line.0].signal {
                Signal::Motion(body) => Some(body),
                Signal::Force(_) => None,
            },
        }
    }

    /// The degrees of freedom of a motion; none for the ground.
    #[must_use]
    pub fn axes_of(&self, motion: Motion) -> &'static [Dof] {
        self.body_of(motion).map_or(&[], |body| self.bodies[body.0].axes)
    }

    /// A spring and a damper along every direction in which `end` moves: the force on `end` is
    /// `k·(x_anchor − x_end) + b·(v_anchor − v_end)`. It turns nothing.
    #[must_use]
    pub fn spring(&self, end: Motion, anchor: Motion, spring: SpringDamper) -> Coupling {
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
        Coupling { components, terms }
    }

    /// Lets a force act on `body`.
    pub fn act(&mut self, body: BodyId, coupling: Coupling) {
        self.actions.push(Action { body, force: Force::Coupling(coupling) });
    }

    /// Pulls `body` towards `anchor`. Nothing acts on the anchor.
    pub fn pull(&mut self, body: BodyId, anchor: Motion, spring: SpringDamper) {
        let coupling = self.spring(Motion::Current(body), anchor, spring);
        self.act(body, coupling);
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

    /// Every force that something computes.
    pub(crate) fn couplings(&self) -> impl Iterator<Item = &Coupling> {
        let acting = self.actions.iter().filter_map(|action| match &action.force {
            Force::Coupling(coupling) => Some(coupling),
            Force::Held(_) => None,
        });
        let sampled = self.lines.iter().filter_map(|line| match &line.signal {
            Signal::Force(coupling) => Some(coupling),
            Signal::Motion(_) => None,
        });
        acting.chain(sampled)
    }

    /// The force behind an action, computed here or where it was sampled.
    pub(crate) fn coupling_of<'a>(&'a self, action: &'a Action) -> Option<&'a Coupling> {
        match &action.force {
            Force::Coupling(coupling) => Some(coupling),
            Force::Held(line) => match &self.lines[line.0].signal {
                Signal::Force(coupling) => Some(coupling),
                Signal::Motion(_) => None,
            },
        }
    }
}

impl Coupling {
    /// A force with this many components and no terms yet.
    #[must_use]
    pub const fn new(components: usize) -> Self {
        Self { components, terms: Vec::new() }
    }

    /// Adds a 3 × 3 block of a gain matrix in world axes: its rows are the force's components of one kind (forces or
    /// torques), its columns the motion's numbers of one kind and order. Directions that either side lacks are left out.
    pub fn add(&mut self, rows: Rows, motion: (Motion, &[Dof]), columns: Columns, block: &DMat3) {
        let (motion, axes) = motion;
        let Columns { turns, velocity } = columns;
        let first = if velocity { axes.len() } else { 0 };
        for (component, row) in rows.axes.iter().enumerate().filter(|(_, dof)| dof.turns() == rows.turns) {
            for (number, column) in axes.iter().enumerate().filter(|(_, dof)| dof.turns() == turns) {
                let gain = block.col(column.axis().index())[row.axis().index()];
                if gain != 0.0 {
                    self.terms.push(Term { component, motion, number: first + number, gain });
                }
            }
        }
    }
}

/// The components that a block of gains adds to.
#[derive(Clone, Copy, Debug)]
pub struct Rows {
    /// What the force acts on.
    pub axes: &'static [Dof],
    /// Torques, not forces.
    pub turns: bool,
}

/// The numbers that a block of gains reads.
#[derive(Clone, Copy, Debug)]
pub struct Columns {
    /// Turns, not positions.
    pub turns: bool,
    /// Velocities.
    pub velocity: bool,
}
