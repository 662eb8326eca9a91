//! Pose, twist and wrench, and what a haptic device reports. All SI, all in the world frame.

use arrayvec::ArrayVec;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::limits::MAX_FINGERS;

/// What a device reports at one instant: one reading a finger.
pub type Readings = ArrayVec<Reading, MAX_FINGERS>;

/// What a device is asked to render: one wrench a finger.
pub type Wrenches = ArrayVec<Wrench, MAX_FINGERS>;

/// Position and orientation of a frame in the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Where the frame's origin is, m.
    pub position: DVec3,
    /// How the frame is turned: a unit quaternion.
    pub orientation: DQuat,
}

impl Pose {
    /// At `position`, unturned.
    #[must_use]
    pub const fn at(position: DVec3) -> Self {
        Self { position, orientation: DQuat::IDENTITY }
    }

    /// The world's point that this frame calls `point`, m.
    #[must_use]
    pub fn to_world(&self, point: DVec3) -> DVec3 {
        self.position + self.orientation * point
    }

    /// What this frame calls the world's `point`, m.
    #[must_use]
    pub fn to_local(&self, point: DVec3) -> DVec3 {
        self.orientation.conjugate() * (point - self.position)
    }
}

impl Default for Pose {
    fn default() -> Self {
        Self::at(DVec3::ZERO)
    }
}

/// Linear and angular velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Linear velocity, m/s.
    pub linear: DVec3,
    /// Angular velocity, rad/s.
    pub angular: DVec3,
}

/// Force and torque about the frame's origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wrench {
    /// Force, N.
    pub force: DVec3,
    /// Torque about the origin of the frame, N·m.
    pub torque: DVec3,
}

impl Wrench {
    /// A force without a torque.
    #[must_use]
    pub const fn force(force: DVec3) -> Self {
        Self { force, torque: DVec3::ZERO }
    }

    /// Whether every component is a number.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.force.is_finite() && self.torque.is_finite()
    }
}

/// What a haptic device reports at one instant: the haptic interface point's pose and twist.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Pose of the haptic interface point.
    pub pose: Pose,
    /// Its twist.
    pub twist: Twist,
}

impl Reading {
    /// A point at `position` moving at `velocity`.
    #[must_use]
    pub fn point(position: DVec3, velocity: DVec3) -> Self {
        Self { pose: Pose::at(position), twist: Twist { linear: velocity, angular: DVec3::ZERO } }
    }

    /// Whether every component is a number.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.pose.position.is_finite()
            && self.pose.orientation.is_finite()
            && self.twist.linear.is_finite()
            && self.twist.angular.is_finite()
    }
}
