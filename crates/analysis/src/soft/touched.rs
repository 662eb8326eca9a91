//! Hosts, fingers and a soft body that they touch, as a loop.

use cotouch_scene::names::{Axis, Coordinate, HostIndex, Part};
use cotouch_scene::scene::{ReturnedForce, SurfaceHold};
use cotouch_scene::time::Schedule;
use cotouch_world::LinearBlock;
use cotouch_world::local::LawState;
use nalgebra::DMatrix;

use super::local_laws::{HostLaw, ticks_of_periods, without_repetition};
use super::slow_body::SlowBody;
use crate::loop_spec::{
    AppliedForce, Block, BlockId, BodyId, Delay, ForceGains, Hold, Line, LineId, LoopSpec, Motion, Signal,
    Term,
};

/// A finger slot.
#[derive(Clone, Copy)]
pub(super) struct Finger {
    pub(super) user: HostIndex,
    /// Which of the user's fingers.
    pub(super) finger: u8,
}

/// Everything that makes such a loop.
pub(super) struct Touched<'a> {
    /// The fingers that touch, with their places among the loop's bodies.
    pub(super) touching: Vec<(usize, Finger)>,
    /// The hosts that have a body: all of them, or the server, which sends forces back to other hosts' fingers.
    pub(super) hosts: Vec<HostIndex>,
    /// Of samples from one host to another.
    pub(super) delay: Box<dyn Fn(HostIndex, HostIndex) -> Delay + 'a>,
    /// Which tick begins which period of the slow simulation.
    pub(super) slow: Schedule,
    pub(super) returned_force: ReturnedForce,
    pub(super) hold: SurfaceHold,
    pub(super) result_delay_periods: u32,
    /// Seen from the fingers that touch.
    pub(super) body: &'a SlowBody,
    pub(super) law: HostLaw,
    /// Axes of the world along which nothing acts.
    pub(super) idle_axes: [bool; 3],
    /// The fingers, and what else acts on them.
    pub(super) spec: LoopSpec,
}

impl Touched<'_> {
    /// How a host knows where a finger that touches is.
    pub(super) fn finger(&mut self, host: HostIndex, contact: usize) -> Motion {
        let (slot, Finger { user, finger }) = self.touching[contact];
        if user == host {
            return Motion::Current(BodyId(slot));
        }
        let (part, signal) = (Part::Hand(finger), Signal::Position(BodyId(slot)));
        let line = Line { host, from: user, part, signal, delay: (self.delay)(user, host) };
        Motion::Held(self.spec.line(line))
    }

    /// Which of its body's numbers is a coordinate of the fingers that touch, three a contact; nothing where it cannot move.
    pub(super) fn number(&self, row: usize) -> Option<usize> {
        let (slot, _) = self.touching[row / 3];
        self.spec.bodies[slot].axes.iter().position(|dof| dof.axis().index() == row % 3)
    }

    /// Which of the contacts are with fingers of a host.
    pub(super) fn own_contacts(&self, host: HostIndex) -> impl Iterator<Item = usize> {
        let contacts = self.touching.iter().enumerate();
        contacts.filter(move |(_, (_, finger))| finger.user == host).map(|(contact, _)| contact)
    }

    /// Whether the law reads the forces with which the frame in use was made.
    pub(super) fn reads_stepped_forces(&self) -> bool {
        self.law.direct.ncols() > self.law.direct.nrows()
    }
}

/// The loop.
pub(super) fn touched_body(of: Touched<'_>) -> LoopSpec {
    Session { of, worlds: Vec::new() }.compiled()
}

/// A loop that is being written down.
struct Session<'a> {
    of: Touched<'a>,
    worlds: Vec<World>,
}

/// A host's copy of the body.
struct World {
    host: HostIndex,
    /// How this host knows where each finger that touches is.
    fingers: Vec<Motion>,
    integral: BlockId,
    held: BlockId,
    body: BlockId,
    stepped: BlockId,
}

