//! What came apart in an outage, brought together as hosts do it ([`cotouch_world::Offset`]): for each trajectory by itself, since what comes
//! together by itself stays together, which no linear loop does. It is in proportion to the pushes all the same.

use cotouch_scene::names::{Coordinate, HostIndex, Part};
use cotouch_scene::scene::SceneValues;
use cotouch_world::coupler::Stretch;
use cotouch_world::{Offset, RejoiningPace};
use glam::{DMat3, DVec3};
use nalgebra::DMatrix;

use super::session::{FadingSession, Presence};
use super::timeline::Timeline;
use crate::dof::Dof;
use crate::lift::rows::Rows;
use crate::loop_spec::{BodyId, ForceGains, LineId, LoopSpec, Motion, Signal, Term};

/// How hosts of a session bring together what came apart.
pub(super) struct Rejoining {
    pub(super) pace: RejoiningPace,
    pairs: Vec<Pair>,
    /// For each coupling of the session, what of its force goes with which offset.
    parts: Vec<Vec<OffsetPart>>,
}

/// A held motion, and the own one to which it is drawn.
struct Pair {
    to: HostIndex,
    from: HostIndex,
    held: LineId,
    own: BodyId,
    kind: PairKind,
    /// Of the held motion, in order.
    dofs: Vec<Dof>,
    has_velocities: bool,
    /// Of a finger at a copy: how it would move along with the own body turning, by the axes of the finger and of the turn, m/rad.
    arm: DMat3,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PairKind {
    /// A copy of a body.
    Copy,
    /// A finger, displaced along with the copy of this pair.
    FingerAt(usize),
    /// A finger that a server knows of.
    Finger,
}

/// `gain` times one number of an offset adds to one component of a force.
struct OffsetPart {
    component: usize,
    pair: usize,
    dof: Dof,
    is_velocity: bool,
    gain: f64,
}

impl Rejoining {
    pub(super) fn new(scene: &SceneValues, session: &FadingSession) -> Self {
        let (rates, values) = (&scene.rates, &scene.session);
        let pace = RejoiningPace::new(values.rejoin_s, values.peer_fade_s, rates.control_hz.period_s());
        let pairs = if session.fades && pace.exists() { pairs(session) } else { Vec::new() };
        let part_of = |coupling: &super::session::FadingCoupling| parts(&pairs, &coupling.force);
        Self { pace, parts: session.couplings.iter().map(part_of).collect(), pairs }
    }

    pub(super) fn exists(&self) -> bool {
        !self.pairs.is_empty()
    }

    /// What must be observed: of every pair the held numbers, then the own ones.
    pub(super) fn observed(&self, spec: &LoopSpec) -> Vec<ForceGains> {
        let of = |motion: Motion, numbers: usize, count: usize, dofs: usize| {
            // Of a body that also turns, the first numbers are those that are shared.
            let place = |number: usize| if number < count { number } else { dofs + number - count };
            let term = |component| Term { component, motion, number: place(component), gain: 1.0 };
            ForceGains { components: numbers, terms: (0..numbers).map(term).collect() }
        };
        let of_pair = |pair: &Pair| {
            let (count, own) = (pair.dofs.len(), spec.bodies[pair.own.0].axes.len());
            let held = if pair.has_velocities { 2 * count } else { count };
            [
                of(Motion::Held(pair.held), held, count, count),
                of(Motion::Current(pair.own), 2 * count, count, own),
            ]
        };
        self.pairs.iter().flat_map(of_pair).collect()
    }

    /// What offsets add to the force of a coupling in one trajectory.
    pub(super) fn force(&self, coupling: usize, component: usize, offsets: &Offsets, column: usize) -> f64 {
        let of_part = |part: &OffsetPart| {
            let value = self.displacement(part.pair, offsets, column)[usize::from(part.dof.turns())];
            let vector = if part.is_velocity { value.velocity } else { value.position };
            part.gain * vector[part.dof.axis() as usize]
        };
        let parts = self.parts[coupling].iter().filter(|part| part.component == component);
        parts.map(of_part).sum()
    }

    /// How far a held motion counts as elsewhere, by place and by turning: a finger at a copy along with that.
    fn displacement(&self, pair: usize, offsets: &Offsets, column: usize) -> [Stretch; 2] {
        let own = &offsets.pairs[pair].columns[column];
        match self.pairs[pair].kind {
            PairKind::FingerAt(copy) => {
                let along = self.pairs[pair].along(&offsets.pairs[copy].columns[column]);
                [along + own.value(false), Stretch::default()]
            }
            PairKind::Copy | PairKind::Finger => [own.value(false), own.value(true)],
        }
    }

    /// No offsets, for so many trajectories.
    pub(super) fn start(&self, columns: usize) -> Offsets {
        let of_pair = |_: &Pair| OfPair { columns: vec![OfColumn::default(); columns] };
        Offsets { pairs: self.pairs.iter().map(of_pair).collect() }
    }

