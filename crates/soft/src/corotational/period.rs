//! One period of a body with inertia.
//!
//! A period looks for the velocities that make
//!
//! ```text
//! Φ(v) = ½·(1 + h·α)·vᵀMv − v₀ᵀMv + ½·h·β·vᵀK₀v + E(x₀ + h·v) − h·fᵀv
//! ```
//!
//! least (its gradient is the residual of backward Euler) by Newton steps that are shortened until Φ falls. In the end all
//! velocities are shortened until the body has no more energy than it had plus the work of the forces.

use glam::DVec3;

use super::body::Corotational;
use super::element::Tangent;
use crate::point::PointForce;
use crate::vector::{add_multiple, dot};

/// How often a step is halved before it is given up.
const MAX_HALVINGS: u32 = 60;

/// What a period starts from, in the free coordinates.
struct PeriodStart {
    positions_m: Vec<DVec3>,
    /// Momentum M·v₀ at the start, kg·m/s.
    momentum: Vec<f64>,
    /// Impulse h·f of the external forces, N·s.
    impulse: Vec<f64>,
    elastic_j: f64,
    kinetic_j: f64,
}

impl Corotational {
    pub(super) fn period(&mut self, forces: &[PointForce]) {
        let start = self.start(forces);
        let mut velocities = vec![0.0; start.momentum.len()];
        let mut descent = vec![0.0; start.momentum.len()];
        for iteration in 0..self.constants.newton_steps {
            let gradient = self.gradient(&start, &velocities);
            if !self.newton_direction(iteration == 0, &gradient, &mut descent) {
                break;
            }
            descent.iter_mut().for_each(|part| *part = -*part);
            if !self.go_downhill(&start, &mut velocities, &gradient, &descent) {
                break;
            }
        }
        self.arrive(&start, velocities);
    }

    fn start(&self, forces: &[PointForce]) -> PeriodStart {
        let constants = &*self.constants;
        let velocities = constants.symbolic.gather(&self.state.velocities_m_per_s);
        let mut impulse = constants.external_forces(forces);
        impulse.iter_mut().for_each(|force| *force *= constants.period_s);
        PeriodStart {
            positions_m: self.state.positions_m.clone(),
            momentum: constants.free_mass_kg.iter().zip(&velocities).map(|(mass, v)| mass * v).collect(),
            impulse,
            elastic_j: self.present.energy_j,
            kinetic_j: constants.kinetic_j(&velocities),
        }
    }

    /// Φ's gradient at `velocities`, where the present evaluation is.
    fn gradient(&mut self, start: &PeriodStart, velocities: &[f64]) -> Vec<f64> {
        let mut gradient = self.quadratic_gradient(start, velocities);
        self.present.add_forces(
            &self.constants.elements,
            &self.constants.symbolic,
            -self.constants.period_s,
            &mut gradient,
        );
        gradient
    }

    /// The gradient of Φ without E.
    fn quadratic_gradient(&self, start: &PeriodStart, velocities: &[f64]) -> Vec<f64> {
        let mut gradient = self.quadratic(velocities);
        for ((part, momentum), impulse) in gradient.iter_mut().zip(&start.momentum).zip(&start.impulse) {
            *part -= momentum + impulse;
        }
        gradient
    }

    /// `((1 + h·α)·M + h·β·K₀)·velocities`. K₀ counts where there are velocities, and is known by then.
    fn quadratic(&self, velocities: &[f64]) -> Vec<f64> {
        let constants = &*self.constants;
        let damping = constants.period_s * constants.stiffness_damping_s;
        let inertia = 1.0 + constants.period_s * constants.mass_damping_per_s;
        let mut product = vec![0.0; velocities.len()];
        if damping > 0.0 && velocities.iter().any(|velocity| *velocity != 0.0) {
            self.damper.multiply(velocities, &mut product);
            product.iter_mut().for_each(|part| *part *= damping);
        }
        for ((part, mass), velocity) in product.iter_mut().zip(&constants.free_mass_kg).zip(velocities) {
            *part += inertia * mass * velocity;
        }
        product
    }

