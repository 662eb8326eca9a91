//! Virtual couplers: a spring and damper between two moving points (Fotoohi Ghiam 2006, (3.4), (4.25)–(4.29)), and how
//! far two frames are turned against each other.

use std::ops::{Add, Sub};

use cotouch_scene::scene::SpringDamper;
use glam::{DQuat, DVec3};

/// How far, and how fast, the far end of a coupler is from the near end; or how far and how fast it turns against it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stretch {
    /// From the near end to the far end, m; or the shortest rotation that takes the one to the other, as a rotation vector
    /// in the world's frame, rad.
    pub position: DVec3,
    /// Of the far end against the near end, m/s or rad/s.
    pub velocity: DVec3,
}

impl Stretch {
    /// That does not change.
    #[must_use]
    pub fn at_rest(position: DVec3) -> Self {
        Self { position, velocity: DVec3::ZERO }
    }

    /// From `near` to `far`, each a position (m) and a velocity (m/s).
    #[must_use]
    pub fn between(near: (DVec3, DVec3), far: (DVec3, DVec3)) -> Self {
        Self { position: far.0 - near.0, velocity: far.1 - near.1 }
    }

    /// From `near` to `far`, each an orientation and an angular velocity (rad/s).
    #[must_use]
    pub fn between_orientations(near: (DQuat, DVec3), far: (DQuat, DVec3)) -> Self {
        Self { position: rotation_vector(far.0 * near.0.conjugate()), velocity: far.1 - near.1 }
    }
}

impl Add for Stretch {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { position: self.position + other.position, velocity: self.velocity + other.velocity }
    }
}

impl Sub for Stretch {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { position: self.position - other.position, velocity: self.velocity - other.velocity }
    }
}

/// The force (N) on the near end; the far end gets the opposite.
#[must_use]
pub fn force(spring: SpringDamper, stretch: Stretch) -> DVec3 {
    spring.stiffness_n_per_m * stretch.position + spring.damping_n_s_per_m * stretch.velocity
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
    fn orientations_are_apart_by_the_rotation_that_takes_one_to_the_other() {
        let near = DQuat::from_scaled_axis(DVec3::new(0.2, 1.0, -0.7));
        let turned = DVec3::new(0.0, 0.3, -0.4);
        let far = DQuat::from_scaled_axis(turned) * near;
        let apart = Stretch::between_orientations((near, DVec3::X), (far, DVec3::Y));
        assert!((apart.position - turned).length() < 1e-14 && apart.velocity == DVec3::Y - DVec3::X);
        let back = Stretch::between_orientations((far, DVec3::Y), (near, DVec3::X));
        assert!((back.position + turned).length() < 1e-14 && back.velocity == -apart.velocity);
    }
}
