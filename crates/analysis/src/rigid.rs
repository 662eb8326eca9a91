//! Eigenvalues at exactly 1 that a loop has by its structure.
//!
//! Removed by closeness to 1, a rigid-body pole could not be told from the drag pole beside it, and a double one would
//! be computed as 1 ± 10⁻⁸. So they are found from the description, for each part of the loop that no force connects
//! with the rest (a body that nobody holds, a finger that holds nothing), and for each direction:
//!
//! - **Translation.** Where no stiffness ties a group of bodies to the ground or to the rest, moving them and their
//!   samples by one length changes no force: `A·e = e`. The same goes for turning bodies that nothing keeps from it,
//!   alone or about a finger that touches without force; fingers that press do, for their forces stay in the world's
//!   directions.
//! - **Uniform motion.** Where a part translates as a whole, opposite forces are equal at every tick and nothing is
//!   damped to the ground, momentum is conserved (a second left eigenvector, `Wᵀ·A = Wᵀ`). Then the part can coast:
//!   there is a state `g` in which all bodies move at 1 m/s, with constant offsets that make up for the ages of held
//!   samples, and every force is in balance at every tick: `A·g = g + T·e`, a Jordan pair.
//!
//! Where blocks act in a part, both are found as null spaces ([`with_blocks`]), for a block may make anything of a place.
//!
//! Each vector is checked against the map before it is deflated.

mod coasting;
mod null_space;
mod offsets;
mod pivots;
mod ties;
mod with_blocks;

use cotouch_scene::names::{Coordinate, Part};
use nalgebra::{DMatrix, DVector};

use crate::lift::layout::Layout;
use crate::loop_spec::{Dof, Force, ForceGains, LoopSpec, Motion, Signal, tick_of_step};
use coasting::{Coasting, coasting};
use cotouch_matrix::SingularValues;
use offsets::{Offsets, is_of_part};
use pivots::TurningPart;
pub(crate) use ties::Ties;
use with_blocks::PartWithBlocks;

/// Vectors of the eigenvalue 1 that follow from a loop's structure.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Structure {
    /// Translation of each part as a whole, each with its uniform motion behind it: the rigid-body poles.
    pub(crate) rigid: Vec<DVector<f64>>,
    /// How many of these are translations without uniform motion.
    pub(crate) dragged: usize,
    /// Translations of what no stiffness ties to the rest of its part: it stays where it is put.
    pub(crate) loose: Vec<DVector<f64>>,
    /// To which relative accuracy these are eigenvectors of a computed map.
    pub(crate) rounding: f64,
    /// All translations.
    still: Vec<DVector<f64>>,
}

/// What rounding does to speeds adds up over the ticks of a pattern, and once more in positions.
fn rounding(spec: &LoopSpec) -> f64 {
    const UP_TO_1000_TICKS: f64 = 1e-9;
    let thousands = spec.ticks_per_pattern() as f64 / 1000.0;
    UP_TO_1000_TICKS * thousands.powi(2).max(1.0)
}

/// Whether no force ties the copies of some object to each other.
pub(crate) fn has_untied_copies(spec: &LoopSpec) -> bool {
    let parts = Ties::parts(spec);
    let mut seen: Vec<(Part, usize)> = Vec::new();
    spec.bodies.iter().enumerate().any(|(index, body)| {
        let Some(&Coordinate::Own { part: name @ Part::Object(_), .. }) = body.states.first() else {
            return false;
        };
        let part = parts.of(index);
        let is_apart = seen.iter().any(|&(other, its)| other == name && its != part);
        seen.push((name, part));
        is_apart
    })
}

impl Structure {
    /// Of a loop and its map.
    pub(crate) fn new(spec: &LoopSpec, layout: &Layout, map: &DMatrix<f64>) -> Self {
        let period_s = spec.schedule.control().period_s();
        let coasting: Vec<_> = spec.bodies.iter().map(|body| coasting(body, period_s)).collect();
        let mut structure = Self { rounding: rounding(spec), ..Self::default() };
        let parts = Ties::parts(spec);
        let groups = parts.groups();
        let (with_blocks, without): (Vec<_>, Vec<_>) =
            groups.iter().partition(|bodies| !parts.blocks_beside(bodies[0]).is_empty());
        let mut axes: Vec<Dof> = spec.bodies.iter().flat_map(|body| body.axes).copied().collect();
        axes.sort_unstable();
        axes.dedup();
        for axis in axes {
            let direction = Direction { spec, layout, coasting: &coasting, axis };
            let ties = Ties::along(spec, axis, &coasting);
            for part in &without {
                direction.part(&ties, part, &mut structure);
            }
        }
        for bodies in without {
            let part = TurningPart { spec, layout, coasting: &coasting, bodies };
            for (still, uniform) in part.pivots(&structure.still, map) {
                structure.dragged += usize::from(uniform.is_none());
                structure.rigid.push(still);
                structure.rigid.extend(uniform);
            }
        }
        for bodies in with_blocks {
            let blocks = parts.blocks_beside(bodies[0]);
            PartWithBlocks::new(spec, layout, &coasting, map, (bodies, blocks)).add_to(&mut structure);
        }
        structure
    }
}

