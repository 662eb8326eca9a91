//! Tetrahedra that are pressed together, or pushed through themselves, push back.
//!
//! Springs along edges do not feel which side of a tetrahedron is which, and a network folds into other shapes at rest when its
//! tetrahedra lose their volume. So one that has less than half of its volume `V₀` left (or a negative one) resists with the
//! energy `E·w·V₀/2·(1/2 − V/V₀)²`; all others do not feel this, and the network about rest does not.

use cotouch_scene::soft_mesh::SoftMesh;
use glam::{DMat3, DVec3};

use crate::enclosed::cross_matrix;
use crate::factor::BlockMatrix;
use crate::mesh;

/// The part of its volume below which a tetrahedron pushes back.
const THRESHOLD: f64 = 0.5;
/// w: a block that was pulled at one corner until many tetrahedra were inverted stays folded with 1, and unfolds with 4.
const STRENGTH: f64 = 10.0;

/// All tetrahedra of a mesh.
#[derive(Clone, Debug)]
pub(crate) struct Inversion {
    stiffness_pa: f64,
    /// Nodes and V₀, m³.
    tetrahedra: Vec<([u32; 4], f64)>,
}

/// A tetrahedron that pushes back.
struct Flat {
    nodes: [u32; 4],
    corners: [DVec3; 4],
    volume_m3: f64,
    /// 1/2 − V/V₀, more than 0.
    missing: f64,
}

impl Inversion {
    pub(crate) fn new(mesh: &SoftMesh, young_pa: f64) -> Self {
        let volume = |nodes: &[u32; 4]| mesh::volume(nodes.map(|node| mesh.nodes_m[node as usize]));
        let tetrahedra = mesh.tetrahedra.iter().map(|nodes| (*nodes, volume(nodes))).collect();
        Self { stiffness_pa: STRENGTH * young_pa, tetrahedra }
    }

    fn flat<'a>(&'a self, positions_m: &'a [DVec3]) -> impl Iterator<Item = Flat> + 'a {
        self.tetrahedra.iter().filter_map(|&(nodes, volume_m3)| {
            let corners = nodes.map(|node| positions_m[node as usize]);
            let missing = THRESHOLD - mesh::volume(corners) / volume_m3;
            (missing > 0.0).then_some(Flat { nodes, corners, volume_m3, missing })
        })
    }

    pub(crate) fn energy_j(&self, positions_m: &[DVec3]) -> f64 {
        let squares = self.flat(positions_m).map(|flat| flat.volume_m3 * flat.missing * flat.missing);
        0.5 * self.stiffness_pa * squares.sum::<f64>()
    }

    pub(crate) fn add_forces(&self, positions_m: &[DVec3], forces_n: &mut [DVec3]) {
        for flat in self.flat(positions_m) {
            let pressure_pa = self.stiffness_pa * flat.missing;
            for (&node, gradient) in flat.nodes.iter().zip(flat.gradient()) {
                forces_n[node as usize] += pressure_pa * gradient;
            }
        }
    }

    pub(crate) fn add_tangent(
        &self,
        positions_m: &[DVec3],
        positive: bool,
        scale: f64,
        matrix: &mut BlockMatrix,
    ) {
        for flat in self.flat(positions_m) {
            let (gradient, second) = (flat.gradient(), flat.second());
            let along = scale * self.stiffness_pa / flat.volume_m3;
            let turning = if positive { 0.0 } else { -scale * self.stiffness_pa * flat.missing };
            for (row, column) in (0..4).flat_map(|row| (row..4).map(move |column| (row, column))) {
                let (left, right) = (along * gradient[row], gradient[column]);
                let block = DMat3::from_cols(right.x * left, right.y * left, right.z * left);
                let block = block + turning * second[row][column];
                matrix.add_pair(flat.nodes[row], flat.nodes[column], block);
            }
        }
    }
}

impl Flat {
    /// The edges from the first corner.
    fn edges(&self) -> [DVec3; 3] {
        let [a, b, c, d] = self.corners;
        [b - a, c - a, d - a]
    }

    /// ∂V/∂x of each corner, m².
    fn gradient(&self) -> [DVec3; 4] {
        let [b, c, d] = self.edges();
        let [of_b, of_c, of_d] = [c.cross(d) / 6.0, d.cross(b) / 6.0, b.cross(c) / 6.0];
        [-(of_b + of_c + of_d), of_b, of_c, of_d]
    }

    /// ∂²V/∂x∂x on and above the diagonal, m.
    fn second(&self) -> [[DMat3; 4]; 4] {
        let [b, c, d] = self.edges().map(|edge| cross_matrix(edge) * (1.0 / 6.0));
        let zero = DMat3::ZERO;
        // The columns of the first corner are minus the sums of the others; transposed they stand in its row.
        let (of_b, of_c, of_d) = (d - c, b - d, c - b);
        [[zero, -of_b, -of_c, -of_d], [zero, zero, -d, c], [zero, zero, zero, -b], [zero; 4]]
    }
}
