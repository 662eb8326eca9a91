//! The session's own loop, stepped through an outage.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::SceneValues;
use cotouch_world::Offset;
use cotouch_world::coupler::Stretch;
use glam::DVec3;

use super::reach::{Gains, Reach};
use super::rejoining::{Offsets, Rejoining};
use super::session::{FadingSession, Presence, Target};
use super::timeline::{Governed, Timeline};
use crate::lift::layout::{Layout, Register};
use crate::lift::program::Program;
use crate::lift::rows::Rows;
use crate::lift::stepping::{Outside, Run};
use crate::loop_spec::{ForceGains, Motion, Term};

/// What is told of goes on for so long after everything is as it was before, s, and for as long as it still grows by more than
/// [`GROWTH`] in each such stretch, but no longer than [`LONGEST_S`].
const STRETCH_S: f64 = 1.0;
const GROWTH: f64 = 1e-3;
const LONGEST_S: f64 = 10.0;

/// A largest value, and how it comes about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Worst {
    /// N or m, where every push is at most 1 N.
    pub(super) size: f64,
    /// Which hand, or which of what may come apart.
    pub(super) place: usize,
    pub(super) direction: DVec3,
    pub(super) tick: i64,
}

/// What pushes of 1 N do.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Response {
    /// The largest force at a finger once packets arrive again.
    pub(super) force: Worst,
    /// The pushes that bring it about, one a hand, N.
    pub(super) pushes: Vec<DVec3>,
    /// The largest mean square of the force at a finger then, where every push has a random direction and a mean square of 1 N².
    pub(super) mean_square_n2: f64,
    /// How far apart things come, from the beginning on.
    pub(super) apart: Worst,
}

/// A session that can be stepped.
pub(super) struct Stepper<'a> {
    session: &'a FadingSession,
    layout: Layout,
    program: Program,
    axes: usize,
    rejoining: Rejoining,
    /// The first row of what is observed for that.
    first_observed: usize,
}

impl<'a> Stepper<'a> {
    pub(super) fn new(scene: &SceneValues, session: &'a FadingSession) -> Self {
        let axes = session.hands.first().map_or(1, |hand| session.spec.bodies[hand.body.0].axes.len());
        let layout = Layout::with_memory(&session.spec);
        let places = session.hands.iter().map(|hand| {
            let own = Motion::Current(hand.body);
            let term = |component| Term { component, motion: own, number: component, gain: 1.0 };
            ForceGains { components: axes, terms: (0..axes).map(term).collect() }
        });
        let couplings = session.couplings.iter().map(|coupling| coupling.force.clone());
        let mut observed: Vec<_> = couplings.chain(session.apart.iter().cloned()).chain(places).collect();
        let first_observed = observed.iter().map(|gains| gains.components).sum();
        let rejoining = Rejoining::new(scene, session);
        observed.extend(rejoining.observed(&session.spec));
        let program = Program::observing(&session.spec, &layout, &observed);
        Self { session, layout, program, axes, rejoining, first_observed }
    }

    /// What constant pushes do from the beginning of an outage on, everything being at rest before.
    pub(super) fn response(&self, timeline: &Timeline) -> Response {
        let pushes = self.axes * self.session.hands.len();
        let identity: Vec<Vec<f64>> = (0..pushes)
            .map(|row| (0..pushes).map(|column| f64::from(u8::from(row == column))).collect())
            .collect();
        let mut acting = Acting::new(self, timeline, Question::Largest, identity);
        self.step(&mut acting, |acting| acting.force.size);
        let Acting { force, pushes, mean_square_n2, apart, .. } = acting;
        let linear = Response { force, pushes, mean_square_n2, apart };
        if self.brings_together(timeline) { self.searched(timeline, linear) } else { linear }
    }

    /// Whether hosts bring together what came apart: then responses do not add up.
    fn brings_together(&self, timeline: &Timeline) -> bool {
        self.rejoining.exists() && timeline.first_meeting().is_some()
    }

