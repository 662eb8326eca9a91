//! Where somebody wants a user's fingers to be: how a pointer on the page reaches a device.

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_FINGERS;
use glam::DVec3;

/// Where a pointer wants the fingers to be, m, world; fewer targets than fingers leave the others where they are.
pub type Targets = ArrayVec<DVec3, MAX_FINGERS>;

/// Where guidance comes from; asked once a tick, from the haptic thread. No allocation, no lock.
pub trait Guide: Send {
    /// The newest targets; `None` while no pointer moves this hand. What is not finite counts as not said.
    fn targets(&mut self) -> Option<Targets>;
}

/// A user whom nobody guides.
impl Guide for () {
    fn targets(&mut self) -> Option<Targets> {
        None
    }
}

impl Guide for Box<dyn Guide> {
    fn targets(&mut self) -> Option<Targets> {
        (**self).targets()
    }
}
