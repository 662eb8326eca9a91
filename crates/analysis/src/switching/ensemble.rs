//! Many trajectories of one session side by side, contacts opening and closing in each by themselves.
//!
//! The loop between contacts is stepped by the same program that lifts it; contacts follow the running law of
//! [`cotouch_world::touch_plane`].

use cotouch_world::{ContactState, Phase};
use glam::DVec3;

use crate::compile::{Affected, OneSidedContact, OneSidedLoop};
use crate::lift::layout::{Layout, Registers};
use crate::lift::program::Program;
use crate::lift::rows::Rows;
use crate::lift::stepping::{Outside, Run};
use crate::loop_spec::{BodyId, Dynamics, LoopSpec, Signal};

use super::fast_force::{FastForce, Strength};

/// Trajectories, a column each.
pub(super) struct Ensemble {
    program: Program,
    pub(super) layout: Layout,
    run: Run,
    origins: Vec<Option<(BodyId, usize)>>,
    acting: Acting,
}

impl Ensemble {
    /// So many trajectories with those of the session's `contacts` that are named by their places.
    pub(super) fn new(session: &OneSidedLoop, contacts: &[usize], columns: usize) -> Self {
        let spec = &session.spec;
        // Forces that go back to clients are nothing but what acts from outside: lines must not share their registers.
        let layout = Layout::new(spec, Registers::PerReceiver);
        let contacts: Vec<&OneSidedContact> = contacts.iter().map(|&at| &session.contacts[at]).collect();
        let motions: Vec<_> = contacts.iter().map(|contact| contact.motion.clone()).collect();
        let program = Program::observing(spec, &layout, &motions);
        let mut run = Run::default();
        run.start(&program, columns);
        let acting = Acting::new(session, &contacts, (&program, &layout), columns);
        Self { origins: origins(spec, &layout), program, layout, run, acting }
    }

    /// Multiplications and additions of a tick of a trajectory.
    pub(super) fn work(&self) -> usize {
        /// What one contact takes more than its sums.
        const OF_A_CONTACT: usize = 150;
        self.program.work() + OF_A_CONTACT * self.acting.contacts.len()
    }

    /// Starts every trajectory: `motion(body, number, column)` is where a body is and how fast, as it was for as long as samples
    /// remember.
    pub(super) fn start(&mut self, motion: impl Fn(BodyId, usize, usize) -> f64) {
        let origins = &self.origins;
        self.run.visit_states(&self.program, &mut |place, row| {
            for (column, value) in row.iter_mut().enumerate() {
                *value = origins[place].map_or(0.0, |(body, number)| motion(body, number, column));
            }
        });
    }

    /// Adds constant forces, such as weights, to those on bodies.
    pub(super) fn weigh_down(&mut self, body: BodyId, component: usize, force_n: f64) {
        self.acting.weights.push((self.program.force_on(body) + component, force_n));
    }

    /// What a user's hand does from now on: along each axis (N), for each trajectory.
    pub(super) fn push_with(&mut self, hand: usize) -> &mut [Vec<f64>] {
        let axes = self.acting.axes;
        &mut self.acting.pushes[hand * axes..(hand + 1) * axes]
    }

    /// A linear function of the state between two patterns, of every trajectory: weights by places in the layout.
    pub(super) fn project(&mut self, weights: &[f64], onto: &mut [f64]) {
        onto.fill(0.0);
        self.run.visit_states(&self.program, &mut |place, row| {
            if weights[place] != 0.0 {
                for (sum, &value) in onto.iter_mut().zip(&*row) {
                    *sum += weights[place] * value;
                }
            }
        });
    }

    /// Every number of the state between two patterns, by its place in the layout.
    #[cfg(test)]
    pub(super) fn visit(&mut self, act: &mut dyn FnMut(usize, &mut [f64])) {
        self.run.visit_states(&self.program, act);
    }

