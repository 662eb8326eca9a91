//! A thin elastic skin: triangles in which the strain is the same everywhere.
//!
//! With `F` the 3 × 2 gradient of the deformation from the skin as it was cut and σ₁, σ₂ its singular values (stretches), the
//! energy per area as cut is linear elasticity in plane stress, freed of rotations:
//!
//! ```text
//! ψ = t·(μ·((σ₁ − 1)² + (σ₂ − 1)²) + λ/2·(σ₁ + σ₂ − 2)²),   μ = E/(2·(1 + ν)),   λ = E·ν/(1 − ν²)
//! ```
//!
//! Forces stay bounded and the energy smooth enough however a triangle collapses. The six eigenvectors of ψ's second derivative
//! are known in closed form (Smith, de Goes & Kim 2019, for the part in the plane), so that its negative parts can be left out
//! exactly. A compressed skin pushes; wrinkles finer than its triangles are not modelled.

use glam::{DMat3, DVec2, DVec3};

use crate::elastic::Elastic;
use crate::factor::BlockMatrix;

/// Stretches count as no less than this in what divides by them.
const MIN_STRETCH: f64 = 1e-6;

/// Skin: all of it of one material.
#[derive(Clone, Debug)]
pub(crate) struct Membrane {
    triangles: Vec<Triangle>,
    /// Thickness times the shear modulus, t·μ, N/m.
    shear_n_per_m: f64,
    /// Thickness times Lamé's first constant in plane stress, t·λ, N/m.
    lame_n_per_m: f64,
    thickness_m: f64,
}

#[derive(Clone, Debug)]
struct Triangle {
    nodes: [u32; 3],
    /// Area as cut, m².
    area_m2: f64,
    /// Gradients of the nodes' shares over the skin as cut, 1/m: F is the sum of each node's place times its gradient.
    gradients: [DVec2; 3],
}

/// F in the directions of its stretches.
struct PrincipalStretches {
    /// σ₁ ≥ σ₂ ≥ 0.
    sigma: [f64; 2],
    /// The directions in the skin as cut.
    from: [DVec2; 2],
    /// The same in space, and the normal.
    to: [DVec3; 3],
}

impl Membrane {
    /// A skin that was cut from `thickness_m` thick material `stretch` times smaller than these triangles.
    pub(crate) fn new(
        nodes_m: &[DVec3],
        triangles: &[[u32; 3]],
        [young_pa, poisson_ratio]: [f64; 2],
        thickness_m: f64,
        stretch: f64,
    ) -> Self {
        let of_nodes =
            |nodes: &[u32; 3]| Triangle::new(*nodes, nodes.map(|node| nodes_m[node as usize] / stretch));
        Self {
            triangles: triangles.iter().map(of_nodes).collect(),
            shear_n_per_m: thickness_m * young_pa / (2.0 * (1.0 + poisson_ratio)),
            lame_n_per_m: thickness_m * young_pa * poisson_ratio / (1.0 - poisson_ratio * poisson_ratio),
            thickness_m,
        }
    }

    /// The tensions ∂ψ/∂σ along both stretches, N/m.
    fn tensions(&self, [first, second]: [f64; 2]) -> [f64; 2] {
        let both = self.lame_n_per_m * (first + second - 2.0);
        [first, second].map(|sigma| 2.0 * self.shear_n_per_m * (sigma - 1.0) + both)
    }

    /// ψ's second derivative: each eigenvector as (left, right) pairs of which it is the sum of products, and its eigenvalue.
    fn modes(
        &self,
        PrincipalStretches { sigma, from: [v1, v2], to: [u1, u2, normal] }: &PrincipalStretches,
    ) -> [([DVec3; 2], f64); 6] {
        let (shear, lame) = (2.0 * self.shear_n_per_m, 2.0 * self.lame_n_per_m);
        let [first, second] = self.tensions(*sigma);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let twist = (first + second) / (sigma[0] + sigma[1]).max(MIN_STRETCH);
        let out = |tension: f64, sigma: f64| tension / sigma.max(MIN_STRETCH);
        // A mode is kept by its two columns: what it makes of the skin's own x and y.
        let columns = |pairs: &[(DVec3, DVec2)]| {
            [0, 1].map(|axis| pairs.iter().map(|(left, right)| *left * right[axis]).sum::<DVec3>())
        };
        [
            (columns(&[(half * u1, *v1), (half * u2, *v2)]), shear + lame),
            (columns(&[(half * u1, *v1), (-half * u2, *v2)]), shear),
            (columns(&[(half * u1, *v2), (half * u2, *v1)]), shear),
            (columns(&[(half * u1, *v2), (-half * u2, *v1)]), twist),
            (columns(&[(*normal, *v1)]), out(first, sigma[0])),
            (columns(&[(*normal, *v2)]), out(second, sigma[1])),
        ]
    }
}

