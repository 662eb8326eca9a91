//! Which bodies belong together.

use super::coasting::Coasting;
use crate::loop_spec::{Dof, LoopSpec};

/// Groups of bodies; the last entry is the ground.
pub(super) struct Ties {
    /// For each body, one that stands nearer to the one that stands for its group.
    parent: Vec<usize>,
}

impl Ties {
    fn none(spec: &LoopSpec) -> Self {
        Self { parent: (0..=spec.bodies.len()).collect() }
    }

    /// Bodies between which any force acts. The ground connects nothing.
    pub(super) fn parts(spec: &LoopSpec) -> Self {
        let mut parts = Self::none(spec);
        for action in &spec.actions {
            for term in spec.coupling_of(action).into_iter().flat_map(|coupling| &coupling.terms) {
                if let Some(body) = spec.body_of(term.motion).filter(|_| term.gain != 0.0) {
                    parts.join(body.0, action.body.0);
                }
            }
        }
        parts
    }

    /// Bodies that stiffnesses tie together in one direction.
    pub(super) fn along(spec: &LoopSpec, axis: Dof, coasting: &[Vec<Coasting>]) -> Self {
        /// Gains that cancel but for rounding.
        const RELATIVE: f64 = 1e-13;
        let ground = spec.bodies.len();
        let mut ties = Self::none(spec);
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

    /// All groups, without the ground.
    pub(super) fn groups(&self) -> Vec<Vec<usize>> {
        let bodies = self.parent.len() - 1;
        let mut groups = vec![Vec::new(); bodies];
        (0..bodies).for_each(|body| groups[self.of(body)].push(body));
        groups.retain(|group| !group.is_empty());
        groups
    }

    fn join(&mut self, one: usize, other: usize) {
        let (one, other) = (self.of(one), self.of(other));
        self.parent[one] = other;
    }
}
