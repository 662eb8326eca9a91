//! The step that springs and balloons share: backward Euler or equilibrium, by Newton's method, with energy under control.
//!
//! A period looks for the nodes `x` that make the incremental potential least (its gradient is h⁻¹ times the residual of the
//! backward Euler step), subject to the kept volume if there is one:
//!
//! ```text
//! Φ(x) = E(x) − f·x + ½·dᵀ·(((1 + h·α)/h²)·M + (β/h)·K₀)·d − (1/h)·vᵀ·M·d,   d = x − x₀
//! ```
//!
//! with `K₀` the stiffness at the start of the period. Every Newton step is shortened until Φ falls. In the end the whole
//! displacement is shortened until the body has no more energy than it had plus the work of the forces: energy never grows
//! without input, however the Newton steps went.

use std::sync::Arc;

use cotouch_scene::scene::Scene;
use glam::{DMat3, DVec3};
use nalgebra::DMatrix;

use crate::body::{MaterialPoint, PointForce, SoftBody, SoftEnergy, SoftError, SoftState};
use crate::factor::{BlockMatrix, Factor, Symbolic};
use crate::linear::LinearBody;

/// Newton steps after which a static equilibrium counts as not found.
const MOST_SETTLING_STEPS: usize = 300;
/// Newton steps of a period that is to end in equilibrium.
const MOST_QUASI_STATIC_STEPS: usize = 30;
/// A Newton step shorter than this part of the body's size ends the search for an equilibrium.
const SETTLED: f64 = 1e-12;
/// One that rounding keeps from going further downhill may be this long.
const NEARLY_SETTLED: f64 = 1e-7;
/// Φ has to fall by this part of what its slope promises.
const SUFFICIENT: f64 = 1e-4;
/// How often a step is halved before it is given up.
const MOST_HALVINGS: usize = 40;
/// Energies that differ by less than this part of themselves count as equal.
const ROUNDING: f64 = 1e-13;

/// What holds a body together: an energy of its nodes' positions.
pub(crate) trait Elastic: Clone + Send + Sync + 'static {
    /// Elastic energy, J.
    fn energy_j(&self, positions_m: &[DVec3]) -> f64;

    /// Adds the elastic forces, N.
    fn add_forces(&self, positions_m: &[DVec3], forces_n: &mut [DVec3]);

    /// Adds `scale` times the tangent stiffness, N/m: exactly, or with its parts that are not positive left out.
    fn add_tangent(&self, positions_m: &[DVec3], positive: bool, scale: f64, matrix: &mut BlockMatrix);

    /// Fills the von Mises stress of every node, Pa.
    fn stress_pa(&self, positions_m: &[DVec3], stress: &mut Vec<f32>);
}

/// What a body of this kind is made of.
pub(crate) struct Parts<E> {
    pub(crate) elastic: E,
    pub(crate) rest_m: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) mass_kg: Vec<f64>,
    pub(crate) fixed: Vec<bool>,
    /// Pairs of nodes that act on each other.
    pub(crate) pairs: Vec<[u32; 2]>,
    /// Why the body can move without deforming, if it can.
    pub(crate) not_held: Option<String>,
}

/// What does not change.
struct Constants<E> {
    parts: Parts<E>,
    size_m: f64,
    symbolic: Arc<Symbolic>,
    period_s: f64,
    mass_damping_per_s: f64,
    stiffness_damping_s: f64,
    newton_steps: usize,
    quasi_static: bool,
    gravity_m_per_s2: DVec3,
    rest_energy_j: f64,
    at_rest: Option<Factor>,
}

/// A body that [`Elastic`] holds together.
#[derive(Clone)]
pub(crate) struct ImplicitBody<E> {
    constants: Arc<Constants<E>>,
    state: SoftState,
    matrix: BlockMatrix,
    factor: Factor,
}

/// The potential that a search makes least.
struct Potential<'a> {
    start_m: &'a [DVec3],
    velocity_m_per_s: &'a [DVec3],
    forces_n: Vec<DVec3>,
    /// (1 + h·α)/h², 1/s²; 0 in a search for equilibrium.
    inertia: f64,
    /// 1/h, 1/s; 0 in a search for equilibrium.
    momentum: f64,
    /// β/h; 0 in a search for equilibrium.
    damping: f64,
    /// K₀, where it damps.
    damper: Option<BlockMatrix>,
    /// Whether K₀ is without the parts that are not positive.
    positive_damper: bool,
}

