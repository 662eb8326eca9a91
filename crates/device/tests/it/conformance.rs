//! What holds of every device, whatever it is: of all in the table, and of those that are opened otherwise.

use std::sync::Arc;
use std::thread;

use crate::support::scene_of;
use cotouch_device::{
    DEFAULT_DEVICE, DRIVERS, Device, DeviceError, DeviceOpenError, DeviceSetup, SimulatedUser, StillDevice,
    TrajectoryDevice, WorldView, open,
};
use cotouch_scene::geometry::{Reading, Readings, Wrench, Wrenches};
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, Scene};
use glam::DVec3;

/// Two fingers that swing.
fn scene() -> Scene {
    let swing = Action::Sinusoid {
        amplitude_m: DVec3::X * 0.01,
        frequency_hz: 1.0,
        phase_rad: 0.0,
        duration_s: 100.0,
    };
    scene_of(&[swing], &[DVec3::ZERO, DVec3::X * 0.05])
}

fn same(force: DVec3, fingers: usize) -> Wrenches {
    std::iter::repeat_n(Wrench::force(force), fingers).collect()
}

/// Runs over a device that has not been started.
fn conforms(device: &mut dyn Device) {
    let (name, fingers, limits) = (device.name().to_owned(), device.fingers(), device.limits());
    assert!(!name.is_empty() && (1..=MAX_FINGERS).contains(&fingers), "{name}: {fingers} fingers");
    assert!(limits.max_force_n > 0.0 && limits.max_torque_n_m >= 0.0, "{name}: {limits:?}");
    device.start(3);
    for tick in 3..300 {
        reads_the_same_twice(device, tick);
        write(device, &same(DVec3::X * 0.1, fingers));
    }
    // A loop that was late.
    reads_the_same_twice(device, 400);
    refuses_what_is_not_finite(device);
    lets_go_for_another_thread(device);
    let place = DVec3::new(0.02, 0.0, 0.0);
    device.recentre(place);
    reads_the_same_twice(device, 403);
    assert_eq!((device.name(), device.fingers(), device.limits()), (name.as_str(), fingers, limits));
    assert!(device.pointer_targets().is_empty(), "{name}: nobody points");
}

fn reads_the_same_twice(device: &mut dyn Device, tick: u64) {
    let once = device.read(tick).unwrap();
    assert_eq!(once.len(), device.fingers(), "{}", device.name());
    assert!(once.iter().all(Reading::is_finite), "{}: {once:?}", device.name());
    assert_eq!(device.read(tick).unwrap(), once, "{}", device.name());
}

fn write(device: &mut dyn Device, wrenches: &[Wrench]) {
    device.observe(&WorldView { bodies: &[] });
    device.write(wrenches).unwrap();
}

fn refuses_what_is_not_finite(device: &mut dyn Device) {
    let before = (device.rendered(), device.read(400).unwrap());
    for bad in [DVec3::NAN, DVec3::INFINITY] {
        let mut wrenches = same(DVec3::X, device.fingers());
        wrenches.last_mut().unwrap().force = bad;
        let error = device.write(&wrenches).unwrap_err();
        assert!(matches!(error, DeviceError::NotFinite { .. }), "{}: {error}", device.name());
        assert_eq!((device.rendered(), device.read(400).unwrap()), before, "{}", device.name());
    }
}

fn lets_go_for_another_thread(device: &mut dyn Device) {
    let (fingers, nothing) = (device.fingers(), same(DVec3::ZERO, device.fingers()));
    write(device, &same(DVec3::X * 0.2, fingers));
    assert_ne!(device.rendered(), nothing, "{}: there is something to let go of", device.name());
    let switch = device.force_switch();
    let other = Arc::clone(&switch);
    thread::spawn(move || other.disable()).join().unwrap();
    assert!(switch.is_disabled() && device.force_switch().is_disabled());
    assert_eq!(device.rendered(), nothing, "{}", device.name());
    device.read(401).unwrap();
    write(device, &same(DVec3::X * 0.2, fingers));
    assert_eq!(device.rendered(), nothing, "{}: also of what is written later", device.name());
    thread::spawn(move || switch.enable()).join().unwrap();
    assert_eq!(device.rendered(), nothing, "{}: what was written before does not come back", device.name());
    device.read(402).unwrap();
    write(device, &same(DVec3::X * 0.2, fingers));
    assert_ne!(device.rendered(), nothing, "{}", device.name());
    assert!(!device.force_switch().is_disabled());
}

/// Specs by which devices are opened here that take more than their name, by name. Paths are from `crates/device`.
const SPECS: &[(&str, &str)] = &[("faulty", "faulty:fail@3600")];

#[test]
fn every_device_of_the_table_conforms() {
    let scene = scene();
    for driver in DRIVERS {
        let setup = DeviceSetup { scene: &scene, host: HostIndex::FIRST, guide: Box::new(()) };
        let spec = SPECS.iter().find(|(name, _)| *name == driver.name).map_or(driver.name, |(_, spec)| spec);
        conforms(open(spec, setup).unwrap().as_mut());
        assert!(!driver.summary.is_empty());
    }
    assert!(DRIVERS.iter().any(|driver| driver.name == DEFAULT_DEVICE));
}

#[test]
fn devices_that_are_made_otherwise_conform() {
    let scene = scene();
    conforms(&mut SimulatedUser::new(&scene, HostIndex::FIRST).unwrap());
    conforms(&mut StillDevice::new([DVec3::ZERO]));
    let circle = |time_s: f64| -> Readings {
        [Reading::point(DVec3::new(time_s.cos(), time_s.sin(), 0.0), DVec3::ZERO)].into_iter().collect()
    };
    conforms(&mut TrajectoryDevice::new(scene.rates.control_hz, circle));
}

/// Nobody moves a finger whose force is gone but its own hand, not even while ticks are skipped.
#[test]
fn a_simulated_finger_is_not_pushed_any_more() {
    let scene = scene_of(&[], &[DVec3::ZERO]);
    let pushed = |lets_go: bool| {
        let mut user = SimulatedUser::new(&scene, HostIndex::FIRST).unwrap();
        user.read(0).unwrap();
        user.write(&[Wrench::force(DVec3::X)]).unwrap();
        if lets_go {
            user.force_switch().disable();
        }
        user.read(1000).unwrap()[0].pose.position.x
    };
    assert!(pushed(false) > 50.0 * pushed(true), "{} m and {} m", pushed(false), pushed(true));
    assert!(pushed(true) > 0.0, "it had begun to move");
}

#[test]
fn a_spec_that_means_nothing_is_refused_in_words() {
    let scene = scene();
    let refused = |spec: &str| {
        let setup = DeviceSetup { scene: &scene, host: HostIndex::FIRST, guide: Box::new(()) };
        open(spec, setup).err().expect("refused")
    };
    let unknown = refused("unknown:1");
    assert!(matches!(&unknown, DeviceOpenError::Unknown { name, .. } if name == "unknown"));
    let known: Vec<&str> = DRIVERS.iter().map(|driver| driver.name).collect();
    assert_eq!(
        unknown.to_string(),
        format!("there is no device \"unknown\"; there are {}", known.join(", "))
    );
    assert_eq!(refused("still:5").to_string(), "the device still takes no parameters; found \"5\"");
}
