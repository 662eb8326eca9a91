//! Parts of a loop that do not act on each other to and fro: a body with all that touches it, a finger that feels nothing.
//!
//! The eigenvalues of a loop are those of its parts. Where one part acts on another and feels nothing of it (a finger that
//! touches a remote copy alone, whose own host renders nothing), the map is block triangular, and its eigenvalues are those of
//! the diagonal blocks (Horn & Johnson 2013, §0.9.4): what drives a part may stand still while that is judged. Were such a finger judged with what it
//! pushes, its free motion would be a double pole at 1 that no direction alone explains, and rounding would split it.

use crate::loop_spec::{
    AppliedForce, Block, BlockId, BodyId, Force, ForceGains, Line, LineId, LoopSpec, Motion, Signal, Term,
};
use crate::rigid::Ties;

/// The parts of a loop, each a loop of its own; lines that nothing reads are left out.
pub(crate) fn parts(spec: &LoopSpec) -> Vec<LoopSpec> {
    if spec.blocks.is_empty() {
        return mutual(spec).iter().map(|bodies| Part::new(spec, bodies, &[]).whole()).collect();
    }
    let ties = Ties::parts(spec);
    ties.groups()
        .iter()
        .map(|bodies| Part::new(spec, bodies, &ties.blocks_beside(bodies[0])).whole())
        .collect()
}

/// Groups of bodies each of which acts, directly or through others, on all others of its group.
fn mutual(spec: &LoopSpec) -> Vec<Vec<usize>> {
    let bodies = spec.bodies.len();
    let mut acts_on: Vec<Vec<bool>> =
        (0..bodies).map(|on| (0..bodies).map(|from| on == from).collect()).collect();
    for action in &spec.actions {
        if let Some(coupling) = spec.coupling_of(action) {
            note_what_is_read(spec, coupling, &mut acts_on[action.body.0]);
        }
    }
    // Warshall 1962: through one more body each time.
    for through in 0..bodies {
        let acting = acts_on[through].clone();
        for on in acts_on.iter_mut().filter(|on| on[through]) {
            on.iter_mut().zip(&acting).for_each(|(acts, &too)| *acts |= too);
        }
    }
    let of_body = |one: usize| {
        (0..bodies).filter(|&other| acts_on[one][other] && acts_on[other][one]).collect::<Vec<_>>()
    };
    (0..bodies)
        .map(of_body)
        .enumerate()
        .filter(|(body, group)| group[0] == *body)
        .map(|(_, group)| group)
        .collect()
}

/// Which bodies a coupling reads, directly or by forces that were sent.
fn note_what_is_read(spec: &LoopSpec, coupling: &ForceGains, read: &mut [bool]) {
    for term in coupling.terms.iter().filter(|term| term.gain != 0.0) {
        if let Some(body) = spec.body_of(term.motion) {
            read[body.0] = true;
        } else if let Motion::Held(line) = term.motion
            && let Some(force) = spec.lines[line.0].signal.force()
        {
            note_what_is_read(spec, force, read);
        }
    }
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
                Force::Gains(coupling) => Force::Gains(self.coupling(coupling)),
                Force::Held(line) => match self.line(*line) {
                    Some(line) => Force::Held(line),
                    None => continue,
                },
            };
            self.to.actions.push(AppliedForce { body, force });
        }
        self.to
    }

    /// What belongs to another part stands still.
    fn coupling(&mut self, coupling: &ForceGains) -> ForceGains {
        let mut own = ForceGains::new(coupling.components);
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
    use cotouch_scene::scene::{Architecture, SpringDamper};
    use cotouch_scene::time::Schedule;

    use super::*;
    use crate::loop_spec::{Dynamics, LINE, LoopBody, Plant};
    use crate::poles::analyze_loop;

    /// A free mass that pulls another one by a spring and feels nothing of it: two poles at 1, which rounding splits where they are
    /// not told apart.
    #[test]
    fn what_feels_nothing_of_what_it_drives_is_a_part_of_its_own() {
        let rate = "1000".parse().unwrap();
        let mut spec = LoopSpec::new(Schedule::new(rate, rate).unwrap());
        let spring =
            |stiffness_n_per_m, damping_n_s_per_m| SpringDamper { stiffness_n_per_m, damping_n_s_per_m };
        let mut mass = |name: &str, kg: f64, to_ground: SpringDamper| {
            let states = ["x", "v"].map(|quantity| format!("{name}.{quantity}").parse().unwrap()).to_vec();
            let dynamics = Dynamics::Plant(Plant::mass(kg, to_ground));
            spec.body(LoopBody { states, axes: LINE, dynamics })
        };
        let drives = mass("host1.hand", 0.1, spring(0.0, 0.0));
        let driven = mass("host2.hand", 0.4, spring(150.0, 6.0));
        spec.pull(driven, Motion::Current(drives), spring(400.0, 2.0));
        let found = parts(&spec);
        let verdicts: Vec<_> = found.iter().map(|part| analyze_loop(part).unwrap()).collect();
        assert_eq!(found.iter().map(|part| part.bodies.len()).collect::<Vec<_>>(), [1, 1]);
        assert_eq!(verdicts[0].rigid_body_poles, 2);
        assert!(verdicts[0].stable && verdicts[1].stable, "{verdicts:?}");
        assert!((0.9..1.0).contains(&verdicts[1].spectral_radius), "{verdicts:?}");
        // What is driven has the poles of the same spring to the ground.
        let mut grounded = LoopSpec::new(spec.schedule);
        let alone = grounded.body(spec.bodies[driven.0].clone());
        grounded.pull(alone, Motion::Ground, spring(400.0, 2.0));
        assert_eq!(analyze_loop(&grounded).unwrap().spectral_radius, verdicts[1].spectral_radius);
        // The whole, through its sum of poles: those of the parts, and two at 1.
        let whole = spec.lift().unwrap();
        let of_parts: f64 = verdicts[1].eigenvalues.iter().map(|pole| pole.re).sum();
        assert!((whole.matrix.trace() - 2.0 - of_parts).abs() < 1e-12);
    }

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
