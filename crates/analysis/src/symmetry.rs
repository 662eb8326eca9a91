//! Users who are alike: a loop that does not change when two hosts change places falls apart.
//!
//! For a group of m such hosts, every motion is the sum of one in which all of them move alike and of ones in which
//! their motions sum to 0 while everything outside the group rests. Both kinds are loops of one host of the group:
//!
//! - **alike**: what it reads of another member is its own;
//! - **against each other**: what it reads of *all* other members is minus its own, what it reads of the rest is 0. There
//!   are m − 1 independent ones, all with the same map.
//!
//! So 8 users with 8 states each have the eigenvalues of two maps of 8 states, one of them seven times.

use std::collections::BTreeMap;

use cotouch_scene::names::{Coordinate, HostIndex, Part};

use crate::loop_spec::{
    AppliedForce, BodyId, Delay, Force, ForceGains, Line, LineId, LoopBody, LoopSpec, Motion, Signal, Term,
};
use crate::rigid::translates_only_with;

/// A loop whose eigenvalues the whole has `copies` times.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Share {
    pub(crate) spec: LoopSpec,
    pub(crate) copies: usize,
    /// Whether members of a group move against each other: it has no eigenvalue 1 by structure.
    pub(crate) opposed: bool,
}

/// The parts of a consistent loop whose eigenvalues are, together, those of the loop; the loop itself where no hosts
/// are alike.
///
/// The first part has all eigenvalues that are 1 by structure. Loops in which something turns, and such in which one
/// member of a group can drift without the others, stay whole.
pub(crate) fn split(spec: &LoopSpec) -> Vec<Share> {
    let mut opposed = Vec::new();
    let mut alike = spec.clone();
    while let Some((next, against, copies)) = reduce(&alike) {
        opposed.push(Share { spec: against, copies, opposed: true });
        alike = next;
    }
    std::iter::once(Share { spec: alike, copies: 1, opposed: false }).chain(opposed).collect()
}

/// One group less: all alike; against each other, and how many times that.
fn reduce(spec: &LoopSpec) -> Option<(LoopSpec, LoopSpec, usize)> {
    let turns = |body: &LoopBody| body.axes.iter().any(|axis| axis.turns());
    if !spec.blocks.is_empty() || spec.bodies.iter().any(turns) {
        return None;
    }
    let hosts = Hosts::of(spec)?;
    let group = hosts.groups(spec).into_iter().find(|group| group.len() > 1)?;
    let own = |&body: &usize| hosts.of_body[body] == group[0];
    let own: Vec<usize> = (0..spec.bodies.len()).filter(own).collect();
    let counterparts = |&host| own.iter().map(|&body| hosts.counterpart(spec, body, host)).collect();
    let members = group.iter().map(counterparts).collect::<Option<Vec<Vec<usize>>>>()?;
    if !translates_only_with(spec, &members) {
        return None;
    }
    let part = |opposed| Reduction::new(spec, &hosts, &group, opposed)?.whole();
    Some((part(false)?, part(true)?, group.len() - 1))
}

/// Where every body lives, and how to find it and the lines by name.
struct Hosts {
    of_body: Vec<HostIndex>,
    bodies: BTreeMap<Vec<Coordinate>, usize>,
    lines: BTreeMap<(HostIndex, HostIndex, Part), usize>,
}

impl Hosts {
    /// Nothing where a body's states do not live on one host, or a host sends to itself.
    fn of(spec: &LoopSpec) -> Option<Self> {
        let of_body = spec.bodies.iter().map(host_of).collect::<Option<Vec<_>>>()?;
        let bodies = spec.bodies.iter().map(|body| body.states.clone()).zip(0..).collect();
        let key = |line: &Line| (line.host, line.from, line.part);
        let lines: BTreeMap<_, _> = spec.lines.iter().map(key).zip(0..).collect();
        (lines.len() == spec.lines.len()).then_some(Self { of_body, bodies, lines })
    }

    /// Hosts that can change places, in order; a host that is like no other is alone.
    fn groups(&self, spec: &LoopSpec) -> Vec<Vec<HostIndex>> {
        let mut hosts: Vec<HostIndex> = self.of_body.clone();
        hosts.sort_unstable();
        hosts.dedup();
        let mut groups: Vec<Vec<HostIndex>> = Vec::new();
        for host in hosts {
            // If a and b can change places, and b and c, so can a and c.
            match groups.iter_mut().find(|group| self.can_swap(spec, group[0], host)) {
                Some(group) => group.push(host),
                None => groups.push(vec![host]),
            }
        }
        groups
    }

    fn can_swap(&self, spec: &LoopSpec, one: HostIndex, other: HostIndex) -> bool {
        Swap::new(self, spec, one, other).is_some_and(|swap| swap.changes_nothing(spec))
    }