    /// The worst that the patterns of pushes do, and those that would be worst without offsets.
    fn searched(&self, timeline: &Timeline, linear: Response) -> Response {
        let mut patterns = patterns(self.session.hands.len(), self.axes);
        let counted = patterns.len();
        patterns.push(linear.pushes.clone());
        let rows = (0..self.session.hands.len() * self.axes)
            .map(|row| patterns.iter().map(|pushes| pushes[row / self.axes][row % self.axes]).collect());
        let mut acting = Acting::new(self, timeline, Question::Patterns { counted }, rows.collect());
        self.step(&mut acting, |acting| acting.force.size);
        let apart = if acting.apart.size > linear.apart.size { acting.apart } else { linear.apart };
        Response {
            force: acting.force,
            pushes: patterns.swap_remove(acting.worst_column),
            mean_square_n2: acting.mean_square_n2,
            apart,
        }
    }

    /// The most energy (J) that the rendered forces have given to all hands together at any time since packets arrive again, with
    /// these pushes (N), one a hand.
    pub(super) fn energy_j(&self, timeline: &Timeline, pushes: &[DVec3]) -> f64 {
        let rows = pushes.iter().flat_map(|push| push.to_array()[..self.axes].to_vec());
        let mut acting = Acting::new(self, timeline, Question::Energy, rows.map(|push| vec![push]).collect());
        self.step(&mut acting, |acting| acting.most_energy_j);
        acting.most_energy_j
    }

    fn step(&self, acting: &mut Acting<'_>, grows: impl Fn(&Acting<'_>) -> f64) {
        let hz = self.session.spec.schedule.control().hz();
        let (stretch, last) = ((STRETCH_S * hz) as i64, acting.timeline.is_over + (LONGEST_S * hz) as i64);
        let mut run = Run::default();
        run.start(&self.program, acting.unit_pushes.first().map_or(0, Vec::len));
        let mut next_look = acting.timeline.is_over + stretch;
        let mut before = 0.0;
        loop {
            run.advance(&self.program, acting);
            if acting.tick < next_look {
                continue;
            }
            let now = grows(acting);
            if now <= before * (1.0 + GROWTH) || acting.tick >= last {
                return;
            }
            (before, next_look) = (now, next_look + stretch);
        }
    }
}

/// What is asked of the trajectories.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Question {
    /// The largest force and distance that their sums, each push weighted by at most 1, come to.
    Largest,
    /// The energy of one trajectory.
    Energy,
    /// The largest force and distance of each trajectory by itself, and the mean square of the first ones.
    Patterns { counted: usize },
}

/// Most fingers of which all patterns of signs are tried: then 32 along each axis, since the opposite is the same.
const ALL_SIGNS: usize = 6;

/// Pushes of all hands along one axis, by 1 N forwards or backwards, but for their opposites, which do the opposite. Over all of them no two
/// hands go together: the same mean squares as of independent pushes in random directions.
fn patterns(hands: usize, axes: usize) -> Vec<Vec<DVec3>> {
    let bits = if hands <= ALL_SIGNS {
        hands.max(1) - 1
    } else {
        usize::BITS as usize - hands.leading_zeros() as usize
    };
    let sign = |pattern: usize, hand: usize| {
        // All signs, or the rows of a Hadamard matrix.
        let which = if hands <= ALL_SIGNS { (1 << hand) >> 1 } else { hand };
        if (pattern & which).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 }
    };
    let along = |axis: usize| {
        (0..1_usize << bits).map(move |pattern| {
            (0..hands).map(|hand| sign(pattern, hand) * DVec3::AXES[axis]).collect::<Vec<_>>()
        })
    };
    (0..axes).flat_map(along).collect()
}

/// What acts on the loop: who is there, and hands that push.
struct Acting<'a> {
    stepper: &'a Stepper<'a>,
    timeline: &'a Timeline,
    question: Question,
    /// For each hand and axis, for each column, N.
    unit_pushes: Vec<Vec<f64>>,
    /// From whom to whom each register's samples go.
    ways: Vec<(HostIndex, HostIndex)>,
    tick: i64,
    /// The own part of the force on each hand and axis whose rest is what a server says.
    own_forces: Vec<Vec<f64>>,
    /// The force on each hand and axis that a governor let through last before its release.
    former_forces: Vec<Vec<f64>>,
    /// Of the tick before: where each hand was along each axis, and the force on it.
    places: Vec<f64>,
    rendered: Vec<f64>,
    energy_j: f64,
    most_energy_j: f64,
    force: Worst,
    pushes: Vec<DVec3>,
    worst_column: usize,
    mean_square_n2: f64,
    apart: Worst,
    /// While what came apart is brought together.
    offsets: Option<Offsets>,
    /// For each hand that a server's force reaches, for each column: what is added to that force, and the force of the tick before.
    served: Vec<Vec<(Offset, DVec3)>>,
}

