//! Bodies under hold.

use cotouch_scene::names::Coordinate;
use cotouch_scene::scene::{Integrator, SpringDamper};
use glam::DMat3;
use nalgebra::DMatrix;

use crate::dof::Dof;

/// Something that a force moves, with a position and a velocity.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
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

/// `ẋ = A·x + B·f`, `(positions, velocities) = C·x`, with the force `f` held over each tick.
///
/// Translation and uniform motion are recognised where positions and velocities are states of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// n × n.
    pub a: DMatrix<f64>,
    /// n × d.
    pub b: DMatrix<f64>,
    /// 2d × n: positions (m), then velocities (m/s).
    pub c: DMatrix<f64>,
}

impl Plant {
    /// A mass on a spring and a damper to the ground: states position (m) and velocity (m/s).
    #[must_use]
    pub fn mass(mass_kg: f64, to_ground: SpringDamper) -> Self {
        let SpringDamper { stiffness_n_per_m: k, damping_n_s_per_m: b } = to_ground;
        Self {
            a: DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -k / mass_kg, -b / mass_kg]),
            b: DMatrix::from_column_slice(2, 1, &[0.0, 1.0 / mass_kg]),
            c: DMatrix::identity(2, 2),
        }
    }

    /// The same along the first `axes` axes of the world, with a mass (kg) that may differ from direction to direction:
    /// states are positions, then velocities.
    #[must_use]
    pub fn endpoint(mass: &DMat3, axes: usize, to_ground: SpringDamper) -> Self {
        let full = DMatrix::from_fn(axes, axes, |row, column| mass.col(column)[row]);
        let Some(per_mass) = full.try_inverse().filter(|_| axes > 1) else {
            return Self::mass(mass.x_axis.x, to_ground);
        };
        let mut a = DMatrix::zeros(2 * axes, 2 * axes);
        a.view_mut((0, axes), (axes, axes)).fill_with_identity();
        a.view_mut((axes, 0), (axes, axes)).copy_from(&(&per_mass * -to_ground.stiffness_n_per_m));
        a.view_mut((axes, axes), (axes, axes)).copy_from(&(&per_mass * -to_ground.damping_n_s_per_m));
        let mut b = DMatrix::zeros(2 * axes, axes);
        b.view_mut((axes, 0), (axes, axes)).copy_from(&per_mass);
        Self { a, b, c: DMatrix::identity(2 * axes, 2 * axes) }
    }
}
