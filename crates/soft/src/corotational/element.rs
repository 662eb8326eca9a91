//! One tetrahedron: energy, forces and tangent stiffness of the corotational material.
//!
//! ```text
//! ψ = μ·|F − R|² + λ/2·tr(S − 1)²      F = Σ x_a·g_aᵀ,  R the nearest rotation,  S = RᵀF
//! P = 2μ·(F − R) + λ·tr(S − 1)·R       force on node a: −V·P·g_a
//! K_ab/V = 2μ·(g_a·g_b)·1 + λ·(R·g_a)(R·g_b)ᵀ + R·[g_a]ₓ·T·[g_b]ₓᵀ·Rᵀ
//! T = (λ·tr(S − 1) − 2μ)·(tr(S)·1 − S)⁻¹
//! ```
//!
//! The last term is what the turning of R adds. T is −μ·1 at rest, which makes K that of linear elasticity.

use glam::{DMat3, DVec3};

use super::rotation::{nearest_rotation, norm_squared, symmetric_eigen};
use crate::factor::{BlockMatrix, BlockSlot, Symbolic};

/// The pairs of an element's nodes, the diagonal first.
const PAIRS: [(usize, usize); 10] =
    [(0, 0), (1, 1), (2, 2), (3, 3), (0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

/// Where two stretches sum to less than this, the derivative of the rotation is not used as it is: it grows without bound.
const MIN_STRETCH_SUM: f64 = 0.1;

/// An element's material: Lamé's constants, Pa.
#[derive(Clone, Copy, Debug)]
pub(super) struct Material {
    pub(super) lambda_pa: f64,
    pub(super) mu_pa: f64,
}

impl Material {
    pub(super) fn new(young_pa: f64, poisson_ratio: f64) -> Self {
        let lambda_pa = young_pa * poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio));
        Self { lambda_pa, mu_pa: young_pa / (2.0 * (1.0 + poisson_ratio)) }
    }
}

/// What of a tetrahedron does not change.
#[derive(Clone, Debug)]
pub(super) struct Tetrahedron {
    pub(super) nodes: [u32; 4],
    /// V at rest, m³.
    pub(super) volume_m3: f64,
    /// g: the gradients of the nodes' weights at rest, 1/m.
    gradients_per_m: [DVec3; 4],
    slots: [Option<BlockSlot>; 10],
}

/// How an element is deformed.
#[derive(Clone, Copy, Debug)]
pub(super) struct DeformedTetrahedron {
    /// The rotation R that is nearest to the deformation.
    pub(super) rotation: DMat3,
    /// The symmetric stretch S of the deformation R·S.
    pub(super) stretch: DMat3,
}

/// Which second derivative of the energy is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tangent {
    /// The exact tangent stiffness, which may be indefinite.
    Exact,
    /// Without what is negative: the element resists in every direction.
    Positive,
}

impl Tetrahedron {
    /// `None` where the tetrahedron has no positive volume.
    pub(super) fn new(nodes: [u32; 4], rest_m: &[DVec3], symbolic: &Symbolic) -> Option<Self> {
        let [a, b, c, d] = nodes.map(|node| rest_m[node as usize]);
        let edges = DMat3::from_cols(b - a, c - a, d - a);
        let volume_m3 = edges.determinant() / 6.0;
        if !(volume_m3 > 0.0 && volume_m3.is_finite()) {
            return None;
        }
        let inverse = edges.inverse().transpose();
        let [second, third, fourth] = [inverse.x_axis, inverse.y_axis, inverse.z_axis];
        let gradients_per_m = [-(second + third + fourth), second, third, fourth];
        let slots = PAIRS.map(|(row, column)| symbolic.slot(nodes[row], nodes[column]));
        Some(Self { nodes, volume_m3, gradients_per_m, slots })
    }

    pub(super) fn deformed(&self, positions_m: &[DVec3]) -> DeformedTetrahedron {
        let [a, b, c, d] = self.nodes.map(|node| positions_m[node as usize]);
        let [_, gb, gc, gd] = self.gradients_per_m;
        let deformation = outer(b - a, gb) + outer(c - a, gc) + outer(d - a, gd);
        let rotation = nearest_rotation(deformation);
        let stretch = rotation.transpose() * deformation;
        DeformedTetrahedron { rotation, stretch: 0.5 * (stretch + stretch.transpose()) }
    }

