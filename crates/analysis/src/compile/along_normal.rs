//! A scene along one line.

use cotouch_scene::scene::{
    Body, DeviceKind, DeviceSpec, SceneValues, Shape, ShapeKind, Space, VelocityEstimate,
};
use glam::DVec3;

/// The scene's one-axis reduction, as in Fotoohi Ghiam's analysis: everything moves along one line, across the faces
/// that the fingers press on, and every finger is coupled to the centre of the first body, both ways, by the normal
/// springs and dampers. No walls, ideal sensors.
#[must_use]
pub fn along_normal(scene: &SceneValues) -> SceneValues {
    let mut line = scene.clone();
    let mass_kg = scene.world_bodies().first().map_or(scene.object.mass_kg, |Body { mass_kg, .. }| *mass_kg);
    line.space = Space::Line;
    line.bodies.clear();
    line.object.mass_kg = mass_kg;
    line.object.shape = Shape { kind: ShapeKind::Point, surface: None, ..line.object.shape };
    line.object.position_m = DVec3::ZERO;
    line.object.rotation_rad = DVec3::ZERO;
    line.gravity_m_per_s2 = DVec3::ZERO;
    line.wall.stiffness_n_per_m = 0.0;
    line.wall.damping_n_s_per_m = 0.0;
    line.device = DeviceSpec { kind: DeviceKind::Point, velocity: VelocityEstimate::Exact, ..line.device };
    line
}