impl<E: Elastic> ImplicitBody<E> {
    /// A body at rest where the parts say, with the scene's period, damping and gravity.
    pub(crate) fn new(scene: &Scene, parts: Parts<E>) -> Result<Self, SoftError> {
        let soft = &scene.soft;
        if let (true, Some(why)) = (soft.quasi_static, &parts.not_held) {
            return Err(SoftError::NotHeld(format!("{why}; without inertia nothing else holds it")));
        }
        let symbolic = Arc::new(Symbolic::new(&parts.rest_m, &parts.fixed, &parts.pairs));
        let mut matrix = BlockMatrix::new(symbolic.clone());
        let mut factor = Factor::new(symbolic.clone());
        parts.elastic.add_tangent(&parts.rest_m, false, 1.0, &mut matrix);
        let rigid = parts.not_held.is_none() && factor.refactor(&matrix).is_ok();
        let state = SoftState {
            positions_m: parts.rest_m.clone(),
            velocities_m_per_s: vec![DVec3::ZERO; parts.rest_m.len()],
        };
        let constants = Constants {
            size_m: extent(&parts.rest_m),
            period_s: scene.rates.simulation_hz.period_s(),
            mass_damping_per_s: soft.mass_damping_per_s,
            stiffness_damping_s: soft.stiffness_damping_s,
            newton_steps: soft.newton_steps as usize,
            quasi_static: soft.quasi_static,
            gravity_m_per_s2: scene.gravity_m_per_s2,
            rest_energy_j: parts.elastic.energy_j(&parts.rest_m),
            at_rest: rigid.then(|| factor.clone()),
            symbolic,
            parts,
        };
        Ok(Self { constants: Arc::new(constants), state, matrix, factor })
    }

    /// The period of a body without inertia.
    fn step_in_equilibrium(&mut self, forces_n: Vec<DVec3>) {
        let most_steps = MOST_QUASI_STATIC_STEPS.max(self.constants.newton_steps);
        let start = self.state.clone();
        let potential = Potential::of_equilibrium(&start, forces_n);
        self.search(&potential, most_steps);
        self.state.velocities_m_per_s.fill(DVec3::ZERO);
    }

    /// The period of a body with inertia.
    fn step_in_time(&mut self, forces_n: Vec<DVec3>) {
        let newton_steps = self.constants.newton_steps;
        let start = self.state.clone();
        let potential = self.potential_in_time(&start, forces_n);
        self.search(&potential, newton_steps);
        self.arrive(&start, &potential.forces_n);
    }

    fn potential_in_time<'a>(&mut self, start: &'a SoftState, forces_n: Vec<DVec3>) -> Potential<'a> {
        let Constants { period_s, mass_damping_per_s, stiffness_damping_s, .. } = *self.constants;
        let mut potential = Potential::of_equilibrium(start, forces_n);
        potential.inertia = (1.0 + period_s * mass_damping_per_s) / (period_s * period_s);
        potential.momentum = 1.0 / period_s;
        potential.damping = stiffness_damping_s / period_s;
        if potential.damping > 0.0 {
            potential.positive_damper = !self.factorise(&potential);
            let mut damper = BlockMatrix::new(self.constants.symbolic.clone());
            let elastic = &self.constants.parts.elastic;
            elastic.add_tangent(&start.positions_m, potential.positive_damper, 1.0, &mut damper);
            potential.damper = Some(damper);
        }
        potential
    }

    /// Newton's method downhill from the present positions. Returns whether it ended in a minimum.
    fn search(&mut self, potential: &Potential<'_>, most_steps: usize) -> bool {
        let constants = self.constants.clone();
        let mut value = constants.potential(potential, &self.state.positions_m);
        for _ in 0..most_steps {
            let gradient = constants.gradient(potential, &self.state.positions_m);
            self.factorise(potential);
            let mut step = gradient.clone();
            self.factor.solve_in_place(&mut step);
            let longest = step.iter().fold(0.0_f64, |most, part| most.max(part.abs()));
            let fall = dot(&step, &gradient);
            let found = constants.downhill(potential, &self.state.positions_m, value, &step, fall);
            let Some((positions, less)) = found else { return longest <= NEARLY_SETTLED * constants.size_m };
            (self.state.positions_m, value) = (positions, less);
            if longest <= SETTLED * constants.size_m {
                return true;
            }
        }
        false
    }

    /// The factor of Φ's second derivative where the nodes are: with the exact stiffness if that is positive definite, else
    /// without the parts of it that are not positive. Returns whether it is exact.
    fn factorise(&mut self, potential: &Potential<'_>) -> bool {
        let constants = self.constants.clone();
        for positive in [false, true] {
            constants.fill(&mut self.matrix, potential, &self.state.positions_m, positive);
            if self.factor.refactor(&self.matrix).is_ok() {
                return !positive;
            }
        }
        // Something is loose in this very shape: a little of the body's stiffness everywhere holds it.
        let mut extra = 1e-9 * constants.stiffness_n_per_m();
        while self.factor.refactor(&self.matrix).is_err() && extra.is_finite() {
            (0..constants.symbolic.free_nodes()).for_each(|place| self.matrix.add_to_diagonal(place, extra));
            extra *= 10.0;
        }
        false
    }

    /// Shortens the displacement of a period that began at `start` until energy allows it; and the velocities after it.
    fn arrive(&mut self, start: &SoftState, forces_n: &[DVec3]) {
        let constants = self.constants.clone();
        let before = constants.elastic_j(&start.positions_m) + constants.kinetic_j(&start.velocities_m_per_s);
        for _ in 0..MOST_HALVINGS {
            let SoftState { positions_m: to, velocities_m_per_s: velocities } = &mut self.state;
            let displacements = to.iter().zip(&start.positions_m).map(|(&to, &from)| to - from);
            let work: f64 = displacements.clone().zip(forces_n).map(|(moved, force)| moved.dot(*force)).sum();
            *velocities = displacements.map(|moved| moved / constants.period_s).collect();
            let after = constants.elastic_j(to) + constants.kinetic_j(velocities);
            let rounding =
                ROUNDING * (after.abs() + before.abs() + work.abs() + constants.rest_energy_j.abs());
            if after <= before + work + rounding {
                return;
            }
            to.iter_mut().zip(&start.positions_m).for_each(|(to, &from)| *to = from.midpoint(*to));
        }
        self.state.positions_m.clone_from(&start.positions_m);
        self.state.velocities_m_per_s.fill(DVec3::ZERO);
    }
}

