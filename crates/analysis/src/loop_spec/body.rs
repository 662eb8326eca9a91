//! Bodies under hold.

use cotouch_scene::names::Coordinate;
use cotouch_scene::scene::Integrator;
use glam::DMat3;

use crate::dof::Dof;
use crate::plant::Plant;

/// Something that a force moves, with a position and a velocity.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopBody {
    /// The names of its states, in the order of its vectors.
    pub states: Vec<Coordinate>,
    /// How it can move: d degrees of freedom. [`Dof::Move`] comes before [`Dof::Turn`].
    pub axes: &'static [Dof],
    /// How it steps.
    pub dynamics: Dynamics,
}

/// How a body with d degrees of freedom steps under a force that is held over the tick.
#[derive(Clone, Debug, PartialEq)]
pub enum Dynamics {
    /// Continuous dynamics, discretised exactly.
    Plant(Plant),
    /// Continuous dynamics, of which only positions at ticks are measured; velocities are told from them. The states
    /// are the plant's, then the d positions that were read at the last tick, then, for [`Estimate::Filtered`], the d
    /// velocities that were told at the last tick.
    Sensed {
        /// What moves.
        plant: Plant,
        /// How velocities are told.
        estimate: Estimate,
    },
    /// A point mass that software integrates; its states are d positions and d velocities.
    Mass {
        /// kg, positive.
        mass_kg: f64,
        /// The software's integrator.
        integrator: Integrator,
    },
    /// A rigid body about rest, integrated by software; its states are d positions (turns: rotation vector) and d
    /// velocities. About rest gyroscopic forces vanish to first order.
    Rigid {
        /// kg, positive.
        mass_kg: f64,
        /// About the centre of mass, world frame, kg·m²; positive definite in the directions in which it turns.
        inertia: DMat3,
        /// The software's integrator.
        integrator: Integrator,
    },
}

/// How a velocity is told from positions x(k) that are read at ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Estimate {
    /// v(k) = (x(k) − x(k−1))/T.
    Difference,
    /// v(k) = v(k−1) + (1 − e^(−ω·T))·((x(k) − x(k−1))/T − v(k−1)).
    Filtered {
        /// ω.
        cutoff_rad_per_s: f64,
    },
}
