//! Eigenvalues at exactly 1 that a loop has by its structure, and their removal.
//!
//! Removed by closeness to 1, a rigid-body pole could not be told from the drag pole beside it, and a double one would
//! be computed as 1 ± 10⁻⁸. So they are found from the description:
//!
//! - **Translation.** Where no stiffness ties a group of bodies to the ground or to the rest, moving them and their
//!   samples by one length changes no force: `A·e = e`.
//! - **Uniform motion.** Where the loop translates as a whole, opposite forces are equal at every tick and nothing is
//!   damped to the ground, momentum is conserved (a second left eigenvector, `Wᵀ·A = Wᵀ`). Then the loop can coast:
//!   there is a state `g` in which all bodies move at 1 m/s, with constant offsets that make up for the ages of held
//!   samples, and every force is in balance at every tick: `A·g = g + T·e`, a Jordan pair.
//!
//! Both vectors are checked against the map, and deflated by reflections that take them to the first axis.

use cotouch_scene::scene::SpringDamper;
use nalgebra::{DMatrix, DVector};

use crate::lift::layout::Layout;
use crate::loop_spec::{
    Body, Coupling, Delay, Dynamics, Force, LineId, LoopSpec, Motion, Plant, Signal, tick_of_step,
};

/// Vectors of the eigenvalue 1 that follow from a loop's structure.
#[derive(Clone, Debug, Default)]
pub(crate) struct Structure {
    /// Translation of the whole loop, and its uniform motion: the rigid-body poles.
    pub(crate) rigid: Vec<DVector<f64>>,
    /// Translations of parts that no stiffness ties to the rest: they stay where they are put.
    pub(crate) loose: Vec<DVector<f64>>,
    /// Whether a stiffness ties any body to the ground.
    pub(crate) grounded: bool,
}

impl Structure {
    pub(crate) fn new(spec: &LoopSpec, layout: &Layout) -> Self {
        let groups = Groups::new(spec);
        let mut loose: Vec<_> =
            groups.free.iter().map(|&group| translation(spec, layout, &groups, group)).collect();
        if groups.grounded || loose.is_empty() {
            return Self { rigid: Vec::new(), loose, grounded: groups.grounded };
        }
        let whole = loose.iter().skip(1).fold(loose[0].clone(), |sum, group| sum + group);
        loose.pop();
        let rigid = std::iter::once(whole).chain(uniform_motion(spec, layout)).collect();
        Self { rigid, loose, grounded: false }
    }
}

/// Bodies that stiffnesses tie together.
struct Groups {
    /// For each body, one body that stands for its group; the last entry is the ground.
    parent: Vec<usize>,
    /// The groups that are not tied to the ground.
    free: Vec<usize>,
    grounded: bool,
}

impl Groups {
    fn new(spec: &LoopSpec) -> Self {
        let ground = spec.bodies.len();
        let mut groups = Self { parent: (0..=ground).collect(), free: Vec::new(), grounded: false };
        for (index, body) in spec.bodies.iter().enumerate() {
            if coasting_states(body).is_none() {
                groups.join(index, ground);
            }
        }
        for coupling in couplings(spec).filter(|coupling| coupling.spring.stiffness_n_per_m != 0.0) {
            groups.join(endpoint(spec, coupling.end), endpoint(spec, coupling.anchor));
        }
        let of_ground = groups.of(ground);
        groups.grounded = (0..ground).any(|body| groups.of(body) == of_ground);
        groups.free = (0..ground).filter(|&body| groups.of(body) == body && body != of_ground).collect();
        groups
    }

    fn of(&self, mut body: usize) -> usize {
        while self.parent[body] != body {
            body = self.parent[body];
        }
        body
    }

    fn join(&mut self, one: usize, other: usize) {
        let (one, other) = (self.of(one), self.of(other));
        self.parent[one] = other;
    }
}

fn couplings(spec: &LoopSpec) -> impl Iterator<Item = Coupling> + '_ {
    let acting = spec.actions.iter().filter_map(|action| match action.force {
        Force::Coupling(coupling) => Some(coupling),
        Force::Held(_) => None,
    });
    let sampled = spec.lines.iter().filter_map(|line| match line.signal {
        Signal::Force(coupling) => Some(coupling),
        Signal::Motion(_) => None,
    });
    acting.chain(sampled)
}

/// The body at an end of a coupling; the number of bodies stands for the ground.
fn endpoint(spec: &LoopSpec, motion: Motion) -> usize {
    let body = match motion {
        Motion::Ground => None,
        Motion::Current(body) => Some(body),
        Motion::Held(line) => match spec.lines[line.0].signal {
            Signal::Motion(body) => Some(body),
            Signal::Force(_) => None,
        },
    };
    body.map_or(spec.bodies.len(), |body| body.0)
}

/// How a body is somewhere else, or moves, without a force: a state and its size for 1 m, and for 1 m/s.
#[derive(Clone, Copy)]
struct Coasting {
    position: (usize, f64),
    velocity: Option<(usize, f64)>,
}