impl<'a> Acting<'a> {
    fn new(
        stepper: &'a Stepper<'a>,
        timeline: &'a Timeline,
        question: Question,
        unit_pushes: Vec<Vec<f64>>,
    ) -> Self {
        let rows = unit_pushes.len();
        let columns = unit_pushes.first().map_or(0, Vec::len);
        let nothing = Worst { size: 0.0, place: 0, direction: DVec3::ZERO, tick: 0 };
        let registers = stepper.layout.registers.iter();
        let way = |register: &Register| {
            let line = &stepper.session.spec.lines[register.line.0];
            (line.host, line.from)
        };
        Self {
            stepper,
            timeline,
            question,
            ways: registers.map(way).collect(),
            tick: 0,
            own_forces: vec![vec![0.0; columns]; rows],
            former_forces: vec![vec![0.0; columns]; rows],
            places: vec![0.0; rows],
            rendered: vec![0.0; rows],
            energy_j: 0.0,
            most_energy_j: 0.0,
            force: nothing,
            pushes: Vec::new(),
            worst_column: 0,
            mean_square_n2: 0.0,
            apart: nothing,
            offsets: (question != Question::Largest && stepper.brings_together(timeline))
                .then(|| stepper.rejoining.start(columns)),
            served: vec![vec![(Offset::default(), DVec3::ZERO); columns]; stepper.session.hands.len()],
            unit_pushes,
        }
    }

    /// How much of a force counts at a tick.
    fn share(&self, presence: Presence, tick: i64) -> f64 {
        match presence {
            Presence::Always => 1.0,
            Presence::Finger { to, from } => self.timeline.fade(to, from, tick),
            Presence::Copy { to, from } => {
                let fade = self.timeline.fade(to, from, tick);
                let all = f64::from(self.timeline.users()) - 1.0;
                fade * self.stepper.session.channel_weight(self.timeline.present_peers(to, tick), all)
            }
        }
    }

    fn act_by_share(&self, observed: &Rows, acting: &mut Rows) -> usize {
        let Stepper { session, layout, program, .. } = self.stepper;
        let mut number = 0;
        for (index, coupling) in session.couplings.iter().enumerate() {
            let (row, tick) = match coupling.on {
                Target::Body(body) => (Some(program.force_on(body)), self.tick),
                // A server answers before its tick, in which couplings fade on.
                Target::Sample(line) => (program.sampled_by(layout, line), self.tick - 1),
            };
            let share = self.share(coupling.presence, tick);
            for component in 0..coupling.force.components {
                let Some(row) = row else { continue };
                let acting = acting.row_mut(row + component);
                add(acting, share, observed.row(number + component));
                if let Some(offsets) = &self.offsets {
                    for (column, force) in acting.iter_mut().enumerate() {
                        *force += share * self.stepper.rejoining.force(index, component, offsets, column);
                    }
                }
            }
            number += coupling.force.components;
        }
        number
    }

    /// Sets what a governor and the fade of a server leave of the forces on hands.
    fn govern(&mut self, forces: &mut Rows) {
        let (stepper, axes) = (self.stepper, self.stepper.axes);
        for (index, hand) in stepper.session.hands.iter().enumerate().filter(|(_, hand)| hand.is_served) {
            if self.offsets.is_some() {
                self.go_on_from_former(index, forces);
            }
            let fade = self.timeline.fade(hand.user, HostIndex::FIRST, self.tick);
            let governed = self.timeline.governed(hand.user, self.tick);
            for axis in 0..axes {
                let number = index * axes + axis;
                let force = forces.row_mut(stepper.program.force_on(hand.body) + axis);
                let (own, former) = (&self.own_forces[number], &mut self.former_forces[number]);
                for ((force, own), former) in force.iter_mut().zip(own).zip(former) {
                    let asked_for = own + fade * (*force - own);
                    *force = match governed {
                        Governed::Present(share) => share * asked_for,
                        Governed::Former(share) => share * *former,
                    };
                    if governed == Governed::Present(1.0) {
                        *former = *force;
                    }
                }
            }
        }
    }

