//! What a device is opened with.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use glam::DVec3;

use crate::guide::Guide;

/// Whose device it is, in which scene.
pub struct DeviceSetup<'a> {
    /// The scene: its rates, hands, mechanism, governor.
    pub scene: &'a Scene,
    /// The user's host; the scene has it.
    pub host: HostIndex,
    /// What a pointer on the page says, for a device that can be guided.
    pub guide: Box<dyn Guide>,
}

impl DeviceSetup<'_> {
    /// Where the scene has the user's fingers rest and start, m, world.
    pub fn rest_positions(&self) -> impl Iterator<Item = DVec3> {
        self.scene.users[self.host.index()].fingers.iter().map(|finger| finger.position_m)
    }
}