/// `None` where the body's own dynamics tie it to a place.
fn coasting_states(body: &Body) -> Option<Coasting> {
    match &body.dynamics {
        Dynamics::Mass { .. } => Some(Coasting { position: (0, 1.0), velocity: Some((1, 1.0)) }),
        Dynamics::Plant(plant) => coasting_of_plant(plant),
    }
}

fn coasting_of_plant(plant: &Plant) -> Option<Coasting> {
    let states = || 0..plant.b.len();
    // A position is a state that nothing depends on; it is read as the position alone.
    let position = states().find(|&state| {
        let alone = plant.a.column(state).iter().all(|&element| element == 0.0);
        alone && plant.c[(0, state)] != 0.0 && plant.c[(1, state)] == 0.0
    })?;
    let per_metre = plant.c[(0, position)].recip();
    // A velocity is a state on which only that position depends.
    let velocity = states().find_map(|state| {
        let size = plant.c[(1, state)].recip();
        let column = plant.a.column(state);
        let drives_only_position =
            column.iter().enumerate().all(|(row, &element)| (element != 0.0) == (row == position));
        let consistent = drives_only_position && column[position] * size == per_metre;
        (consistent && plant.c[(0, state)] == 0.0).then_some((state, size))
    });
    Some(Coasting { position: (position, per_metre), velocity })
}

/// All bodies of a group, and all samples of them, moved by 1 m.
fn translation(spec: &LoopSpec, layout: &Layout, groups: &Groups, group: usize) -> DVector<f64> {
    let mut vector = DVector::zeros(layout.coordinates.len());
    let moves = |body: usize| groups.of(body) == group;
    for (index, body) in spec.bodies.iter().enumerate().filter(|&(index, _)| moves(index)) {
        if let Some(Coasting { position: (state, size), .. }) = coasting_states(body) {
            vector[layout.bodies[index] + state] = size;
        }
    }
    for register in &layout.registers {
        if let Signal::Motion(body) = register.signal
            && moves(body.0)
        {
            (1..=register.length).for_each(|age| vector[register.place(age)] = 1.0);
        }
    }
    vector
}

/// The state in which every body coasts at 1 m/s, where there is one.
fn uniform_motion(spec: &LoopSpec, layout: &Layout) -> Option<DVector<f64>> {
    let coasting: Vec<_> = spec.bodies.iter().map(coasting_states).collect::<Option<_>>()?;
    let velocities: Vec<_> = coasting.iter().map(|body| body.velocity).collect::<Option<_>>()?;
    let lags = Lags::new(spec)?;
    let offsets = lags.offsets(spec)?;
    let mut vector = DVector::zeros(layout.coordinates.len());
    for (index, &first) in layout.bodies.iter().enumerate() {
        let (position, per_metre) = coasting[index].position;
        let (velocity, size) = velocities[index];
        vector[first + position] = offsets[index] * per_metre;
        vector[first + velocity] = size;
    }
    let period_s = spec.schedule.control().period_s();
    for register in &layout.registers {
        for age in 1..=register.length {
            let place = register.place(age);
            match register.signal {
                Signal::Motion(body) => {
                    let since_s = tick_of_step(&spec.schedule, -i64::from(age)) as f64 * period_s;
                    vector[place] = offsets[body.0] + since_s;
                    vector[place + 1] = 1.0;
                }
                Signal::Force(coupling) => vector[place] = lags.force(spec, &coupling, &offsets),
            }
        }
    }
    Some(vector)
}

/// In uniform motion, how far each coupling's anchor lags behind its end at equal offsets: the same at every tick.
struct Lags {
    period_s: f64,
}

impl Lags {
    /// `None` where something is damped to the ground, or a coupling's lag varies from tick to tick.
    fn new(spec: &LoopSpec) -> Option<Self> {
        let ground = spec.bodies.len();
        let is_steady = |coupling: &Coupling, at_steps: bool| {
            let SpringDamper { stiffness_n_per_m: k, damping_n_s_per_m: b } = coupling.spring;
            let ends = [endpoint(spec, coupling.end), endpoint(spec, coupling.anchor)];
            let damped_to_ground = b != 0.0 && ends.contains(&ground) && ends != [ground; 2];
            !damped_to_ground && (k == 0.0 || has_constant_lag(spec, coupling, at_steps))
        };
        let acting_steady = spec.actions.iter().all(|action| match action.force {
            Force::Coupling(coupling) => is_steady(&coupling, false),
            Force::Held(_) => true,
        });
        let sampled_steady = spec.lines.iter().all(|line| match line.signal {
            Signal::Force(coupling) => is_steady(&coupling, true),
            Signal::Motion(_) => true,
        });
        let period_s = spec.schedule.control().period_s();
        (acting_steady && sampled_steady).then_some(Self { period_s })
    }

    /// Seconds by which the anchor's data is older than the end's. At tick 0 there is a network step.
    fn lag_s(&self, spec: &LoopSpec, coupling: &Coupling) -> f64 {
        lag_ticks(spec, coupling, 0) as f64 * self.period_s
    }

