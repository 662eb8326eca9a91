//! Forces along given paths of the fingers, against the same scene simulated at the haptic rate.

use std::f64::consts::TAU;

use arrayvec::ArrayVec;
use cotouch_device::TrajectoryDevice;
use cotouch_runtime::VirtualSession;
use cotouch_scene::geometry::Reading;
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{LocalModelKind, ReturnedForce, SceneValues, Space, User};
use cotouch_scene::{Scene, SceneErrors};
use cotouch_world::MeshSurface;
use glam::DVec3;
use serde::Serialize;

/// How long fingers move, s, and from when on forces are compared: peers have faded in.
const DURATION_S: f64 = 6.0;
const FROM_S: f64 = 1.0;

/// How stiff the contact of the reference is, in units of K_o.
pub(super) const REFERENCE_RATIO: f64 = 4.0;

/// Fingers press by this share of the object's least extent, and slide by this share of that.
const PRESS_SHARE: f64 = 0.1;
const SLIDE_SHARE: f64 = 0.5;

/// The first finger presses so often, Hz, and every other so much more often than the one before it.
const FIRST_HZ: f64 = 0.7;
const FURTHER_HZ: f64 = 0.23;

/// How far forces are from those of the reference.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct ForceErrors {
    /// Root mean square of the difference over that of the reference.
    pub(super) force_error: f64,
    /// Largest difference over the largest force of the reference.
    pub(super) peak_error: f64,
    /// Largest change of a force from one tick to the next, N.
    pub(super) max_jump_n: f64,
}

/// What every finger's device is asked to render: by host, by tick, by finger.
pub(super) struct Forces(Vec<Vec<ArrayVec<DVec3, MAX_FINGERS>>>);

/// The scene with the object simulated at the haptic rate, one haptic tick late, and a contact that is much stiffer than
/// the object. Without inertia only the joint compliance gives a stable loop with it, and is exact.
pub(super) fn reference(scene: &Scene) -> Result<Scene, SceneErrors> {
    let refer = |values: &mut SceneValues| {
        values.rates.simulation_hz = values.rates.control_hz;
        let model = &mut values.local_model;
        model.kind = if scene.soft.quasi_static { LocalModelKind::Compliance } else { LocalModelKind::P };
        (model.stiffness_n_per_m, model.stiffness_ratio) = (0.0, REFERENCE_RATIO);
        (model.returned_force, model.result_delay_periods) = (ReturnedForce::First, 0);
    };
    scene.edit(refer)
}

impl Forces {
    /// Along the paths that fit the scene.
    pub(super) fn of(scene: &Scene) -> anyhow::Result<Self> {
        let paths = Path::all(scene)?;
        let control = scene.rates.control_hz;
        let mut session = VirtualSession::with_devices(scene, |host| {
            let paths = paths[host.index()].clone();
            let readings = move |time_s| paths.iter().map(|path: &Path| path.reading(time_s)).collect();
            (TrajectoryDevice::new(control, readings), None)
        })?;
        let tick_at = |time_s: f64| (time_s * control.hz()) as u64;
        let joined = session.run_to_tick(tick_at(FROM_S), |_, _| {});
        anyhow::ensure!(joined, "the hosts could not join over the simulated link");
        let mut forces = vec![Vec::new(); paths.len()];
        session.run_to_tick(tick_at(DURATION_S), |host: HostIndex, tick| {
            forces[host.index()].push(tick.requested.iter().map(|wrench| wrench.force).collect());
        });
        Ok(Self(forces))
    }

    /// How far these are from `reference`, of the same paths.
    pub(super) fn errors(&self, reference: &Self) -> ForceErrors {
        let (mut difference, mut size, mut worst, mut largest) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        for (own, reference) in self.0.iter().flatten().flatten().zip(reference.0.iter().flatten().flatten())
        {
            difference += own.distance_squared(*reference);
            size += reference.length_squared();
            worst = worst.max(own.distance(*reference));
            largest = largest.max(reference.length());
        }
        ForceErrors {
            force_error: (difference / size).sqrt(),
            peak_error: worst / largest,
            max_jump_n: self.largest_jump_n(),
        }
    }

    fn largest_jump_n(&self) -> f64 {
        let jump = |ticks: &[ArrayVec<DVec3, MAX_FINGERS>]| {
            ticks[0].iter().zip(&ticks[1]).map(|(one, next)| one.distance(*next)).fold(0.0, f64::max)
        };
        self.0.iter().flat_map(|host| host.windows(2).map(jump)).fold(0.0, f64::max)
    }
}

/// A finger that presses into the object and out again, and slides while it does.
#[derive(Clone, Copy)]
struct Path {
    /// Where it just touches.
    touching_m: DVec3,
    /// How far it goes in, at most.
    press_m: DVec3,
    /// How far it goes along the surface, to either side.
    slide_m: DVec3,
    frequency_hz: f64,
}

impl Path {
    /// One a finger, by host; at the point of the surface that is nearest to where the finger starts.
    fn all(scene: &Scene) -> anyhow::Result<Vec<Vec<Self>>> {
        let mesh = scene.soft.mesh();
        let surface = MeshSurface::new(mesh.nodes_m.clone(), &mesh.triangles)?;
        let (low, high) =
            mesh.nodes_m.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &node| {
                (low.min(node), high.max(node))
            });
        let extent = high - low;
        let least_m = if extent.min_element() > 1e-6 { extent.min_element() } else { extent.max_element() };
        let mut number = 0.0;
        let mut path = |start: DVec3| {
            let (point, normal) =
                surface.nearest_point(start).map_or((start, DVec3::X), |near| (near.point, near.outward));
            let outward = (start - point).try_normalize().unwrap_or(normal);
            let along =
                if scene.space == Space::Line { DVec3::ZERO } else { outward.any_orthonormal_vector() };
            number += 1.0;
            Self {
                touching_m: point + outward * scene.hand.finger_radius_m,
                press_m: -outward * (PRESS_SHARE * least_m),
                slide_m: along * (PRESS_SHARE * SLIDE_SHARE * least_m),
                frequency_hz: FIRST_HZ + FURTHER_HZ * (number - 1.0),
            }
        };
        let of_user = |user: &User| user.fingers.iter().map(|finger| path(finger.position_m)).collect();
        Ok(scene.users.iter().map(of_user).collect())
    }

    /// At `time_s`: in contact half of the time.
    fn reading(&self, time_s: f64) -> Reading {
        let phase = TAU * self.frequency_hz * time_s;
        let (slow, rate) = (0.37 * phase, TAU * self.frequency_hz);
        let position = self.touching_m - self.press_m * phase.cos() + self.slide_m * slow.sin();
        let velocity = self.press_m * (rate * phase.sin()) + self.slide_m * (0.37 * rate * slow.cos());
        Reading::point(position, velocity)
    }
}
