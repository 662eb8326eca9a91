//! Where the bodies of a part are, relative to each other.

use nalgebra::DVector;

use crate::loop_spec::{ForceGains, LoopSpec, Motion};

/// Whether a force depends on bodies of a part.
pub(super) fn is_of_part(spec: &LoopSpec, coupling: &ForceGains, part: &[usize]) -> bool {
    let of_part = |motion| spec.body_of(motion).is_some_and(|body| part.contains(&body.0));
    coupling.terms.iter().any(|term| of_part(term.motion))
}

/// Constant positions of the bodies of a part.
pub(super) struct Offsets {
    /// For each body, the place of its first value; too large for bodies of other parts.
    pub(super) first: Vec<usize>,
    pub(super) values: DVector<f64>,
}

impl Offsets {
    pub(super) fn new(spec: &LoopSpec, part: &[usize]) -> Self {
        let mut first = vec![usize::MAX; spec.bodies.len()];
        let mut size = 0;
        for &body in part {
            first[body] = size;
            size += spec.bodies[body].axes.len();
        }
        Self { first, values: DVector::zeros(size) }
    }

    pub(super) fn of(&self, body: usize, number: usize) -> f64 {
        self.values[self.first[body] + number]
    }

    /// Where the value lies that a position of a motion has.
    pub(super) fn place(&self, spec: &LoopSpec, motion: Motion, number: usize) -> Option<usize> {
        let body = spec.body_of(motion)?;
        let is_position = number < spec.bodies[body.0].axes.len();
        (is_position && self.first[body.0] != usize::MAX).then(|| self.first[body.0] + number)
    }

    pub(super) fn add_force(&self, spec: &LoopSpec, coupling: &ForceGains, force: &mut DVector<f64>) {
        for term in &coupling.terms {
            if let Some(place) = self.place(spec, term.motion, term.number) {
                force[term.component] += term.gain * self.values[place];
            }
        }
    }
}
