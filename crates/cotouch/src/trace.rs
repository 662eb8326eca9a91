//! What a run looked like, in bounded memory however long it was: the least and the largest value a stretch of time, and
//! paths thinned by halves.

use cotouch_runtime::{RecordItem, RecordKind, SurfaceRecord, TickRecord};
use cotouch_scene::geometry::Pose;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Scene, Space};
use glam::DVec3;

/// Stretches that a curve is cut into, at most.
const MAX_BINS: usize = 1024;

/// Points of a path, at most.
const MAX_POSES: usize = 1024;

/// What every host's user felt and where things were.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Trace {
    /// One entry a host.
    pub(crate) hosts: Vec<HostTrace>,
    /// The soft object at the first host that simulates one.
    pub(crate) soft: SoftTrace,
    /// On a line the force along it, else its magnitude.
    on_a_line: bool,
}

/// One host's curves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HostTrace {
    /// The user's name.
    pub(crate) user: String,
    /// One entry a finger.
    pub(crate) fingers: Vec<FingerTrace>,
    /// This host's copy of every body that is not fixed.
    pub(crate) bodies: Vec<BodyTrace>,
}

/// One finger's curves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FingerTrace {
    /// What the device rendered, N.
    pub(crate) force_n: Envelope,
    /// Position along x, m.
    pub(crate) x_m: Envelope,
    /// Where it went.
    pub(crate) path: Path,
}

/// One body's curves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BodyTrace {
    /// Which of the scene's bodies.
    pub(crate) body: usize,
    /// Position along x, m.
    pub(crate) x_m: Envelope,
    /// Where it went.
    pub(crate) path: Path,
}

impl Trace {
    /// An empty trace of `scene`.
    pub(crate) fn new(scene: &Scene) -> Self {
        let period_s = scene.rates.control_hz.period_s();
        let envelope = || Envelope::new(period_s);
        let finger = || FingerTrace { force_n: envelope(), x_m: envelope(), path: Path::default() };
        let bodies = scene.world_bodies();
        let moving = || bodies.iter().enumerate().filter(|(_, body)| !body.fixed);
        let host = |user: &cotouch_scene::scene::User| HostTrace {
            user: user.name.clone(),
            fingers: user.fingers.iter().map(|_| finger()).collect(),
            bodies: moving()
                .map(|(body, _)| BodyTrace { body, x_m: envelope(), path: Path::default() })
                .collect(),
        };
        Self {
            hosts: scene.users.iter().map(host).collect(),
            soft: SoftTrace::new(scene),
            on_a_line: scene.space == Space::Line,
        }
    }

    /// Takes what a host recorded.
    pub(crate) fn observe(&mut self, item: &RecordItem) {
        match &item.kind {
            RecordKind::Tick(tick) => self.tick(item.host, tick),
            RecordKind::Surface(surface) => self.soft.observe(item.host, surface),
            _ => {}
        }
    }

    fn tick(&mut self, host: HostIndex, tick: &TickRecord) {
        let Some(trace) = self.hosts.get_mut(host.index()) else { return };
        let time_s = tick.instant.as_secs_f64();
        for (trace, (reading, commanded)) in
            trace.fingers.iter_mut().zip(tick.readings.iter().zip(&tick.commanded))
        {
            let force = commanded.force;
            trace.force_n.push(time_s, if self.on_a_line { force.x } else { force.length() });
            trace.x_m.push(time_s, reading.pose.position.x);
            trace.path.push(reading.pose);
        }
        for trace in &mut trace.bodies {
            let Some(body) = tick.bodies.get(trace.body) else { continue };
            trace.x_m.push(time_s, body.pose.position.x);
            trace.path.push(body.pose);
        }
    }
}

/// A soft object when it was deformed most.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SoftTrace {
    /// The nodes at rest, m.
    at_rest_m: Vec<DVec3>,
    /// Whose copy it is.
    host: Option<HostIndex>,
    /// The nodes then, m, and the sum of their squared displacements, m².
    most: Option<(Vec<DVec3>, f64)>,
}

impl SoftTrace {
    fn new(scene: &Scene) -> Self {
        let at_rest_m = scene.soft.nodes.as_ref().map(|mesh| mesh.nodes_m.clone()).unwrap_or_default();
        Self { at_rest_m, host: None, most: None }
    }

    fn observe(&mut self, host: HostIndex, surface: &SurfaceRecord) {
        if *self.host.get_or_insert(host) != host || surface.positions_m.len() != self.at_rest_m.len() {
            return;
        }
        let nodes = || surface.positions_m.iter().map(|&node| glam::Vec3::from_array(node).as_dvec3());
        let moved: f64 = nodes().zip(&self.at_rest_m).map(|(now, rest)| now.distance_squared(*rest)).sum();
        let most = self.most.as_ref().map_or(0.0, |&(_, most)| most);
        if moved.is_finite() && moved > most {
            self.most = Some((nodes().collect(), moved));
        }
    }

    /// The nodes when their mean square displacement was largest, m.
    pub(crate) fn most_deformed(&self) -> Option<&[DVec3]> {
        self.most.as_ref().map(|(nodes, _)| nodes.as_slice())
    }
}

/// Poses at equal intervals, which double when there are too many; the last one always.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Path {
    kept: Vec<Pose>,
    last: Option<Pose>,
    seen: u64,
    /// Every `2^halvings`-th pose is kept.
    halvings: u32,
}

