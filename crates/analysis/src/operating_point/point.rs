//! Poses and contacts about which a session is linearised.

use cotouch_scene::geometry::Pose;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::SceneValues;
use glam::{DMat3, DQuat, DVec3};

/// Poses, and all contacts that are closed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OperatingPoint {
    /// `poses[host][body]`: each host's copy of each body. A centralized session has copies at its first host only;
    /// what stands for the others is not used.
    pub poses: Vec<Vec<Pose>>,
    /// Fingers that touch bodies: one entry for each copy that is touched.
    pub fingers: Vec<FingerContact>,
    /// Corners of bodies that touch walls: one entry for each copy.
    pub corners: Vec<CornerContact>,
}

/// A finger that touches a copy of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerContact {
    /// Whose copy is touched, and computes the force.
    pub host: HostIndex,
    /// Whose finger.
    pub user: HostIndex,
    /// Which of the user's fingers, from 0.
    pub finger: u8,
    /// Which of the scene's bodies.
    pub body: u8,
    /// The finger's centre as this host knows it (held where it is another's), world, m.
    pub centre: DVec3,
    /// The surface's outward normal, of length 1, body frame.
    pub normal: DVec3,
    /// Where the finger's centre is held along the surface, body frame, m. On a flat face its depth is without effect.
    pub anchor: DVec3,
    /// How the normal turns as the finger's centre moves, body frame, 1/m: zero on a flat face,
    /// (I − n·nᵀ)/|centre| on a ball.
    pub curvature: DMat3,
    /// On the finger, world, N.
    pub force: DVec3,
    /// Where it slides: the direction in which the finger moves along the surface, of length 1, body frame. `None` where
    /// it sticks.
    pub slides: Option<DVec3>,
}

/// A corner of a copy of a body that sticks to a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerContact {
    /// Whose copy touches.
    pub host: HostIndex,
    /// Which of [`cotouch_scene::scene::SceneValues::walls`].
    pub wall: usize,
    /// Which of the scene's bodies.
    pub body: u8,
    /// The corner's centre, body frame, m; zero for a body without a surface.
    pub corner: DVec3,
    /// On the body, world, N.
    pub force: DVec3,
}

impl OperatingPoint {
    /// All bodies at their start poses, nothing touched.
    #[must_use]
    pub fn free(scene: &SceneValues) -> Self {
        let pose = |body: &cotouch_scene::scene::Body| Pose {
            position: body.position_m,
            orientation: DQuat::from_scaled_axis(body.rotation_rad),
        };
        let poses: Vec<_> = scene.world_bodies().iter().map(pose).collect();
        Self {
            poses: vec![poses; usize::from(scene.session.users)],
            fingers: Vec::new(),
            corners: Vec::new(),
        }
    }
}
