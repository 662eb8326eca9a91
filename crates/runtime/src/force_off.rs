//! Every device of this process that may render, so that all forces can be switched off at once from anywhere.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use cotouch_device::ForceSwitch;

/// Switches of devices in sessions that run. Held for moments, and never by a haptic thread.
static SWITCHES: Mutex<Vec<Weak<dyn ForceSwitch>>> = Mutex::new(Vec::new());

/// Takes note of the devices of a session that begins.
pub(crate) fn register(switches: &[Arc<dyn ForceSwitch>]) {
    let mut all = SWITCHES.lock().unwrap_or_else(PoisonError::into_inner);
    all.retain(|switch| switch.strong_count() > 0);
    all.extend(switches.iter().map(Arc::downgrade));
}

/// Switches off the forces of all devices in all sessions of this process, for a program that is about to end without an orderly
/// release. Whatever else it does, it must end then: a haptic thread that comes back from standing still switches its own on.
pub fn switch_off_all_forces() {
    let all = SWITCHES.lock().unwrap_or_else(PoisonError::into_inner);
    all.iter().filter_map(Weak::upgrade).for_each(|switch| switch.disable());
}

#[cfg(test)]
mod tests {
    use cotouch_device::SoftwareSwitch;

    use super::*;

    #[test]
    fn all_devices_that_are_still_there_are_switched_off() {
        let [gone, first, second] = [(); 3].map(|()| SoftwareSwitch::default());
        register(&[gone.handle(), first.handle()]);
        drop(gone);
        register(&[second.handle()]);
        switch_off_all_forces();
        assert!(first.is_disabled() && second.is_disabled());
    }
}
