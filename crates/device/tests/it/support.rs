//! Scenes for tests.

use cotouch_device::{Device, SimulatedUser, WorldView};
use cotouch_scene::geometry::{Pose, Wrenches};
use cotouch_scene::scene::{
    Action, Body, DeviceKind, DeviceSpec, Finger, Hand, Scene, SceneValues, ShapeKind, Space, SpringDamper,
};
use cotouch_testkit::scenes::edited;
use glam::DVec3;

/// A free arm.
pub(crate) fn arm() -> Hand {
    Hand { mass_kg: 0.25, damping_n_s_per_m: 5.0, finger_radius_m: 1e-4, ..Hand::default() }
}

/// How firmly targets are tracked.
pub(crate) const TRACKING: SpringDamper = SpringDamper { stiffness_n_per_m: 500.0, damping_n_s_per_m: 20.0 };

/// A point with a perfect sensor.
pub(crate) fn point() -> DeviceSpec {
    DeviceSpec { kind: DeviceKind::Point, velocity_cutoff_hz: 100.0, ..DeviceSpec::default() }
}

/// A scene on a line at 1 kHz, whose first user has fingers at `starts` and does `actions`.
pub(crate) fn scene_of(actions: &[Action], starts: &[DVec3]) -> Scene {
    edited(&cotouch_scene::load("single-axis", &[]).unwrap(), |scene| furnish(scene, actions, starts))
}

fn furnish(scene: &mut SceneValues, actions: &[Action], starts: &[DVec3]) {
    scene.rates.control_hz = "1000".parse().unwrap();
    scene.session.seed = 7;
    scene.space = Space::Line;
    scene.hand = arm();
    scene.device = point();
    let user = &mut scene.users[0];
    (user.tracking, user.script, user.repeat) = (TRACKING, actions.to_vec(), false);
    user.fingers = starts.iter().map(|&position_m| Finger { position_m, script: Vec::new() }).collect();
}

/// The same in `space`, with a box of edges `size_m` about the origin, called `box`.
pub(crate) fn scene_with_box(space: Space, actions: &[Action], starts: &[DVec3], size_m: DVec3) -> Scene {
    edited(&cotouch_scene::load("single-axis", &[]).unwrap(), |scene| {
        furnish(scene, actions, starts);
        scene.space = space;
        let mut shape = scene.object.shape.clone();
        (shape.kind, shape.size_m) = (ShapeKind::Box, size_m);
        scene.bodies = vec![Body {
            name: "box".into(),
            shape,
            mass_kg: 0.2,
            position_m: DVec3::ZERO,
            rotation_rad: DVec3::ZERO,
            fixed: false,
        }];
    })
}

/// One tick of a user who sees `bodies` and feels what `wrenches` makes of where the fingers are.
pub(crate) fn tick(
    user: &mut SimulatedUser,
    tick: u64,
    bodies: &[Pose],
    wrenches: impl FnOnce(&cotouch_scene::geometry::Readings) -> Wrenches,
) {
    let readings = user.read(tick).unwrap();
    user.observe(&WorldView { bodies });
    user.write(&wrenches(&readings)).unwrap();
}
