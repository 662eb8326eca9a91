//! Virtual couplers: a spring and damper between two moving points (thesis (3.4), (4.25)–(4.29)).

use cotouch_scene::scene::SpringDamper;
use glam::DVec3;

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
