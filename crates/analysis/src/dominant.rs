//! Which way things move in the motion that belongs to the largest eigenvalue.
//!
//! Where several eigenvalues are the largest, as those of equal hands are, it is all their motions together: any one of
//! them would be a matter of rounding.

use std::collections::BTreeMap;

use cotouch_matrix::{eigenvectors, principal_directions};
use nalgebra::{Complex, DMatrix};

use crate::discretise::per_inertia;
use crate::lift::layout::Layout;
use crate::loop_spec::{Dof, Dynamics, LoopBody, LoopSpec};

/// Eigenvalues are equally large up to this share of them.
const EQUAL: f64 = 1e-9;
/// Shares of the energy are alike up to this share of them.
const ALIKE: f64 = 1e-6;
/// Bodies that move less than this in an eigenvector of length 1 do not take part in it.
const STILL: f64 = 1e-10;

/// How much of the kinetic energy of the dominant motions is along and about each axis: 1 for each motion in all.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct EnergyShares(BTreeMap<Dof, f64>);

impl EnergyShares {
    /// Of a loop in which everything moves along or about one axis, whatever its eigenvalues are; nothing where there are
    /// several axes.
    pub(crate) fn along_only_axis(spec: &LoopSpec) -> Option<Self> {
        let mut axes = spec.bodies.iter().flat_map(|body| body.axes);
        let first = *axes.next()?;
        axes.all(|axis| *axis == first).then(|| Self(BTreeMap::from([(first, 1.0)])))
    }

    /// In the eigenvectors of the largest eigenvalues of `balanced` = D⁻¹·A·D.
    pub(crate) fn of_largest(
        spec: &LoopSpec,
        layout: &Layout,
        balanced: &DMatrix<f64>,
        scales: &[f64],
        eigenvalues: &[Complex<f64>],
    ) -> Self {
        let moving = moving(spec, layout);
        let mut shares = Self::default();
        for (eigenvalue, count) in largest(eigenvalues) {
            if let Some(vectors) = eigenvectors(balanced, eigenvalue, count) {
                shares.add_motions(&moving, &vectors, scales);
            }
        }
        shares
    }

    /// By speeds, or where things stay displaced without any, by displacements: these are to each other as speeds are in a
    /// slow motion.
    fn add_motions(&mut self, moving: &[Moving], vectors: &DMatrix<Complex<f64>>, scales: &[f64]) {
        let moves = |state: usize| (0..vectors.ncols()).any(|column| vectors[(state, column)].norm() > STILL);
        let states: [fn(&Moving) -> usize; 2] = [|moving| moving.speed, |moving| moving.displacement];
        let Some(state) = states.into_iter().find(|state| moving.iter().any(|one| moves(state(one)))) else {
            return;
        };
        let motions = DMatrix::from_fn(moving.len(), vectors.ncols(), |row, column| {
            let state = state(&moving[row]);
            vectors[(state, column)] * (scales[state] * moving[row].mass.sqrt())
        });
        let Some((directions, sizes)) = principal_directions(&motions) else { return };
        for column in (0..sizes.len()).take_while(|&column| sizes[column] > ALIKE * sizes[0]) {
            for (row, one) in moving.iter().enumerate() {
                *self.0.entry(one.axis).or_default() += directions[(row, column)].norm_sqr();
            }
        }
    }

    /// With the motions of another part of the same loop, which it has so many times.
    pub(crate) fn add(&mut self, other: &Self, copies: usize) {
        for (axis, share) in &other.0 {
            *self.0.entry(*axis).or_default() += copies as f64 * share;
        }
    }

    /// The axis with the largest share; of those that are alike, the first of x, y, z, rx, ry, rz.
    pub(crate) fn axis(&self) -> Option<&'static str> {
        let largest = self.0.values().copied().fold(0.0, f64::max);
        let is_largest = |(_, share): &(&Dof, &f64)| **share > 0.0 && **share >= (1.0 - ALIKE) * largest;
        self.0.iter().find(is_largest).map(|(axis, _)| name(*axis))
    }
}

/// Whether an eigenvalue of this absolute value is as large as another one.
pub(crate) fn is_as_large(one: f64, other: f64) -> bool {
    one >= (1.0 - EQUAL) * other
}

fn name(axis: Dof) -> &'static str {
    const MOVES: [&str; 3] = ["x", "y", "z"];
    const TURNS: [&str; 3] = ["rx", "ry", "rz"];
    let names = if axis.turns() { TURNS } else { MOVES };
    names[axis.axis().index()]
}

