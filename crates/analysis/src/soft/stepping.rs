//! One pattern of the soft loop, tick by tick, on all columns of the identity at once.
//!
//! Every number is a row: its dependence on the state at the start of the pattern. The order of events is that of the
//! running hosts.

use std::collections::VecDeque;

use cotouch_scene::scene::{LocalModelKind, ReturnedForce, SurfaceHold};
use nalgebra::DMatrix;

use super::layout::Layout;
use super::{SoftLoop, Touch, Way, World};
use crate::discretise::Step;

/// Numbers, one a row, as functions of the state at the start.
type Rows = DMatrix<f64>;

/// The exact map of the state over one pattern.
pub(super) fn lift(of: &SoftLoop, layout: &Layout) -> DMatrix<f64> {
    lift_over(of, layout, of.ticks_per_pattern())
}

/// The same over a multiple of a pattern.
pub(super) fn lift_over(of: &SoftLoop, layout: &Layout, ticks: u64) -> DMatrix<f64> {
    let mut run = Run::at_identity(of, layout);
    for tick in 0..ticks {
        run.tick(tick);
    }
    run.stacked()
}

/// The loop on its way through a pattern.
struct Run<'a> {
    of: &'a SoftLoop,
    layout: &'a Layout,
    /// Of every hand over a tick.
    steps: Vec<Step>,
    hands: Vec<Rows>,
    /// Positions of fingers, of every register.
    samples: Vec<Samples>,
    /// Forces that the server sends back, one entry a contact of the first world.
    sent: Vec<Option<Samples>>,
    worlds: Vec<WorldState>,
}

/// Samples of one signal.
struct Samples {
    /// Newest first.
    values: VecDeque<Rows>,
    /// The network step of the newest.
    newest: i64,
    /// How many are part of the state.
    kept: u32,
}

struct WorldState {
    /// (1/K_h + W)⁻¹, where contacts share their forces.
    sharing: Option<Rows>,
    /// Of every contact, along its normal.
    integrals: Rows,
    body: Rows,
    /// Newest first.
    frames: VecDeque<Frame>,
    /// The period of the newest.
    newest: i64,
    /// On all fingers that touch, of this tick (of `hold`: of the period's first tick), 3m rows.
    forces: Rows,
    /// What the present period returns, so far, 3m rows.
    returned: Rows,
}

/// A body after a period, as the contacts of a host see it.
struct Frame {
    /// How far each contact is from rest, 3m rows.
    surface: Rows,
    /// The forces on the body with which it was stepped, 3m rows.
    forces: Rows,
}

/// Hands out the rows of the identity, one block after the other.
struct Identity {
    next: usize,
    size: usize,
}

impl Identity {
    fn rows(&mut self, count: usize) -> Rows {
        let first = self.next;
        self.next += count;
        Rows::from_fn(count, self.size, |row, column| f64::from(u8::from(first + row == column)))
    }
}

/// Where a tick lies in its slow period.
#[derive(Clone, Copy)]
struct Place {
    period: i64,
    /// From 0.
    tick: u64,
    /// N.
    ticks: u64,
}

impl<'a> Run<'a> {
    /// In the order of [`Layout`].
    fn at_identity(of: &'a SoftLoop, layout: &'a Layout) -> Self {
        let period_s = of.network.control().period_s();
        let mut identity = Identity { next: 0, size: layout.size() };
        let hands = of.hands.iter().map(|hand| identity.rows(hand.body.states.len())).collect();
        let registers = layout.registers.iter();
        let samples = registers
            .map(|register| {
                let numbers = of.hands[register.hand].body.axes.len();
                Samples::at_identity(register.length, numbers, &mut identity)
            })
            .collect();
        let touches = of.worlds[0].touches.iter();
        let sent = touches
            .map(|touch| {
                let (delay, numbers) = (touch.force_back?, of.hands[touch.hand].body.axes.len());
                Some(Samples::at_identity(delay.samples(&of.network), numbers, &mut identity))
            })
            .collect();
        let worlds =
            of.worlds.iter().map(|world| WorldState::at_identity(of, world, &mut identity)).collect();
        let steps = of.hands.iter().map(|hand| Step::new(&hand.body, period_s)).collect();
        Self { of, layout, steps, hands, samples, sent, worlds }
    }

    fn tick(&mut self, tick: u64) {
        let network_step = self.of.network.step_at(tick).map(|step| step as i64);
        if let Some(step) = network_step {
            self.sample_fingers(step);
        }
        let place = self.of.place_in_period(tick);
        for index in 0..self.worlds.len() {
            let fingers = self.fingers(index, tick);
            self.worlds[index].local_models(self.of, &self.of.worlds[index], &fingers, place);
        }
        if let Some(step) = network_step {
            self.send_forces(step);
        }
        self.step_hands(tick);
        for (state, world) in self.worlds.iter_mut().zip(&self.of.worlds) {
            state.return_forces(self.of, world, place);
        }
    }