    /// Until another call, a hand also does this (N) and its opposite in turns in one trajectory: so often (Hz), and from that share
    /// of a turn on.
    pub(super) fn swing(&mut self, hand: usize, column: usize, force: DVec3, (hz, phase): (f64, f64)) {
        self.acting.swings.push(Swing { hand, column, force, hz, phase });
    }

    pub(super) fn stop_swinging(&mut self) {
        self.acting.swings.clear();
    }

    /// One pattern.
    pub(super) fn advance(&mut self) {
        self.run.advance(&self.program, &mut self.acting);
    }

    /// From now on fingers' forces are observed.
    pub(super) fn observe(&mut self) {
        let columns = self.acting.force[0].len();
        self.acting.observed = Some(FastForce::new(self.acting.pushes.len(), columns, self.acting.period_s));
    }

    /// Of a hand's rendered force above 8 Hz since the last block, which had so many ticks; nothing before it is observed.
    pub(super) fn strength(&self, hand: usize, column: usize, ticks: u64) -> Strength {
        let axes = self.acting.axes;
        let of = |observed: &FastForce| observed.strength(hand * axes, axes, column, ticks);
        self.acting.observed.as_ref().map(of).unwrap_or_default()
    }

    pub(super) fn end_block(&mut self) {
        if let Some(observed) = &mut self.acting.observed {
            observed.end_block();
        }
    }
}

/// Where each number of the state comes from: which body's, and which of its positions and velocities; none for what starts at
/// zero.
fn origins(spec: &LoopSpec, layout: &Layout) -> Vec<Option<(BodyId, usize)>> {
    let mut origins = vec![None; layout.coordinates.len()];
    for (index, (body, &first)) in spec.bodies.iter().zip(&layout.bodies).enumerate() {
        let axes = body.axes.len();
        for (state, origin) in origins[first..first + body.states.len()].iter_mut().enumerate() {
            // After a plant's own states a sensor remembers the positions and the velocities of the last tick.
            let number = match &body.dynamics {
                Dynamics::Sensed { plant, .. } if state >= plant.a.nrows() => state - plant.a.nrows(),
                _ => state,
            };
            *origin = (number < 2 * axes).then_some((BodyId(index), number));
        }
    }
    for register in &layout.registers {
        if let Signal::Motion(body) | Signal::Position(body) = spec.lines[register.line.0].signal {
            for age in 1..=register.length {
                for number in 0..register.numbers {
                    origins[register.place(age) + number] = Some((body, number));
                }
            }
        }
    }
    origins
}

/// What acts on the loop: contacts and users.
struct Acting {
    /// In which points move.
    axes: usize,
    contacts: Vec<PlacedContact>,
    /// Forces on all spheres at one contact, world: x, y, z.
    force: [Vec<f64>; 3],
    /// Constant forces, by row.
    weights: Vec<(usize, f64)>,
    /// The first row of the force on each hand.
    hands: Vec<usize>,
    /// For each hand and axis, for each trajectory, N.
    pushes: Vec<Vec<f64>>,
    swings: Vec<Swing>,
    tick: u64,
    period_s: f64,
    observed: Option<FastForce>,
}

/// A force that changes sign in a rhythm.
struct Swing {
    hand: usize,
    column: usize,
    force: DVec3,
    hz: f64,
    phase: f64,
}

impl Swing {
    /// 1 or −1.
    fn sign(&self, time_s: f64) -> f64 {
        if (time_s * self.hz + self.phase).fract() < 0.5 { 1.0 } else { -1.0 }
    }
}

/// A contact, its states in all trajectories, and the rows that it acts on.
struct PlacedContact {
    contact: OneSidedContact,
    states: Vec<ContactState>,
    effects: Vec<(usize, DVec3)>,
}

