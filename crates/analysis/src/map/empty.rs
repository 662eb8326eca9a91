//! Why no point of a map is stable: dampers that held data turn against themselves, or else which single change of
//! something that is not swept would make some of it stable.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};

use cotouch_scene::scene::Architecture;
use cotouch_scene::time::Rate;
use cotouch_scene::{Scene, with_override};
use rayon::prelude::*;

use crate::compile::compile;
use crate::evaluator::Evaluator;
use crate::gains::{Gain, acting_gains};
use crate::loop_spec::{Dynamics, Force, ForceGains, LoopSpec, Motion, Signal};
use crate::sweep::{Sweep, SweepError};
use cotouch_matrix::{eigenvalues, spectral_radius};

/// Changed scenes are looked at on a grid of so many points a direction.
const LOOKS: usize = 12;
/// The same where every point has to be compiled.
const SLOW_LOOKS: usize = 4;
/// So many changes are told of.
const MAX_CHANGES: usize = 3;
/// What grows by less than this a pattern is not said to grow.
const GROWTH: f64 = 1e-4;

/// One or two plain sentences.
pub(super) fn reason(
    scene: &Scene,
    x: &Sweep,
    y: Option<&Sweep>,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<String, SweepError> {
    let map = Map { scene, x, y, gains: acting_gains(scene) };
    let mut sentences = Vec::new();
    if !scene.soft.exists() {
        sentences.extend(map.damper_alone()?);
    }
    sentences.push(map.what_would_help(progress));
    Ok(sentences.join(" "))
}

struct Map<'a> {
    scene: &'a Scene,
    x: &'a Sweep,
    y: Option<&'a Sweep>,
    gains: Vec<Gain>,
}

