//! Parts of a loop: one user at the object while the others are absent (Fig 6.1 (a)–(c)), and the copies of the object
//! without any hand (Fig 6.3).

use std::collections::BTreeSet;

use cotouch_scene::names::{Coordinate, HostIndex, Part};
use glam::DVec3;

use crate::loop_spec::{
    AppliedForce, Block, BlockId, BodyId, Dof, Force, ForceGains, Line, LineId, LoopBody, LoopSpec, Motion,
    Signal, Term,
};

/// A loop, and the bodies of it on which a user's force acts.
#[derive(Clone, Debug)]
pub(super) struct Held {
    /// The loop.
    pub(super) spec: LoopSpec,
    /// What the force acts on.
    pub(super) pushed: Vec<End>,
    /// Whose motion answers: the sum of their shares.
    pub(super) read: Vec<End>,
}

/// A body on which a user's force acts, or whose motion answers.
#[derive(Clone, Debug)]
pub(super) struct End {
    pub(super) body: BodyId,
    /// For each of its degrees of freedom: the component of the force of 1 N, or the weight of its motion.
    pub(super) shares: Vec<f64>,
}

impl Held {
    /// Of a session's loop: the fingers of `user`, which share the force equally, each along its own direction `along` (unit,
    /// world), and all copies of the object that they have to do with. All other hands are gone, with every coupler to them.
    pub(super) fn by_hand(spec: &LoopSpec, user: HostIndex, along: &dyn Fn(u8) -> DVec3) -> Self {
        let finger = |body: &LoopBody| match place(body) {
            Some((host, Part::Hand(finger))) => Some((host, finger)),
            _ => None,
        };
        let is_present = |body: &LoopBody| finger(body).is_none_or(|(host, _)| host == user);
        let own = |body: &LoopBody| finger(body).filter(|&(host, _)| host == user).map(|(_, finger)| finger);
        let spec = connected(&restricted(spec, is_present), |body| own(body).is_some());
        let fingers =
            spec.bodies.iter().enumerate().filter_map(|(index, body)| Some((index, own(body)?, body)));
        let share = 1.0 / fingers.clone().count().max(1) as f64;
        let end = |(index, finger, body): (usize, u8, &LoopBody)| {
            let component = |dof: &Dof| share * along(finger)[dof.axis().index()];
            End { body: BodyId(index), shares: body.axes.iter().map(component).collect() }
        };
        let ends: Vec<End> = fingers.map(end).collect();
        Self { pushed: ends.clone(), read: ends, spec }
    }

    /// The copies of the object, on one line, alone. The force acts on every copy, and the copy of `user` (of a centralized
    /// session, the only one) answers.
    ///
    /// In the model, the others get samples of the force, some network periods late: without effect on a constant force.
    pub(super) fn directly(spec: &LoopSpec, user: HostIndex) -> Self {
        let is_copy = |body: &LoopBody| matches!(place(body), Some((_, Part::Object(_))));
        let copies = restricted(spec, is_copy);
        let host = |body: &LoopBody| place(body).map(|(host, _)| host);
        let has_own = copies.bodies.iter().any(|body| host(body) == Some(user));
        let keeper = if has_own { user } else { HostIndex::FIRST };
        let is_read = |body: &LoopBody| host(body) == Some(keeper);
        let spec = connected(&copies, is_read);
        let end = |(index, _): (usize, &LoopBody)| End { body: BodyId(index), shares: vec![1.0] };
        let pushed = spec.bodies.iter().enumerate().map(end).collect();
        let read = spec.bodies.iter().enumerate().filter(|(_, body)| is_read(body)).map(end).collect();
        Self { pushed, read, spec }
    }

    /// The positions (`order` 0) or velocities (1) that are read, as states: which body, which of its states, factor.
    /// True motion, not what a sensor tells of it.
    pub(super) fn answer(&self, order: usize) -> Vec<(BodyId, usize, f64)> {
        let numbers = |end: &End| {
            let (body, axes) = (end.body, end.shares.len());
            let of_axis = move |(axis, share): (usize, f64)| (body, order * axes + axis, share);
            end.shares.clone().into_iter().enumerate().map(of_axis).collect::<Vec<_>>()
        };
        let states = |(body, number, share): (BodyId, usize, f64)| {
            let row = self.spec.bodies[body.0].dynamics.output(number);
            row.into_iter().map(move |(state, factor)| (body, state, factor * share))
        };
        let all = self.read.iter().flat_map(numbers).flat_map(states);
        all.filter(|&(.., factor)| factor != 0.0).collect()
    }

    /// Lets the first number of a motion act on what is pushed.
    pub(super) fn push_with(&mut self, motion: Motion) {
        for End { body, shares } in &self.pushed {
            let components = shares.len();
            let term = |(component, &gain)| Term { component, motion, number: 0, gain };
            self.spec
                .act(*body, ForceGains { components, terms: shares.iter().enumerate().map(term).collect() });
        }
    }
}

/// Where a body is and what it is.
fn place(body: &LoopBody) -> Option<(HostIndex, Part)> {
    match body.states.first()? {
        &Coordinate::Own { host, part, .. } => Some((host, part)),
        _ => None,
    }
}