impl<'a> Potential<'a> {
    fn of_equilibrium(start: &'a SoftState, forces_n: Vec<DVec3>) -> Self {
        Self {
            start_m: &start.positions_m,
            velocity_m_per_s: &start.velocities_m_per_s,
            forces_n,
            inertia: 0.0,
            momentum: 0.0,
            damping: 0.0,
            damper: None,
            positive_damper: false,
        }
    }
}

impl<E: Elastic> Constants<E> {
    /// Gravity and the points' forces on every node, N; forces that are not finite count as none.
    fn external_forces(&self, points: &[PointForce]) -> Vec<DVec3> {
        let mut forces: Vec<DVec3> =
            self.parts.mass_kg.iter().map(|mass| *mass * self.gravity_m_per_s2).collect();
        for point in points.iter().filter(|point| point.force_n.is_finite()) {
            for (&node, weight) in point.at.nodes.iter().zip(point.at.weights) {
                forces[node as usize] += weight * point.force_n;
            }
        }
        forces
    }

    /// From rest.
    fn elastic_j(&self, positions_m: &[DVec3]) -> f64 {
        self.parts.elastic.energy_j(positions_m) - self.rest_energy_j
    }

    fn kinetic_j(&self, velocities: &[DVec3]) -> f64 {
        let each = self.parts.mass_kg.iter().zip(velocities);
        each.map(|(mass, velocity)| 0.5 * mass * velocity.length_squared()).sum()
    }

    /// Φ.
    fn potential(&self, potential: &Potential<'_>, positions_m: &[DVec3]) -> f64 {
        let Potential { start_m, velocity_m_per_s, forces_n, inertia, momentum, damping, .. } = potential;
        let mut value = self.parts.elastic.energy_j(positions_m);
        for (node, (position, start)) in positions_m.iter().zip(*start_m).enumerate() {
            let (moved, mass) = (*position - *start, self.parts.mass_kg[node]);
            value += mass
                * (0.5 * inertia * moved.length_squared() - momentum * velocity_m_per_s[node].dot(moved));
            value -= forces_n[node].dot(moved);
        }
        match &potential.damper {
            None => value,
            Some(damper) => {
                let moved = self.displacement(start_m, positions_m);
                let mut force = vec![0.0; moved.len()];
                damper.multiply(&moved, &mut force);
                value + 0.5 * damping * dot(&moved, &force)
            }
        }
    }

    /// Φ's gradient.
    fn gradient(&self, potential: &Potential<'_>, positions_m: &[DVec3]) -> Vec<f64> {
        let Potential { start_m, velocity_m_per_s, forces_n, inertia, momentum, damping, .. } = potential;
        let mut down = forces_n.clone();
        self.parts.elastic.add_forces(positions_m, &mut down);
        for (node, force) in down.iter_mut().enumerate() {
            let moved = positions_m[node] - start_m[node];
            *force -= self.parts.mass_kg[node] * (*inertia * moved - *momentum * velocity_m_per_s[node]);
        }
        let mut gradient = self.symbolic.gather(&down);
        gradient.iter_mut().for_each(|part| *part = -*part);
        if let Some(damper) = &potential.damper {
            let mut force = vec![0.0; gradient.len()];
            damper.multiply(&self.displacement(start_m, positions_m), &mut force);
            gradient.iter_mut().zip(force).for_each(|(part, force)| *part += damping * force);
        }
        gradient
    }