    fn force(&self, spec: &LoopSpec, coupling: &Coupling, offsets: &DVector<f64>) -> f64 {
        let offset = |motion| offsets.get(endpoint(spec, motion)).copied().unwrap_or(0.0);
        let stretch = offset(coupling.anchor) - offset(coupling.end) - self.lag_s(spec, coupling);
        coupling.spring.stiffness_n_per_m * stretch
    }

    /// Offsets at which the forces on every body are in balance, where there are some.
    fn offsets(&self, spec: &LoopSpec) -> Option<DVector<f64>> {
        let bodies = spec.bodies.len();
        let mut stiffness = DMatrix::zeros(bodies, bodies);
        let mut lag_force = DVector::zeros(bodies);
        for action in &spec.actions {
            let coupling = match action.force {
                Force::Coupling(coupling) => coupling,
                Force::Held(LineId(line)) => match spec.lines[line].signal {
                    Signal::Force(coupling) => coupling,
                    Signal::Motion(_) => return None,
                },
            };
            let k = coupling.spring.stiffness_n_per_m;
            let (end, anchor) = (endpoint(spec, coupling.end), endpoint(spec, coupling.anchor));
            if k != 0.0 && end < bodies && anchor < bodies {
                stiffness[(action.body.0, anchor)] += k;
                stiffness[(action.body.0, end)] -= k;
                lag_force[action.body.0] += k * self.lag_s(spec, &coupling);
            }
        }
        solve_balance(stiffness, &lag_force)
    }
}

/// A solution of `stiffness·offsets = lag_force`, if the two sides can be equal: a net drag cannot be balanced.
fn solve_balance(stiffness: DMatrix<f64>, lag_force: &DVector<f64>) -> Option<DVector<f64>> {
    const RELATIVE: f64 = 1e-10;
    let scale = lag_force.amax();
    if scale == 0.0 {
        return Some(DVector::zeros(lag_force.len()));
    }
    let threshold = stiffness.amax() * 1e-13;
    let decomposition = stiffness.clone().svd(true, true);
    let offsets = decomposition.solve(lag_force, threshold).ok()?;
    let is_balanced = (stiffness * &offsets - lag_force).amax() <= RELATIVE * scale;
    is_balanced.then_some(offsets)
}

fn has_constant_lag(spec: &LoopSpec, coupling: &Coupling, at_steps: bool) -> bool {
    let ticks = spec.schedule.ticks_per_pattern();
    let mut evaluated = (0..ticks).filter(|&tick| !at_steps || spec.schedule.step_at(tick).is_some());
    let at_start = lag_ticks(spec, coupling, 0);
    evaluated.all(|tick| lag_ticks(spec, coupling, tick as i64) == at_start)
}

fn lag_ticks(spec: &LoopSpec, coupling: &Coupling, tick: i64) -> i64 {
    let age = |motion| match motion {
        Motion::Held(line) => tick - sampled_at(spec, spec.lines[line.0].delay, tick),
        Motion::Ground | Motion::Current(_) => 0,
    };
    age(coupling.anchor) - age(coupling.end)
}

/// The tick at which the sample was taken that is held at `tick`.
fn sampled_at(spec: &LoopSpec, delay: Delay, tick: i64) -> i64 {
    tick_of_step(&spec.schedule, delay.step_held_at(&spec.schedule, tick))
}

/// `matrix` in an orthogonal basis that begins with `eigenvector`, without its first row and column, and the
/// reflection that leads there: the other eigenvalues.
pub(crate) fn deflate(matrix: &DMatrix<f64>, eigenvector: &DVector<f64>) -> (DMatrix<f64>, Reflection) {
    let reflection = Reflection::to_first_axis(eigenvector);
    let mut reduced = matrix.clone();
    reflection.apply_left(&mut reduced);
    reflection.apply_right(&mut reduced);
    (reduced.remove_row(0).remove_column(0), reflection)
}

/// `H = I − 2·n·nᵀ` (Householder).
pub(crate) struct Reflection {
    /// Of length 1, or 0 for the identity.
    normal: DVector<f64>,
}

impl Reflection {
    fn to_first_axis(vector: &DVector<f64>) -> Self {
        let mut normal = vector / vector.norm();
        normal[0] += 1.0f64.copysign(normal[0]);
        let length = normal.norm();
        Self { normal: normal / length }
    }

    fn apply_left(&self, matrix: &mut DMatrix<f64>) {
        let along = matrix.tr_mul(&self.normal);
        matrix.ger(-2.0, &self.normal, &along, 1.0);
    }

    fn apply_right(&self, matrix: &mut DMatrix<f64>) {
        let along = &*matrix * &self.normal;
        matrix.ger(-2.0, &along, &self.normal, 1.0);
    }

    /// A vector in the new basis, without its first element.
    pub(crate) fn deflate_vector(&self, vector: &DVector<f64>) -> DVector<f64> {
        let reflected = vector - &self.normal * (2.0 * self.normal.dot(vector));
        reflected.remove_row(0)
    }
}