    pub(super) fn energy_j(&self, material: Material, deformed: &DeformedTetrahedron) -> f64 {
        let strain = deformed.stretch - DMat3::IDENTITY;
        let trace = trace(strain);
        self.volume_m3 * (material.mu_pa * norm_squared(strain) + 0.5 * material.lambda_pa * trace * trace)
    }

    /// The elastic forces on the four nodes, N.
    pub(super) fn forces_n(&self, material: Material, deformed: &DeformedTetrahedron) -> [DVec3; 4] {
        let stress = deformed.rotation * deformed.stress(material);
        self.gradients_per_m.map(|gradient| -self.volume_m3 * (stress * gradient))
    }

    /// Adds the tangent stiffness.
    pub(super) fn add_tangent(
        &self,
        material: Material,
        deformed: &DeformedTetrahedron,
        kind: Tangent,
        matrix: &mut BlockMatrix,
    ) {
        let (mu, lambda) = (2.0 * self.volume_m3 * material.mu_pa, self.volume_m3 * material.lambda_pa);
        let turning = self.volume_m3 * deformed.turning(material, kind);
        let rotation = deformed.rotation;
        let turned = self.gradients_per_m.map(|gradient| rotation * gradient);
        let across = rotation * turning * rotation.transpose();
        let beside = turned.map(|gradient| cross_rows(gradient, across));
        for ((a, b), slot) in PAIRS.into_iter().zip(self.slots) {
            let Some(slot) = slot else { continue };
            let (first, second) = (turned[a], turned[b]);
            let stiff = mu * first.dot(second);
            let mut block = outer(lambda * first, second) + cross_columns(beside[a], second);
            block.x_axis.x += stiff;
            block.y_axis.y += stiff;
            block.z_axis.z += stiff;
            matrix.add(slot, block);
        }
    }
}

impl DeformedTetrahedron {
    /// `2μ·(S − 1) + λ·tr(S − 1)·1`: stress in the element's own frame, Pa.
    pub(super) fn stress(&self, material: Material) -> DMat3 {
        let strain = self.stretch - DMat3::IDENTITY;
        strain * (2.0 * material.mu_pa)
            + DMat3::from_diagonal(DVec3::splat(material.lambda_pa * trace(strain)))
    }

    /// The part T of the tangent that comes of the rotation's change, Pa.
    fn turning(&self, material: Material, kind: Tangent) -> DMat3 {
        let factor = material.lambda_pa * (trace(self.stretch) - 3.0) - 2.0 * material.mu_pa;
        let sums = DMat3::from_diagonal(DVec3::splat(trace(self.stretch))) - self.stretch;
        if kind == Tangent::Exact && positive_above(sums, MIN_STRETCH_SUM) {
            return sums.inverse() * factor;
        }
        let (sums, vectors) = symmetric_eigen(sums);
        let least = if kind == Tangent::Exact { f64::NEG_INFINITY } else { -material.mu_pa };
        let values = sums.max(DVec3::splat(MIN_STRETCH_SUM)).recip() * factor;
        vectors * DMat3::from_diagonal(values.max(DVec3::splat(least))) * vectors.transpose()
    }
}

/// Whether all eigenvalues of a symmetric matrix are larger than `least`.
fn positive_above(matrix: DMat3, least: f64) -> bool {
    let shifted = matrix - DMat3::from_diagonal(DVec3::splat(least));
    let [a, b, c] = [shifted.x_axis, shifted.y_axis, shifted.z_axis];
    a.x > 0.0 && a.x * b.y - a.y * b.x > 0.0 && a.dot(b.cross(c)) > 0.0
}

fn trace(matrix: DMat3) -> f64 {
    matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z
}

/// The outer product `column·rowᵀ`.
fn outer(column: DVec3, row: DVec3) -> DMat3 {
    DMat3::from_cols(column * row.x, column * row.y, column * row.z)
}

/// The product `[v]ₓ·matrix` with the matrix that crosses with v.
fn cross_rows(v: DVec3, matrix: DMat3) -> DMat3 {
    DMat3::from_cols(v.cross(matrix.x_axis), v.cross(matrix.y_axis), v.cross(matrix.z_axis))
}

/// The product `matrix·[v]ₓᵀ` with the matrix that crosses with v.
fn cross_columns(matrix: DMat3, v: DVec3) -> DMat3 {
    let [a, b, c] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    DMat3::from_cols(c * v.y - b * v.z, a * v.z - c * v.x, b * v.x - a * v.y)
}
