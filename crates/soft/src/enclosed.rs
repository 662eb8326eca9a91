//! The volume within a closed surface, and how it changes with the surface's nodes.
//!
//! `V = 1/6·Σ a·(b × c)` over the triangles; a pressure `p` inside pushes the nodes with `p·∂V/∂x`.

use glam::{DMat3, DVec3};

use crate::factor::BlockMatrix;

/// A volume is kept when it is nearer than this, relative to itself; what rounding allows.
const KEPT: f64 = 1e-14;
/// A shape whose volume cannot be brought nearer than this is not taken.
const NEAR_ENOUGH: f64 = 1e-9;
/// How many corrections bring a volume back.
const MAX_CORRECTIONS: usize = 20;

/// A volume that a closed surface keeps.
#[derive(Clone, Debug)]
pub(crate) struct Enclosed {
    triangles: Vec<[u32; 3]>,
    /// The volume that is kept, m³.
    pub(crate) volume_m3: f64,
}

impl Enclosed {
    /// What these triangles enclose.
    pub(crate) fn new(nodes_m: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let mut enclosed = Self { triangles: triangles.to_vec(), volume_m3: 0.0 };
        enclosed.volume_m3 = enclosed.volume(nodes_m);
        enclosed
    }

    /// The volume now, m³.
    pub(crate) fn volume(&self, positions_m: &[DVec3]) -> f64 {
        let origin = self.origin(positions_m);
        let corners =
            self.triangles.iter().map(|nodes| nodes.map(|node| positions_m[node as usize] - origin));
        corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    /// A node of the surface: places about it do not lose digits far from the world's origin.
    fn origin(&self, positions_m: &[DVec3]) -> DVec3 {
        self.triangles.first().map_or(DVec3::ZERO, |triangle| positions_m[triangle[0] as usize])
    }

    /// How far the volume is from what it should be, relative.
    pub(crate) fn error(&self, positions_m: &[DVec3]) -> f64 {
        (self.volume(positions_m) - self.volume_m3) / self.volume_m3
    }

    /// ∂V/∂x of every node, m².
    pub(crate) fn gradient(&self, positions_m: &[DVec3]) -> Vec<DVec3> {
        let mut gradient = vec![DVec3::ZERO; positions_m.len()];
        for nodes in &self.triangles {
            let [a, b, c] = nodes.map(|node| positions_m[node as usize]);
            let share = (b - a).cross(c - a) / 6.0;
            nodes.iter().for_each(|&node| gradient[node as usize] += share);
        }
        gradient
    }

    /// Adds `scale` times V's second derivative, m.
    pub(crate) fn add_second(&self, positions_m: &[DVec3], scale: f64, matrix: &mut BlockMatrix) {
        let origin = self.origin(positions_m);
        for &[a, b, c] in &self.triangles {
            for [from, to, opposite] in [[a, b, c], [b, c, a], [c, a, b]] {
                let cross = cross_matrix(positions_m[opposite as usize] - origin);
                matrix.add_pair(from, to, -scale / 6.0 * cross);
            }
        }
    }

    /// Moves along `direction` (or against it) until the volume is right. `false` when that does not succeed.
    pub(crate) fn restore(&self, positions_m: &mut [DVec3], direction: &[DVec3]) -> bool {
        let mut error = self.error(positions_m);
        for _ in 0..MAX_CORRECTIONS {
            if error.abs() <= KEPT {
                break;
            }
            let growth =
                self.gradient(positions_m).iter().zip(direction).map(|(a, b)| a.dot(*b)).sum::<f64>();
            let back = error * self.volume_m3 / growth;
            if !back.is_finite() {
                return false;
            }
            positions_m.iter_mut().zip(direction).for_each(|(at, along)| *at -= back * *along);
            let next = self.error(positions_m);
            if next.abs() >= error.abs() && error.abs() <= NEAR_ENOUGH {
                break;
            }
            error = next;
        }
        self.error(positions_m).abs() <= NEAR_ENOUGH
    }
}

/// The matrix that crosses a vector with others from the left.
pub(crate) fn cross_matrix(v: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, v.z, -v.y), DVec3::new(-v.z, 0.0, v.x), DVec3::new(v.y, -v.x, 0.0))
}
