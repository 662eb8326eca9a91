//! Taking the force from a device, from whatever thread: the loop that writes it may be the one that hangs.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use cotouch_scene::geometry::{Wrench, Wrenches};

use crate::error::DeviceError;

/// Switches the force of one device off and on. Lock-free; any thread may call it at any time, any number of times, also
/// while another thread reads or writes the device.
pub trait ForceSwitch: Send + Sync {
    /// From now on the device renders no force, whatever is written, until [`enable`](Self::enable).
    fn disable(&self);

    /// Lets the device render again what is written from now on. Whoever enables it has forces begin softly.
    fn enable(&self);

    /// Whether the force is switched off.
    fn is_disabled(&self) -> bool;
}

/// The switch of a device whose force is made by this program: it is looked at whenever a force is about to be rendered.
///
/// A driver whose hardware has such a switch of its own, or a link that can be cut, implements [`ForceSwitch`] by that.
#[derive(Default)]
pub struct SoftwareSwitch(Arc<Flag>);

#[derive(Default)]
struct Flag(AtomicBool);

impl SoftwareSwitch {
    /// The handle that other threads get. It outlives the device.
    #[must_use]
    pub fn handle(&self) -> Arc<dyn ForceSwitch> {
        Arc::<Flag>::clone(&self.0)
    }

    /// Whether the force is switched off.
    #[must_use]
    pub fn is_disabled(&self) -> bool {
        self.0.is_disabled()
    }
}

impl ForceSwitch for Flag {
    fn disable(&self) {
        self.0.store(true, Ordering::SeqCst);
    }

    fn enable(&self) {
        self.0.store(false, Ordering::SeqCst);
    }

    fn is_disabled(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}

/// A copied device has a switch of its own, which stands as the original's does.
impl Clone for SoftwareSwitch {
    fn clone(&self) -> Self {
        Self(Arc::new(Flag(self.is_disabled().into())))
    }
}

impl PartialEq for SoftwareSwitch {
    fn eq(&self, other: &Self) -> bool {
        self.is_disabled() == other.is_disabled()
    }
}

impl fmt::Debug for SoftwareSwitch {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("SoftwareSwitch").field(&self.is_disabled()).finish()
    }
}

/// The wrenches that were written last, behind a [`SoftwareSwitch`]: what a device without dynamics renders.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldWrenches {
    written: Wrenches,
    switch: SoftwareSwitch,
}

impl HeldWrenches {
    /// No wrench at any of so many fingers.
    #[must_use]
    pub fn new(fingers: usize) -> Self {
        let written = std::iter::repeat_n(Wrench::default(), fingers).collect();
        Self { written, switch: SoftwareSwitch::default() }
    }

    /// Holds these from now on, one a finger; fingers beyond the last keep theirs.
    ///
    /// # Errors
    /// When one is not finite; then all stay as they were.
    pub fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        check_finite(wrenches)?;
        self.written.iter_mut().zip(wrenches).for_each(|(held, new)| *held = *new);
        if self.switch.is_disabled() {
            self.written.fill(Wrench::default());
        }
        Ok(())
    }

    /// What is rendered: nothing while the force is switched off.
    #[must_use]
    pub fn rendered(&self) -> Wrenches {
        let share = |held: &Wrench| if self.switch.is_disabled() { Wrench::default() } else { *held };
        self.written.iter().map(share).collect()
    }

    /// What switches the force off and on.
    #[must_use]
    pub fn switch(&self) -> Arc<dyn ForceSwitch> {
        self.switch.handle()
    }
}

/// Refuses wrenches that are not finite.
///
/// # Errors
/// [`DeviceError::NotFinite`], with the first of them.
pub fn check_finite(wrenches: &[Wrench]) -> Result<(), DeviceError> {
    match wrenches.iter().find(|wrench| !wrench.is_finite()) {
        Some(&wrench) => Err(DeviceError::NotFinite { wrench }),
        None => Ok(()),
    }
}