/// Whether nothing of the members of a group can be moved and stay, without a force, but together with the same of all
/// members. `members` are their bodies, corresponding ones at the same place.
pub(crate) fn translates_only_with(spec: &LoopSpec, members: &[Vec<usize>]) -> bool {
    let period_s = spec.schedule.control().period_s();
    let coasting: Vec<_> = spec.bodies.iter().map(|body| coasting(body, period_s)).collect();
    let mut axes: Vec<Dof> = spec.bodies.iter().flat_map(|body| body.axes).copied().collect();
    axes.sort_unstable();
    axes.dedup();
    let parts = Ties::parts(spec);
    axes.into_iter().all(|axis| {
        let ties = Ties::along(spec, axis, &coasting);
        let number_of_members = members.first().map_or(0, Vec::len);
        let fixed = |body: &usize| ties.is_grounded(*body);
        (0..number_of_members).all(|place| {
            let alike = members.iter().map(|bodies| bodies[place]);
            alike.clone().all(|body| fixed(&body))
                || alike
                    .clone()
                    .zip(alike.skip(1))
                    .all(|(one, other)| ties.of(one) == ties.of(other) && parts.of(one) == parts.of(other))
        })
    })
}

/// One degree of freedom, of all bodies that have it.
struct Direction<'a> {
    spec: &'a LoopSpec,
    layout: &'a Layout,
    coasting: &'a [Vec<Coasting>],
    axis: Dof,
}

