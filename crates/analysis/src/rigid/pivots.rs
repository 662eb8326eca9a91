//! Motions of a part that turn something and that no force resists: a body turns about the one finger that touches it.
//!
//! They are the null space of the part's static stiffness, without the translations. Uniform motion along one of them is
//! looked for in the map itself: offsets `u` at which `(A − I)·(g₀ + U·u) = T·e`.

use nalgebra::{DMatrix, DVector};

use super::coasting::Coasting;
use super::null_space::{NEGLIGIBLE, null_space};
use super::offsets::{Offsets, is_of_part};
use crate::lift::layout::Layout;
use crate::loop_spec::{LoopSpec, Signal, tick_of_step};

/// A part of a loop in which something turns.
pub(super) struct TurningPart<'a> {
    pub(super) spec: &'a LoopSpec,
    pub(super) layout: &'a Layout,
    pub(super) coasting: &'a [Vec<Coasting>],
    pub(super) bodies: &'a [usize],
}

impl TurningPart<'_> {
    /// Pairs of a motion at rest and, where there is one, its uniform motion; `known` are translations.
    pub(super) fn pivots(
        &self,
        known: &[DVector<f64>],
        map: &DMatrix<f64>,
    ) -> Vec<(DVector<f64>, Option<DVector<f64>>)> {
        let turns = |&body: &usize| self.spec.bodies[body].axes.iter().any(|axis| axis.turns());
        if !self.bodies.iter().any(turns) {
            return Vec::new();
        }
        let places = Offsets::new(self.spec, self.bodies);
        let mut basis: Vec<DVector<f64>> = Vec::new();
        for vector in known {
            basis.extend(apart_from(&basis, vector.clone()));
        }
        let mut found = Vec::new();
        for motion in null_space(&self.stiffness(&places)) {
            let still = apart_from(&basis, self.still(&places, &motion));
            if let Some(still) =
                still.filter(|still| (map * still - still).norm() <= 1e-9 * (1.0 + map.norm()))
            {
                basis.push(still.clone());
                found.push(still);
            }
        }
        found.into_iter().map(|still| (still.clone(), self.uniform(&places, &still, map))).collect()
    }

    /// Forces on all bodies of the part per position of each, all data being up to date; scaled rows and columns.
    fn stiffness(&self, places: &Offsets) -> DMatrix<f64> {
        let size = places.values.len();
        let mut stiffness: DMatrix<f64> = DMatrix::zeros(size, size);
        for action in self.spec.actions.iter().filter(|action| self.bodies.contains(&action.body.0)) {
            let row = places.first[action.body.0];
            for term in self.spec.coupling_of(action).into_iter().flat_map(|coupling| &coupling.terms) {
                if let Some(column) = places.place(self.spec, term.motion, term.number) {
                    stiffness[(row + term.component, column)] += term.gain;
                }
            }
        }
        // What a body's own dynamics tie to a place does not move.
        let largest = stiffness.amax().max(1.0);
        for &body in self.bodies {
            for (number, axis) in self.coasting[body].iter().enumerate() {
                if axis.still.is_none() {
                    let place = places.first[body] + number;
                    stiffness[(place, place)] -= largest;
                    let mut column = stiffness.column_mut(place);
                    let diagonal = column[place];
                    column.fill(0.0);
                    column[place] = diagonal;
                }
            }
        }
        stiffness
    }

    /// Bodies and samples moved and at rest.
    fn still(&self, places: &Offsets, motion: &DVector<f64>) -> DVector<f64> {
        let mut vector = DVector::zeros(self.layout.coordinates.len());
        for &body in self.bodies {
            for (number, axis) in self.coasting[body].iter().enumerate() {
                let by = motion[places.first[body] + number];
                for &(state, size) in axis.still.iter().flatten() {
                    vector[self.layout.bodies[body] + state] += by * size;
                }
            }
        }
        let moved = Offsets { first: places.first.clone(), values: motion.clone() };
        for register in &self.layout.registers {
            for age in 1..=register.length {
                let place = register.place(age);
                match &self.spec.lines[register.line.0].signal {
                    Signal::Motion(body) | Signal::Position(body) if self.bodies.contains(&body.0) => {
                        for number in 0..self.spec.bodies[body.0].axes.len() {
                            vector[place + number] = moved.of(body.0, number);
                        }
                    }
                    Signal::Force(coupling) if is_of_part(self.spec, coupling, self.bodies) => {
                        let mut force = DVector::zeros(coupling.components);
                        moved.add_force(self.spec, coupling, &mut force);
                        vector.rows_mut(place, coupling.components).copy_from(&force);
                    }
                    Signal::Motion(_) | Signal::Position(_) | Signal::Force(_) => {}
                }
            }
        }
        vector
    }

    /// The motion at rest as velocities, with samples as old as they are.
    fn moving(&self, places: &Offsets, rates: &DVector<f64>) -> Option<DVector<f64>> {
        let mut vector = DVector::zeros(self.layout.coordinates.len());
        for &body in self.bodies {
            for (number, axis) in self.coasting[body].iter().enumerate() {
                let rate = rates[places.first[body] + number];
                if rate == 0.0 {
                    continue;
                }
                for &(state, size) in axis.moving.as_ref()? {
                    vector[self.layout.bodies[body] + state] += rate * size;
                }
            }
        }
        let period_s = self.spec.schedule.control().period_s();
        for register in &self.layout.registers {
            if let Some(body) = self.spec.lines[register.line.0].signal.body()
                && self.bodies.contains(&body.0)
            {
                let axes = self.spec.bodies[body.0].axes.len();
                for age in 1..=register.length {
                    let since_s = tick_of_step(&self.spec.schedule, -i64::from(age)) as f64 * period_s;
                    for number in 0..axes {
                        let rate = rates[places.first[body.0] + number];
                        vector[register.place(age) + number] = rate * since_s;
                        if register.numbers > axes {
                            vector[register.place(age) + axes + number] = rate;
                        }
                    }
                }
            }
        }
        Some(vector)
    }

    /// `g` with `A·g = g + T·e`, T being the pattern's duration.
    fn uniform(&self, places: &Offsets, still: &DVector<f64>, map: &DMatrix<f64>) -> Option<DVector<f64>> {
        let size = places.values.len();
        let mut rates = DVector::zeros(size);
        for &body in self.bodies {
            for (number, axis) in self.coasting[body].iter().enumerate() {
                if let Some(&(state, per_metre)) = axis.still.iter().flatten().next() {
                    rates[places.first[body] + number] = still[self.layout.bodies[body] + state] / per_metre;
                }
            }
        }
        let small = rates.amax() * NEGLIGIBLE;
        rates.apply(|rate| *rate = if rate.abs() <= small { 0.0 } else { *rate });
        let mut motion = self.moving(places, &rates)?;
        let pattern_s = self.spec.pattern_s();
        let missing = |motion: &DVector<f64>| still * pattern_s - (map * motion - motion);
        let mut unit = DVector::zeros(size);
        let mut offsets = DMatrix::zeros(motion.len(), size);
        for column in 0..size {
            unit[column] = 1.0;
            offsets.set_column(column, &self.still(places, &unit));
            unit[column] = 0.0;
        }
        let effects = map * &offsets - &offsets;
        let target = missing(&motion);
        let scale = effects.amax();
        let chosen = effects.svd(true, true).solve(&target, NEGLIGIBLE * scale).ok()?;
        motion += offsets * chosen;
        (missing(&motion).norm() <= NEGLIGIBLE * (1.0 + map.norm()) * motion.norm()).then_some(motion)
    }
}

/// What of a vector is not in an orthonormal basis, of length 1; `None` where that is nothing.
fn apart_from(basis: &[DVector<f64>], vector: DVector<f64>) -> Option<DVector<f64>> {
    const NOTHING: f64 = 1e-6;
    let mut rest = vector.try_normalize(0.0)?;
    for _ in 0..2 {
        for other in basis {
            rest -= other * other.dot(&rest);
        }
    }
    rest.try_normalize(NOTHING)
}