impl Path {
    /// Takes the next pose.
    pub(crate) fn push(&mut self, pose: Pose) {
        if !pose.position.is_finite() {
            return;
        }
        if self.seen.is_multiple_of(1 << self.halvings) {
            if self.kept.len() == MAX_POSES {
                self.kept = self.kept.iter().step_by(2).copied().collect();
                self.halvings += 1;
            }
            if self.seen.is_multiple_of(1 << self.halvings) {
                self.kept.push(pose);
            }
        }
        self.seen += 1;
        self.last = Some(pose);
    }

    /// All that is kept, and the last one.
    pub(crate) fn poses(&self) -> impl Iterator<Item = Pose> + Clone {
        self.kept.iter().copied().chain(self.last)
    }

    /// The same without orientations.
    pub(crate) fn points(&self) -> impl Iterator<Item = DVec3> + Clone {
        self.poses().map(|pose| pose.position)
    }

    /// The first pose and the last one.
    pub(crate) fn ends(&self) -> Option<(Pose, Pose)> {
        Some((*self.kept.first()?, self.last?))
    }
}

/// A curve as the least and the largest value in stretches of equal length. When there are too many stretches, pairs of
/// them become one. Values that are no numbers are left out.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Envelope {
    bin_s: f64,
    bins: Vec<Bin>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Bin {
    index: u64,
    /// Time (s) and value.
    least: (f64, f64),
    largest: (f64, f64),
}

impl Envelope {
    /// An empty curve whose values come every `period_s`.
    pub(crate) fn new(period_s: f64) -> Self {
        Self { bin_s: period_s, bins: Vec::with_capacity(MAX_BINS) }
    }

    /// Takes a value; times do not go backwards.
    pub(crate) fn push(&mut self, time_s: f64, value: f64) {
        if !value.is_finite() {
            return;
        }
        // Half a period makes the index of a tick safe from rounding.
        let index = (time_s / self.bin_s + 0.5) as u64;
        let point = (time_s, value);
        match self.bins.last_mut() {
            Some(bin) if bin.index == index => bin.take(point),
            _ => {
                self.bins.push(Bin { index, least: point, largest: point });
                if self.bins.len() >= MAX_BINS {
                    self.halve();
                }
            }
        }
    }

    /// The curve as points, in the order of time: the least and the largest value of every stretch, each when it was.
    pub(crate) fn points(&self) -> impl Iterator<Item = (f64, f64)> {
        self.bins.iter().flat_map(|bin| {
            let (first, second) = if bin.least.0 <= bin.largest.0 {
                (bin.least, bin.largest)
            } else {
                (bin.largest, bin.least)
            };
            [Some(first), (second != first).then_some(second)].into_iter().flatten()
        })
    }

    fn halve(&mut self) {
        self.bin_s *= 2.0;
        let mut halved: Vec<Bin> = Vec::with_capacity(MAX_BINS);
        for bin in &self.bins {
            let index = bin.index / 2;
            match halved.last_mut() {
                Some(last) if last.index == index => {
                    last.take(bin.least);
                    last.take(bin.largest);
                }
                _ => halved.push(Bin { index, ..*bin }),
            }
        }
        self.bins = halved;
    }
}

impl Bin {
    fn take(&mut self, point: (f64, f64)) {
        if point.1 < self.least.1 {
            self.least = point;
        }
        if point.1 > self.largest.1 {
            self.largest = point;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_survive_and_memory_is_bounded() {
        let mut curve = Envelope::new(1e-3);
        for tick in 0..1_000_000_u32 {
            let spike = if tick == 123_456 { 7.0 } else { 0.0 };
            curve.push(f64::from(tick) * 1e-3, (f64::from(tick) * 0.1).sin() + spike);
        }
        assert!(curve.points().count() <= 2 * MAX_BINS);
        let largest = curve.points().map(|point| point.1).fold(f64::MIN, f64::max);
        assert!(largest > 6.0, "{largest}");
        let (start, end) = (curve.points().next().unwrap().0, curve.points().last().unwrap().0);
        assert!((0.0..2.0).contains(&start) && (990.0..=1000.0).contains(&end), "{start} {end}");
    }

    #[test]
    fn a_path_keeps_its_ends_and_its_memory_is_bounded() {
        let mut path = Path::default();
        for tick in 0..100_001_u32 {
            path.push(Pose::at(DVec3::X * f64::from(tick)));
        }
        assert!(path.poses().count() <= MAX_POSES + 1);
        let (first, last) = path.ends().unwrap();
        assert_eq!((first.position.x, last.position.x), (0.0, 100_000.0));
        let steps: Vec<f64> = path.points().map(|point| point.x).collect();
        assert!(steps.windows(2).all(|pair| pair[1] > pair[0] || pair[1] == 100_000.0));
    }

    #[test]
    fn a_short_curve_is_kept_as_it_is() {
        let mut curve = Envelope::new(0.5);
        for (time_s, value) in [(0.0, 1.0), (0.5, 2.0), (1.0, f64::NAN), (1.5, -1.0)] {
            curve.push(time_s, value);
        }
        assert_eq!(curve.points().collect::<Vec<_>>(), [(0.0, 1.0), (0.5, 2.0), (1.5, -1.0)]);
    }
}
