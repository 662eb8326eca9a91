//! A part of a loop in which blocks act: what of it is 1 by structure follows from its laws of rest.
//!
//! A block may answer to how far bodies are apart, to where they are, or to the change of that: only what it does to a
//! constant input decides whether bodies that move together feel something. So the states in which everything stays as it
//! is are the null space of the laws of rest ([`Balance`]), blocks included. A uniform motion along one of them, `e`, is
//! `g` with `Φ·g = g + T·e`. It is looked for in the map, bordered by the null space E and by kicks V, which set the bodies
//! of each state of rest going:
//!
//! ```text
//! [I − Φ  V] [g]   [−T·e]
//! [  Eᵀ   0]·[l] = [  0 ]
//! ```
//!
//! has one solution; where no kick is needed (l = 0), what moves goes on moving.

use nalgebra::{DMatrix, DVector};

use super::Structure;
use super::coasting::Coasting;
use super::null_space::{NEGLIGIBLE, null_space};
use crate::balance::Balance;
use crate::lift::layout::Layout;
use crate::loop_spec::{BodyId, Dof, Dynamics, LoopSpec, Motion, Signal, Term};
use cotouch_matrix::SingularValues;

/// A part in which blocks act.
pub(super) struct PartWithBlocks<'a> {
    spec: &'a LoopSpec,
    layout: &'a Layout,
    coasting: &'a [Vec<Coasting>],
    map: &'a DMatrix<f64>,
    balance: Balance,
    bodies: &'a [usize],
    blocks: Vec<usize>,
}

/// The degrees of freedom of a part: which body, which of its numbers.
type Place = (usize, usize);

/// A state of rest, in the map's coordinates.
struct Rest {
    state: DVector<f64>,
    /// Of every degree of freedom, m or rad.
    positions: DVector<f64>,
}

