//! Continuous linear plants.

use cotouch_scene::scene::SpringDamper;
use glam::DMat3;
use nalgebra::DMatrix;

/// `ẋ = A·x + B·u`, `y = C·x`, with an input `u` that is held.
///
/// A body with d degrees of freedom has d forces as inputs, and d positions (m) and d velocities (m/s) as outputs.
/// Translation and uniform motion are recognised where these are states of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// n × n, 1/s.
    pub a: DMatrix<f64>,
    /// n × inputs.
    pub b: DMatrix<f64>,
    /// Outputs × n.
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