/// The largest eigenvalues, one of each conjugate pair, and how many there are of each.
fn largest(eigenvalues: &[Complex<f64>]) -> Vec<(Complex<f64>, usize)> {
    let radius = eigenvalues.iter().map(|value| value.norm()).fold(0.0, f64::max);
    let mut largest: Vec<(Complex<f64>, usize)> = Vec::new();
    let is_one = |value: &&Complex<f64>| value.im >= 0.0 && is_as_large(value.norm(), radius);
    for value in eigenvalues.iter().filter(is_one).filter(|_| radius > 0.0) {
        match largest.iter_mut().find(|(other, _)| (other - value).norm() <= EQUAL * radius) {
            Some((_, count)) => *count += 1,
            None => largest.push((*value, 1)),
        }
    }
    largest
}

/// What moves along or about an axis, kg or kg·m², and which numbers of the state say where it is and how fast.
struct Moving {
    axis: Dof,
    mass: f64,
    displacement: usize,
    speed: usize,
}

fn moving(spec: &LoopSpec, layout: &Layout) -> Vec<Moving> {
    let mut moving = Vec::new();
    for (body, &first) in spec.bodies.iter().zip(&layout.bodies) {
        let (masses, velocities) = masses(body);
        let of_body = body.axes.iter().zip(masses).zip(first..);
        moving.extend(of_body.map(|((&axis, mass), displacement)| Moving {
            axis,
            mass,
            displacement,
            speed: displacement + velocities,
        }));
    }
    moving
}

/// A body's inertia for each degree of freedom, and the place of its first velocity among its states.
fn masses(body: &LoopBody) -> (Vec<f64>, usize) {
    let axes = body.axes.len();
    match &body.dynamics {
        Dynamics::Mass { mass_kg, .. } => (vec![*mass_kg; axes], axes),
        Dynamics::Rigid { .. } => {
            (per_inertia(body).diagonal().iter().map(|value| value.recip()).collect(), axes)
        }
        // Of plants that are written like a mass: positions, then velocities.
        Dynamics::Plant(plant) | Dynamics::Sensed { plant, .. } => {
            let mass = |axis: usize| {
                let state = axes + axis;
                let gain = if state < plant.b.nrows() { plant.b[(state, axis)] } else { 0.0 };
                if gain > 0.0 { gain.recip() } else { 0.0 }
            };
            let known = plant.b.nrows() >= 2 * axes;
            (
                (0..axes).map(|axis| if known { mass(axis) } else { 0.0 }).collect(),
                if known { axes } else { 0 },
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use cotouch_scene::names::{Coordinate, HostIndex, Part};
    use cotouch_scene::scene::SpringDamper;
    use cotouch_scene::time::Schedule;

    use crate::dof::motion_quantities;
    use crate::loop_spec::{Dynamics, LoopBody, LoopSpec, Motion, Plant, SPACE_POINT};
    use crate::poles::analyze_loop;

    /// Hands of these masses (kg) on springs, coupled to each other, with less damping along one of the axes.
    fn hands(masses_kg: [f64; 3], order: [usize; 3], along: Option<usize>) -> LoopSpec {
        let spring =
            |stiffness_n_per_m, damping_n_s_per_m| SpringDamper { stiffness_n_per_m, damping_n_s_per_m };
        let mut spec = LoopSpec::new(Schedule::new("1000".parse().unwrap(), "500".parse().unwrap()).unwrap());
        let mut bodies = Vec::new();
        for place in order {
            let (host, part) = (HostIndex(place as u8), Part::HAND);
            let states = motion_quantities(SPACE_POINT)
                .map(|quantity| Coordinate::Own { host, part, quantity })
                .collect();
            let inertia = glam::DMat3::IDENTITY * masses_kg[place];
            let dynamics = Dynamics::Plant(Plant::endpoint(&inertia, 3, spring(90.0, 1.1)));
            bodies.push(spec.body(LoopBody { states, axes: SPACE_POINT, dynamics }));
        }
        for (one, other) in [(0, 1), (1, 0), (1, 2), (2, 1), (2, 0), (0, 2)] {
            spec.pull(bodies[one], Motion::Current(bodies[other]), spring(70.0, 0.3));
        }
        for &body in &bodies {
            let mut less = spec.spring(Motion::Current(body), Motion::Ground, spring(0.0, -0.4));
            less.terms.retain(|term| Some(term.component) == along);
            spec.act(body, less);
        }
        spec
    }

    #[test]
    fn the_axis_does_not_depend_on_rounding() {
        let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        for (masses_kg, along, expected) in [
            ([0.1, 0.1, 0.1], None, "x"),
            ([0.1, 0.23, 0.37], None, "x"),
            ([0.1, 0.1, 0.1], Some(1), "y"),
            ([0.1, 0.23, 0.37], Some(2), "z"),
        ] {
            for order in orders {
                let axis = analyze_loop(&hands(masses_kg, order, along)).unwrap().axis;
                assert_eq!(axis, Some(expected), "{masses_kg:?} {order:?} {along:?}");
            }
        }
    }
}
