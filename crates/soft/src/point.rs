//! Points of the material, and forces on them.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A point of the material: a weighted mean of nodes. A point of the surface has three nodes (and a weight 0), one inside
/// a tetrahedron four. The weights sum to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MaterialPoint {
    /// The nodes of which the point is a mean.
    pub nodes: [u32; 4],
    /// How much each counts.
    pub weights: [f64; 4],
}

impl MaterialPoint {
    /// On a triangle with these nodes and barycentric weights.
    #[must_use]
    pub fn on_triangle(nodes: [u32; 3], weights: [f64; 3]) -> Self {
        let ([a, b, c], [wa, wb, wc]) = (nodes, weights);
        Self { nodes: [a, b, c, a], weights: [wa, wb, wc, 0.0] }
    }

    /// Where it is when the nodes are at `positions_m`.
    ///
    /// # Panics
    /// When a node does not exist.
    #[must_use]
    pub fn at(&self, positions_m: &[DVec3]) -> DVec3 {
        let place = |(&node, &weight): (&u32, &f64)| positions_m[node as usize] * weight;
        self.nodes.iter().zip(&self.weights).map(place).sum()
    }
}

/// A force on a point of the material, N, world frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointForce {
    /// The point of the material on which it acts.
    pub at: MaterialPoint,
    /// The force in the world's frame, N.
    pub force_n: DVec3,
}