impl Session<'_> {
    fn compiled(mut self) -> LoopSpec {
        self.add_worlds();
        let forces = self.forces_on_fingers();
        for world in std::mem::take(&mut self.worlds) {
            self.add_blocks(&world);
        }
        self.of.spec.actions.extend(forces);
        self.of.spec
    }

    /// Where the bodies are, where their fingers are known from, and which places their blocks will have.
    fn add_worlds(&mut self) {
        let mut next = 0;
        let mut place = |exists: bool| {
            next += usize::from(exists);
            BlockId(next - usize::from(exists))
        };
        for host in self.of.hosts.clone() {
            let fingers = (0..self.of.touching.len()).map(|contact| self.of.finger(host, contact)).collect();
            let integral = place(self.of.law.state.is_some());
            let held = place(self.of.law.held);
            let (body, stepped) = (place(true), place(self.of.reads_stepped_forces()));
            self.worlds.push(World { host, fingers, integral, held, body, stepped });
        }
    }

    /// On own fingers, and sent back to those of others where one host has the only body.
    fn forces_on_fingers(&mut self) -> Vec<AppliedForce> {
        let mut forces = LoopSpec::new(self.of.spec.schedule);
        for index in 0..self.worlds.len() {
            for (contact, &(slot, Finger { user, finger })) in self.of.touching.clone().iter().enumerate() {
                let host = self.worlds[index].host;
                let axes = self.of.spec.bodies[slot].axes;
                let mut force = ForceGains::new(axes.len());
                for (component, dof) in axes.iter().enumerate() {
                    let row = 3 * contact + dof.axis().index();
                    self.add_force(&mut force, component, &self.worlds[index], row, 1.0);
                }
                if user == host {
                    forces.act(BodyId(slot), force);
                } else if !self.of.hosts.contains(&user) {
                    let line = self.send_back(host, user, finger, force);
                    forces.apply_held(BodyId(slot), line);
                }
            }
        }
        forces.actions
    }

    fn send_back(&mut self, server: HostIndex, client: HostIndex, finger: u8, force: ForceGains) -> LineId {
        self.of.spec.line(Line {
            host: client,
            from: server,
            part: Part::Force(finger),
            signal: Signal::Force(force),
            delay: (self.of.delay)(server, client),
        })
    }

    /// Adds row `row` of the forces on the fingers that touch, three rows a contact, `scale` times.
    fn add_force(&self, to: &mut ForceGains, component: usize, world: &World, row: usize, scale: f64) {
        if self.of.law.state.is_some() {
            let motion = Motion::Output(world.integral);
            to.terms.push(Term { component, motion, number: row, gain: scale });
        }
        if self.of.idle_axes[row % 3] {
            return;
        }
        if self.of.law.held {
            let motion = Motion::Output(world.held);
            to.terms.push(Term { component, motion, number: row, gain: scale });
        } else {
            self.add_direct(to, component, world, row, scale);
        }
    }

    fn add_direct(&self, to: &mut ForceGains, component: usize, world: &World, row: usize, scale: f64) {
        let rows = self.of.law.direct.nrows();
        for (column, &gain) in
            self.of.law.direct.row(row).iter().enumerate().filter(|(_, gain)| **gain != 0.0)
        {
            if column < rows {
                self.add_error(to, component, world, column, scale * gain);
            } else {
                let motion = Motion::Output(world.stepped);
                to.terms.push(Term { component, motion, number: column - rows, gain: scale * gain });
            }
        }
    }

    /// Surface minus finger.
    fn add_error(&self, to: &mut ForceGains, component: usize, world: &World, row: usize, gain: f64) {
        let surface = Motion::Output(world.body);
        to.terms.push(Term { component, motion: surface, number: row, gain });
        if let Some(number) = self.of.number(row) {
            let motion = world.fingers[row / 3];
            to.terms.push(Term { component, motion, number, gain: -gain });
        }
    }

    fn add_blocks(&mut self, world: &World) {
        let slow = self.of.slow;
        let (host, rows) = (world.host, 3 * self.of.touching.len());
        let slots: Vec<u8> = self.of.touching.iter().map(|&(slot, _)| slot as u8).collect();
        let later = |body: bool| Delay::periods(u32::from(body) + self.of.result_delay_periods);
        if let Some((law, weights)) = self.of.law.state.clone() {
            let mut error = ForceGains::new(rows);
            (0..rows).for_each(|row| self.add_error(&mut error, row, world, row, 1.0));
            let coordinate = |slot: u8, name: LawState| match name {
                LawState::Integral => Coordinate::Integral { host, slot },
                LawState::Memory(number) => Coordinate::LawMemory { host, slot, number },
            };
            let names = self.of.law.names.iter();
            let states =
                slots.iter().flat_map(|&slot| names.clone().map(move |&name| coordinate(slot, name)));
            let states = states.collect();
            let ticks = every_tick(&slow);
            self.of.spec.block(Block { states, weights, ..Block::sampled(ticks, error, law, Delay::NONE) });
        }
        if self.of.law.held {
            let mut error = ForceGains::new(rows);
            (0..rows).for_each(|row| self.add_error(&mut error, row, world, row, 1.0));
            let law = LinearBlock::gain(self.of.law.direct.clone());
            self.of.spec.block(Block::sampled(slow, error, law, Delay::NONE));
        }
        let mut pressing = ForceGains::new(rows);
        (0..rows).for_each(|row| self.add_force(&mut pressing, row, world, row, -1.0));
        let weights = returned_force(&slow, self.of.returned_force);
        let SlowBody { law, shown } = self.of.body;
        let hold = match self.of.hold {
            SurfaceHold::Zero => Hold::Zero,
            SurfaceHold::First => Hold::First,
        };
        // What the state shows is not remembered beside it.
        let (law, delay, age) = match shown {
            Some(shown) => {
                let d = DMatrix::zeros(rows, rows);
                (LinearBlock { c: shown.clone(), d, ..law.clone() }, later(false), 2)
            }
            None => (law.clone(), later(true), 1),
        };
        let of_contacts = |name: &dyn Fn(u8, Axis) -> Coordinate| -> Vec<Coordinate> {
            slots.iter().flat_map(|&slot| Axis::ALL.map(|axis| name(slot, axis))).collect()
        };
        self.of.spec.block(Block {
            states: (0..law.states() as u32).map(|index| Coordinate::SoftBody { host, index }).collect(),
            outputs: of_contacts(&|slot, axis| Coordinate::Surface { host, slot, axis, age }),
            weights: weights.clone(),
            hold,
            ..Block::sampled(slow, pressing.clone(), law, delay)
        });
        if self.of.reads_stepped_forces() {
            let law = LinearBlock::gain(DMatrix::identity(rows, rows));
            self.of.spec.block(Block {
                outputs: of_contacts(&|slot, axis| Coordinate::SteppedForce { host, slot, axis, age: 1 }),
                weights,
                ..Block::sampled(slow, pressing, law, later(true))
            });
        }
    }
}

/// A step at each tick.
fn every_tick(slow: &Schedule) -> Schedule {
    Schedule::new(slow.control(), slow.control()).unwrap_or(*slow)
}

/// The weights of a period's forces in what goes to the simulation.
pub(super) fn returned_force(slow: &Schedule, returned: ReturnedForce) -> Vec<Vec<f64>> {
    let weights = |ticks: u64| match returned {
        ReturnedForce::First => vec![1.0],
        ReturnedForce::Mean => vec![(ticks as f64).recip(); ticks as usize],
        ReturnedForce::Last => (1..=ticks).map(|tick| if tick == ticks { 1.0 } else { 0.0 }).collect(),
    };
    without_repetition(ticks_of_periods(slow).map(weights).collect())
}
