//! What the slow simulation tells ticks.

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_SOFT_CONTACTS;
use cotouch_soft::SoftEnergy;
use cotouch_world::local::FrameCompliance;
use cotouch_world::{MeshSurface, SurfaceError};
use glam::DVec3;

/// The body after a step, in the form in which ticks use it. Never changes once made.
#[derive(Clone, Debug)]
pub struct SlowFrame {
    /// The period whose forces led here; `None`: the body before all of them.
    pub period: Option<u64>,
    /// Where the nodes are, m.
    pub positions_m: Vec<DVec3>,
    /// The surface with the nodes at these places.
    pub surface: MeshSurface,
    /// The least K_o of all fingers that touch or are near, N/m.
    pub ko_n_per_m: f64,
    /// K_o of every finger slot, N/m: see [`cotouch_soft::contact_stiffnesses`].
    pub slot_ko_n_per_m: [f64; MAX_SOFT_CONTACTS],
    /// The slots in `compliance`.
    pub slots: ArrayVec<u8, MAX_SOFT_CONTACTS>,
    /// Joint compliance of these, m/N: row-major, 3 rows and columns each.
    pub compliance: Vec<f64>,
    /// The forces on the body with which it was stepped, one a slot in `slots`, N.
    pub forces_n: ArrayVec<DVec3, MAX_SOFT_CONTACTS>,
    /// Von Mises stress at each node, Pa.
    pub stress_pa: Vec<f32>,
    /// Energy of the body.
    pub energy: SoftEnergy,
}

impl SlowFrame {
    /// The same with the nodes elsewhere (m), all of it seen as if it had always been there: for who varies a state.
    ///
    /// # Errors
    /// When there are more or fewer nodes, or one is not finite.
    pub fn moved_to(&self, positions_m: Vec<DVec3>) -> Result<Self, SurfaceError> {
        let mut frame = self.clone();
        let generation = frame.surface.generation();
        frame.surface.deform(&positions_m)?;
        frame.surface.forget_motion(generation);
        frame.positions_m = positions_m;
        Ok(frame)
    }

    /// What it tells of the body's compliance.
    pub(crate) fn joint_compliance(&self) -> FrameCompliance<'_> {
        FrameCompliance { slots: &self.slots, compliance: &self.compliance, forces_n: &self.forces_n }
    }
}
