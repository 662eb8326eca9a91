//! Virtual couplers: a spring and damper between two moving points (thesis (3.4), (4.25)–(4.29)), and between two frames
//! that turn.

use cotouch_scene::scene::{RotationalSpringDamper, SpringDamper};
use glam::{DQuat, DVec3};

/// How far, and how fast, the far end of a coupler is from the near end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stretch {
    /// m.
    pub position: DVec3,
    /// m/s.
    pub velocity: DVec3,
}

impl Stretch {
    /// From `near` to `far`, each a position (m) and a velocity (m/s).
    #[must_use]
    pub fn between(near: (DVec3, DVec3), far: (DVec3, DVec3)) -> Self {
        Self { position: far.0 - near.0, velocity: far.1 - near.1 }
    }
}

/// The force (N) on the near end; the far end gets the opposite.
#[must_use]
pub fn force(spring: SpringDamper, stretch: Stretch) -> DVec3 {
    spring.stiffness_n_per_m * stretch.position + spring.damping_n_s_per_m * stretch.velocity
}

/// How far the far end of a rotational coupler is turned against the near end, and how fast it turns against it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turn {
    /// The shortest rotation that takes the near end to the far end: a rotation vector in the world's frame, rad.
    pub rotation: DVec3,
    /// rad/s.
    pub velocity: DVec3,
}

impl Turn {
    /// From `near` to `far`, each an orientation and an angular velocity (rad/s).
    #[must_use]
    pub fn between(near: (DQuat, DVec3), far: (DQuat, DVec3)) -> Self {
        Self { rotation: rotation_vector(far.0 * near.0.conjugate()), velocity: far.1 - near.1 }
    }
}

/// The torque (N·m) on the near end; the far end gets the opposite.
#[must_use]
pub fn torque(spring: RotationalSpringDamper, turn: Turn) -> DVec3 {
    spring.stiffness_n_m_per_rad * turn.rotation + spring.damping_n_m_s_per_rad * turn.velocity
}

/// The rotation vector (axis times angle, at most π) of a unit quaternion: accurate for small angles, and defined at π,
/// where one of the two axes is taken.
#[must_use]
pub fn rotation_vector(rotation: DQuat) -> DVec3 {
    let rotation = if rotation.w < 0.0 { -rotation } else { rotation };
    let vector = DVec3::new(rotation.x, rotation.y, rotation.z);
    let sine = vector.length();
    if sine < 1e-150 {
        return 2.0 * vector;
    }
    vector * (2.0 * sine.atan2(rotation.w) / sine)
}