impl Acting {
    fn new(
        session: &OneSidedLoop,
        contacts: &[&OneSidedContact],
        (program, layout): (&Program, &Layout),
        columns: usize,
    ) -> Self {
        let row = |on: Affected| match on {
            Affected::Body(body) => Some(program.force_on(body)),
            Affected::Sample(line) => program.sampled_by(layout, line),
        };
        let place = |contact: &&OneSidedContact| {
            let effects = contact.effects.iter();
            PlacedContact {
                contact: (*contact).clone(),
                states: vec![ContactState::default(); columns],
                effects: effects
                    .filter_map(|effect| Some((row(effect.on)? + effect.component, effect.gain)))
                    .collect(),
            }
        };
        let hands: Vec<BodyId> = session.hands.iter().flatten().copied().collect();
        let axes = hands.first().map_or(0, |hand| session.spec.bodies[hand.0].axes.len());
        Self {
            axes,
            contacts: contacts.iter().map(place).collect(),
            force: std::array::from_fn(|_| vec![0.0; columns]),
            weights: Vec::new(),
            pushes: vec![vec![0.0; columns]; axes * hands.len()],
            hands: hands.into_iter().map(|hand| program.force_on(hand)).collect(),
            swings: Vec::new(),
            tick: 0,
            period_s: session.spec.schedule.control().period_s(),
            observed: None,
        }
    }
}

impl Outside for Acting {
    fn act(&mut self, observed: &Rows, acting: &mut Rows) {
        for (index, contact) in self.contacts.iter_mut().enumerate() {
            let motion = |number: usize| observed.row(index * 2 * self.axes + number);
            if contact.touch(self.axes, motion, &mut self.force) {
                for &(row, gain) in &contact.effects {
                    add_effect(acting.row_mut(row), gain, &self.force);
                }
            }
        }
        for &(row, force_n) in &self.weights {
            acting.row_mut(row).iter_mut().for_each(|value| *value += force_n);
        }
    }

    fn push(&mut self, forces: &mut Rows) {
        for (hand, &first) in self.hands.iter().enumerate() {
            for axis in 0..self.axes {
                let row = hand * self.axes + axis;
                let forces = forces.row_mut(first + axis);
                if let Some(observed) = &mut self.observed {
                    observed.observe(row, forces);
                }
                for (force, &push) in forces.iter_mut().zip(&self.pushes[row]) {
                    *force += push;
                }
            }
        }
        let time_s = self.tick as f64 * self.period_s;
        for swing in &self.swings {
            for axis in 0..self.axes {
                let force = forces.row_mut(self.hands[swing.hand] + axis);
                force[swing.column] += swing.sign(time_s) * swing.force[axis];
            }
        }
        self.tick += 1;
        if let Some(observed) = &mut self.observed {
            observed.end_tick();
        }
    }
}

impl PlacedContact {
    /// The forces on the spheres of all trajectories; false where none of them touches.
    fn touch<'a>(
        &mut self,
        axes: usize,
        motion: impl Fn(usize) -> &'a [f64],
        force: &mut [Vec<f64>; 3],
    ) -> bool {
        let normal = self.contact.normal;
        let mut touches = false;
        for (column, state) in self.states.iter_mut().enumerate() {
            let vector = |first: usize| {
                let component = |axis: usize| if axis < axes { motion(first + axis)[column] } else { 0.0 };
                DVec3::new(component(0), component(1), component(2))
            };
            let place = vector(0);
            // What is apart, and was, is most of what there is.
            let on_sphere = if place.dot(normal) >= 0.0 && state.phase == Phase::Free {
                DVec3::ZERO
            } else {
                touches = true;
                self.contact.force(state, place, vector(axes))
            };
            for (axis, forces) in force.iter_mut().enumerate() {
                forces[column] = on_sphere[axis];
            }
        }
        touches
    }
}

fn add_effect(target: &mut [f64], gain: DVec3, force: &[Vec<f64>; 3]) {
    for (axis, forces) in force.iter().enumerate().filter(|&(axis, _)| gain[axis] != 0.0) {
        for (value, &force) in target.iter_mut().zip(forces) {
            *value += gain[axis] * force;
        }
    }
}
