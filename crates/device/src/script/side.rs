//! From which side fingers go at a body, and along which axes they can move.

use cotouch_scene::scene::{Shape, ShapeKind, Space};
use glam::{BVec3, DVec3};

/// How fingers go at a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Side {
    /// Straight at the face of a box of these half edges, m.
    Face(DVec3),
    /// Towards the centre of the body.
    Centre,
}

impl Side {
    pub(super) fn of_shape(shape: &Shape) -> Self {
        match shape.kind {
            ShapeKind::Box => Self::Face(shape.size_m * 0.5),
            _ => Self::Centre,
        }
    }

    /// The direction from `point` (m) to the side, a unit vector, or zero at the centre; both in the body's frame.
    pub(super) fn direction(self, point: DVec3) -> DVec3 {
        match self {
            Self::Centre => -point.normalize_or_zero(),
            Self::Face(half) => {
                let relative = point / half;
                let (mut axis, mut sign) = (0, relative.x);
                for other in 1..3 {
                    if relative[other].abs() > sign.abs() {
                        (axis, sign) = (other, relative[other]);
                    }
                }
                if sign == 0.0 { DVec3::ZERO } else { -DVec3::AXES[axis] * sign.signum() }
            }
        }
    }
}

/// Which axes are free.
pub(crate) fn free_axes(space: Space) -> BVec3 {
    match space {
        Space::Line => BVec3::new(true, false, false),
        Space::Plane => BVec3::new(true, true, false),
        Space::Space => BVec3::TRUE,
    }
}
