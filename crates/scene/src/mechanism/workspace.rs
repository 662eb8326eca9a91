//! Where a haptic interface point can go.

use glam::DVec3;

/// An upright box in which a haptic interface point can be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Workspace {
    /// m.
    pub centre: DVec3,
    /// Half of its edges, m.
    pub half_size: DVec3,
}

impl Workspace {
    /// Whether `position` lies in it.
    #[must_use]
    pub fn contains(&self, position: DVec3) -> bool {
        (position - self.centre).abs().cmple(self.half_size).all()
    }

    /// The nearest place in it.
    #[must_use]
    pub fn nearest(&self, position: DVec3) -> DVec3 {
        position.clamp(self.centre - self.half_size, self.centre + self.half_size)
    }
}
