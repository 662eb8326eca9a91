//! From a scene to the sampled-data loops of its contact modes.

mod modes;
mod session;

use cotouch_scene::mechanism::endpoint_inertia;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{
    Body, DeviceKind, DeviceSpec, SceneValues, Shape, ShapeKind, Space, VelocityEstimate,
};
use glam::{DMat3, DVec3};

use crate::loop_spec::LoopSpec;
use crate::operating_point::OperatingPoint;

pub(crate) use modes::{modes, sets_of_fingers};
pub(crate) use session::delay;

/// The loop of a scene while a given set of switching contacts is closed.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactMode {
    /// The switching contacts that are closed, such as `["wall"]` or `["anna.finger1", "wall"]`. A two-sided wall and a
    /// hand that is coupled to a point never switch.
    pub contacts: Vec<String>,
    /// Whether every finger that presses on something is in contact, and no wall is touched.
    pub settled: bool,
    /// The loop.
    pub spec: LoopSpec,
}

/// The loops of a scene, one for each contact mode; the free one first.
///
/// Fingers that press on bodies with surfaces give a mode for each set of them; each wall gives these again with the
/// body against it. Where a finger touches, it touches all copies of the body. Each mode is linear about the scene's
/// settled grasp ([`OperatingPoint::settled_grasp`]), with forces that are in balance in that mode. A body without a
/// surface, and a one-sided wall, give two modes: all copies of the object off it, and all against it. Links are taken
/// with their constant latency; loss, jitter and rate limits are not part of the linear loop.
#[must_use]
pub fn compile(scene: &SceneValues) -> Vec<ContactMode> {
    modes(scene).0
}

/// The loop of a scene about a given operating point, with exactly its contacts closed, all of them sticking.
///
/// Forces that depend on nothing do not enter, so the point need not be at rest by itself: only its poses, anchors and
/// contact forces count.
///
/// # Panics
/// When the operating point names hosts, bodies, fingers or walls that the scene does not have.
#[must_use]
pub fn compile_at(scene: &SceneValues, point: &OperatingPoint) -> LoopSpec {
    session::Session::new(scene, point).into_spec()
}

/// The inertia of a finger where it is (m, world), kg: m_h, and the links' own where [`DeviceSpec::inertia`] asks for it.
#[must_use]
pub fn endpoint_mass(scene: &SceneValues, host: HostIndex, finger: u8, position: DVec3) -> DMat3 {
    let start = scene.users[host.index()].fingers[usize::from(finger)].position_m;
    endpoint_inertia(&scene.device, scene.hand.mass_kg, start, position)
}

/// The scene's one-axis reduction, as in the thesis's analysis: everything moves along one line, across the faces that
/// the fingers press on, and every finger is coupled to the centre of the first body, both ways, by the normal springs
/// and dampers. No walls, ideal sensors.
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