/// Only what forces connect, over any number of others, with the bodies that `is_start` names.
fn connected(spec: &LoopSpec, is_start: impl Fn(&LoopBody) -> bool) -> LoopSpec {
    let mut is_in: Vec<bool> = spec.bodies.iter().map(is_start).collect();
    loop {
        let before = is_in.clone();
        for action in &spec.actions {
            let together: Vec<_> =
                Sources::of_action(spec, action).bodies.into_iter().chain([action.body]).collect();
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

/// A loop without some of its bodies; with them go the forces on them and every force that depends on them, and lines and
/// blocks that nothing reads any more.
fn restricted(spec: &LoopSpec, is_kept: impl FnMut(&LoopBody) -> bool) -> LoopSpec {
    let is_kept: Vec<bool> = spec.bodies.iter().map(is_kept).collect();
    let mut used = Sources::default();
    let mut actions = Vec::new();
    for action in spec.actions.iter().filter(|action| is_kept[action.body.0]) {
        let sources = Sources::of_action(spec, action);
        if sources.bodies.iter().all(|body| is_kept[body.0]) {
            actions.push(action);
            used.lines.extend(sources.lines);
            used.blocks.extend(sources.blocks);
        }
    }
    let places = Places {
        bodies: (0..spec.bodies.len()).map(BodyId).filter(|body| is_kept[body.0]).collect(),
        lines: used.lines.into_iter().collect(),
        blocks: used.blocks.into_iter().collect(),
    };
    LoopSpec {
        schedule: spec.schedule,
        bodies: places.bodies.iter().map(|body| spec.bodies[body.0].clone()).collect(),
        lines: places.lines.iter().map(|line| places.line(&spec.lines[line.0])).collect(),
        blocks: places.blocks.iter().map(|block| places.block(&spec.blocks[block.0])).collect(),
        actions: actions.into_iter().map(|action| places.action(action)).collect(),
    }
}

/// What a force depends on, at once and over lines and blocks.
#[derive(Default)]
struct Sources {
    bodies: BTreeSet<BodyId>,
    lines: BTreeSet<LineId>,
    blocks: BTreeSet<BlockId>,
}

impl Sources {
    fn of_action(spec: &LoopSpec, action: &AppliedForce) -> Self {
        let mut sources = Self::default();
        match &action.force {
            Force::Gains(coupling) => sources.add_coupling(spec, coupling),
            &Force::Held(line) => sources.add_line(spec, line),
        }
        sources
    }

    fn add_coupling(&mut self, spec: &LoopSpec, coupling: &ForceGains) {
        for term in acting(coupling) {
            match term.motion {
                Motion::Ground => {}
                Motion::Current(body) => {
                    self.bodies.insert(body);
                }
                Motion::Held(line) => self.add_line(spec, line),
                Motion::Output(block) => {
                    if self.blocks.insert(block) {
                        self.add_coupling(spec, &spec.blocks[block.0].input);
                    }
                }
            }
        }
    }

    fn add_line(&mut self, spec: &LoopSpec, line: LineId) {
        if !self.lines.insert(line) {
            return;
        }
        match &spec.lines[line.0].signal {
            &Signal::Motion(body) | &Signal::Position(body) => {
                self.bodies.insert(body);
            }
            Signal::Force(coupling) => self.add_coupling(spec, coupling),
        }
    }
}

fn acting(coupling: &ForceGains) -> impl Iterator<Item = &Term> {
    coupling.terms.iter().filter(|term| term.gain != 0.0)
}

/// What is kept, in order: its new places.
struct Places {
    bodies: Vec<BodyId>,
    lines: Vec<LineId>,
    blocks: Vec<BlockId>,
}

/// The place of something among what is kept, which it is.
fn new_place<Id: Ord>(kept: &[Id], id: &Id) -> usize {
    kept.partition_point(|other| other < id)
}

impl Places {
    fn body(&self, body: BodyId) -> BodyId {
        BodyId(new_place(&self.bodies, &body))
    }

    fn line(&self, line: &Line) -> Line {
        let signal = match &line.signal {
            &Signal::Motion(body) => Signal::Motion(self.body(body)),
            &Signal::Position(body) => Signal::Position(self.body(body)),
            Signal::Force(coupling) => Signal::Force(self.coupling(coupling)),
        };
        Line { signal, ..line.clone() }
    }

    fn block(&self, block: &Block) -> Block {
        Block { input: self.coupling(&block.input), ..block.clone() }
    }

    fn coupling(&self, coupling: &ForceGains) -> ForceGains {
        let motion = |motion| match motion {
            Motion::Ground => Motion::Ground,
            Motion::Current(body) => Motion::Current(self.body(body)),
            Motion::Held(line) => Motion::Held(LineId(new_place(&self.lines, &line))),
            Motion::Output(block) => Motion::Output(BlockId(new_place(&self.blocks, &block))),
        };
        let term = |term: &Term| Term { motion: motion(term.motion), ..*term };
        ForceGains { components: coupling.components, terms: acting(coupling).map(term).collect() }
    }

    fn action(&self, action: &AppliedForce) -> AppliedForce {
        let force = match &action.force {
            Force::Gains(coupling) => Force::Gains(self.coupling(coupling)),
            Force::Held(line) => Force::Held(LineId(new_place(&self.lines, line))),
        };
        AppliedForce { body: self.body(action.body), force }
    }
}
