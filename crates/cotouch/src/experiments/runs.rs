//! A run in virtual time as curves, beside what the analysis says about it.

use std::ops::Range;

use anyhow::Context as _;
use cotouch_analysis::Stability;
use cotouch_runtime::Summary;
use cotouch_scene::scene::SceneValues;
use cotouch_scene::{Override, Scene};
use glam::DVec3;

use crate::session;

/// Every so many ticks a point of a curve is kept: the network rate of the built-in scenes.
const TICKS_A_POINT: u64 = 8;

/// What one run gave.
pub(super) struct Run {
    /// What ran.
    pub(super) scene: Scene,
    /// What the analysis says.
    pub(super) predicted: Stability,
    /// What happened.
    pub(super) summary: Summary,
    /// One entry a host.
    pub(super) hosts: Vec<HostCurves>,
}

/// What one host saw, at equal intervals.
#[derive(Clone, Debug, Default)]
pub(super) struct HostCurves {
    /// s.
    pub(super) time_s: Vec<f64>,
    /// One entry a finger.
    pub(super) fingers: Vec<FingerCurves>,
    /// The first body's position, m, velocity, m/s, and turn about z, rad.
    pub(super) body_m: Vec<DVec3>,
    pub(super) body_m_per_s: Vec<DVec3>,
    pub(super) body_turn_rad: Vec<f64>,
}

/// One finger's curves.
#[derive(Clone, Debug, Default)]
pub(super) struct FingerCurves {
    /// m.
    pub(super) position_m: Vec<DVec3>,
    /// Mean over the interval of what the device rendered on the finger, N.
    pub(super) force_n: Vec<DVec3>,
    /// The same, largest magnitude in the interval, N.
    pub(super) largest_force_n: Vec<f64>,
}

impl Run {
    /// Runs a built-in scene with `settings` (KEY=VALUE) for `duration_s`.
    pub(super) fn of(scene: &str, settings: &[&str], duration_s: f64) -> anyhow::Result<Self> {
        Self::of_scene(load(scene, settings)?, duration_s)
    }

    /// Runs `scene`.
    pub(super) fn of_scene(scene: Scene, duration_s: f64) -> anyhow::Result<Self> {
        let predicted = cotouch_analysis::analyze_settled(&scene)?;
        let mut hosts = vec![HostCurves::default(); scene.users.len()];
        let mut ticks = vec![0_u64; hosts.len()];
        let summary = session::simulate(&scene, duration_s, |host, tick| {
            let at = ticks[host.index()];
            ticks[host.index()] += 1;
            hosts[host.index()].take(at, tick);
        })?;
        Ok(Self { scene, predicted, summary, hosts })
    }

    /// Whether prediction and run say the same, and what.
    pub(super) fn verdict_in_words(&self) -> String {
        let word = |stable| if stable { "each mode stable" } else { "unstable" };
        format!(
            "predicted {} (spectral radius {:.4}), run {}",
            word(self.predicted.each_mode_is_stable()),
            self.predicted.spectral_radius,
            self.summary.verdict.in_words()
        )
    }
}

/// A built-in scene with settings.
pub(super) fn load(scene: &str, settings: &[&str]) -> anyhow::Result<Scene> {
    let overrides: Vec<Override> = settings
        .iter()
        .map(|text| text.parse().map_err(|error| anyhow::anyhow!("{text}: {error}")))
        .collect::<Result<_, _>>()?;
    cotouch_scene::load(scene, &overrides).with_context(|| format!("the scene {scene}"))
}

/// The largest spectral radius with hands that are masses and nothing else.
pub(super) fn radius_of_mass_only_hands(scene: &Scene) -> anyhow::Result<f64> {
    // No scene lets hands follow paths without stiffness; its loop can be compiled all the same.
    let mut values = SceneValues::clone(scene);
    values.hand.damping_n_s_per_m = 0.0;
    values.hand.stiffness_n_per_m = 0.0;
    for user in &mut values.users {
        user.tracking.stiffness_n_per_m = 0.0;
        user.tracking.damping_n_s_per_m = 0.0;
    }
    let modes = cotouch_analysis::compile(&values);
    modes.iter().try_fold(0.0_f64, |radius, mode| {
        Ok(radius.max(cotouch_analysis::analyze_loop(&mode.spec)?.spectral_radius))
    })
}

impl HostCurves {
    fn take(&mut self, at: u64, tick: &cotouch_runtime::TickRecord) {
        self.fingers.resize(tick.readings.len(), FingerCurves::default());
        if at.is_multiple_of(TICKS_A_POINT) {
            self.time_s.push(tick.instant.as_secs_f64());
            let body = &tick.bodies[0];
            self.body_m.push(body.pose.position);
            self.body_m_per_s.push(body.twist.linear);
            self.body_turn_rad.push(body.pose.orientation.to_scaled_axis().z);
            for (curves, reading) in self.fingers.iter_mut().zip(&tick.readings) {
                curves.position_m.push(reading.pose.position);
                curves.force_n.push(DVec3::ZERO);
                curves.largest_force_n.push(0.0);
            }
        }
        for (curves, commanded) in self.fingers.iter_mut().zip(&tick.commanded) {
            let force = commanded.force;
            if let (Some(mean), Some(largest)) =
                (curves.force_n.last_mut(), curves.largest_force_n.last_mut())
            {
                *mean += force / TICKS_A_POINT as f64;
                *largest = largest.max(force.length());
            }
        }
    }

    /// The points whose times lie in `times_s`.
    pub(super) fn between(&self, times_s: Range<f64>) -> Range<usize> {
        let first = self.time_s.partition_point(|&time| time < times_s.start);
        first..self.time_s.partition_point(|&time| time < times_s.end)
    }

    /// The sum of the forces that the user's fingers put on the world, N: the opposite of what the devices render.
    pub(super) fn net_force_n(&self, point: usize) -> DVec3 {
        self.fingers.iter().map(|finger| -finger.force_n[point]).sum()
    }
}

/// Pairs of time and value.
pub(super) fn curve(times: &[f64], value: impl Fn(usize) -> f64) -> Vec<(f64, f64)> {
    times.iter().enumerate().map(|(point, &time)| (time, value(point))).collect()
}

/// Root mean square.
pub(super) fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0_u32, 0.0), |(count, sum), value| (count + 1, sum + value * value));
    (sum / f64::from(count.max(1))).sqrt()
}
