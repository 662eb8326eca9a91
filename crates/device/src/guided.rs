//! A simulated user whose fingers a pointer draws, while there is one: how a browser's mouse or touch takes part.

use arrayvec::ArrayVec;
use cotouch_scene::geometry::{MAX_FINGERS, Readings, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Scene, SpringDamper};
use glam::DVec3;

use crate::device::{Device, DeviceError, DeviceLimits, WorldView};
use crate::finger::FingerError;
use crate::user::SimulatedUser;

/// Where a pointer wants the fingers to be, m, world; fewer targets than fingers leave the others where they are.
pub type Targets = ArrayVec<DVec3, MAX_FINGERS>;

/// Where guidance comes from; asked once a tick, from the haptic thread. No allocation, no lock.
pub trait Guide: Send {
    /// The newest targets; `None` while no pointer moves this hand.
    fn targets(&mut self) -> Option<Targets>;
}

/// The spring from a pointer to each finger of the user at `host`: the scene's `tracking`, or a usual one where the scene
/// has none. It is a part of the loop.
#[must_use]
pub fn spring(scene: &Scene, host: HostIndex) -> SpringDamper {
    let _ = (scene, host);
    todo!()
}

/// `scene` as the analysis must see it while pointers move the hands of `hosts`: their fingers are tracked by [`spring`].
#[must_use]
pub fn guided_scene(scene: &Scene, hosts: &[HostIndex]) -> Scene {
    let _ = hosts;
    scene.clone()
}

/// A [`SimulatedUser`] that follows its script, or a [`Guide`] while that has targets.
pub struct GuidedUser<G> {
    user: SimulatedUser,
    guide: G,
}

impl<G: Guide> GuidedUser<G> {
    /// The user at `host` of a scene.
    ///
    /// # Errors
    /// As for [`SimulatedUser::of_scene`].
    pub fn of_scene(scene: &Scene, host: HostIndex, guide: G) -> Result<Self, FingerError> {
        Ok(Self { user: SimulatedUser::of_scene(scene, host)?, guide })
    }
}

impl<G: Guide> Device for GuidedUser<G> {
    fn name(&self) -> &str {
        self.user.name()
    }

    fn fingers(&self) -> usize {
        self.user.fingers()
    }

    fn limits(&self) -> DeviceLimits {
        self.user.limits()
    }

    fn start(&mut self, tick: u64) {
        self.user.start(tick);
    }

    fn recentre(&mut self, position: DVec3) {
        self.user.recentre(position);
    }

    fn observe(&mut self, view: &WorldView<'_>) {
        self.user.observe(view);
    }

    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
        let _ = self.guide.targets();
        self.user.read(tick)
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        self.user.write(wrenches)
    }
}
