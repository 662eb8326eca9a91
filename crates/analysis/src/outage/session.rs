//! A session's loop for an outage: what is always there, and what fades with a peer.

use std::sync::Arc;

use cotouch_scene::names::{Coordinate, HostIndex, Part};
use cotouch_scene::scene::SceneValues;
use cotouch_world::coordination::{self, Scheme};

use crate::lift::layout::{Layout, Registers};
use crate::lift::stepping::lift;
use crate::loop_spec::{
    AppliedForce, BodyId, Force, ForceGains, Line, LineId, LoopBody, LoopSpec, Motion, Signal, Term,
};
use crate::rigid::Structure;

/// A session whose couplings to peers stand apart from the rest of its loop.
pub(super) struct FadingSession {
    /// The loop without what is in `couplings`.
    pub(super) spec: LoopSpec,
    pub(super) couplings: Vec<FadingCoupling>,
    pub(super) hands: Vec<Hand>,
    /// What may come apart, as differences of positions.
    pub(super) apart: Vec<ForceGains>,
    /// Whether couplings fade in this loop; else samples are held for as long as an outage lasts.
    pub(super) fades: bool,
    scheme: Arc<dyn Scheme>,
}

/// A force whose share depends on who is there.
pub(super) struct FadingCoupling {
    pub(super) on: Target,
    pub(super) force: ForceGains,
    pub(super) presence: Presence,
}

/// What a force acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Body(BodyId),
    /// The samples of a force that goes back to a client.
    Sample(LineId),
}

/// Who must be there for a force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Presence {
    /// Nobody: it is the own host's.
    Always,
    /// A held finger of `from`, at `to`.
    Finger { to: HostIndex, from: HostIndex },
    /// The copy that `from` has of a body, at `to`.
    Copy { to: HostIndex, from: HostIndex },
}

/// A finger of a user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Hand {
    pub(super) body: BodyId,
    pub(super) user: HostIndex,
    pub(super) finger: u8,
    /// Whether its force is what a server says.
    pub(super) is_served: bool,
}

impl FadingSession {
    pub(super) fn new(scene: &SceneValues, spec: &LoopSpec) -> Self {
        let [translation, _] = coordination::gains(&scene.coupling);
        let mut session = Self {
            hands: hands(spec),
            apart: apart(spec),
            spec: spec.clone(),
            couplings: Vec::new(),
            fades: !reads_samples_in_blocks(spec),
            scheme: coordination::scheme(scene, translation),
        };
        if session.fades {
            session.take_out_actions();
            session.take_out_samples();
        }
        session
    }

    /// How much a channel between copies counts while so many of all others are there, to how much it does while all are.
    pub(super) fn channel_weight(&self, present_peers: f64, peers: f64) -> f64 {
        self.scheme.weight(present_peers) / self.scheme.weight(peers)
    }

    fn take_out_actions(&mut self) {
        for AppliedForce { body, force } in std::mem::take(&mut self.spec.actions) {
            let is_served = self.hands.iter().any(|hand| hand.body == body && hand.is_served);
            match force {
                Force::Gains(force) => match presence(&self.spec, &force) {
                    Presence::Always if !is_served => self.spec.act(body, force),
                    presence => {
                        self.couplings.push(FadingCoupling { on: Target::Body(body), force, presence })
                    }
                },
                Force::Held(line) => self.spec.apply_held(body, line),
            }
        }
    }

    fn take_out_samples(&mut self) {
        for index in 0..self.spec.lines.len() {
            let Signal::Force(force) = &self.spec.lines[index].signal else { continue };
            let nothing = ForceGains::new(force.components);
            let presence = presence(&self.spec, force);
            if presence == Presence::Always {
                continue;
            }
            let signal = std::mem::replace(&mut self.spec.lines[index].signal, Signal::Force(nothing));
            let Signal::Force(force) = signal else { continue };
            self.couplings.push(FadingCoupling { on: Target::Sample(LineId(index)), force, presence });
        }
    }
}

