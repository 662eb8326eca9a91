//! What holds a body together.

use glam::DVec3;

use crate::factor::BlockMatrix;

/// What holds a body together: an energy of its nodes' positions.
pub(crate) trait Elastic: Clone + Send + Sync + 'static {
    /// Elastic energy with the nodes at these places, J.
    fn energy_j(&self, positions_m: &[DVec3]) -> f64;

    /// Adds the elastic forces, N.
    fn add_forces(&self, positions_m: &[DVec3], forces_n: &mut [DVec3]);

    /// Adds `scale` times the tangent stiffness, N/m: exactly, or with its parts that are not positive left out.
    fn add_tangent(&self, positions_m: &[DVec3], positive: bool, scale: f64, matrix: &mut BlockMatrix);

    /// Fills the von Mises stress of every node, Pa.
    fn stress_pa(&self, positions_m: &[DVec3], stress: &mut Vec<f32>);
}