    fn position(&self, hand: usize) -> Rows {
        self.steps[hand].c.rows(0, self.of.hands[hand].body.axes.len()) * &self.hands[hand]
    }

    fn sample_fingers(&mut self, step: i64) {
        for index in 0..self.samples.len() {
            let position = self.position(self.layout.registers[index].hand);
            self.samples[index].take(step, position);
        }
    }

    /// Where every contact's finger is for a world, 3m rows.
    fn fingers(&self, world: usize, tick: u64) -> Rows {
        let touches = &self.of.worlds[world].touches;
        let mut fingers = Rows::zeros(3 * touches.len(), self.layout.size());
        for (contact, touch) in touches.iter().enumerate() {
            let position = match (touch.way, self.layout.register_of(world, touch.hand)) {
                (Way::Samples(delay), Some(register)) => {
                    let step = delay.step_held_at(&self.of.network, tick as i64);
                    self.samples[register].of_step(step).clone()
                }
                _ => self.position(touch.hand),
            };
            for (row, dof) in self.of.hands[touch.hand].body.axes.iter().enumerate() {
                fingers.row_mut(3 * contact + dof.axis().index()).copy_from(&position.row(row));
            }
        }
        fingers
    }

    /// The force on the finger of a contact, along the axes on which it moves.
    fn force_on_finger(&self, world: usize, contact: usize) -> Rows {
        let touch = &self.of.worlds[world].touches[contact];
        let rows = self.of.hands[touch.hand].body.axes.iter().map(|dof| 3 * contact + dof.axis().index());
        self.worlds[world].forces.select_rows(&rows.collect::<Vec<_>>())
    }

    fn send_forces(&mut self, step: i64) {
        for contact in 0..self.sent.len() {
            let force = self.force_on_finger(0, contact);
            if let Some(samples) = &mut self.sent[contact] {
                samples.take(step, force);
            }
        }
    }

    /// Every hand over the tick, under the forces on it.
    fn step_hands(&mut self, tick: u64) {
        let mut forces: Vec<Rows> = (0..self.hands.len()).map(|hand| self.damping_force(hand)).collect();
        for (index, world) in self.of.worlds.iter().enumerate() {
            for (contact, touch) in world.touches.iter().enumerate() {
                match (self.sent.get(contact).filter(|_| index == 0), touch) {
                    (Some(Some(sent)), Touch { force_back: Some(delay), .. }) => {
                        let step = delay.step_held_at(&self.of.network, tick as i64);
                        forces[touch.hand] += sent.of_step(step);
                    }
                    (_, Touch { way: Way::Own, .. }) => {
                        forces[touch.hand] += self.force_on_finger(index, contact);
                    }
                    _ => {}
                }
            }
        }
        for ((hand, step), force) in self.hands.iter_mut().zip(&self.steps).zip(forces) {
            *hand = &step.a * &*hand + &step.b * force;
        }
    }

    /// What the governor brakes a hand with.
    fn damping_force(&self, hand: usize) -> Rows {
        let axes = self.of.hands[hand].body.axes.len();
        let velocity = self.steps[hand].c.rows(axes, axes) * &self.hands[hand];
        velocity * -self.of.hands[hand].damping_n_s_per_m
    }

    /// The state at the end, in the order of [`Layout`].
    fn stacked(&self) -> DMatrix<f64> {
        let mut blocks: Vec<&Rows> = self.hands.iter().collect();
        blocks.extend(self.samples.iter().chain(self.sent.iter().flatten()).flat_map(Samples::kept));
        for (state, world) in self.worlds.iter().zip(&self.of.worlds) {
            blocks.extend([&state.integrals, &state.body]);
            let shown = usize::from(world.body.shown.is_some());
            let frames = state.frames.iter().take(self.of.frames() as usize);
            blocks.extend(frames.skip(shown).map(|frame| &frame.surface));
            let stepped = state.frames.iter().take(self.of.frames_with_forces() as usize);
            blocks.extend(stepped.map(|frame| &frame.forces));
        }
        let mut map = DMatrix::zeros(self.layout.size(), self.layout.size());
        let mut first = 0;
        for block in blocks {
            map.rows_mut(first, block.nrows()).copy_from(block);
            first += block.nrows();
        }
        debug_assert_eq!(first, self.layout.size(), "the state at the end is that at the start");
        map
    }
}

impl Samples {
    fn at_identity(kept: u32, numbers: usize, identity: &mut Identity) -> Self {
        Self { values: (0..kept).map(|_| identity.rows(numbers)).collect(), newest: -1, kept }
    }

    fn take(&mut self, step: i64, value: Rows) {
        self.values.push_front(value);
        self.values.truncate(self.kept as usize + 1);
        self.newest = step;
    }

    fn of_step(&self, step: i64) -> &Rows {
        &self.values[(self.newest - step) as usize]
    }