/// Who must be there for a force that something computes: at most one peer, since every force is between two things.
fn presence(spec: &LoopSpec, force: &ForceGains) -> Presence {
    let held = force.terms.iter().find_map(|term| match term.motion {
        Motion::Held(LineId(line)) => Some(&spec.lines[line]),
        _ => None,
    });
    held.map_or(Presence::Always, |line| match line.part {
        Part::Object(_) => Presence::Copy { to: line.host, from: line.from },
        _ => Presence::Finger { to: line.host, from: line.from },
    })
}

/// Whether something reads samples that is no force of one tick: a local model, a soft body, a scheme that remembers.
fn reads_samples_in_blocks(spec: &LoopSpec) -> bool {
    let mut inputs = spec.blocks.iter().flat_map(|block| &block.input.terms);
    inputs.any(|term| matches!(term.motion, Motion::Held(_)))
}

fn hands(spec: &LoopSpec) -> Vec<Hand> {
    let is_served = |body: BodyId| {
        spec.actions.iter().any(|action| action.body == body && matches!(action.force, Force::Held(_)))
    };
    let hand = |(index, body): (usize, &LoopBody)| match body.states.first() {
        Some(&Coordinate::Own { host: user, part: Part::Hand(finger), .. }) => {
            let body = BodyId(index);
            Some(Hand { body, user, finger, is_served: is_served(body) })
        }
        _ => None,
    };
    spec.bodies.iter().enumerate().filter_map(hand).collect()
}

/// Between the copies of every body at two hosts; where there is one copy, or none, between a finger and what another host knows
/// of it.
fn apart(spec: &LoopSpec) -> Vec<ForceGains> {
    let copies: Vec<_> = spec
        .bodies
        .iter()
        .enumerate()
        .filter_map(|(index, body)| match body.states.first() {
            Some(&Coordinate::Own { part: Part::Object(object), .. }) => Some((object, BodyId(index))),
            _ => None,
        })
        .collect();
    let between_copies: Vec<_> = copies
        .iter()
        .enumerate()
        .flat_map(|(place, &(object, copy))| {
            let others = copies[place + 1..].iter().filter(move |&&(other, _)| other == object);
            others.map(move |&(_, other)| (Motion::Current(copy), other))
        })
        .collect();
    let pairs = if between_copies.is_empty() { fingers_and_samples(spec) } else { between_copies };
    pairs.into_iter().map(|(motion, body)| difference(spec, motion, body)).collect()
}

fn fingers_and_samples(spec: &LoopSpec) -> Vec<(Motion, BodyId)> {
    let of_line = |(index, line): (usize, &Line)| match line.signal {
        Signal::Motion(body) | Signal::Position(body) => Some((Motion::Held(LineId(index)), body)),
        Signal::Force(_) => None,
    };
    spec.lines.iter().enumerate().filter_map(of_line).collect()
}

/// Of positions, along the axes of the world.
fn difference(spec: &LoopSpec, motion: Motion, body: BodyId) -> ForceGains {
    let moves = spec.bodies[body.0].axes.iter().filter(|dof| !dof.turns()).count();
    let mut difference = ForceGains::new(moves);
    for (motion, gain) in [(motion, 1.0), (Motion::Current(body), -1.0)] {
        difference.terms.extend((0..moves).map(|component| Term {
            component,
            motion,
            number: component,
            gain,
        }));
    }
    difference
}

/// Whether something can be moved without a force that would bring it back while nothing arrives: what a hand holds drifts away.
pub(super) fn drifts(session: &FadingSession) -> bool {
    let mut alone = session.spec.clone();
    alone.actions.retain(|action| matches!(action.force, Force::Gains(_)));
    for block in &mut alone.blocks {
        block.input.terms.retain(|term| !matches!(term.motion, Motion::Held(_)));
    }
    let layout = Layout::new(&alone, Registers::PerReceiver);
    let map = lift(&alone, &layout);
    !Structure::new(&alone, &layout, &map).rigid.is_empty()
}