impl Map<'_> {
    /// The damper that is unstable without any spring and any other damper, all over the map.
    fn damper_alone(&self) -> Result<Option<String>, SweepError> {
        let corners = self.corners()?;
        let dampers = self.gains.iter().filter(|gain| gain.damps && gain.value > 0.0);
        for damper in dampers.filter(|damper| !self.is_swept(damper.key)) {
            let growths: Vec<f64> =
                corners.iter().filter_map(|corner| self.growth_of(corner, damper)).collect();
            let least = growths.iter().copied().fold(f64::INFINITY, f64::min);
            if growths.len() == corners.len() && least > 1.0 + GROWTH {
                return Ok(Some(self.sentence(damper, least)));
            }
        }
        Ok(None)
    }

    /// How much the largest motion grows in a pattern while only one damper acts; `None` where that cannot be told.
    fn growth_of(&self, scene: &Scene, damper: &Gain) -> Option<f64> {
        let mut alone = scene.clone();
        for gain in self.gains.iter().filter(|gain| gain.damps && gain.key != damper.key) {
            alone = with_override(&alone, gain.key, 0.0).ok()?;
        }
        compile(&alone).into_iter().try_fold(0.0_f64, |largest, mode| {
            let map = without_springs(mode.spec).lift_shared().ok()?.matrix;
            Some(largest.max(spectral_radius(&eigenvalues(&map).ok()?)))
        })
    }

    fn sentence(&self, damper: &Gain, growth: f64) -> String {
        let alone = format!(
            "No point is stable: {} = {} is too much damping for samples that are held so long: alone, without any spring, it lets motions grow {growth:.3}-fold a pattern",
            damper.key, damper.value
        );
        match self.limit_of_held_damper(damper) {
            Some((share, limit)) => format!(
                "{alone} (b·T_t/m_h = {share:.2}, where a damper over samples that are held and this late must stay below 2·sin(π/(4n + 2)) = {limit:.2})."
            ),
            None => format!("{alone}."),
        }
    }

    /// Of a client's hand on the server's samples: how strong its damper is, and how strong it may be, if that is passed.
    fn limit_of_held_damper(&self, damper: &Gain) -> Option<(f64, f64)> {
        let scene = self.scene;
        let remote = "coupling.remote_hand_object.damping_n_s_per_m";
        let fixed = ["hand.mass_kg", "link.delay_periods", "rates.network_hz"];
        let applies = scene.session.architecture == Architecture::Centralized
            && damper.key == remote
            && !fixed.iter().any(|key| self.is_swept(key));
        let share = damper.value / (scene.rates.network_hz.hz() * scene.hand_impedance().mass_kg);
        let limit = 2.0 * (PI / f64::from(4 * scene.link.delay_periods + 2)).sin();
        (applies && share > limit).then_some((share, limit))
    }

    fn is_swept(&self, key: &str) -> bool {
        self.x.key == key || self.y.is_some_and(|y| y.key == key)
    }

    /// The scene at the corners of the map.
    fn corners(&self) -> Result<Vec<Scene>, SweepError> {
        let ends = |sweep: &Sweep| -> Vec<f64> {
            let values = sweep.values.values();
            values.first().into_iter().chain(values.last()).copied().collect()
        };
        let mut corners = Vec::new();
        for x in ends(self.x) {
            let scene = with_override(self.scene, &self.x.key, x)?;
            match self.y {
                None => corners.push(scene),
                Some(y) => {
                    for value in ends(y) {
                        corners.push(with_override(&scene, &y.key, value)?);
                    }
                }
            }
        }
        Ok(corners)
    }

    /// Which changes make some of the map stable.
    fn what_would_help(&self, progress: &(dyn Fn(f64) + Sync)) -> String {
        let mut changes = self.changes();
        let (count, done) = (changes.len(), AtomicUsize::new(0));
        let share_of = |(_, scene): &(String, Scene)| {
            let share = self.share_of_stable(scene);
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / count as f64);
            share
        };
        let shares: Vec<f64> = changes.par_iter().map(share_of).collect();
        let mut helpful: Vec<(f64, String)> = shares
            .into_iter()
            .zip(changes.drain(..).map(|(name, _)| name))
            .filter(|(share, _)| *share > 0.0)
            .collect();
        helpful.sort_by(|a, b| b.0.total_cmp(&a.0));
        helpful.truncate(MAX_CHANGES);
        let told: Vec<String> = helpful
            .iter()
            .map(|(share, name)| format!("{:.0} % with {name}", (100.0 * share).max(1.0)))
            .collect();
        if told.is_empty() {
            "No single change opens it: neither a shorter delay, nor twice the network rate, nor any other gain halved or doubled.".to_owned()
        } else {
            format!("Of the same map would be stable: {}.", told.join(", "))
        }
    }

    /// Changes of single things that are not swept, in words, and the scenes that they give.
    fn changes(&self) -> Vec<(String, Scene)> {
        let scene = self.scene;
        let mut changes = Vec::new();
        let mut set = |key: &str, value: f64, words: String| {
            if let Ok(changed) = with_override(scene, key, value) {
                changes.push((words, changed));
            }
        };
        if !self.is_swept("link.delay_periods") {
            for periods in (0..scene.link.delay_periods).rev() {
                let words = format!("link.delay_periods = {periods} instead of {}", scene.link.delay_periods);
                set("link.delay_periods", f64::from(periods), words);
            }
        }
        for &Gain { key, value, .. } in self.gains.iter().filter(|gain| !self.is_swept(gain.key)) {
            for (factor, word) in [(0.5, "halved"), (2.0, "doubled")] {
                set(key, factor * value, format!("{key} {word}"));
            }
        }
        let network = scene.rates.network_hz;
        if !self.is_swept("rates.network_hz")
            && let Ok(doubled) = Rate::new(2 * network.numerator(), network.denominator())
            && let Ok(changed) = scene.edit(|changed| changed.rates.network_hz = doubled)
        {
            changes.push((format!("rates.network_hz = {doubled} instead of {network}"), changed));
        }
        changes
    }

    /// On a coarse grid; none where it cannot be analysed.
    fn share_of_stable(&self, scene: &Scene) -> f64 {
        let keys: Vec<&str> = std::iter::once(self.x).chain(self.y).map(|sweep| sweep.key.as_str()).collect();
        let Ok(evaluator) = Evaluator::new(scene, &keys) else { return 0.0 };
        let looks = if evaluator.is_quick() { LOOKS } else { SLOW_LOOKS };
        let sample = |sweep: &Sweep| sample(sweep, looks);
        let rows = self.y.map_or_else(|| vec![None], |y| sample(y).into_iter().map(Some).collect());
        let points: Vec<Vec<f64>> = rows
            .into_iter()
            .flat_map(|y| sample(self.x).into_iter().map(move |x| std::iter::once(x).chain(y).collect()))
            .collect();
        let is_stable = |point: &&Vec<f64>| evaluator.is_stable_at(point).is_ok_and(|stable| stable);
        points.iter().filter(is_stable).count() as f64 / points.len() as f64
    }
}

/// So many values of a sweep at most, both ends among them.
fn sample(sweep: &Sweep, looks: usize) -> Vec<f64> {
    let values = sweep.values.values();
    let count = values.len().min(looks);
    (0..count).map(|index| values[index * (values.len() - 1) / (count - 1).max(1)]).collect()
}

/// The loop without forces that depend on positions.
fn without_springs(mut spec: LoopSpec) -> LoopSpec {
    let axes: Vec<usize> = spec.bodies.iter().map(|body| body.axes.len()).collect();
    let lines: Vec<Option<usize>> =
        spec.lines.iter().map(|line| line.signal.body().map(|body| axes[body.0])).collect();
    let strip = |coupling: &mut ForceGains| {
        coupling.terms.retain(|term| {
            let positions = match term.motion {
                Motion::Ground | Motion::Output(_) => None,
                Motion::Current(body) => Some(axes[body.0]),
                Motion::Held(line) => lines[line.0],
            };
            positions.is_none_or(|positions| term.number >= positions)
        });
    };
    for body in &mut spec.bodies {
        if let Dynamics::Plant(plant) | Dynamics::Sensed { plant, .. } = &mut body.dynamics {
            // A finger's states are positions, then velocities.
            let moves = body.axes.len();
            plant.a.view_mut((moves, 0), (moves, moves)).fill(0.0);
        }
    }
    for action in &mut spec.actions {
        if let Force::Gains(coupling) = &mut action.force {
            strip(coupling);
        }
    }
    for line in &mut spec.lines {
        if let Signal::Force(coupling) = &mut line.signal {
            strip(coupling);
        }
    }
    spec
}
