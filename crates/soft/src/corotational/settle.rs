//! Static equilibrium, the quasi-static period, and the step's linearisation.

use glam::DVec3;

use super::body::Corotational;
use super::element::Tangent;
use crate::body::SoftError;
use crate::linear::LinearBody;
use crate::point::PointForce;
use crate::vector::dot;

/// Newton steps after which an equilibrium counts as not found.
const MAX_STEPS: u32 = 300;
/// Newton steps of a quasi-static period.
const MAX_QUASI_STATIC_STEPS: u32 = 30;
/// A Newton step shorter than this part of the body's size ends the search.
const SETTLED: f64 = 1e-13;
/// One that rounding keeps from going further may be so long.
const NEARLY_SETTLED: f64 = 1e-8;
/// A step may move no node further than this part of the body's size.
const LONGEST: f64 = 0.5;
/// How often a step is halved before it is given up.
const MAX_HALVINGS: u32 = 40;

impl Corotational {
    /// Moves to the static equilibrium under the forces.
    pub(super) fn find_equilibrium(&mut self, forces: &[PointForce]) -> Result<(), SoftError> {
        let before = self.state.clone();
        let external = self.constants.external_forces(forces);
        let found = self.descend(&external, MAX_STEPS);
        self.state.velocities_m_per_s.fill(DVec3::ZERO);
        found.inspect_err(|_| self.place(&before))
    }

    /// As far towards the equilibrium as a bounded number of Newton steps goes.
    pub(super) fn quasi_static_period(&mut self, forces: &[PointForce]) {
        let external = self.constants.external_forces(forces);
        let max_steps = MAX_QUASI_STATIC_STEPS.max(self.constants.newton_steps);
        // Not arriving is no failure: the next period goes on from there.
        let _ = self.descend(&external, max_steps);
        self.state.velocities_m_per_s.fill(DVec3::ZERO);
    }

    /// Newton's method downhill on `E(x) − fᵀx`.
    fn descend(&mut self, external: &[f64], max_steps: u32) -> Result<(), SoftError> {
        let mut step = vec![0.0; external.len()];
        let mut longest = f64::INFINITY;
        self.solver.forget();
        for _ in 0..max_steps {
            let mut force = external.to_vec();
            self.present.add_forces(&self.constants.elements, &self.constants.symbolic, 1.0, &mut force);
            if !self.static_direction(&force, &mut step) {
                return Err(SoftError::NoEquilibrium("the deformed body has no stiffness somewhere".into()));
            }
            longest = step.iter().fold(0.0_f64, |most, part| most.max(part.abs()));
            let limit = LONGEST * self.constants.size_m;
            if longest > limit {
                step.iter_mut().for_each(|part| *part *= limit / longest);
            }
            let moved = self.go_lower(external, &force, &step);
            if longest <= SETTLED * self.constants.size_m || !moved {
                break;
            }
        }
        self.solver.forget();
        if longest <= NEARLY_SETTLED * self.constants.size_m {
            return Ok(());
        }
        let after = format!("after {max_steps} steps the next one is {longest:.1e} m");
        Err(SoftError::NoEquilibrium(after))
    }

    /// Newton's step: with the exact stiffness where it is positive definite, else with each element's positive part.
    fn static_direction(&mut self, force: &[f64], step: &mut [f64]) -> bool {
        for kind in [Tangent::Exact, Tangent::Positive] {
            self.assemble(kind);
            self.solver.matrix.clone_from(&self.stiffness);
            if self.solver.solve_exactly(force, step).is_ok() && step.iter().all(|part| part.is_finite()) {
                return true;
            }
        }
        false
    }

    /// Goes along a step as far as the potential falls. Returns whether it did.
    fn go_lower(&mut self, external: &[f64], force: &[f64], step: &[f64]) -> bool {
        let constants = self.constants.clone();
        let start = self.state.positions_m.clone();
        let (slope, work) = (dot(force, step), dot(external, step));
        let mut part = 1.0;
        for _ in 0..MAX_HALVINGS {
            for (&node, moved) in constants.symbolic.order().iter().zip(step.as_chunks::<3>().0) {
                let node = node as usize;
                self.state.positions_m[node] = start[node] + part * DVec3::from_array(*moved);
            }
            self.trial.update(&constants.elements, &self.state.positions_m);
            let change = self.trial.energy_j - self.present.energy_j - part * work;
            let size = self.trial.energy_j + self.present.energy_j + (part * work).abs();
            if change <= -1e-4 * part * slope + constants.rounding_j(size) {
                std::mem::swap(&mut self.present, &mut self.trial);
                return true;
            }
            part *= 0.5;
        }
        self.state.positions_m = start;
        false
    }

    /// The step's linearisation about the present state.
    pub(super) fn linearised(&self) -> LinearBody {
        let mut body = self.clone();
        let constants = &*self.constants;
        body.assemble(Tangent::Exact);
        let exact = body.stiffness.entries();
        let step_stiffness = (!constants.quasi_static && !body.exact_step_is_possible()).then(|| {
            body.assemble(Tangent::Positive);
            body.stiffness.entries()
        });
        let coordinate = |&node: &u32| (0..3).map(move |axis| (node, axis));
        LinearBody {
            period_s: constants.period_s,
            quasi_static: constants.quasi_static,
            coordinates: constants.symbolic.order().iter().flat_map(coordinate).collect(),
            mass_kg: constants.free_mass_kg.clone(),
            mass_damping_per_s: constants.mass_damping_per_s,
            stiffness_damping_s: constants.stiffness_damping_s,
            stiffness: exact,
            step_stiffness,
            volume_gradient: None,
        }
    }

    /// Whether the step's matrix with the exact stiffness (assembled) is positive definite.
    fn exact_step_is_possible(&mut self) -> bool {
        self.damper.clone_from(&self.stiffness);
        self.fill_system();
        let mut solution = vec![0.0; self.constants.free_mass_kg.len()];
        self.solver.solve_exactly(&vec![0.0; solution.len()], &mut solution).is_ok()
    }
}
