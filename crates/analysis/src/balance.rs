//! The laws of rest, with everything held equal to what is current.

use cotouch_world::LinearBlock;
use nalgebra::DMatrix;

use crate::loop_spec::{Dynamics, LoopBody, LoopSpec, Motion, Signal, Term};

/// The laws of rest: for plants `A·s + B·f = 0`, for masses `f = 0`, for blocks `(A − I)·x + B·u = 0` and
/// `C·x + D·u − y = 0`; in the plants' states, the masses' positions, and the blocks' states and outputs.
pub(crate) struct Balance {
    pub(crate) matrix: DMatrix<f64>,
    /// The first unknown of each body.
    pub(crate) first: Vec<usize>,
    /// The first unknown of each block: its states, then its outputs.
    pub(crate) blocks: Vec<usize>,
}

impl Balance {
    pub(crate) fn new(spec: &LoopSpec) -> Self {
        let mut size = 0;
        let mut place = |numbers: usize| {
            size += numbers;
            size - numbers
        };
        let first = spec.bodies.iter().map(|body| place(Self::numbers(body))).collect();
        let blocks =
            spec.blocks.iter().map(|block| place(block.law.states() + block.law.outputs())).collect();
        let mut balance = Self { matrix: DMatrix::zeros(size, size), first, blocks };
        balance.add_plants(spec);
        balance.add_couplings(spec);
        balance.add_blocks(spec);
        balance
    }

    /// How many unknowns a body has.
    pub(crate) fn numbers(body: &LoopBody) -> usize {
        match &body.dynamics {
            Dynamics::Plant(plant) | Dynamics::Sensed { plant, .. } => plant.a.nrows(),
            Dynamics::Mass { .. } | Dynamics::Rigid { .. } => body.axes.len(),
        }
    }

    fn add_plants(&mut self, spec: &LoopSpec) {
        for (body, &first) in spec.bodies.iter().zip(&self.first) {
            if let Dynamics::Plant(plant) | Dynamics::Sensed { plant, .. } = &body.dynamics {
                let size = plant.a.nrows();
                let mut own = self.matrix.view_mut((first, first), (size, size));
                own += &plant.a;
            }
        }
    }

    fn add_couplings(&mut self, spec: &LoopSpec) {
        let mut matrix = std::mem::take(&mut self.matrix);
        for action in &spec.actions {
            for term in spec.coupling_of(action).into_iter().flat_map(|coupling| &coupling.terms) {
                for (column, factor) in self.motion(spec, term) {
                    self.add_force(spec, action.body.0, term.component, term.gain * factor, |row, value| {
                        matrix[(row, column)] += value;
                    });
                }
            }
        }
        self.matrix = matrix;
    }

    fn add_blocks(&mut self, spec: &LoopSpec) {
        for (block, &first) in spec.blocks.iter().zip(&self.blocks) {
            let LinearBlock { a, b, c, d } = &block.law;
            let (states, outputs) = (block.law.states(), block.law.outputs());
            let output = first + states;
            let mut own = self.matrix.view_mut((first, first), (states, states));
            own += a - DMatrix::identity(states, states);
            self.matrix.view_mut((output, first), (outputs, states)).copy_from(c);
            self.matrix.view_mut((output, output), (outputs, outputs)).fill_diagonal(-1.0);
            // What is gathered of an input that stays: the same in every period, but for integrals, whose input is 0 then.
            let gathered: f64 = block.weights_of_step(0).iter().sum();
            for term in &block.input.terms {
                for (column, factor) in self.motion(spec, term) {
                    let gain = gathered * term.gain * factor;
                    let mut state_rows = self.matrix.view_mut((first, column), (states, 1));
                    state_rows += b.column(term.component) * gain;
                    let mut output_rows = self.matrix.view_mut((output, column), (outputs, 1));
                    output_rows += d.column(term.component) * gain;
                }
            }
        }
    }

    /// A force on a body, in the rows of the body.
    pub(crate) fn add_force(
        &self,
        spec: &LoopSpec,
        body: usize,
        component: usize,
        force: f64,
        mut add: impl FnMut(usize, f64),
    ) {
        let first = self.first[body];
        match &spec.bodies[body].dynamics {
            Dynamics::Plant(plant) | Dynamics::Sensed { plant, .. } => {
                let column = plant.b.column(component);
                column.iter().enumerate().for_each(|(row, b)| add(first + row, b * force));
            }
            Dynamics::Mass { .. } | Dynamics::Rigid { .. } => add(first + component, force),
        }
    }

    /// What a term reads, at rest: unknowns and factors.
    pub(crate) fn motion(&self, spec: &LoopSpec, term: &Term) -> Vec<(usize, f64)> {
        if let Motion::Output(block) = term.motion {
            return vec![(self.blocks[block.0] + spec.blocks[block.0].law.states() + term.number, 1.0)];
        }
        if let Motion::Held(line) = term.motion
            && let Signal::Force(force) = &spec.lines[line.0].signal
        {
            let terms = force.terms.iter().filter(|of_force| of_force.component == term.number);
            let read = |of_force: &Term| {
                let scaled = |(unknown, factor)| (unknown, of_force.gain * factor);
                self.motion(spec, of_force).into_iter().map(scaled).collect::<Vec<_>>()
            };
            return terms.flat_map(read).collect();
        }
        let Some(body) = spec.body_of(term.motion) else { return Vec::new() };
        let (first, LoopBody { axes, dynamics, .. }) = (self.first[body.0], &spec.bodies[body.0]);
        let is_velocity = term.number >= axes.len();
        match dynamics {
            // Nothing moves.
            Dynamics::Mass { .. } | Dynamics::Rigid { .. } if is_velocity => Vec::new(),
            dynamics => {
                let states = dynamics.output(term.number).into_iter();
                states.map(|(state, factor)| (first + state, factor)).collect()
            }
        }
    }
}

impl Dynamics {
    /// One of a body's positions and velocities, in its continuous states.
    pub(crate) fn output(&self, number: usize) -> Vec<(usize, f64)> {
        match self {
            Self::Plant(plant) | Self::Sensed { plant, .. } => {
                plant.c.row(number).iter().copied().enumerate().collect()
            }
            Self::Mass { .. } | Self::Rigid { .. } => vec![(number, 1.0)],
        }
    }
}