    /// Φ's second derivative.
    fn fill(
        &self,
        matrix: &mut BlockMatrix,
        potential: &Potential<'_>,
        positions_m: &[DVec3],
        positive: bool,
    ) {
        let elastic = &self.parts.elastic;
        matrix.clear();
        elastic.add_tangent(positions_m, positive, 1.0, matrix);
        if potential.damping > 0.0 {
            let positive = positive || potential.positive_damper;
            elastic.add_tangent(potential.start_m, positive, potential.damping, matrix);
        }
        for (place, &node) in self.symbolic.order().iter().enumerate() {
            matrix.add_to_diagonal(place, potential.inertia * self.parts.mass_kg[node as usize]);
        }
    }

    /// The first of the steps 1, 1/2, 1/4 … against `step` on which Φ falls, and Φ there. `fall` is its slope.
    fn downhill(
        &self,
        potential: &Potential<'_>,
        from_m: &[DVec3],
        value: f64,
        step: &[f64],
        fall: f64,
    ) -> Option<(Vec<DVec3>, f64)> {
        let full = self.scattered(step);
        let rounding = ROUNDING * (value.abs() + self.parts.elastic.energy_j(from_m).abs());
        let mut part = 1.0;
        for _ in 0..MOST_HALVINGS {
            let to_m: Vec<DVec3> =
                from_m.iter().zip(&full).map(|(from, step)| *from - part * *step).collect();
            let there = self.potential(potential, &to_m);
            if there <= value - SUFFICIENT * part * fall + rounding {
                return Some((to_m, there));
            }
            part *= 0.5;
        }
        None
    }

    fn displacement(&self, from_m: &[DVec3], to_m: &[DVec3]) -> Vec<f64> {
        let moved: Vec<DVec3> = to_m.iter().zip(from_m).map(|(to, from)| *to - *from).collect();
        self.symbolic.gather(&moved)
    }

    /// A vector over the free coordinates as a field over the nodes, zero where they are fixed.
    fn scattered(&self, vector: &[f64]) -> Vec<DVec3> {
        let mut field = vec![DVec3::ZERO; self.parts.rest_m.len()];
        self.symbolic.scatter(vector, &mut field);
        field
    }

    /// The largest stiffness of a node about rest, N/m.
    fn stiffness_n_per_m(&self) -> f64 {
        let mut matrix = BlockMatrix::new(self.symbolic.clone());
        self.parts.elastic.add_tangent(&self.parts.rest_m, true, 1.0, &mut matrix);
        let diagonal = matrix.entries().into_iter().filter(|(row, column, _)| row == column);
        diagonal.map(|(_, _, value)| value).fold(f64::MIN_POSITIVE, f64::max)
    }

    /// The unit forces of a point along x, y and z, in the free coordinates: three columns.
    fn unit_forces(&self, points: &[MaterialPoint]) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(self.symbolic.coordinates(), 3 * points.len());
        for (index, point) in points.iter().enumerate() {
            for (&node, weight) in point.nodes.iter().zip(point.weights) {
                let Some(place) = self.symbolic.position(node) else { continue };
                (0..3).for_each(|axis| columns[(3 * place + axis, 3 * index + axis)] += weight);
            }
        }
        columns
    }
}

impl<E: Elastic> SoftBody for ImplicitBody<E> {
    fn rest_m(&self) -> &[DVec3] {
        &self.constants.parts.rest_m
    }

    fn triangles(&self) -> &[[u32; 3]] {
        &self.constants.parts.triangles
    }

    fn state(&self) -> &SoftState {
        &self.state
    }

    fn set_state(&mut self, state: &SoftState) {
        let constants = self.constants.clone();
        let Parts { rest_m, fixed, .. } = &constants.parts;
        assert_eq!(state.positions_m.len(), rest_m.len(), "a state of another body");
        assert_eq!(state.velocities_m_per_s.len(), rest_m.len(), "a state of another body");
        let mut numbers = state.positions_m.iter().chain(&state.velocities_m_per_s);
        if !numbers.all(|vector| vector.is_finite()) {
            self.state.velocities_m_per_s.fill(DVec3::ZERO);
            return;
        }
        self.state.clone_from(state);
        for node in (0..rest_m.len()).filter(|&node| fixed[node]) {
            self.state.positions_m[node] = rest_m[node];
            self.state.velocities_m_per_s[node] = DVec3::ZERO;
        }
    }

