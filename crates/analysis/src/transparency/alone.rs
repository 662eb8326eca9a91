//! Parts of a loop: one user at the object while the others are absent (Fig 6.1 (a)–(c)), and the copies of the object
//! without any hand (Fig 6.3).

use cotouch_scene::names::{Coordinate, HostIndex, Part};

use crate::loop_spec::{Action, Body, BodyId, Coupling, Force, Line, LineId, LoopSpec, Motion, Signal, Term};

/// A loop on one line, and the bodies of it on which a user's force acts.
#[derive(Clone, Debug)]
pub(super) struct Held {
    /// The loop.
    pub(super) spec: LoopSpec,
    /// What the force acts on, and its share of the force.
    pub(super) pushed: Vec<(BodyId, f64)>,
    /// Whose motion answers: the mean of theirs.
    pub(super) read: Vec<BodyId>,
}

impl Held {
    /// Of a session's loop: the fingers of `user`, which share the force equally, and all copies of the object that they
    /// have to do with. All other hands are gone, with every coupler to them.
    pub(super) fn by_hand(spec: &LoopSpec, user: HostIndex) -> Self {
        let is_present = |body: &Body| match place(body) {
            Some((host, Part::Hand(_))) => host == user,
            _ => true,
        };
        let is_finger = |body: &Body| matches!(place(body), Some((host, Part::Hand(_))) if host == user);
        let spec = connected(&restricted(spec, is_present), is_finger);
        let fingers = bodies_that(&spec, is_finger);
        let share = 1.0 / fingers.len().max(1) as f64;
        Self { pushed: fingers.iter().map(|&finger| (finger, share)).collect(), read: fingers, spec }
    }

    /// The copies of the object alone. The force acts on every copy, and the copy of `user` (of a centralized session,
    /// the only one) answers.
    ///
    /// In the model, the others get samples of the force, some network periods late: without effect on a constant force.
    pub(super) fn directly(spec: &LoopSpec, user: HostIndex) -> Self {
        let is_copy = |body: &Body| matches!(place(body), Some((_, Part::Object(_))));
        let copies = restricted(spec, is_copy);
        let host = |body: &Body| place(body).map(|(host, _)| host);
        let has_own = copies.bodies.iter().any(|body| host(body) == Some(user));
        let keeper = if has_own { user } else { HostIndex::FIRST };
        let is_read = |body: &Body| host(body) == Some(keeper);
        let spec = connected(&copies, is_read);
        let pushed = bodies_that(&spec, |_| true).into_iter().map(|copy| (copy, 1.0)).collect();
        Self { pushed, read: bodies_that(&spec, is_read), spec }
    }

    /// The positions (`number` 0) or velocities (1) that are read, as states: which body, which of its states, factor.
    /// True motion, not what a sensor tells of it.
    pub(super) fn answer(&self, number: usize) -> Vec<(BodyId, usize, f64)> {
        let share = 1.0 / self.read.len().max(1) as f64;
        let of_body = |&body: &BodyId| {
            let row = self.spec.bodies[body.0].dynamics.output(number);
            row.into_iter().enumerate().map(move |(state, factor)| (body, state, factor * share))
        };
        self.read.iter().flat_map(of_body).filter(|&(.., factor)| factor != 0.0).collect()
    }

    /// Lets the first number of a motion act on what is pushed.
    pub(super) fn push_with(&mut self, motion: Motion) {
        for &(body, share) in &self.pushed {
            let term = Term { component: 0, motion, number: 0, gain: share };
            self.spec.act(body, Coupling { components: 1, terms: vec![term] });
        }
    }
}

impl crate::loop_spec::Dynamics {
    /// A body on a line: its position (0) or velocity (1) in its continuous states.
    fn output(&self, number: usize) -> Vec<f64> {
        match self {
            Self::Plant(plant) | Self::Sensed { plant, .. } => plant.c.row(number).iter().copied().collect(),
            Self::Mass { .. } | Self::Rigid { .. } => {
                (0..2).map(|state| f64::from(u8::from(state == number))).collect()
            }
        }
    }
}

/// Where a body is and what it is.
fn place(body: &Body) -> Option<(HostIndex, Part)> {
    match body.states.first()? {
        &Coordinate::Own { host, part, .. } => Some((host, part)),
        _ => None,
    }
}

fn bodies_that(spec: &LoopSpec, is_wanted: impl Fn(&Body) -> bool) -> Vec<BodyId> {
    (0..spec.bodies.len()).filter(|&body| is_wanted(&spec.bodies[body])).map(BodyId).collect()
}