    /// The body that is to `host` what `body` is to its own.
    fn counterpart(&self, spec: &LoopSpec, body: usize, host: HostIndex) -> Option<usize> {
        let rename = |_| host;
        let names: Vec<_> = spec.bodies[body].states.iter().map(|&name| renamed(name, &rename)).collect();
        self.bodies.get(&names).copied()
    }
}

/// The host of all of a body's states.
fn host_of(body: &LoopBody) -> Option<HostIndex> {
    let host = |name: &Coordinate| match *name {
        Coordinate::Own { host, .. } => Some(host),
        _ => None,
    };
    let first = host(body.states.first()?)?;
    body.states.iter().all(|name| host(name) == Some(first)).then_some(first)
}

fn renamed(name: Coordinate, rename: &impl Fn(HostIndex) -> HostIndex) -> Coordinate {
    match name {
        Coordinate::Own { host, part, quantity } => Coordinate::Own { host: rename(host), part, quantity },
        other => other,
    }
}

/// Two hosts that change places: where each body and line goes.
struct Swap {
    bodies: Vec<usize>,
    lines: Vec<usize>,
}

impl Swap {
    fn new(hosts: &Hosts, spec: &LoopSpec, one: HostIndex, other: HostIndex) -> Option<Self> {
        let swapped = |host| {
            if host == one {
                other
            } else if host == other {
                one
            } else {
                host
            }
        };
        let body = |(body, &host): (usize, &HostIndex)| hosts.counterpart(spec, body, swapped(host));
        let line = |line: &Line| {
            // A host that sends to itself is not like one that sends to others.
            let sends_to_itself = line.host == line.from && swapped(line.host) != line.host;
            let key = (swapped(line.host), swapped(line.from), line.part);
            hosts.lines.get(&key).copied().filter(|_| !sends_to_itself)
        };
        Some(Self {
            bodies: hosts.of_body.iter().enumerate().map(body).collect::<Option<_>>()?,
            lines: spec.lines.iter().map(line).collect::<Option<_>>()?,
        })
    }

    fn changes_nothing(&self, spec: &LoopSpec) -> bool {
        let same_body = |(body, &image): (usize, &usize)| {
            let (body, image) = (&spec.bodies[body], &spec.bodies[image]);
            body.axes == image.axes && body.dynamics == image.dynamics
        };
        self.bodies.iter().enumerate().all(same_body)
            && spec
                .lines
                .iter()
                .zip(&self.lines)
                .all(|(line, &image)| self.same_line(line, &spec.lines[image]))
            && (0..spec.bodies.len()).all(|body| self.same_forces(spec, body))
    }

    fn same_line(&self, line: &Line, image: &Line) -> bool {
        let same_signal = match (&line.signal, &image.signal) {
            (Signal::Motion(body), Signal::Motion(image))
            | (Signal::Position(body), Signal::Position(image)) => self.bodies[body.0] == image.0,
            (Signal::Force(force), Signal::Force(image)) => {
                force.components == image.components
                    && sorted(force.terms.iter().map(|term| self.moved(term)).collect())
                        == sorted(image.terms.clone())
            }
            _ => false,
        };
        line.delay == image.delay && same_signal
    }

    fn same_forces(&self, spec: &LoopSpec, body: usize) -> bool {
        let held = |body: usize, line_of: &dyn Fn(LineId) -> usize| {
            let actions = spec.actions.iter().filter(|action| action.body.0 == body);
            let mut lines: Vec<usize> = actions
                .filter_map(|action| match action.force {
                    Force::Held(line) => Some(line_of(line)),
                    Force::Gains(_) => None,
                })
                .collect();
            lines.sort_unstable();
            lines
        };
        let image = self.bodies[body];
        let moved = terms_on(spec, body).map(|term| self.moved(term)).collect();
        held(body, &|line| self.lines[line.0]) == held(image, &|line| line.0)
            && sorted(moved) == sorted(terms_on(spec, image).copied().collect())
    }

    fn moved(&self, term: &Term) -> Term {
        let motion = match term.motion {
            Motion::Ground => Motion::Ground,
            Motion::Current(body) => Motion::Current(BodyId(self.bodies[body.0])),
            Motion::Held(line) => Motion::Held(LineId(self.lines[line.0])),
            Motion::Output(block) => Motion::Output(block),
        };
        Term { motion, ..*term }
    }
}

/// Of all forces that are evaluated at every tick.
fn terms_on(spec: &LoopSpec, body: usize) -> impl Iterator<Item = &Term> {
    let actions = spec.actions.iter().filter(move |action| action.body.0 == body);
    actions.flat_map(|action| match &action.force {
        Force::Gains(coupling) => coupling.terms.as_slice(),
        Force::Held(_) => &[],
    })
}

fn sorted(mut terms: Vec<Term>) -> Vec<Term> {
    let key = |term: &Term| {
        let motion = match term.motion {
            Motion::Ground => (0, 0),
            Motion::Current(body) => (1, body.0),
            Motion::Held(line) => (2, line.0),
            Motion::Output(block) => (3, block.0),
        };
        (term.component, motion, term.number)
    };
    terms.sort_by(|a, b| key(a).cmp(&key(b)).then(a.gain.total_cmp(&b.gain)));
    terms
}

