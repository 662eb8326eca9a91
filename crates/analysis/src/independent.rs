//! Parts of a loop between which no force acts: a body with all that touches it, a finger that touches nothing.
//!
//! The eigenvalues of a loop are those of its parts.

use crate::loop_spec::{
    AppliedForce, Block, BlockId, BodyId, Coupling, Force, Line, LineId, LoopSpec, Motion, Signal, Term,
};
use crate::rigid::Ties;

/// The parts of a loop, each a loop of its own; lines that nothing reads are left out.
pub(crate) fn parts(spec: &LoopSpec) -> Vec<LoopSpec> {
    let ties = Ties::parts(spec);
    ties.groups()
        .iter()
        .map(|bodies| Part::new(spec, bodies, &ties.blocks_beside(bodies[0])).whole())
        .collect()
}

/// A part that is being written down: the new place of each of the loop's bodies, blocks and lines.
struct Part<'a> {
    from: &'a LoopSpec,
    bodies: Vec<Option<BodyId>>,
    blocks: Vec<Option<BlockId>>,
    lines: Vec<Option<LineId>>,
    to: LoopSpec,
}

impl<'a> Part<'a> {
    fn new(from: &'a LoopSpec, bodies: &[usize], blocks: &[usize]) -> Self {
        let mut part = Self {
            from,
            bodies: vec![None; from.bodies.len()],
            blocks: vec![None; from.blocks.len()],
            lines: vec![None; from.lines.len()],
            to: LoopSpec::new(from.schedule),
        };
        for &body in bodies {
            part.bodies[body] = Some(part.to.body(from.bodies[body].clone()));
        }
        for (place, &block) in blocks.iter().enumerate() {
            part.blocks[block] = Some(BlockId(place));
        }
        part
    }

    fn whole(mut self) -> LoopSpec {
        for (block, _) in
            self.from.blocks.iter().zip(self.blocks.clone()).filter(|(_, place)| place.is_some())
        {
            let input = self.coupling(&block.input);
            self.to.block(Block { input, ..block.clone() });
        }
        for action in &self.from.actions {
            let Some(body) = self.bodies[action.body.0] else { continue };
            let force = match &action.force {
                Force::Coupling(coupling) => Force::Coupling(self.coupling(coupling)),
                Force::Held(line) => match self.line(*line) {
                    Some(line) => Force::Held(line),
                    None => continue,
                },
            };
            self.to.actions.push(AppliedForce { body, force });
        }
        self.to
    }

    /// A gain of 0 may read what belongs to another part.
    fn coupling(&mut self, coupling: &Coupling) -> Coupling {
        let mut own = Coupling::new(coupling.components);
        for term in &coupling.terms {
            if let Some(motion) = self.motion(term.motion) {
                own.terms.push(Term { motion, ..*term });
            }
        }
        own
    }

    fn motion(&mut self, motion: Motion) -> Option<Motion> {
        match motion {
            Motion::Ground => Some(Motion::Ground),
            Motion::Current(body) => self.bodies[body.0].map(Motion::Current),
            Motion::Held(line) => self.line(line).map(Motion::Held),
            Motion::Output(block) => self.blocks[block.0].map(Motion::Output),
        }
    }

    fn line(&mut self, line: LineId) -> Option<LineId> {
        if let Some(known) = self.lines[line.0] {
            return Some(known);
        }
        let Line { signal, .. } = &self.from.lines[line.0];
        let signal = match signal {
            Signal::Motion(body) => Signal::Motion(self.bodies[body.0]?),
            Signal::Position(body) => Signal::Position(self.bodies[body.0]?),
            Signal::Force(coupling) => Signal::Force(self.coupling(coupling)),
        };
        let id = self.to.line(Line { signal, ..self.from.lines[line.0].clone() });
        self.lines[line.0] = Some(id);
        Some(id)
    }
}

#[cfg(test)]
mod tests {
    use cotouch_scene::scene::Architecture;

    use super::*;
    use crate::poles::analyze_loop;

    /// A part's eigenvalues are the whole's: none is lost, none is new.
    #[test]
    fn parts_have_the_eigenvalues_of_the_whole() {
        for (name, architecture) in [
            ("grasp", Architecture::Distributed),
            ("grasp", Architecture::Centralized),
            ("hand-over", Architecture::Distributed),
            ("single-axis", Architecture::Distributed),
        ] {
            let scene = cotouch_scene::load(name, &[]).unwrap();
            let scene = scene.edit(|scene| scene.session.architecture = architecture).unwrap();
            for mode in crate::compile(&scene).into_iter().step_by(5) {
                let whole = analyze_loop(&mode.spec).unwrap();
                let parts: Vec<_> =
                    parts(&mode.spec).iter().map(|part| analyze_loop(part).unwrap()).collect();
                let poles: usize = parts.iter().map(|part| usize::from(part.rigid_body_poles)).sum();
                assert_eq!(poles, usize::from(whole.rigid_body_poles), "{name} {:?}", mode.contacts);
                let mut radii = [vec![whole], parts].map(|loops| {
                    let all = loops.into_iter().flat_map(|verdict| verdict.eigenvalues);
                    // Samples that nobody reads are poles at 0.
                    let mut radii: Vec<f64> =
                        all.map(|pole| pole.norm()).filter(|&pole| pole > 1e-3).collect();
                    radii.sort_by(f64::total_cmp);
                    radii
                });
                let [of_whole, of_parts] = &mut radii;
                assert_eq!(of_whole.len(), of_parts.len(), "{name} {:?}", mode.contacts);
                for (one, other) in of_whole.iter().zip(of_parts) {
                    assert!((one - *other).abs() < 1e-7, "{name} {:?}: {one} {other}", mode.contacts);
                }
            }
        }
    }
}
