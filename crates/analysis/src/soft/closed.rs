//! Hosts, fingers and soft bodies of which only what fingers observe is there, as a loop.

use cotouch_scene::names::{Axis, Coordinate, HostIndex};
use cotouch_world::LinearBlock;
use nalgebra::{Complex, DMatrix};

use super::closed_body::ClosedBodies;
use super::touched::Touched;
use crate::loop_spec::{Block, BlockId, BodyId, Delay, ForceGains, Hold, LoopSpec, Motion, Term};

/// The loop.
pub(super) fn closed_loop(bodies: &ClosedBodies, of: Touched<'_>) -> LoopSpec {
    let mut session = Session { of, bodies };
    for (host, law) in &bodies.observable {
        session.add_host(*host, law);
    }
    session.add_unobservable();
    session.of.spec
}

/// A loop that is being written down.
struct Session<'a> {
    of: Touched<'a>,
    bodies: &'a ClosedBodies,
}

/// A coordinate of a finger as a host knows it.
struct Position {
    /// Three a contact.
    input: usize,
    motion: Motion,
    number: usize,
}

/// Outputs of a block, from the first of these on.
#[derive(Clone, Copy)]
struct Outputs {
    block: BlockId,
    first: usize,
}

impl Session<'_> {
    /// What a host computes, and its forces on its own fingers.
    fn add_host(&mut self, host: HostIndex, law: &LinearBlock) {
        let own: Vec<usize> = self.of.own_contacts(host).collect();
        if own.is_empty() {
            return;
        }
        let positions = self.positions(host);
        let body = self.add_body(host, law, &positions);
        let parts = self.held_parts(host, body, &own);
        for (place, &contact) in own.iter().enumerate() {
            let parts = parts.iter().map(|part| Outputs { first: part.first + 3 * place, ..*part });
            let slot = BodyId(self.of.touching[contact].0);
            let force = self.force(contact, &parts.collect::<Vec<_>>(), &positions);
            self.of.spec.act(slot, force);
        }
    }

    fn positions(&mut self, host: HostIndex) -> Vec<Position> {
        let contacts = 0..self.of.touching.len();
        let fingers: Vec<Motion> = contacts.map(|contact| self.of.finger(host, contact)).collect();
        let position = |&input: &usize| {
            Some(Position { input, motion: fingers[input / 3], number: self.of.number(input)? })
        };
        self.bodies.inputs.iter().filter_map(position).collect()
    }

    /// What the host's own fingers observe of its body.
    fn add_body(&mut self, host: HostIndex, law: &LinearBlock, positions: &[Position]) -> BlockId {
        let mut input = ForceGains::new(positions.len());
        for (component, &Position { motion, number, .. }) in positions.iter().enumerate() {
            input.terms.push(Term { component, motion, number, gain: 1.0 });
        }
        let names = |numbers: std::ops::Range<usize>| {
            numbers.map(|index| Coordinate::SoftBody { host, index: index as u32 }).collect()
        };
        let states = law.states();
        let (law, delay, outputs) = match self.bodies.direct {
            None => (law.clone(), Delay::NONE, 0),
            // It follows from what was before the period: it is put out by the step before.
            Some(_) => (with_next_output(law), Delay::periods(1), law.outputs()),
        };
        self.of.spec.block(Block {
            states: names(0..states),
            outputs: names(states..states + outputs),
            weights: self.bodies.weights.clone(),
            ..Block::sampled(self.of.slow, input, law, delay)
        })
    }

    /// The parts of the forces on own fingers as they are held.
    fn held_parts(&mut self, host: HostIndex, body: BlockId, own: &[usize]) -> Vec<Outputs> {
        let holds = self.bodies.holds.iter().zip((0..).step_by(3 * own.len()));
        let held = |(hold, first): (&Hold, usize)| {
            let part = Outputs { block: body, first };
            match hold {
                Hold::Zero => part,
                Hold::First => self.add_first_order_hold(host, part, own),
            }
        };
        holds.map(held).collect()
    }

    fn add_first_order_hold(&mut self, host: HostIndex, part: Outputs, own: &[usize]) -> Outputs {
        let rows = 3 * own.len();
        let mut input = ForceGains::new(rows);
        for component in 0..rows {
            let (motion, number) = (Motion::Output(part.block), part.first + component);
            input.terms.push(Term { component, motion, number, gain: 1.0 });
        }
        let slots = own.iter().map(|&contact| self.of.touching[contact].0 as u8);
        let name = |slot, axis| Coordinate::Surface { host, slot, axis, age: 1 };
        let outputs = slots.flat_map(|slot| Axis::ALL.map(|axis| name(slot, axis))).collect();
        let law = LinearBlock::gain(DMatrix::identity(rows, rows));
        let held = Block::sampled(self.of.slow, input, law, Delay::NONE);
        Outputs { block: self.of.spec.block(Block { outputs, hold: Hold::First, ..held }), first: 0 }
    }

    /// The force on a finger of its host's own.
    fn force(&self, contact: usize, parts: &[Outputs], positions: &[Position]) -> ForceGains {
        let axes = self.of.spec.bodies[self.of.touching[contact].0].axes;
        let mut force = ForceGains::new(axes.len());
        for (component, dof) in axes.iter().enumerate() {
            let axis = dof.axis().index();
            for &Outputs { block, first } in parts {
                let (motion, number) = (Motion::Output(block), first + axis);
                force.terms.push(Term { component, motion, number, gain: 1.0 });
            }
            let Some(k_e) = &self.bodies.direct else { continue };
            for &Position { input, motion, number } in positions {
                let gain = -k_e[(3 * contact + axis, input)];
                force.terms.push(Term { component, motion, number, gain });
            }
        }
        force.terms.retain(|term| term.gain != 0.0);
        force
    }

    /// A mode that no finger observes. The slow clock goes on where there is none.
    fn add_unobservable(&mut self) {
        let a = match self.bodies.unobservable {
            None => DMatrix::zeros(0, 0),
            Some(Complex { re, im: 0.0 }) => DMatrix::from_element(1, 1, re),
            Some(Complex { re, im }) => DMatrix::from_row_slice(2, 2, &[re, im, -im, re]),
        };
        let (states, no_numbers) = (a.nrows(), DMatrix::zeros(0, 0));
        let (b, c) = (DMatrix::zeros(states, 0), DMatrix::zeros(0, states));
        let (host, law) = &self.bodies.observable[0];
        let after = (law.states() + law.outputs()) as u32;
        let names = (after..).map(|index| Coordinate::SoftBody { host: *host, index });
        let law = LinearBlock { a, b, c, d: no_numbers };
        let block = Block::sampled(self.of.slow, ForceGains::new(0), law, Delay::NONE);
        self.of.spec.block(Block { states: names.take(states).collect(), ..block });
    }
}

/// Of a system without `d`: the same with the output of the step after.
fn with_next_output(law: &LinearBlock) -> LinearBlock {
    LinearBlock { c: &law.c * &law.a, d: &law.c * &law.b, ..law.clone() }
}

#[cfg(test)]
mod tests;