    /// Has the force that a server says go on from what it was before a gap.
    fn go_on_from_former(&mut self, index: usize, forces: &mut Rows) {
        let (stepper, pace) = (self.stepper, self.stepper.rejoining.pace.at_the_pace_of_rates());
        let hand = stepper.session.hands[index];
        let meeting = self.timeline.meets(hand.user, HostIndex::FIRST);
        let meets = meeting.is_some_and(|meeting| meeting.tick == self.tick && meeting.goes_on);
        let first = stepper.program.force_on(hand.body);
        for (column, (offset, last)) in self.served[index].iter_mut().enumerate() {
            let mut said = DVec3::ZERO;
            for axis in 0..stepper.axes {
                said[axis] =
                    forces.row(first + axis)[column] - self.own_forces[index * stepper.axes + axis][column];
            }
            offset.advance(pace, *last);
            if meets {
                let counted = Stretch::at_rest(*last) - offset.value();
                *offset = Offset::met(pace, Stretch::at_rest(said), counted);
            }
            let added = -offset.value().position;
            for axis in 0..stepper.axes {
                forces.row_mut(first + axis)[column] += added[axis];
            }
            *last = said;
        }
    }

    /// Keeps the energy of one trajectory.
    fn observe_energy(&mut self, observed: &Rows, first: usize) {
        for (number, (place, force)) in self.places.iter_mut().zip(&self.rendered).enumerate() {
            let now = observed.row(first + number)[0];
            self.energy_j += force * (now - *place);
            *place = now;
        }
        self.most_energy_j = self.most_energy_j.max(self.energy_j);
    }

    fn observe_apart(&mut self, observed: &Rows, first: usize) {
        // From then on responses do not add up, and nothing comes farther apart by itself.
        let adds_up = !self.stepper.brings_together(self.timeline)
            || self.timeline.first_meeting().is_none_or(|meeting| self.tick < meeting);
        if !adds_up {
            return;
        }
        let mut number = first;
        for (place, apart) in self.stepper.session.apart.iter().enumerate() {
            let gains = Gains::new(apart.components, |axis| observed.row(number + axis));
            worsen(&mut self.apart, &gains, place, self.tick);
            number += apart.components;
        }
    }

    fn observe_columns_apart(&mut self, observed: &Rows, first: usize) {
        let mut number = first;
        for (place, apart) in self.stepper.session.apart.iter().enumerate() {
            for column in 0..self.columns() {
                let vector = vector(observed, number, apart.components, column);
                if vector.length() > self.apart.size {
                    self.apart = Worst::of(vector, place, self.tick);
                }
            }
            number += apart.components;
        }
    }

    fn observe_columns(&mut self, forces: &Rows, counted: usize) {
        let Stepper { session, program, axes, .. } = self.stepper;
        for (index, hand) in session.hands.iter().enumerate() {
            let mut sum = 0.0;
            for column in 0..self.columns() {
                let force = vector(forces, program.force_on(hand.body), *axes, column);
                if force.length() > self.force.size {
                    self.force = Worst::of(force, index, self.tick);
                    self.worst_column = column;
                }
                sum += if column < counted { force.length_squared() } else { 0.0 };
            }
            self.mean_square_n2 = self.mean_square_n2.max(sum / counted as f64);
        }
    }

    fn columns(&self) -> usize {
        self.unit_pushes.first().map_or(0, Vec::len)
    }

    fn observe_forces(&mut self, forces: &Rows) {
        let Stepper { session, program, axes, .. } = self.stepper;
        for (index, hand) in session.hands.iter().enumerate() {
            let first = program.force_on(hand.body);
            let gains = Gains::new(*axes, |axis| forces.row(first + axis));
            self.mean_square_n2 = self.mean_square_n2.max(gains.mean_square());
            if worsen(&mut self.force, &gains, index, self.tick) {
                self.pushes = gains.best_pushes(self.force.direction);
            }
        }
    }
}