    fn step(&mut self, forces: &[PointForce]) {
        let forces_n = self.constants.external_forces(forces);
        if self.constants.quasi_static {
            self.step_in_equilibrium(forces_n)
        } else {
            self.step_in_time(forces_n)
        }
    }

    fn settle(&mut self, forces: &[PointForce]) -> Result<(), SoftError> {
        if let Some(why) = &self.constants.parts.not_held {
            return Err(SoftError::NotHeld(why.clone()));
        }
        let start = self.state.clone();
        let potential = Potential::of_equilibrium(&start, self.constants.external_forces(forces));
        if !self.search(&potential, MOST_SETTLING_STEPS) {
            self.state = start;
            let steps = format!("{MOST_SETTLING_STEPS} Newton steps did not end in one");
            return Err(SoftError::NoEquilibrium(steps));
        }
        self.state.velocities_m_per_s.fill(DVec3::ZERO);
        Ok(())
    }

    fn compliance(&self, points: &[MaterialPoint]) -> Option<DMatrix<f64>> {
        let factor = self.constants.at_rest.as_ref()?;
        let forces = self.constants.unit_forces(points);
        let mut displacements = forces.clone();
        factor.solve_columns_in_place(&mut displacements);
        let compliance = forces.tr_mul(&displacements);
        Some((&compliance + compliance.transpose()) * 0.5)
    }

    fn linear(&self) -> Option<LinearBody> {
        let mut body = self.clone();
        let constants = self.constants.clone();
        let start = self.state.clone();
        let potential = match constants.quasi_static {
            true => Potential::of_equilibrium(&start, constants.external_forces(&[])),
            false => body.potential_in_time(&start, constants.external_forces(&[])),
        };
        let exact = body.factorise(&potential);
        if !exact && (constants.quasi_static || constants.newton_steps > 1) {
            return None;
        }
        let stiffness = |positive| {
            let mut matrix = BlockMatrix::new(constants.symbolic.clone());
            constants.parts.elastic.add_tangent(&start.positions_m, positive, 1.0, &mut matrix);
            matrix.entries()
        };
        let order = constants.symbolic.order();
        Some(LinearBody {
            period_s: constants.period_s,
            quasi_static: constants.quasi_static,
            coordinates: order.iter().flat_map(|&node| [0, 1, 2].map(|axis| (node, axis))).collect(),
            mass_kg: order.iter().flat_map(|&node| [constants.parts.mass_kg[node as usize]; 3]).collect(),
            mass_damping_per_s: constants.mass_damping_per_s,
            stiffness_damping_s: constants.stiffness_damping_s,
            stiffness: stiffness(false),
            step_stiffness: (!exact).then(|| stiffness(true)),
            volume_gradient: None,
        })
    }

    fn energy(&self) -> SoftEnergy {
        let Constants { parts, gravity_m_per_s2, .. } = &*self.constants;
        let SoftState { positions_m, velocities_m_per_s } = &self.state;
        let lifted =
            positions_m.iter().zip(&parts.rest_m).map(|(at, rest)| (*at - *rest).dot(*gravity_m_per_s2));
        SoftEnergy {
            elastic_j: self.constants.elastic_j(positions_m),
            kinetic_j: self.constants.kinetic_j(velocities_m_per_s),
            potential_j: -lifted.zip(&parts.mass_kg).map(|(lifted, mass)| lifted * mass).sum::<f64>(),
        }
    }

    fn stress_pa(&self, stress: &mut Vec<f32>) {
        self.constants.parts.elastic.stress_pa(&self.state.positions_m, stress);
    }

    fn period_s(&self) -> f64 {
        self.constants.period_s
    }

    fn boxed_clone(&self) -> Box<dyn SoftBody> {
        Box::new(self.clone())
    }
}

/// Adds a block that joins two nodes, and its transpose on the other side of the diagonal; nothing if one is fixed.
pub(crate) fn add_pair(matrix: &mut BlockMatrix, row: u32, column: u32, block: DMat3) {
    if let Some(slot) = matrix.symbolic().slot(row, column) {
        matrix.add(slot, block);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The diagonal of the box around some points, m.
fn extent(points: &[DVec3]) -> f64 {
    let first = points.first().copied().unwrap_or_default();
    let (low, high) = points.iter().fold((first, first), |(low, high), &at| (low.min(at), high.max(at)));
    low.distance(high)
}