    /// One tick: offsets go on to it, and hosts meet. `first` is the row from which on [`observed`](Self::observed) lies.
    pub(super) fn advance(
        &self,
        offsets: &mut Offsets,
        timeline: &Timeline,
        tick: i64,
        observed: &Rows,
        first: usize,
    ) {
        let mut row = first;
        let mut rows = Vec::with_capacity(self.pairs.len());
        for (pair, of_pair) in self.pairs.iter().zip(&mut offsets.pairs) {
            let held_row = row;
            row += if pair.has_velocities { 2 } else { 1 } * pair.dofs.len();
            let own_row = row;
            row += 2 * pair.dofs.len();
            rows.push((held_row, own_row));
            for (index, column) in of_pair.columns.iter_mut().enumerate() {
                column.own = read(pair, observed, own_row, true, index);
                // Of a finger at a copy only what it moved on the body is displaced: that is in no ratchet.
                let is_rest = matches!(pair.kind, PairKind::FingerAt(_));
                for turns in [false, true] {
                    let apart =
                        column.held[usize::from(turns)].position - column.own[usize::from(turns)].position;
                    column.offsets[usize::from(turns)]
                        .advance(self.pace, if is_rest { DVec3::ZERO } else { apart });
                }
            }
        }
        self.meet(offsets, timeline, tick, observed, &rows);
        for ((pair, of_pair), (held_row, _)) in self.pairs.iter().zip(&mut offsets.pairs).zip(rows) {
            for (index, column) in of_pair.columns.iter_mut().enumerate() {
                column.held = read(pair, observed, held_row, pair.has_velocities, index);
            }
        }
    }

