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

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn the_rotation_vector_is_right_for_every_turn() {
        let axis = DVec3::new(1.0, -2.0, 0.5).normalize();
        for angle in [0.0, 1e-300, 1e-12, 1e-7, 0.1, 1.5, 3.0, PI - 1e-9] {
            let quaternion = DQuat::from_xyzw(
                axis.x * (0.5 * angle).sin(),
                axis.y * (0.5 * angle).sin(),
                axis.z * (0.5 * angle).sin(),
                (0.5 * angle).cos(),
            );
            for quaternion in [quaternion, -quaternion] {
                let error = (rotation_vector(quaternion) - angle * axis).length();
                assert!(error <= 4.0 * f64::EPSILON * angle, "{angle}: {error}");
            }
        }
        assert_eq!(rotation_vector(DQuat::IDENTITY), DVec3::ZERO);
        // Half a turn has two shortest ways; beyond it the other one is shorter.
        assert!((rotation_vector(DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0)).length() - PI).abs() < 1e-15);
        let beyond = rotation_vector(DQuat::from_axis_angle(axis, PI + 0.1));
        assert!((beyond + (PI - 0.1) * axis).length() < 1e-12);
    }

    #[test]
    fn a_torque_turns_the_near_end_to_the_far_end() {
        let spring = RotationalSpringDamper { stiffness_n_m_per_rad: 2.0, damping_n_m_s_per_rad: 0.5 };
        let near = DQuat::from_scaled_axis(DVec3::new(0.2, 1.0, -0.7));
        let turned = DVec3::new(0.0, 0.3, -0.4);
        let far = DQuat::from_scaled_axis(turned) * near;
        let turn = Turn::between((near, DVec3::X), (far, DVec3::Y));
        let expected = 2.0 * turned + 0.5 * (DVec3::Y - DVec3::X);
        assert!((torque(spring, turn) - expected).length() < 1e-14);
        let back = Turn::between((far, DVec3::Y), (near, DVec3::X));
        assert!((torque(spring, back) + expected).length() < 1e-14, "the ends feel opposite torques");
    }
}