/// A loop of one member of a group that is being written down.
struct Reduction<'a> {
    from: &'a LoopSpec,
    hosts: &'a Hosts,
    group: &'a [HostIndex],
    opposed: bool,
    to: LoopSpec,
    /// The place of each body, or of its counterpart; none for what is left out.
    bodies: Vec<Option<BodyId>>,
    lines: BTreeMap<(HostIndex, HostIndex, Part), LineId>,
}

impl<'a> Reduction<'a> {
    fn new(from: &'a LoopSpec, hosts: &'a Hosts, group: &'a [HostIndex], opposed: bool) -> Option<Self> {
        let mut reduction = Self {
            from,
            hosts,
            group,
            opposed,
            to: LoopSpec::new(from.schedule),
            bodies: vec![None; from.bodies.len()],
            lines: BTreeMap::new(),
        };
        for body in 0..from.bodies.len() {
            if reduction.keeps(hosts.of_body[body]) {
                reduction.bodies[body] = Some(reduction.to.body(from.bodies[body].clone()));
            }
        }
        for body in 0..from.bodies.len() {
            if group.contains(&hosts.of_body[body]) {
                let own = hosts.counterpart(from, body, group[0])?;
                reduction.bodies[body] = reduction.bodies[own];
            }
        }
        Some(reduction)
    }

    fn keeps(&self, host: HostIndex) -> bool {
        host == self.group[0] || !(self.opposed || self.group.contains(&host))
    }

    /// The member that stands for the group, and everybody else.
    fn image(&self, host: HostIndex) -> HostIndex {
        if self.group.contains(&host) { self.group[0] } else { host }
    }

    /// With all forces on what is kept, and all samples of it.
    fn whole(mut self) -> Option<LoopSpec> {
        for line in &self.from.lines {
            let kept = match line.signal {
                Signal::Motion(body) | Signal::Position(body) => {
                    self.keeps(self.image(self.hosts.of_body[body.0]))
                }
                Signal::Force(_) => self.keeps(line.host),
            };
            if kept {
                self.line(line)?;
            }
        }
        for action in &self.from.actions {
            let host = self.hosts.of_body[action.body.0];
            if !self.keeps(host) {
                continue;
            }
            let body = self.bodies[action.body.0]?;
            let force = match &action.force {
                Force::Gains(coupling) => Force::Gains(self.coupling(coupling, host)?),
                Force::Held(line) if self.from.lines[line.0].host == host => {
                    Force::Held(self.line(&self.from.lines[line.0])?)
                }
                Force::Held(_) => return None,
            };
            self.to.actions.push(AppliedForce { body, force });
        }
        Some(self.to)
    }

    /// The line that stands for `line`.
    fn line(&mut self, line: &Line) -> Option<LineId> {
        let key = (self.image(line.host), self.image(line.from), line.part);
        if matches!(line.signal, Signal::Force(_)) && key.0 == key.1 {
            // Forces between members are one for every pair of them.
            return None;
        }
        let signal = match &line.signal {
            Signal::Motion(body) => Signal::Motion(self.bodies[body.0]?),
            Signal::Position(body) => Signal::Position(self.bodies[body.0]?),
            Signal::Force(coupling) => Signal::Force(self.coupling(coupling, line.host)?),
        };
        if let Some(&known) = self.lines.get(&key) {
            let Line { signal: of_known, delay, .. } = &self.to.lines[known.0];
            return (*of_known == signal && *delay == line.delay).then_some(known);
        }
        let (host, from, part) = key;
        let delay: Delay = line.delay;
        let id = self.to.line(Line { host, from, part, signal, delay });
        self.lines.insert(key, id);
        Some(id)
    }

    /// The force on `host`, or for it.
    fn coupling(&mut self, coupling: &ForceGains, host: HostIndex) -> Option<ForceGains> {
        let mut reduced = ForceGains::new(coupling.components);
        for term in &coupling.terms {
            let Some(body) = self.from.body_of(term.motion) else { continue };
            let Some(sign) = self.sign(host, self.hosts.of_body[body.0]) else { continue };
            let motion = match term.motion {
                Motion::Ground | Motion::Output(_) => continue,
                Motion::Current(_) => Motion::Current(self.bodies[body.0]?),
                Motion::Held(line) => Motion::Held(self.line(&self.from.lines[line.0])?),
            };
            reduced.terms.push(Term { motion, gain: sign * term.gain, ..*term });
        }
        Some(reduced)
    }

    /// What a motion of `from` counts for `host`; nothing where it is 0, or counted with another one.
    fn sign(&self, host: HostIndex, from: HostIndex) -> Option<f64> {
        if !self.opposed || host == from {
            return Some(1.0);
        }
        // All others together move by minus one's own, so the first of them stands for all.
        (self.group.get(1) == Some(&from)).then_some(-1.0)
    }
}
