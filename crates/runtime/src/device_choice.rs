//! Who has which device.

use std::convert::Infallible;
use std::str::FromStr;

use cotouch_device::{DEFAULT_DEVICE, Device, DeviceOpenError, DeviceSetup, Guide, open};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;

/// A device of the table in `cotouch_device`, for a user or for everybody; `USER=SPEC` or `SPEC` as a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceChoice {
    /// The user's name; every user of this process when there is none.
    pub user: Option<String>,
    /// The device, `NAME` or `NAME:PARAMETERS`.
    pub spec: String,
}

/// What stands behind a colon belongs to the device.
impl FromStr for DeviceChoice {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        let user = text.split_once('=').filter(|(user, _)| !user.contains(':'));
        Ok(match user {
            Some((user, spec)) => Self { user: Some(user.to_owned()), spec: spec.to_owned() },
            None => Self { user: None, spec: text.to_owned() },
        })
    }
}

impl DeviceChoice {
    fn is_for(&self, user: &str) -> bool {
        self.user.as_deref().is_none_or(|name| name == user)
    }
}

/// Opens the device of the user at `host`: the last of `choices` that is for the user, or the simulated hand. A pointer
/// speaks through `guide`, if the device listens.
///
/// # Errors
/// When there is no such device, or it cannot be had.
pub(crate) fn open_device(
    scene: &Scene,
    host: HostIndex,
    choices: &[DeviceChoice],
    guide: impl Guide + 'static,
) -> Result<Box<dyn Device>, DeviceOpenError> {
    let user = &scene.users[host.index()].name;
    let choice = choices.iter().rfind(|choice| choice.is_for(user));
    let spec = choice.map_or(DEFAULT_DEVICE, |choice| &choice.spec);
    open(spec, DeviceSetup { scene, host, guide: Box::new(guide) })
}

/// What a person is to know before a session begins in which the user at `host` has `device`: that it has too few fingers.
pub(crate) fn missing_fingers(scene: &Scene, host: HostIndex, device: &dyn Device) -> Option<String> {
    let user = &scene.users[host.index()];
    let (found, expected) = (device.fingers(), user.fingers.len());
    let note = || {
        format!("{}'s device has {found} of {expected} fingers; the prediction is of {expected}", user.name)
    };
    (found < expected).then(note)
}

#[cfg(test)]
mod tests {
    use cotouch_device::StillDevice;
    use glam::DVec3;

    use super::*;

    #[test]
    fn too_few_fingers_are_told_and_enough_are_not() {
        let scene = cotouch_scene::load("grasp", &[]).unwrap();
        let told = |fingers: usize| {
            let device = StillDevice::new(std::iter::repeat_n(DVec3::ZERO, fingers));
            missing_fingers(&scene, HostIndex(1), &device)
        };
        let user = &scene.users[1].name;
        let note = format!("{user}'s device has 1 of 2 fingers; the prediction is of 2");
        assert_eq!((told(1), told(2), told(3)), (Some(note), None, None));
    }

    #[test]
    fn the_last_choice_for_a_user_counts() {
        let scene = cotouch_scene::load("single-axis", &[]).unwrap();
        let ben = &scene.users[1].name;
        let choices = ["still".to_owned(), format!("{ben}=hand")].map(|text| text.parse().unwrap());
        let name = |host, choices: &[DeviceChoice]| {
            open_device(&scene, HostIndex(host), choices, ()).unwrap().name().to_owned()
        };
        assert_eq!((name(0, &choices), &name(1, &choices)), ("still".to_owned(), ben));
        assert_eq!(&name(0, &[]), &scene.users[0].name);
        let odd: DeviceChoice = "file:a=b".parse().unwrap();
        assert_eq!((odd.user, odd.spec.as_str()), (None, "file:a=b"));
    }
}