/// Only what forces connect, over any number of others, with the bodies that `is_start` names.
fn connected(spec: &LoopSpec, is_start: impl Fn(&Body) -> bool) -> LoopSpec {
    let mut is_in: Vec<bool> = spec.bodies.iter().map(is_start).collect();
    loop {
        let before = is_in.clone();
        for action in &spec.actions {
            let read = bodies_read(spec, action).filter(|&(_, gain)| gain != 0.0).map(|(body, _)| body);
            let together: Vec<_> = read.chain([action.body]).collect();
            if together.iter().any(|body| is_in[body.0]) {
                together.iter().for_each(|body| is_in[body.0] = true);
            }
        }
        if is_in == before {
            break;
        }
    }
    let mut flags = is_in.iter();
    restricted(spec, |_| *flags.next().unwrap_or(&false))
}

/// A loop without some of its bodies; with them go the forces on them and every force that reads them, and lines that
/// nothing reads any more.
fn restricted(spec: &LoopSpec, is_kept: impl FnMut(&Body) -> bool) -> LoopSpec {
    let is_kept: Vec<bool> = spec.bodies.iter().map(is_kept).collect();
    let survives = |action: &&Action| {
        is_kept[action.body.0] && bodies_read(spec, action).all(|(body, _)| is_kept[body.0])
    };
    let actions: Vec<&Action> = spec.actions.iter().filter(survives).collect();
    let mut is_used = vec![false; spec.lines.len()];
    for action in &actions {
        if let Force::Held(line) = action.force {
            is_used[line.0] = true;
        }
        for term in spec.coupling_of(action).into_iter().flat_map(|coupling| &coupling.terms) {
            if let Motion::Held(line) = term.motion {
                is_used[line.0] = true;
            }
        }
    }
    let places = Places { bodies: numbered(&is_kept), lines: numbered(&is_used) };
    let kept = |flags: &[bool]| (0..flags.len()).filter(|&index| flags[index]).collect::<Vec<_>>();
    LoopSpec {
        schedule: spec.schedule,
        bodies: kept(&is_kept).into_iter().map(|body| spec.bodies[body].clone()).collect(),
        lines: kept(&is_used).into_iter().map(|line| places.line(&spec.lines[line])).collect(),
        blocks: Vec::new(),
        actions: actions.into_iter().map(|action| places.action(action)).collect(),
    }
}

/// The bodies that the force of an action depends on, with the gains.
fn bodies_read<'a>(spec: &'a LoopSpec, action: &'a Action) -> impl Iterator<Item = (BodyId, f64)> + 'a {
    let terms = spec.coupling_of(action).into_iter().flat_map(|coupling| &coupling.terms);
    terms.filter_map(|term| Some((spec.body_of(term.motion)?, term.gain)))
}

/// New places of what is kept.
struct Places {
    bodies: Vec<usize>,
    lines: Vec<usize>,
}

fn numbered(flags: &[bool]) -> Vec<usize> {
    let count = |next: &mut usize, &flag: &bool| {
        let place = *next;
        *next += usize::from(flag);
        Some(place)
    };
    flags.iter().scan(0, count).collect()
}

impl Places {
    fn body(&self, body: BodyId) -> BodyId {
        BodyId(self.bodies[body.0])
    }

    fn line(&self, line: &Line) -> Line {
        let signal = match &line.signal {
            &Signal::Motion(body) => Signal::Motion(self.body(body)),
            &Signal::Position(body) => Signal::Position(self.body(body)),
            Signal::Force(coupling) => Signal::Force(self.coupling(coupling)),
        };
        Line { signal, ..line.clone() }
    }

    fn coupling(&self, coupling: &Coupling) -> Coupling {
        let motion = |motion| match motion {
            Motion::Ground => Motion::Ground,
            Motion::Current(body) => Motion::Current(self.body(body)),
            Motion::Held(line) => Motion::Held(LineId(self.lines[line.0])),
            Motion::Output(block) => Motion::Output(block),
        };
        let term = |term: &Term| Term { motion: motion(term.motion), ..*term };
        Coupling { components: coupling.components, terms: coupling.terms.iter().map(term).collect() }
    }

    fn action(&self, action: &Action) -> Action {
        let force = match &action.force {
            Force::Coupling(coupling) => Force::Coupling(self.coupling(coupling)),
            Force::Held(line) => Force::Held(LineId(self.lines[line.0])),
        };
        Action { body: self.body(action.body), force }
    }
}
