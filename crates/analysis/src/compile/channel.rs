//! One end of a coordination scheme's channel between two copies of a body, as sampled blocks of a loop.

use std::ops::Range;

use cotouch_scene::limits::MAX_CHANNEL_VECTORS;
use cotouch_scene::names::{Coordinate, HostIndex, Part};
use cotouch_scene::time::Schedule;
use cotouch_world::LinearBlock;
use cotouch_world::coordination::{Scheme, StepInput, TickInput};
use glam::DQuat;
use nalgebra::DMatrix;

use crate::contact::{ChannelGains, couple_copies};
use crate::loop_spec::{Block, BlockId, BodyId, Delay, Dof, ForceGains, LineId, LoopSpec, Motion, Term};

/// The end of a channel at `host`, for translation or for rotation of one body.
#[derive(Clone, Copy)]
pub(super) struct ChannelEnd {
    pub(super) host: HostIndex,
    pub(super) from: HostIndex,
    pub(super) object: u8,
    pub(super) turns: bool,
    pub(super) near: BodyId,
    /// The samples of the other copy.
    pub(super) far: LineId,
    pub(super) axes: &'static [Dof],
    /// How the far copy is turned against the near one, and the near one against the scene's start.
    pub(super) turned: (DQuat, DQuat),
}

impl ChannelEnd {
    /// What a vector that the end receives is called.
    pub(super) fn part(&self, vector: usize) -> Part {
        let kind = 2 * usize::from(self.object) + usize::from(self.turns);
        Part::Channel((kind * MAX_CHANNEL_VECTORS + vector) as u8)
    }

    /// The components of the body's wrench that the channel acts on.
    fn components(&self) -> Range<usize> {
        let moves = self.axes.iter().filter(|dof| !dof.turns()).count();
        if self.turns { moves..self.axes.len() } else { 0..moves }
    }

    /// What the scheme does at ticks, all but what it receives; its outputs are the force, then the memory as it was before.
    pub(super) fn tick_block(&self, scheme: &dyn Scheme, spec: &LoopSpec) -> Block {
        let LinearBlock { a, b, c, d } = scheme.tick_block();
        let (states, inputs) = b.shape();
        let mut outputs = (DMatrix::zeros(1 + states, states), DMatrix::zeros(1 + states, inputs));
        outputs.0.rows_mut(0, 1).copy_from(&c);
        outputs.0.view_mut((1, 0), (states, states)).fill_with_identity();
        outputs.1.rows_mut(0, 1).copy_from(&d);
        let mut input = ForceGains::new(inputs * self.components().len());
        for number in TickInput::ALL {
            self.add_motion(&mut input, number as usize, Motion::Held(self.far), number);
        }
        let ticks = Schedule::new(spec.schedule.control(), spec.schedule.control()).unwrap_or(spec.schedule);
        let law = self.along_all_axes(&LinearBlock { a, b, c: outputs.0, d: outputs.1 });
        Block { states: self.names(0, states), ..Block::sampled(ticks, input, law, Delay::NONE) }
    }

    /// What the scheme does at network steps, with the memory that `ticks` puts out; its outputs are what is sent.
    pub(super) fn step_block(&self, scheme: &dyn Scheme, spec: &LoopSpec, ticks: BlockId) -> Block {
        let block = scheme.step_block();
        let first = scheme.size().tick_memory;
        let (states, inputs) = block.b.shape();
        let degrees = self.components().len();
        let mut input = ForceGains::new(inputs * degrees);
        let own = [TickInput::OwnPosition, TickInput::OwnVelocity];
        for (number, read) in [StepInput::OwnPosition, StepInput::OwnVelocity].into_iter().zip(own) {
            self.add_motion(&mut input, number as usize, Motion::Current(self.near), read);
        }
        for component in 2 * degrees..inputs * degrees {
            let number = component - degrees;
            input.terms.push(Term { component, motion: Motion::Output(ticks), number, gain: 1.0 });
        }
        let law = self.along_all_axes(&block);
        let states = self.names(first, states);
        Block { states, ..Block::sampled(spec.schedule, input, law, Delay::NONE) }
    }

    /// The force that the channel's block puts out, on the body.
    pub(super) fn force(&self, block: BlockId, weight: f64) -> ForceGains {
        let mut force = ForceGains::new(self.axes.len());
        let terms = self.components().enumerate();
        force.terms.extend(terms.map(|(number, component)| Term {
            component,
            motion: Motion::Output(block),
            number,
            gain: weight,
        }));
        force
    }

    /// One of the vectors that its step block puts out, along the world's axes.
    pub(super) fn sent(&self, block: BlockId, vector: usize) -> ForceGains {
        let degrees = self.components();
        let axis = |component: usize| self.axes[component].axis().index();
        let mut sent = ForceGains::new(degrees.clone().map(axis).max().map_or(1, |last| last + 1));
        let terms = degrees.clone().enumerate().map(|(place, component)| Term {
            component: axis(component),
            motion: Motion::Output(block),
            number: vector * degrees.len() + place,
            gain: 1.0,
        });
        sent.terms.extend(terms);
        sent
    }

    /// The names of so many vectors of memory, from the vector `first` on.
    fn names(&self, first: usize, vectors: usize) -> Vec<Coordinate> {
        let (host, from, object) = (self.host, self.from, self.object);
        let vectors = (first..first + vectors).map(|vector| vector as u8);
        let name = |vector: u8| {
            let degrees = self.axes[self.components()].iter();
            degrees.map(move |dof| Coordinate::SchemeMemory {
                host,
                from,
                object,
                quantity: dof.position(),
                vector,
            })
        };
        vectors.flat_map(name).collect()
    }

    /// Adds one number of the motions, of which the scheme knows four, to the input at `place`.
    fn add_motion(&self, input: &mut ForceGains, place: usize, far: Motion, number: TickInput) {
        let [apart, apart_velocity, own, own_velocity] =
            TickInput::ALL.map(|at| f64::from(u8::from(number == at)));
        let gains = ChannelGains { apart: [apart, apart_velocity], own: [own, own_velocity] };
        let none = ChannelGains::default();
        let gains = if self.turns { [none, gains] } else { [gains, none] };
        let mut force = ForceGains::new(self.axes.len());
        couple_copies(&mut force, (Motion::Current(self.near), self.axes), far, gains, self.turned);
        let degrees = self.components();
        let first = place * degrees.len();
        let shifted = |term: Term| Term { component: first + term.component - degrees.start, ..term };
        input.terms.extend(force.terms.into_iter().map(shifted));
    }

    /// Adds a received vector to the input of the block of ticks.
    pub(super) fn receive(&self, input: &mut ForceGains, vector: usize, line: LineId) {
        let degrees = self.axes[self.components()].iter().enumerate();
        let first = (TickInput::ALL.len() + vector) * self.components().len();
        input.terms.extend(degrees.map(|(degree, dof)| Term {
            component: first + degree,
            motion: Motion::Held(line),
            number: dof.axis().index(),
            gain: 1.0,
        }));
    }

    /// A block of one axis, for all of the channel's: numbers of one kind lie together.
    fn along_all_axes(&self, block: &LinearBlock) -> LinearBlock {
        let degrees = self.components().len();
        let each = DMatrix::identity(degrees, degrees);
        let along = |matrix: &DMatrix<f64>| matrix.kronecker(&each);
        LinearBlock { a: along(&block.a), b: along(&block.b), c: along(&block.c), d: along(&block.d) }
    }
}
