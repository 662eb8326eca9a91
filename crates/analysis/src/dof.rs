//! Degrees of freedom.

use cotouch_scene::names::{Axis, Quantity};

/// One way in which something moves, in the world frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Dof {
    /// Along an axis, m.
    Move(Axis),
    /// About an axis: a small rotation vector from the pose about which the loop is linear, rad.
    Turn(Axis),
}

/// Along x.
pub const LINE: &[Dof] = &[Dof::Move(Axis::X)];
/// A point in the x-y plane.
pub const PLANE_POINT: &[Dof] = &[Dof::Move(Axis::X), Dof::Move(Axis::Y)];
/// A body in the x-y plane, turning about z.
pub const PLANE_BODY: &[Dof] = &[Dof::Move(Axis::X), Dof::Move(Axis::Y), Dof::Turn(Axis::Z)];
/// A point in space.
pub const SPACE_POINT: &[Dof] = &[Dof::Move(Axis::X), Dof::Move(Axis::Y), Dof::Move(Axis::Z)];
/// A body in space.
pub const SPACE_BODY: &[Dof] = &[
    Dof::Move(Axis::X),
    Dof::Move(Axis::Y),
    Dof::Move(Axis::Z),
    Dof::Turn(Axis::X),
    Dof::Turn(Axis::Y),
    Dof::Turn(Axis::Z),
];

impl Dof {
    /// Whether it is a turn.
    #[must_use]
    pub const fn turns(self) -> bool {
        matches!(self, Self::Turn(_))
    }

    /// The axis along or about which it is.
    #[must_use]
    pub const fn axis(self) -> Axis {
        match self {
            Self::Move(axis) | Self::Turn(axis) => axis,
        }
    }

    /// What its position is called.
    #[must_use]
    pub const fn position(self) -> Quantity {
        match self {
            Self::Move(axis) => Quantity::Position(axis),
            Self::Turn(axis) => Quantity::Rotation(axis),
        }
    }

    /// What its velocity is called.
    #[must_use]
    pub const fn velocity(self) -> Quantity {
        match self {
            Self::Move(axis) => Quantity::Velocity(axis),
            Self::Turn(axis) => Quantity::AngularVelocity(axis),
        }
    }
}

/// Positions, then velocities.
pub(crate) fn motion_quantities(axes: &'static [Dof]) -> impl Iterator<Item = Quantity> {
    axes.iter().map(|dof| dof.position()).chain(axes.iter().map(|dof| dof.velocity()))
}