impl Outside for Acting<'_> {
    fn loses(&self, register: usize) -> bool {
        let (to, from) = self.ways[register];
        self.timeline.loses(to, from, self.tick)
    }

    fn act(&mut self, observed: &Rows, acting: &mut Rows) {
        if let Some(offsets) = &mut self.offsets {
            let stepper = self.stepper;
            let first = stepper.first_observed;
            stepper.rejoining.advance(offsets, self.timeline, self.tick, observed, first);
        }
        let apart = self.act_by_share(observed, acting);
        let stepper = self.stepper;
        let served = stepper.session.hands.iter().enumerate().filter(|(_, hand)| hand.is_served);
        for (index, hand) in served {
            for axis in 0..stepper.axes {
                let row = acting.row(stepper.program.force_on(hand.body) + axis);
                self.own_forces[index * stepper.axes + axis].copy_from_slice(row);
            }
        }
        let places = apart + stepper.session.apart.iter().map(|apart| apart.components).sum::<usize>();
        match self.question {
            Question::Largest => self.observe_apart(observed, apart),
            Question::Energy => self.observe_energy(observed, places),
            Question::Patterns { .. } => self.observe_columns_apart(observed, apart),
        }
    }

    fn push(&mut self, forces: &mut Rows) {
        self.govern(forces);
        let back = self.tick >= self.timeline.ends;
        match self.question {
            Question::Largest if back => self.observe_forces(forces),
            Question::Patterns { counted } if back => self.observe_columns(forces, counted),
            _ => {}
        }
        let (stepper, axes) = (self.stepper, self.stepper.axes);
        for (index, hand) in stepper.session.hands.iter().enumerate() {
            for axis in 0..axes {
                let number = index * axes + axis;
                let force = forces.row_mut(stepper.program.force_on(hand.body) + axis);
                self.rendered[number] = if back { force[0] } else { 0.0 };
                if self.tick >= self.timeline.begins {
                    add(force, 1.0, &self.unit_pushes[number]);
                }
            }
        }
        self.tick += 1;
    }
}

impl Worst {
    fn of(vector: DVec3, place: usize, tick: i64) -> Self {
        Self { size: vector.length(), place, direction: vector.normalize_or(DVec3::X), tick }
    }
}

fn vector(rows: &Rows, first: usize, components: usize, column: usize) -> DVec3 {
    let mut vector = DVec3::ZERO;
    for component in 0..components {
        vector[component] = rows.row(first + component)[column];
    }
    vector
}

/// Whether these gains reach farther than the worst so far, which they then become.
fn worsen(worst: &mut Worst, gains: &Gains<'_>, place: usize, tick: i64) -> bool {
    if gains.bound() <= worst.size {
        return false;
    }
    let Reach { size, direction } = gains.reach();
    let is_worse = size > worst.size;
    if is_worse {
        *worst = Worst { size, place, direction, tick };
    }
    is_worse
}

fn add(target: &mut [f64], factor: f64, row: &[f64]) {
    for (sum, &value) in target.iter_mut().zip(row) {
        *sum += factor * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// E p·pᵀ = I/d, of few hands and of many.
    #[test]
    fn patterns_of_pushes_are_as_independent_as_random_ones() {
        for (hands, axes) in [(1, 1), (2, 1), (4, 2), (6, 3), (7, 3), (8, 2), (12, 3)] {
            let patterns = patterns(hands, axes);
            let mean = |one: (usize, usize), other: (usize, usize)| {
                let products = patterns.iter().map(|pushes| pushes[one.0][one.1] * pushes[other.0][other.1]);
                products.sum::<f64>() / patterns.len() as f64
            };
            let numbers = || (0..hands).flat_map(|hand| (0..axes).map(move |axis| (hand, axis)));
            for one in numbers() {
                for other in numbers() {
                    let expected = if one == other { 1.0 / axes as f64 } else { 0.0 };
                    assert!((mean(one, other) - expected).abs() < 1e-12, "{hands} {axes}: {one:?} {other:?}");
                }
            }
        }
    }
}
