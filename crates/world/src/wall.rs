//! Walls: a static plane across an axis that an object is coupled to, and half-spaces that bodies with a shape meet.

use cotouch_scene::scene::{Wall, WallPlane, WallSides};
use glam::DVec3;

/// A half-space that never moves; its surface is met by [`crate::contact::touch_plane`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedPlane {
    /// A point of it, m.
    pub point: DVec3,
    /// Where it pushes to: a unit vector.
    pub normal: DVec3,
}

impl FixedPlane {
    /// The half-space that a scene's plane bounds.
    #[must_use]
    pub fn new(wall: &WallPlane) -> Self {
        Self { point: wall.point_m, normal: wall.normal.normalize_or(DVec3::NEG_X) }
    }

    /// How far `position` (m) is on the free side, m.
    #[must_use]
    pub fn height(&self, position: DVec3) -> f64 {
        (position - self.point).dot(self.normal)
    }
}

/// The force (N) of `wall`, whose outward normal is −`axis`, on a point at `position` (m) with `velocity` (m/s).
///
/// Two-sided: `−k_w·(x − x_w) − b_w·v`. One-sided: the same where the point is beyond the wall and the sum pushes
/// it back; zero otherwise, so that a wall never pulls.
#[must_use]
pub fn force(wall: &Wall, axis: DVec3, position: DVec3, velocity: DVec3) -> DVec3 {
    let depth = position.dot(axis) - wall.position_m;
    let push = -wall.stiffness_n_per_m * depth - wall.damping_n_s_per_m * velocity.dot(axis);
    match wall.sides {
        WallSides::Two => push * axis,
        WallSides::One if depth > 0.0 => push.min(0.0) * axis,
        WallSides::One => DVec3::ZERO,
    }
}

/// Whether an object at `position` (m) touches the wall.
#[must_use]
pub fn touches(wall: &Wall, axis: DVec3, position: DVec3) -> bool {
    wall.exists() && (wall.sides == WallSides::Two || position.dot(axis) > wall.position_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(sides: WallSides) -> Wall {
        Wall {
            stiffness_n_per_m: 1000.0,
            damping_n_s_per_m: 20.0,
            position_m: 0.1,
            sides,
            tangential_stiffness_n_per_m: 0.0,
            tangential_damping_n_s_per_m: 0.0,
            static_friction: 0.0,
            dynamic_friction: 0.0,
            planes: Vec::new(),
        }
    }

    #[test]
    fn a_one_sided_wall_never_pulls() {
        let one = wall(WallSides::One);
        let at = |x: f64, v: f64| force(&one, DVec3::X, DVec3::X * x, DVec3::X * v).x;
        assert_eq!(at(0.05, 1.0), 0.0);
        assert_eq!(at(0.11, -100.0), 0.0, "leaving fast: the damper alone would pull");
        assert!((at(0.11, 0.1) + 12.0).abs() < 1e-12);
    }

    #[test]
    fn a_two_sided_wall_is_linear() {
        let two = wall(WallSides::Two);
        let at = |x: f64| force(&two, DVec3::X, DVec3::X * x, DVec3::ZERO).x;
        assert!((at(0.0) - 100.0).abs() < 1e-12);
        assert!((at(0.2) + 100.0).abs() < 1e-12);
        let none = Wall { stiffness_n_per_m: 0.0, damping_n_s_per_m: 0.0, ..two };
        assert!(!touches(&none, DVec3::X, DVec3::X));
    }

    #[test]
    fn a_plane_takes_a_normal_of_any_length() {
        let wall = WallPlane { name: "floor".into(), point_m: DVec3::Y * 0.2, normal: DVec3::Y * 5.0 };
        let plane = FixedPlane::new(&wall);
        assert_eq!(plane.normal, DVec3::Y);
        assert!((plane.height(DVec3::new(7.0, 0.5, -3.0)) - 0.3).abs() < 1e-15);
    }
}