impl Triangle {
    fn new(nodes: [u32; 3], [a, b, c]: [DVec3; 3]) -> Self {
        let (along, other) = (b - a, c - a);
        let x = along.normalize();
        let y = along.cross(other).cross(along).normalize();
        let (b, c) = (DVec2::new(along.length(), 0.0), DVec2::new(other.dot(x), other.dot(y)));
        let twice = b.perp_dot(c);
        let gradients = [DVec2::new(b.y - c.y, c.x - b.x), DVec2::new(c.y, -c.x), DVec2::new(-b.y, b.x)];
        Self { nodes, area_m2: 0.5 * twice, gradients: gradients.map(|gradient| gradient / twice) }
    }

    fn stretch(&self, positions_m: &[DVec3]) -> PrincipalStretches {
        let column = |axis: usize| -> DVec3 {
            let terms = self.nodes.iter().zip(&self.gradients);
            terms.map(|(&node, gradient)| positions_m[node as usize] * gradient[axis]).sum()
        };
        PrincipalStretches::from_columns([column(0), column(1)])
    }
}

impl PrincipalStretches {
    /// The singular value decomposition of the matrix of these columns.
    fn from_columns([x, y]: [DVec3; 2]) -> Self {
        let angle = 0.5 * f64::atan2(2.0 * x.dot(y), x.length_squared() - y.length_squared());
        let first = DVec2::from_angle(angle);
        let from = [first, first.perp()];
        let images = from.map(|direction| x * direction.x + y * direction.y);
        let sigma = images.map(DVec3::length);
        let u1 = images[0].try_normalize().unwrap_or(DVec3::X);
        let across = (images[1] - images[1].dot(u1) * u1).try_normalize();
        let u2 = across.unwrap_or_else(|| u1.any_orthonormal_vector());
        Self { sigma, from, to: [u1, u2, u1.cross(u2)] }
    }
}

impl Elastic for Membrane {
    fn energy_j(&self, positions_m: &[DVec3]) -> f64 {
        let of_triangle = |triangle: &Triangle| {
            let [first, second] = triangle.stretch(positions_m).sigma.map(|sigma| sigma - 1.0);
            let both = first + second;
            let square = first * first + second * second;
            triangle.area_m2 * (self.shear_n_per_m * square + 0.5 * self.lame_n_per_m * both * both)
        };
        self.triangles.iter().map(of_triangle).sum()
    }

    fn add_forces(&self, positions_m: &[DVec3], forces_n: &mut [DVec3]) {
        for triangle in &self.triangles {
            let PrincipalStretches { sigma, from: [v1, v2], to: [u1, u2, _] } = triangle.stretch(positions_m);
            let [first, second] = self.tensions(sigma);
            for (&node, gradient) in triangle.nodes.iter().zip(&triangle.gradients) {
                let pull = first * v1.dot(*gradient) * u1 + second * v2.dot(*gradient) * u2;
                forces_n[node as usize] -= triangle.area_m2 * pull;
            }
        }
    }

    fn add_tangent(&self, positions_m: &[DVec3], positive: bool, scale: f64, matrix: &mut BlockMatrix) {
        for triangle in &self.triangles {
            let mut blocks = [[DMat3::ZERO; 3]; 3];
            for ([x, y], value) in self.modes(&triangle.stretch(positions_m)) {
                let value = if positive { value.max(0.0) } else { value };
                let of_node = triangle.gradients.map(|gradient| gradient.x * x + gradient.y * y);
                for (row, column) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
                    let (left, right) = (scale * triangle.area_m2 * value * of_node[row], of_node[column]);
                    blocks[row][column] += DMat3::from_cols(right.x * left, right.y * left, right.z * left);
                }
            }
            for (row, column) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
                matrix.add_pair(triangle.nodes[row], triangle.nodes[column], blocks[row][column]);
            }
        }
    }

    /// Of the tension in the skin, divided by its thickness as cut; of a node, the mean of its triangles.
    fn stress_pa(&self, positions_m: &[DVec3], stress: &mut Vec<f32>) {
        let mut sums = vec![(0.0, 0.0); positions_m.len()];
        for triangle in &self.triangles {
            let PrincipalStretches { sigma, .. } = triangle.stretch(positions_m);
            let [first, second] = self.tensions(sigma);
            let [a, b] = [first / sigma[1].max(MIN_STRETCH), second / sigma[0].max(MIN_STRETCH)];
            let value = (a * a - a * b + b * b).sqrt() / self.thickness_m;
            for &node in &triangle.nodes {
                let (sum, area) = &mut sums[node as usize];
                (*sum, *area) = (*sum + triangle.area_m2 * value, *area + triangle.area_m2);
            }
        }
        stress.clear();
        stress.extend(sums.iter().map(|(sum, area)| (sum / area.max(f64::MIN_POSITIVE)) as f32));
    }
}