    fn kept(&self) -> impl Iterator<Item = &Rows> {
        self.values.iter().take(self.kept as usize)
    }
}

impl WorldState {
    fn at_identity(of: &SoftLoop, world: &World, identity: &mut Identity) -> Self {
        let (contacts, size) = (world.touches.len(), identity.size);
        let integrals = if of.kind == LocalModelKind::Pi { contacts } else { 0 };
        let integrals = identity.rows(integrals);
        let body = identity.rows(world.body.a.nrows());
        let mut surfaces: Vec<Rows> = world.body.shown.iter().map(|shown| shown * &body).collect();
        let independent = of.frames() as usize - surfaces.len();
        surfaces.extend((0..independent).map(|_| identity.rows(3 * contacts)));
        let frames = surfaces.into_iter().enumerate().map(|(age, surface)| {
            let has_forces = age < of.frames_with_forces() as usize;
            let forces =
                if has_forces { identity.rows(3 * contacts) } else { Rows::zeros(3 * contacts, size) };
            Frame { surface, forces }
        });
        let frames = frames.collect();
        let zeros = Rows::zeros(3 * contacts, size);
        let sharing = world.sharing(of.kind);
        Self { sharing, integrals, body, frames, newest: -1, forces: zeros.clone(), returned: zeros }
    }

    fn frame(&self, period: i64) -> &Frame {
        &self.frames[(self.newest - period) as usize]
    }

    /// The surface in use, and the forces with which the frame was stepped that it comes from.
    fn in_use(&self, of: &SoftLoop, place: Place) -> (Rows, Rows) {
        let period = place.period - 1 - i64::from(of.result_delay_periods);
        let now = self.frame(period);
        match of.hold {
            SurfaceHold::Zero => (now.surface.clone(), now.forces.clone()),
            SurfaceHold::First => {
                let (share, before) = (place.tick as f64 / place.ticks as f64, self.frame(period - 1));
                (&now.surface * share + &before.surface * (1.0 - share), now.forces.clone())
            }
        }
    }

    /// Forces on all fingers that touch this tick; integrals go on.
    fn local_models(&mut self, of: &SoftLoop, world: &World, fingers: &Rows, place: Place) {
        if of.kind == LocalModelKind::Hold && place.tick > 0 {
            return;
        }
        let (surface, stepped_with) = self.in_use(of, place);
        let error = surface - fingers;
        match (&self.sharing, &world.compliance) {
            (Some(sharing), Some(compliance)) => {
                self.forces = sharing * (&error - compliance * stepped_with);
            }
            _ => {
                self.forces = error.clone();
                for (row, mut force) in self.forces.row_iter_mut().enumerate() {
                    force *= world.kh_n_per_m[row / 3];
                }
            }
        }
        for row in (0..self.forces.nrows()).filter(|row| of.idle_axes[row % 3]) {
            self.forces.row_mut(row).fill(0.0);
        }
        if of.kind == LocalModelKind::Pi {
            for (contact, touch) in world.touches.iter().enumerate() {
                let per_tick = world.int_n_per_m[contact] / place.ticks as f64;
                let normal = touch.normal.to_array();
                for (axis, along) in normal.into_iter().enumerate() {
                    let integral = self.integrals.row(contact) * along;
                    let mut force = self.forces.row_mut(3 * contact + axis);
                    force += integral;
                }
                for (axis, along) in normal.into_iter().enumerate() {
                    let mut integral = self.integrals.row_mut(contact);
                    integral += error.row(3 * contact + axis) * (along * per_tick);
                }
            }
        }
    }

    /// The simulation's share of this tick's forces, and its step when all that it needs is known.
    fn return_forces(&mut self, of: &SoftLoop, world: &World, place: Place) {
        let last = place.tick + 1 == place.ticks;
        let (weight, is_complete) = match of.returned_force {
            ReturnedForce::First => (f64::from(u8::from(place.tick == 0)), place.tick == 0),
            ReturnedForce::Mean => ((place.ticks as f64).recip(), last),
            ReturnedForce::Last => (f64::from(u8::from(last)), last),
        };
        if weight > 0.0 {
            self.returned -= &self.forces * weight;
        }
        if is_complete {
            let zeros = Rows::zeros(self.returned.nrows(), self.returned.ncols());
            let forces = std::mem::replace(&mut self.returned, zeros);
            let body = &world.body;
            let surface = &body.c * &self.body + &body.d * &forces;
            self.body = &body.a * &self.body + &body.b * &forces;
            self.frames.push_front(Frame { surface, forces });
            self.frames.truncate(of.frames() as usize + 1);
            self.newest = place.period;
        }
    }
}

impl SoftLoop {
    fn place_in_period(&self, tick: u64) -> Place {
        let period = self.slow.last_step_at(tick);
        let (first, next) = (self.slow.tick_of_step(period), self.slow.tick_of_step(period + 1));
        Place { period: period as i64, tick: tick - first, ticks: next - first }
    }
}