    fn meet(
        &self,
        offsets: &mut Offsets,
        timeline: &Timeline,
        tick: i64,
        observed: &Rows,
        rows: &[(usize, usize)],
    ) {
        let is_due =
            |pair: &Pair| timeline.meets(pair.to, pair.from).is_some_and(|meeting| meeting.tick == tick);
        if !self.pairs.iter().any(is_due) {
            return;
        }
        let before = offsets.pairs.clone();
        for (place, pair) in self.pairs.iter().enumerate() {
            let Some(meeting) = timeline.meets(pair.to, pair.from).filter(|meeting| meeting.tick == tick)
            else {
                continue;
            };
            for index in 0..before[place].columns.len() {
                let was = &before[place].columns[index];
                let held = read(pair, observed, rows[place].0, pair.has_velocities, index);
                let mut met = [Offset::default(); 2];
                for turns in [false, true] {
                    let at = usize::from(turns);
                    let (apart, former) = match pair.kind {
                        PairKind::FingerAt(copy) => {
                            let (then, now) =
                                (&before[copy].columns[index], &offsets.pairs[copy].columns[index]);
                            let counted = was.held[at] - pair.along(then) - was.value(turns);
                            (Stretch::default(), counted - (held[at] - pair.along(now)))
                        }
                        PairKind::Copy | PairKind::Finger => {
                            (held[at] - was.own[at], was.held[at] - was.own[at] - was.value(turns))
                        }
                    };
                    let former = if meeting.goes_on { former } else { Stretch::default() };
                    met[at] = Offset::met(self.pace, apart, former);
                }
                offsets.pairs[place].columns[index].offsets = met;
            }
        }
    }
}

impl Pair {
    /// How a finger is displaced along with a copy.
    fn along(&self, copy: &OfColumn) -> Stretch {
        let Stretch { position, velocity } = copy.value(true);
        copy.value(false) + Stretch { position: self.arm * position, velocity: self.arm * velocity }
    }
}

/// What changes of a [`Rejoining`].
pub(super) struct Offsets {
    pairs: Vec<OfPair>,
}

#[derive(Clone)]
struct OfPair {
    columns: Vec<OfColumn>,
}

/// Of one trajectory, by place and by turning.
#[derive(Clone, Default)]
struct OfColumn {
    offsets: [Offset; 2],
    /// At the tick before.
    held: [Stretch; 2],
    own: [Stretch; 2],
}

impl OfColumn {
    fn value(&self, turns: bool) -> Stretch {
        self.offsets[usize::from(turns)].value()
    }
}

fn read(pair: &Pair, observed: &Rows, first: usize, has_velocities: bool, column: usize) -> [Stretch; 2] {
    let mut motion = [Stretch::default(); 2];
    for (number, dof) in pair.dofs.iter().enumerate() {
        let motion = &mut motion[usize::from(dof.turns())];
        motion.position[dof.axis() as usize] = observed.row(first + number)[column];
        if has_velocities {
            motion.velocity[dof.axis() as usize] = observed.row(first + pair.dofs.len() + number)[column];
        }
    }
    motion
}

/// Copies first, so that fingers at them find them.
fn pairs(session: &FadingSession) -> Vec<Pair> {
    let spec = &session.spec;
    let mut pairs: Vec<Pair> = Vec::new();
    for is_copy in [true, false] {
        for coupling in &session.couplings {
            let (to, from) = match (is_copy, coupling.presence) {
                (true, Presence::Copy { to, from }) | (false, Presence::Finger { to, from }) => (to, from),
                _ => continue,
            };
            let held = coupling.force.terms.iter().find_map(|term| match term.motion {
                Motion::Held(line) => Some(line),
                _ => None,
            });
            let (Some(held), Some(own)) = (held, own_body(spec, to, &coupling.force)) else { continue };
            if pairs.iter().any(|pair| pair.held == held) {
                continue;
            }
            let copy = pairs.iter().position(|pair| {
                pair.kind == PairKind::Copy && (pair.to, pair.from, pair.own) == (to, from, own)
            });
            let kind = match (is_copy, copy) {
                (true, _) => PairKind::Copy,
                (false, Some(copy)) => PairKind::FingerAt(copy),
                (false, None) => PairKind::Finger,
            };
            let (dofs, has_velocities) = signal(spec, held);
            let arm = arm(spec, &coupling.force, (held, &dofs), own);
            pairs.push(Pair { to, from, held, own, kind, dofs, has_velocities, arm });
        }
    }
    pairs
}

/// The own body that a force is drawn to, or acts on: where a finger is held, the first.
fn own_body(spec: &LoopSpec, host: HostIndex, force: &ForceGains) -> Option<BodyId> {
    let is_own = |body: BodyId| matches!(spec.bodies[body.0].states.first(), Some(&Coordinate::Own { host: of, part: Part::Object(_), .. }) if of == host);
    force.terms.iter().find_map(|term| match term.motion {
        Motion::Current(body) if is_own(body) => Some(body),
        _ => None,
    })
}

/// `θ × r` for a finger at r from a body: the damping of a contact, `B·ḣ + C·(ẋ, ω)`, sees none of it if both move together, so `C_ω·ω = −B·(ω × r)`,
/// from which it is found along the directions in which there is damping at all; where there is none, from the stiffness, which is the
/// same but for what a preload does.
fn arm(spec: &LoopSpec, force: &ForceGains, (held, dofs): (LineId, &[Dof]), own: BodyId) -> DMat3 {
    let axes = spec.bodies[own.0].axes;
    let found = |is_velocity: bool| -> Option<DMatrix<f64>> {
        let nothing = DMatrix::<f64>::zeros(force.components, 3);
        let (mut of_finger, mut of_turns) = (nothing.clone(), nothing);
        let dof_of = |dofs: &[Dof], number: usize| {
            let first = if is_velocity { dofs.len() } else { 0 };
            dofs.get(number.checked_sub(first)?).copied()
        };
        for term in &force.terms {
            match term.motion {
                Motion::Held(line) if line == held => {
                    if let Some(dof) = dof_of(dofs, term.number) {
                        of_finger[(term.component, dof.axis() as usize)] += term.gain;
                    }
                }
                Motion::Current(body) if body == own => {
                    if let Some(dof) = dof_of(axes, term.number).filter(|dof| dof.turns()) {
                        of_turns[(term.component, dof.axis() as usize)] += term.gain;
                    }
                }
                _ => {}
            }
        }
        let acts = of_finger.iter().any(|&gain| gain != 0.0);
        acts.then(|| of_finger.pseudo_inverse(1e-12).ok()).flatten().map(|inverse| -inverse * of_turns)
    };
    let found = found(true).or_else(|| found(false));
    found.map_or(DMat3::ZERO, |found| DMat3::from_cols_array(&std::array::from_fn(|place| found[place])))
}

/// The degrees of freedom of what a line carries, and whether their velocities are there.
fn signal(spec: &LoopSpec, line: LineId) -> (Vec<Dof>, bool) {
    match spec.lines[line.0].signal {
        Signal::Motion(body) => (spec.bodies[body.0].axes.to_vec(), true),
        Signal::Position(body) => (spec.bodies[body.0].axes.to_vec(), false),
        Signal::Force(_) => (Vec::new(), false),
    }
}

/// A held motion is displaced by the opposite of its offset.
fn parts(pairs: &[Pair], force: &ForceGains) -> Vec<OffsetPart> {
    let part = |term: &Term| {
        let Motion::Held(line) = term.motion else { return None };
        let pair = pairs.iter().position(|pair| pair.held == line)?;
        let dofs = &pairs[pair].dofs;
        let is_velocity = term.number >= dofs.len();
        let dof = dofs[term.number - if is_velocity { dofs.len() } else { 0 }];
        Some(OffsetPart { component: term.component, pair, dof, is_velocity, gain: -term.gain })
    };
    force.terms.iter().filter_map(part).collect()
}