impl Direction<'_> {
    /// The vectors of one part.
    fn part(&self, ties: &Ties, part: &[usize], structure: &mut Structure) {
        let moving: Vec<usize> = part.iter().copied().filter(|&body| self.number(body).is_some()).collect();
        let grounded = moving.iter().any(|&body| ties.is_grounded(body));
        let mut free: Vec<usize> = moving.iter().map(|&body| ties.of(body)).collect();
        free.sort_unstable();
        free.dedup();
        free.retain(|&group| !ties.is_ground(group));
        let mut loose: Vec<_> = free.iter().map(|&group| self.translation(&moving, ties, group)).collect();
        if !grounded && let Some(whole) = loose.iter().cloned().reduce(|sum, group| sum + group) {
            loose.pop();
            structure.still.push(whole.clone());
            structure.rigid.push(whole);
            match self.uniform_motion(part) {
                Some(uniform) => structure.rigid.push(uniform),
                None => structure.dragged += 1,
            }
        }
        structure.still.extend(loose.iter().cloned());
        structure.loose.append(&mut loose);
    }

    /// Which of a body's degrees of freedom this is.
    fn number(&self, body: usize) -> Option<usize> {
        self.spec.bodies[body].axes.iter().position(|&axis| axis == self.axis)
    }

    /// All bodies of a group, and all samples of them, moved by 1 m.
    fn translation(&self, bodies: &[usize], ties: &Ties, group: usize) -> DVector<f64> {
        let mut vector = DVector::zeros(self.layout.coordinates.len());
        let moves = |body: usize| bodies.contains(&body) && ties.of(body) == group;
        for &body in bodies.iter().filter(|&&body| moves(body)) {
            let number = self.number(body).unwrap_or_default();
            for &(state, size) in self.coasting[body][number].still.iter().flatten() {
                vector[self.layout.bodies[body] + state] = size;
            }
        }
        for register in &self.layout.registers {
            if let Some(body) = self.spec.lines[register.line.0].signal.body()
                && moves(body.0)
                && let Some(number) = self.number(body.0)
            {
                (1..=register.length).for_each(|age| vector[register.place(age) + number] = 1.0);
            }
        }
        vector
    }

    /// The state in which every body of a part coasts at 1 m/s, where there is one.
    fn uniform_motion(&self, part: &[usize]) -> Option<DVector<f64>> {
        let spec = self.spec;
        let free = |&body: &usize| self.coasting[body].iter().all(|axis| axis.still.is_some());
        let coasts =
            |&body: &usize| self.number(body).is_some_and(|n| self.coasting[body][n].moving.is_some());
        if !part.iter().all(|body| free(body) && coasts(body)) {
            return None;
        }
        let offsets = self.offsets(part)?;
        let mut vector = DVector::zeros(self.layout.coordinates.len());
        for &body in part {
            let first = self.layout.bodies[body];
            for (number, axis) in self.coasting[body].iter().enumerate() {
                for &(state, size) in axis.still.iter().flatten() {
                    vector[first + state] += offsets.of(body, number) * size;
                }
            }
            let moving = self.number(body).and_then(|number| self.coasting[body][number].moving.as_ref());
            for &(state, size) in moving.into_iter().flatten() {
                vector[first + state] += size;
            }
        }
        let period_s = spec.schedule.control().period_s();
        for register in &self.layout.registers {
            for age in 1..=register.length {
                let place = register.place(age);
                match &spec.lines[register.line.0].signal {
                    Signal::Motion(body) | Signal::Position(body) if part.contains(&body.0) => {
                        let axes = spec.bodies[body.0].axes.len();
                        let since_s = tick_of_step(&spec.schedule, -i64::from(age)) as f64 * period_s;
                        for number in 0..axes {
                            vector[place + number] = offsets.of(body.0, number);
                        }
                        if let Some(number) = self.number(body.0) {
                            vector[place + number] += since_s;
                            if register.numbers > axes {
                                vector[place + axes + number] = 1.0;
                            }
                        }
                    }
                    Signal::Force(coupling) if is_of_part(spec, coupling, part) => {
                        let mut force = self.lag_force(coupling);
                        offsets.add_force(spec, coupling, &mut force);
                        vector.rows_mut(place, coupling.components).copy_from(&force);
                    }
                    Signal::Motion(_) | Signal::Position(_) | Signal::Force(_) => {}
                }
            }
        }
        Some(vector)
    }

    /// Offsets at which the forces on every body of a part are in balance, where there are some.
    fn offsets(&self, part: &[usize]) -> Option<Offsets> {
        let spec = self.spec;
        let acts = |body: usize| part.contains(&body);
        for line in &spec.lines {
            if let Signal::Force(coupling) = &line.signal
                && is_of_part(spec, coupling, part)
                && !self.is_steady(coupling, true)
            {
                return None;
            }
        }
        let mut offsets = Offsets::new(spec, part);
        let size = offsets.values.len();
        let (mut stiffness, mut lag_force) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for action in spec.actions.iter().filter(|action| acts(action.body.0)) {
            let coupling = spec.coupling_of(action)?;
            if matches!(action.force, Force::Gains(_)) && !self.is_steady(coupling, false) {
                return None;
            }
            let row = offsets.first[action.body.0];
            let mut rows = lag_force.rows_mut(row, coupling.components);
            rows -= self.lag_force(coupling);
            for term in &coupling.terms {
                if let Some(column) = offsets.place(spec, term.motion, term.number) {
                    stiffness[(row + term.component, column)] += term.gain;
                }
            }
        }
        offsets.values = solve_balance(stiffness, &lag_force)?;
        Some(offsets)
    }

    /// Whether, in uniform motion, a force is the same at every tick: no damper to the ground, and ages of samples that
    /// keep their differences.
    fn is_steady(&self, coupling: &ForceGains, at_steps: bool) -> bool {
        /// Gains that cancel but for rounding.
        const RELATIVE: f64 = 1e-13;
        let mut net = vec![(0.0, 0.0_f64); coupling.components];
        let mut motions: Vec<Motion> = Vec::new();
        for term in &coupling.terms {
            let axes = self.spec.axes_of(term.motion);
            if axes.get(term.number % axes.len().max(1)) != Some(&self.axis) {
                continue;
            }
            if term.number >= axes.len() {
                let (sum, largest) = &mut net[term.component];
                *sum += term.gain;
                *largest = largest.max(term.gain.abs());
            } else if !motions.contains(&term.motion) {
                motions.push(term.motion);
            }
        }
        if net.iter().any(|&(sum, largest): &(f64, f64)| sum.abs() > RELATIVE * largest) {
            return false;
        }
        let Some(&first) = motions.first() else { return true };
        let schedule = &self.spec.schedule;
        let ticks =
            (0..schedule.ticks_per_pattern()).filter(|&tick| !at_steps || schedule.step_at(tick).is_some());
        let lag = |motion, tick| self.age(motion, tick) - self.age(first, tick);
        let mut later = ticks.flat_map(|tick| motions.iter().map(move |&motion| (motion, tick as i64)));
        later.all(|(motion, tick)| lag(motion, tick) == lag(motion, 0))
    }

    /// In uniform motion at equal offsets: what a force is because its motions are of different ages.
    fn lag_force(&self, coupling: &ForceGains) -> DVector<f64> {
        let period_s = self.spec.schedule.control().period_s();
        let mut force = DVector::zeros(coupling.components);
        let mut first = None;
        for term in &coupling.terms {
            let axes = self.spec.axes_of(term.motion);
            if axes.get(term.number) == Some(&self.axis) {
                let age = self.age(term.motion, 0);
                let lag = age - *first.get_or_insert(age);
                force[term.component] -= term.gain * lag as f64 * period_s;
            }
        }
        force
    }

    /// Ticks since what is read at `tick` was sampled.
    fn age(&self, motion: Motion, tick: i64) -> i64 {
        match motion {
            Motion::Held(line) => {
                let (schedule, delay) = (&self.spec.schedule, self.spec.lines[line.0].delay);
                tick - tick_of_step(schedule, delay.step_held_at(schedule, tick))
            }
            Motion::Ground | Motion::Current(_) | Motion::Output(_) => 0,
        }
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
    let offsets = SingularValues::of(&stiffness)?.solve(lag_force, threshold);
    let is_balanced = (stiffness * &offsets - lag_force).amax() <= RELATIVE * scale;
    is_balanced.then_some(offsets)
}
