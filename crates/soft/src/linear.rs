//! One step of a soft body, linearised: what the analysis compiles.

use nalgebra::DMatrix;

use crate::body::MaterialPoint;

/// The linearisation of a step about a state, in the coordinates of the nodes that move.
///
/// With `q` the displacements and `v` the velocities of the free coordinates, `f` the change of the forces on them:
///
/// ```text
/// implicit       S·v⁺ + g·λ = M·v + h·(f − K·q),   S = (1 + h·α)·M + h·β·K_s + h²·K_s,   gᵀ·(q + h·v⁺) = 0,   q⁺ = q + h·v⁺
/// quasi-static   K·q⁺ + g·λ = f,   gᵀ·q⁺ = 0,   v⁺ = 0
/// ```
///
/// where `K` is the exact tangent stiffness, `K_s` the one that the step's matrix was made with (equal at rest), and `g` the
/// gradient of a volume that is kept (absent in most bodies).
#[derive(Clone, Debug, PartialEq)]
pub struct LinearBody {
    /// h, s.
    pub period_s: f64,
    /// Whether the step is the quasi-static one.
    pub quasi_static: bool,
    /// The free coordinates: which node and axis (0 to 2) each is.
    pub coordinates: Vec<(u32, u8)>,
    /// Diagonal of M, kg.
    pub mass_kg: Vec<f64>,
    /// α, 1/s.
    pub mass_damping_per_s: f64,
    /// β, s.
    pub stiffness_damping_s: f64,
    /// K, N/m: all entries (row, column, value), both triangles; entries at the same place add.
    pub stiffness: Vec<(u32, u32, f64)>,
    /// K_s, likewise; `None` where it is K.
    pub step_stiffness: Option<Vec<(u32, u32, f64)>>,
    /// g.
    pub volume_gradient: Option<Vec<f64>>,
}

/// What a body is as seen from some contacts: the same step in a few coordinates.
///
/// M-orthonormal coordinates `z` with `q = V·z`: the mass matrix is the identity.
#[derive(Clone, Debug, PartialEq)]
pub struct ReducedBody {
    /// h, s.
    pub period_s: f64,
    /// Whether the step is the quasi-static one. Then the coordinates are scaled so that `stiffness` is the identity.
    pub quasi_static: bool,
    /// α, 1/s.
    pub mass_damping_per_s: f64,
    /// β, s.
    pub stiffness_damping_s: f64,
    /// VᵀKV, k × k.
    pub stiffness: DMatrix<f64>,
    /// J·V, 3m × k: displacements of the contacts (x, y, z each), and, transposed, what forces there act on.
    pub contacts: DMatrix<f64>,
}

impl LinearBody {
    /// The body as seen from `points`, by a block Krylov subspace of `blocks` blocks (of the step's matrix) that starts from
    /// their unit forces; constraints are kept exactly. Exact when the subspace is exhausted. With K_s = K.
    #[must_use]
    pub fn reduced(&self, points: &[MaterialPoint], blocks: usize) -> ReducedBody {
        let _ = (points, blocks);
        todo!()
    }
}
