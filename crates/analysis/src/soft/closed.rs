//! Hosts, fingers and soft bodies that are known by what fingers feel of them, as a loop.

use cotouch_scene::names::{Axis, Coordinate, HostIndex};
use nalgebra::{Complex, DMatrix};

use super::pressed::Pressed;
use super::touched::Touched;
use crate::loop_spec::{Block, BlockId, BodyId, Coupling, Delay, Hold, LoopSpec, Motion, Term};
use cotouch_world::LinearBlock;

/// The loop.
pub(super) fn closed_loop(pressed: &Pressed, of: Touched<'_>) -> LoopSpec {
    let mut session = Session { of, pressed };
    for (host, law) in &pressed.felt {
        session.add_host(*host, law);
    }
    session.add_unfelt();
    session.of.spec
}

/// A loop that is being written down.
struct Session<'a> {
    of: Touched<'a>,
    pressed: &'a Pressed,
}

/// A coordinate of a finger as a host knows it.
struct Position {
    /// Three a contact.
    input: usize,
    motion: Motion,
    number: usize,
}

impl Session<'_> {
    /// What a host computes, and its forces on its own fingers.
    fn add_host(&mut self, host: HostIndex, law: &LinearBlock) {
        let own = self.own_contacts(host);
        if own.is_empty() {
            return;
        }
        let positions = self.positions(host);
        let felt = self.add_felt(host, law, &positions);
        let parts = self.add_holds(host, felt, &own);
        for (place, &contact) in own.iter().enumerate() {
            let slot = self.of.touching[contact].0;
            let axes = self.of.spec.bodies[slot].axes;
            let mut force = Coupling::new(axes.len());
            for (component, dof) in axes.iter().enumerate() {
                let axis = dof.axis().index();
                for &(block, first) in &parts {
                    let number = first + 3 * place + axis;
                    force.terms.push(Term { component, motion: Motion::Output(block), number, gain: 1.0 });
                }
                let Some(k_e) = &self.pressed.direct else { continue };
                for &Position { input, motion, number } in &positions {
                    let gain = -k_e[(3 * contact + axis, input)];
                    force.terms.push(Term { component, motion, number, gain });
                }
            }
            force.terms.retain(|term| term.gain != 0.0);
            self.of.spec.act(BodyId(slot), force);
        }
    }

    /// What the host's own fingers feel, of all fingers' positions.
    fn add_felt(&mut self, host: HostIndex, law: &LinearBlock, positions: &[Position]) -> BlockId {
        let mut input = Coupling::new(positions.len());
        for (component, &Position { motion, number, .. }) in positions.iter().enumerate() {
            input.terms.push(Term { component, motion, number, gain: 1.0 });
        }
        let names = |numbers: std::ops::Range<usize>| {
            numbers.map(|index| Coordinate::SoftBody { host, index: index as u32 }).collect()
        };
        let states = law.states();
        let (law, delay, outputs) = match self.pressed.direct {
            None => (law.clone(), Delay::NONE, 0),
            // It follows from what was before the period: the output of the step before.
            Some(_) => (put_out_before(law), Delay::periods(1), law.outputs()),
        };
        self.of.spec.block(Block {
            states: names(0..states),
            outputs: names(states..states + outputs),
            weights: self.pressed.weights.clone(),
            ..Block::sampled(self.of.slow, input, law, delay)
        })
    }

    /// For each part of what is felt: the block that puts it out, and its first number there.
    fn add_holds(&mut self, host: HostIndex, felt: BlockId, own: &[usize]) -> Vec<(BlockId, usize)> {
        let parts = self.pressed.holds.iter().enumerate();
        parts
            .map(|(part, hold)| {
                let first = part * 3 * own.len();
                match hold {
                    Hold::Zero => (felt, first),
                    Hold::First => (self.add_moving(host, felt, first, own), 0),
                }
            })
            .collect()
    }

    fn positions(&mut self, host: HostIndex) -> Vec<Position> {
        let contacts = 0..self.of.touching.len();
        let fingers: Vec<Motion> = contacts.map(|contact| self.of.finger(host, contact)).collect();
        let position = |&input: &usize| {
            Some(Position { input, motion: fingers[input / 3], number: self.of.number(input)? })
        };
        self.pressed.inputs.iter().filter_map(position).collect()
    }

    fn own_contacts(&self, host: HostIndex) -> Vec<usize> {
        let touching = self.of.touching.iter().enumerate();
        touching.filter(|(_, (_, finger))| finger.user == host).map(|(contact, _)| contact).collect()
    }

    /// A part of what is felt that moves on from period to period.
    fn add_moving(&mut self, host: HostIndex, felt: BlockId, first: usize, own: &[usize]) -> BlockId {
        let rows = 3 * own.len();
        let mut input = Coupling::new(rows);
        for component in 0..rows {
            let (motion, number) = (Motion::Output(felt), first + component);
            input.terms.push(Term { component, motion, number, gain: 1.0 });
        }
        let slots = own.iter().map(|&contact| self.of.touching[contact].0 as u8);
        let name = |slot, axis| Coordinate::Surface { host, slot, axis, age: 1 };
        let outputs = slots.flat_map(|slot| Axis::ALL.map(|axis| name(slot, axis))).collect();
        let law = LinearBlock::gain(DMatrix::identity(rows, rows));
        let hold = Hold::First;
        self.of.spec.block(Block { outputs, hold, ..Block::sampled(self.of.slow, input, law, Delay::NONE) })
    }

    /// A motion of a body that nobody feels. The slow clock goes on where there is none.
    fn add_unfelt(&mut self) {
        let a = match self.pressed.unfelt {
            None => DMatrix::zeros(0, 0),
            Some(Complex { re, im: 0.0 }) => DMatrix::from_element(1, 1, re),
            Some(Complex { re, im }) => DMatrix::from_row_slice(2, 2, &[re, im, -im, re]),
        };
        let states = a.nrows();
        let (host, first) = self
            .pressed
            .felt
            .first()
            .map_or((HostIndex::FIRST, 0), |(host, law)| (*host, law.states() + law.outputs()));
        let names = (first as u32..).map(|index| Coordinate::SoftBody { host, index });
        let law = LinearBlock {
            a,
            b: DMatrix::zeros(states, 0),
            c: DMatrix::zeros(0, states),
            d: DMatrix::zeros(0, 0),
        };
        self.of.spec.block(Block {
            states: names.take(states).collect(),
            ..Block::sampled(self.of.slow, Coupling::new(0), law, Delay::NONE)
        });
    }
}

/// Of a system without `d`: the same output, as of the step before.
fn put_out_before(law: &LinearBlock) -> LinearBlock {
    LinearBlock { c: &law.c * &law.a, d: &law.c * &law.b, ..law.clone() }
}

#[cfg(test)]
mod tests;