    /// Solves with the second derivative of Φ at the present positions: exact where that is positive definite, else with each
    /// element's positive part. In the first iteration the stiffness is also that of the damper.
    fn newton_direction(&mut self, first: bool, gradient: &[f64], direction: &mut [f64]) -> bool {
        if self.solver.uses_rotations() {
            self.present.node_rotations(
                &self.constants.elements,
                &self.constants.symbolic,
                &mut self.solver.rotations,
            );
        }
        for kind in [Tangent::Exact, Tangent::Positive] {
            self.assemble(kind);
            if first {
                self.damper.clone_from(&self.stiffness);
            }
            self.fill_system();
            if self.solver.solve(gradient, direction).is_ok() && direction.iter().all(|part| part.is_finite())
            {
                return true;
            }
        }
        false
    }

    /// Goes along `descent` as far as Φ falls. Returns whether there was such a step.
    fn go_downhill(
        &mut self,
        start: &PeriodStart,
        reached: &mut Vec<f64>,
        gradient: &[f64],
        descent: &[f64],
    ) -> bool {
        let slope = dot(gradient, descent);
        let quadratic_slope = dot(&self.quadratic_gradient(start, reached), descent);
        let curvature = dot(&self.quadratic(descent), descent);
        let elastic_before = self.present.energy_j;
        let mut part = 1.0;
        for _ in 0..MAX_HALVINGS {
            let mut velocities = reached.clone();
            add_multiple(&mut velocities, part, descent);
            self.try_velocities(start, &velocities);
            let smooth = part * quadratic_slope + 0.5 * part * part * curvature;
            let change = smooth + self.trial.energy_j - elastic_before;
            let size = elastic_before + self.trial.energy_j + smooth.abs() + start.kinetic_j;
            if change <= 1e-4 * part * slope + self.constants.rounding_j(size) {
                std::mem::swap(&mut self.present, &mut self.trial);
                *reached = velocities;
                return true;
            }
            part *= 0.5;
        }
        self.try_velocities(start, reached);
        std::mem::swap(&mut self.present, &mut self.trial);
        false
    }

    /// Moves the nodes to where a period with these velocities ends, and evaluates there.
    fn try_velocities(&mut self, start: &PeriodStart, velocities: &[f64]) {
        let constants = self.constants.clone();
        let h = constants.period_s;
        let nodes = constants.symbolic.order().iter();
        for (&node, velocity) in nodes.zip(velocities.as_chunks::<3>().0) {
            let node = node as usize;
            self.state.positions_m[node] = start.positions_m[node] + h * DVec3::from_array(*velocity);
        }
        self.trial.update(&constants.elements, &self.state.positions_m);
    }

    /// Ends the period with the velocities, or with a part of them that does not make energy from nothing.
    fn arrive(&mut self, start: &PeriodStart, mut velocities: Vec<f64>) {
        let constants = self.constants.clone();
        let before = start.elastic_j + start.kinetic_j;
        for _ in 0..MAX_HALVINGS {
            let kinetic = constants.kinetic_j(&velocities);
            let work = dot(&start.impulse, &velocities);
            let after = self.present.energy_j + kinetic;
            if after <= before + work + constants.rounding_j(before + after + work.abs()) {
                constants.symbolic.scatter(&velocities, &mut self.state.velocities_m_per_s);
                return;
            }
            velocities.iter_mut().for_each(|velocity| *velocity *= 0.5);
            self.try_velocities(start, &velocities);
            std::mem::swap(&mut self.present, &mut self.trial);
        }
        self.rest_at(&start.positions_m);
    }

    /// Puts the nodes there, at rest.
    fn rest_at(&mut self, positions_m: &[DVec3]) {
        self.state.positions_m.copy_from_slice(positions_m);
        self.state.velocities_m_per_s.fill(DVec3::ZERO);
        self.present.update(&self.constants.elements, &self.state.positions_m);
    }
}
