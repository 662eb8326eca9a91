//! Which bodies belong together.

use super::coasting::Coasting;
use crate::loop_spec::{Dof, ForceGains, LoopSpec, Motion};

/// Groups of bodies, and of the blocks that read them or act on them.
pub(crate) struct Ties {
    /// For each body, block and the ground, one that stands nearer to the one that stands for its group.
    parent: Vec<usize>,
    bodies: usize,
}

impl Ties {
    fn none(spec: &LoopSpec) -> Self {
        let bodies = spec.bodies.len();
        Self { parent: (0..=bodies + spec.blocks.len()).collect(), bodies }
    }

    /// Bodies between which any force acts. The ground connects nothing.
    pub(crate) fn parts(spec: &LoopSpec) -> Self {
        let mut parts = Self::none(spec);
        for action in &spec.actions {
            if let Some(coupling) = spec.coupling_of(action) {
                parts.join_what_is_read(spec, coupling, action.body.0);
            }
        }
        for (block, node) in spec.blocks.iter().zip(spec.bodies.len()..) {
            parts.join_what_is_read(spec, &block.input, node);
        }
        parts
    }

    fn join_what_is_read(&mut self, spec: &LoopSpec, coupling: &ForceGains, by: usize) {
        for term in coupling.terms.iter().filter(|term| term.gain != 0.0) {
            if let Motion::Output(block) = term.motion {
                self.join(self.bodies + block.0, by);
            } else if let Some(body) = spec.body_of(term.motion) {
                self.join(body.0, by);
            } else if let Motion::Held(line) = term.motion
                && let Some(force) = spec.lines[line.0].signal.force()
            {
                self.join_what_is_read(spec, force, by);
            }
        }
    }

    /// The blocks of a body's group.
    pub(crate) fn blocks_beside(&self, body: usize) -> Vec<usize> {
        let blocks = self.parent.len() - 1 - self.bodies;
        (0..blocks).filter(|block| self.of(self.bodies + block) == self.of(body)).collect()
    }

    /// Bodies that stiffnesses tie together in one direction, but for what blocks do.
    pub(super) fn along(spec: &LoopSpec, axis: Dof, coasting: &[Vec<Coasting>]) -> Self {
        /// Gains that cancel but for rounding.
        const RELATIVE: f64 = 1e-13;
        let mut ties = Self::none(spec);
        let ground = ties.parent.len() - 1;
        for (index, body) in spec.bodies.iter().enumerate() {
            let number = body.axes.iter().position(|&of_body| of_body == axis);
            if number.is_none_or(|number| coasting[index][number].still.is_none()) {
                ties.join(index, ground);
            }
        }
        let mut net = Vec::new();
        for coupling in spec.couplings() {
            let mut first = None;
            net.clear();
            net.resize(coupling.components, (0.0, 0.0_f64));
            for term in coupling.terms.iter().filter(|term| term.gain != 0.0) {
                let Some(body) = spec.body_of(term.motion) else { continue };
                if spec.bodies[body.0].axes.get(term.number) == Some(&axis) {
                    ties.join(body.0, *first.get_or_insert(body.0));
                    let (sum, largest) = &mut net[term.component];
                    *sum += term.gain;
                    *largest = largest.max(term.gain.abs());
                }
            }
            let is_relative = net.iter().all(|&(sum, largest): &(f64, f64)| sum.abs() <= RELATIVE * largest);
            if let Some(body) = first.filter(|_| !is_relative) {
                ties.join(body, ground);
            }
        }
        ties
    }

    /// The body (or the ground) that stands for a body's group.
    pub(super) fn of(&self, mut body: usize) -> usize {
        while self.parent[body] != body {
            body = self.parent[body];
        }
        body
    }

    pub(super) fn is_ground(&self, group: usize) -> bool {
        group == self.of(self.parent.len() - 1)
    }

    pub(super) fn is_grounded(&self, body: usize) -> bool {
        self.is_ground(self.of(body))
    }

    /// The bodies of all groups.
    pub(crate) fn groups(&self) -> Vec<Vec<usize>> {
        let mut groups = vec![Vec::new(); self.parent.len()];
        (0..self.bodies).for_each(|body| groups[self.of(body)].push(body));
        groups.retain(|group| !group.is_empty());
        groups
    }

    fn join(&mut self, one: usize, other: usize) {
        let (one, other) = (self.of(one), self.of(other));
        self.parent[one] = other;
    }
}