impl<'a> PartWithBlocks<'a> {
    pub(super) fn new(
        spec: &'a LoopSpec,
        layout: &'a Layout,
        coasting: &'a [Vec<Coasting>],
        map: &'a DMatrix<f64>,
        (bodies, blocks): (&'a [usize], Vec<usize>),
    ) -> Self {
        Self { spec, layout, coasting, map, balance: Balance::new(spec), bodies, blocks }
    }

    /// Adds its vectors: of every direction the whole part's translation, with its uniform motion; then what turns or moves
    /// otherwise; and what can move without the rest.
    pub(super) fn add_to(&self, structure: &mut Structure) {
        let places = self.places();
        let rests: Vec<Rest> =
            self.null_space().iter().map(|unknowns| self.rest(unknowns, &places)).collect();
        let stays = |rest: &Rest| {
            let size = structure.rounding * (1.0 + self.map.norm()) * rest.state.norm();
            (self.map * &rest.state - &rest.state).norm() <= size
        };
        if rests.is_empty() || !rests.iter().all(stays) {
            return;
        }
        let mut found: Vec<DVector<f64>> = Vec::new();
        let mut rigid = Vec::new();
        for axis in self.axes() {
            let along = |place: &Place| self.spec.bodies[place.0].axes[place.1] == axis;
            let on_axis =
                DVector::from_iterator(places.len(), places.iter().map(|p| f64::from(u8::from(along(p)))));
            let own = within(&rests, &on_axis);
            let whole = combination(&own, &on_axis);
            found.extend(whole.iter().map(|whole| whole.positions.normalize()));
            rigid.extend(whole);
            for loose in beyond(&mut found, &own) {
                structure.loose.push(loose.state);
            }
        }
        rigid.extend(beyond(&mut found, &rests));
        for (still, uniform) in self.uniform_motions(rigid, &rests, &places) {
            structure.dragged += usize::from(uniform.is_none());
            structure.rigid.push(still);
            structure.rigid.extend(uniform);
        }
    }

    fn places(&self) -> Vec<Place> {
        let of = |&body: &usize| (0..self.spec.bodies[body].axes.len()).map(move |number| (body, number));
        self.bodies.iter().flat_map(of).collect()
    }

    fn axes(&self) -> Vec<Dof> {
        let mut axes: Vec<Dof> =
            self.bodies.iter().flat_map(|&body| self.spec.bodies[body].axes).copied().collect();
        axes.sort_unstable();
        axes.dedup();
        axes
    }

    /// All that solves the laws of rest, in their unknowns. The blocks' own are eliminated where the bodies determine them.
    fn null_space(&self) -> Vec<DVector<f64>> {
        let Balance { matrix, first, blocks } = &self.balance;
        let of_body = |&body: &usize| first[body]..first[body] + Balance::numbers(&self.spec.bodies[body]);
        let of_block = |&block: &usize| {
            let law = &self.spec.blocks[block].law;
            blocks[block]..blocks[block] + law.states() + law.outputs()
        };
        let bodies: Vec<usize> = self.bodies.iter().flat_map(of_body).collect();
        let all: Vec<usize> = bodies.iter().copied().chain(self.blocks.iter().flat_map(of_block)).collect();
        let mut laws = matrix.select_rows(&all).select_columns(&all);
        for mut row in laws.row_iter_mut() {
            let size = row.amax();
            if size > 0.0 {
                row.unscale_mut(size);
            }
        }
        let (own, rest) = (bodies.len(), all.len() - bodies.len());
        let answer =
            answer(&laws.view((own, own), (rest, rest)).into(), &laws.view((own, 0), (rest, own)).into());
        let solutions = match answer {
            Some(answer) => {
                let felt = laws.view((0, 0), (own, own)) + laws.view((0, own), (own, rest)) * &answer;
                let whole = |of_bodies: DVector<f64>| {
                    let of_blocks = &answer * &of_bodies;
                    DVector::from_iterator(all.len(), of_bodies.iter().chain(&of_blocks).copied())
                };
                null_space(&felt).into_iter().map(whole).collect()
            }
            None => null_space(&laws),
        };
        let placed = |solution: DVector<f64>| {
            let mut unknowns = DVector::zeros(matrix.ncols());
            all.iter().zip(&solution).for_each(|(&place, &value)| unknowns[place] = value);
            unknowns
        };
        solutions.into_iter().map(placed).collect()
    }

    /// The state of the whole loop in which everything is, and was, as a solution of the laws of rest says.
    fn rest(&self, unknowns: &DVector<f64>, places: &[Place]) -> Rest {
        let spec = self.spec;
        let read = |term: &Term| -> f64 {
            let read = self.balance.motion(spec, term).into_iter();
            read.map(|(unknown, factor)| unknowns[unknown] * factor).sum()
        };
        let number = |motion, number| read(&Term { component: 0, motion, number, gain: 1.0 });
        let mut state = DVector::zeros(self.layout.coordinates.len());
        for &body in self.bodies {
            let of_body = &spec.bodies[body];
            let (place, count) = (self.layout.bodies[body], Balance::numbers(of_body));
            state.rows_mut(place, count).copy_from(&unknowns.rows(self.balance.first[body], count));
            if matches!(of_body.dynamics, Dynamics::Sensed { .. }) {
                for axis in 0..of_body.axes.len() {
                    state[place + count + axis] = number(Motion::Current(BodyId(body)), axis);
                }
            }
        }
        for register in &self.layout.registers {
            for age in 1..=register.length {
                let place = register.place(age);
                match &spec.lines[register.line.0].signal {
                    &Signal::Motion(body) | &Signal::Position(body) => {
                        for axis in 0..spec.bodies[body.0].axes.len() {
                            state[place + axis] = number(Motion::Current(body), axis);
                        }
                    }
                    Signal::Force(force) => {
                        for term in &force.terms {
                            state[place + term.component] += term.gain * read(term);
                        }
                    }
                }
            }
        }
        for &block in &self.blocks {
            let (placed, law) = (self.layout.blocks[block], &spec.blocks[block].law);
            let (states, outputs) = (law.states(), law.outputs());
            let first = self.balance.blocks[block];
            state.rows_mut(placed.states, states).copy_from(&unknowns.rows(first, states));
            for age in 0..spec.blocks[block].past_outputs() as usize {
                let put_out = unknowns.rows(first + states, outputs);
                state.rows_mut(placed.outputs + age * outputs, outputs).copy_from(&put_out);
            }
        }
        let positions = places.iter().map(|&(body, axis)| number(Motion::Current(BodyId(body)), axis));
        Rest { positions: DVector::from_iterator(places.len(), positions), state }
    }

    /// Each state of rest with its uniform motion, where there is one.
    fn uniform_motions(
        &self,
        rigid: Vec<Rest>,
        rests: &[Rest],
        places: &[Place],
    ) -> Vec<(DVector<f64>, Option<DVector<f64>>)> {
        let own = self.coordinates();
        let (states, count) = (own.len(), rests.len());
        let mut matrix = DMatrix::zeros(states + count, states + count);
        for (row, &place) in own.iter().enumerate() {
            for (column, &of) in own.iter().enumerate() {
                matrix[(row, column)] = f64::from(u8::from(row == column)) - self.map[(place, of)];
            }
        }
        for (index, rest) in rests.iter().enumerate() {
            let kick = self.kick(rest, places);
            for (row, &place) in own.iter().enumerate() {
                matrix[(row, states + index)] = kick[place];
                matrix[(states + index, row)] = rest.state[place];
            }
        }
        let decomposition = matrix.full_piv_lu();
        let pattern_s = self.spec.pattern_s();
        let uniform = |still: &DVector<f64>| {
            let mut right = DVector::zeros(states + count);
            own.iter().enumerate().for_each(|(row, &place)| right[row] = -pattern_s * still[place]);
            let solution = decomposition.solve(&right)?;
            let mut motion = DVector::zeros(still.len());
            own.iter().enumerate().for_each(|(row, &place)| motion[place] = solution[row]);
            let missing = (self.map * &motion - &motion - still * pattern_s).norm();
            (missing <= NEGLIGIBLE * (1.0 + self.map.norm()) * motion.norm()).then_some(motion)
        };
        rigid
            .into_iter()
            .map(|rest| (uniform(&rest.state), rest.state))
            .map(|(uniform, still)| (still, uniform))
            .collect()
    }

    /// The velocities with which bodies pass a state of rest; where no body moves, the state itself.
    fn kick(&self, rest: &Rest, places: &[Place]) -> DVector<f64> {
        let mut kick = DVector::zeros(rest.state.len());
        for (&(body, axis), &rate) in places.iter().zip(&rest.positions) {
            for &(state, size) in self.coasting[body][axis].moving.iter().flatten() {
                kick[self.layout.bodies[body] + state] += rate * size;
            }
        }
        if kick.amax() > 0.0 { kick } else { rest.state.clone() }
    }

    /// The map's coordinates that belong to the part.
    fn coordinates(&self) -> Vec<usize> {
        let (spec, layout) = (self.spec, self.layout);
        let mut own = Vec::new();
        for &body in self.bodies {
            own.extend((layout.bodies[body]..).take(spec.bodies[body].states.len()));
        }
        for register in &layout.registers {
            let is_own = match &spec.lines[register.line.0].signal {
                Signal::Motion(body) | Signal::Position(body) => self.bodies.contains(&body.0),
                Signal::Force(force) => force.terms.iter().any(|term| match term.motion {
                    Motion::Output(block) => self.blocks.contains(&block.0),
                    motion => spec.body_of(motion).is_some_and(|body| self.bodies.contains(&body.0)),
                }),
            };
            if is_own {
                own.extend((register.first..).take(register.length as usize * register.numbers));
            }
        }
        for &block in &self.blocks {
            let placed = layout.blocks[block];
            let past = spec.blocks[block].past_outputs() as usize * spec.blocks[block].law.outputs();
            own.extend(placed.states..placed.outputs + past);
        }
        own
    }
}

/// `−of_blocks⁻¹·of_bodies`; `None` where there is no inverse.
fn answer(of_blocks: &DMatrix<f64>, of_bodies: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    /// A pivot as small as this beside the largest is 0 but for rounding.
    const NO_PIVOT: f64 = 1e-14;
    let decomposition = of_blocks.clone().lu();
    let pivots = decomposition.u().diagonal().abs();
    (pivots.min() > NO_PIVOT * pivots.max()).then(|| decomposition.solve(&-of_bodies)).flatten()
}

/// The combinations of states of rest in which only what is marked by 1 moves, a basis.
fn within(rests: &[Rest], marked: &DVector<f64>) -> Vec<Rest> {
    let columns: Vec<_> = rests.iter().map(|rest| &rest.positions).collect();
    let others = DMatrix::from_fn(marked.len().max(rests.len()), rests.len(), |row, column| {
        if row < marked.len() && marked[row] == 0.0 { columns[column][row] } else { 0.0 }
    });
    null_space(&others).iter().map(|factors| combined(rests, factors)).collect()
}

/// The combination with the given positions, where there is one.
fn combination(rests: &[Rest], positions: &DVector<f64>) -> Option<Rest> {
    if rests.is_empty() {
        return None;
    }
    let columns: Vec<_> = rests.iter().map(|rest| rest.positions.clone()).collect();
    let columns = DMatrix::from_columns(&columns);
    let scale = columns.amax();
    let factors = SingularValues::of(&columns)?.solve(positions, NEGLIGIBLE * scale);
    let combined = combined(rests, &factors);
    ((&combined.positions - positions).norm() <= NOT_MOVED * positions.norm()).then_some(combined)
}

/// Relative to what moves: at rest but for rounding.
const NOT_MOVED: f64 = 1e-8;

/// Combinations whose positions are at right angles to those found and to each other; these are found then.
fn beyond(found: &mut Vec<DVector<f64>>, rests: &[Rest]) -> Vec<Rest> {
    let largest = rests.iter().map(|rest| rest.positions.norm()).fold(0.0, f64::max);
    let mut new = Vec::new();
    loop {
        let apart = |rest: &Rest| {
            let mut apart = rest.positions.clone();
            for _ in 0..2 {
                for known in found.iter() {
                    apart -= known * known.dot(&apart);
                }
            }
            apart
        };
        let all: Vec<_> = rests.iter().map(apart).collect();
        let Some(index) = (0..all.len()).max_by(|&a, &b| all[a].norm().total_cmp(&all[b].norm())) else {
            break;
        };
        if all[index].norm() <= NOT_MOVED * largest {
            break;
        }
        found.push(all[index].normalize());
        new.push(Rest { state: rests[index].state.clone(), positions: rests[index].positions.clone() });
    }
    new
}

fn combined(rests: &[Rest], factors: &DVector<f64>) -> Rest {
    let sum = |of: fn(&Rest) -> &DVector<f64>| {
        let mut sum = DVector::zeros(of(&rests[0]).len());
        rests.iter().zip(factors).for_each(|(rest, &factor)| sum += of(rest) * factor);
        sum
    };
    Rest { state: sum(|rest| &rest.state), positions: sum(|rest| &rest.positions) }
}

#[cfg(test)]
mod tests;
