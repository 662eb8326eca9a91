//! What a run looked like, in bounded memory however long it was: the least and the largest value a stretch of time.

use cotouch_runtime::record::TickRecord;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Scene, Space};

/// Stretches that a curve is cut into, at most.
const MOST_BINS: usize = 1024;

/// What every host's user felt, and where things were along the axis that the picture shows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Trace {
    /// Whether everything moves along the axis.
    pub(crate) is_line: bool,
    /// One entry a host.
    pub(crate) hosts: Vec<HostTrace>,
}

/// One host's curves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HostTrace {
    /// The user's name.
    pub(crate) user: String,
    /// Force on each finger, N: along the axis on a line, its size elsewhere.
    pub(crate) forces_n: Vec<Envelope>,
    /// Where each finger was, m.
    pub(crate) fingers_m: Vec<Envelope>,
    /// Where this host's copy of each body was, m.
    pub(crate) bodies_m: Vec<Envelope>,
}

impl Trace {
    /// An empty trace of `scene`.
    pub(crate) fn new(scene: &Scene) -> Self {
        let period_s = scene.rates.control_hz.period_s();
        let bodies = scene.world_bodies().len();
        let curves = |count: usize| vec![Envelope::new(period_s); count];
        let host = |user: &cotouch_scene::scene::User| HostTrace {
            user: user.name.clone(),
            forces_n: curves(user.fingers.len()),
            fingers_m: curves(user.fingers.len()),
            bodies_m: curves(bodies),
        };
        Self { is_line: scene.space == Space::Line, hosts: scene.users.iter().map(host).collect() }
    }

    /// Takes one tick.
    pub(crate) fn observe(&mut self, host: HostIndex, tick: &TickRecord) {
        let Some(trace) = self.hosts.get_mut(host.index()) else { return };
        let time_s = tick.instant.as_secs_f64();
        for (curve, wrench) in trace.forces_n.iter_mut().zip(&tick.commanded) {
            curve.push(time_s, if self.is_line { wrench.force.x } else { wrench.force.length() });
        }
        for (curve, reading) in trace.fingers_m.iter_mut().zip(&tick.readings) {
            curve.push(time_s, reading.pose.position.x);
        }
        for (curve, body) in trace.bodies_m.iter_mut().zip(&tick.bodies) {
            curve.push(time_s, body.pose.position.x);
        }
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
        Self { bin_s: period_s, bins: Vec::with_capacity(MOST_BINS) }
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
                if self.bins.len() >= MOST_BINS {
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
        let mut halved: Vec<Bin> = Vec::with_capacity(MOST_BINS);
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
        assert!(curve.points().count() <= 2 * MOST_BINS);
        let largest = curve.points().map(|point| point.1).fold(f64::MIN, f64::max);
        assert!(largest > 6.0, "{largest}");
        let (start, end) = (curve.points().next().unwrap().0, curve.points().last().unwrap().0);
        assert!((0.0..2.0).contains(&start) && (990.0..=1000.0).contains(&end), "{start} {end}");
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
