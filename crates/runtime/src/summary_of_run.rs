//! What a run's hosts leave behind, put together into a [`Summary`].

use cotouch_device::device::Device;
use cotouch_net::statistics::LinkStatistics;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Body, Scene};
use cotouch_world::rigid::BodyState;
use hdrhistogram::Histogram;

use crate::haptic_loop::Timing;
use crate::monitor;
use crate::station::Station;
use crate::summary::{
    HapticSummary, Instability, NetworkSummary, ObjectSummary, Percentiles, RoundTrip, Summary,
};

/// What one host leaves behind.
#[derive(Clone, Debug)]
pub(crate) struct HostRun {
    host: HostIndex,
    bodies: Vec<BodyState>,
    diverged: bool,
    limits_exceeded: bool,
    /// Oscillation energy in the last quarter but one and in the last, J.
    oscillation_j: (f64, f64),
    peak_force_n: f64,
    energy_j: f64,
    timing: Timing,
    links: Vec<LinkStatistics>,
}

impl HostRun {
    pub(crate) fn new<D: Device>(station: &Station<D>, timing: Timing, links: Vec<LinkStatistics>) -> Self {
        Self {
            host: station.model.host,
            bodies: station.state.host.bodies.clone(),
            diverged: station.state.host.diverged,
            limits_exceeded: station.limits.is_exceeded(station.model.schedule.control()),
            oscillation_j: station.oscillation.last_two_quarters_j(),
            peak_force_n: station.peak_force_n(),
            energy_j: station.energy_j(),
            timing,
            links,
        }
    }
}

/// The summary of the hosts of this process after `duration_s` of session time.
pub(crate) fn summarise(scene: &Scene, duration_s: f64, runs: &[HostRun]) -> Summary {
    let mut summary = Summary::new(scene);
    summary.duration_s = duration_s;
    summary.instability = instability(runs);
    summary.stable = summary.instability.is_none();
    summary.haptic = haptic(runs);
    summary.network = network(runs);
    summary.objects = runs.first().map(|run| objects(scene, run)).unwrap_or_default();
    for run in runs {
        if let Some(user) = summary.users_detail.get_mut(run.host.index()) {
            (user.peak_force_n, user.energy_j) = (Some(run.peak_force_n), Some(run.energy_j));
        }
    }
    summary
}

fn instability(runs: &[HostRun]) -> Option<Instability> {
    let before_j = runs.iter().map(|run| run.oscillation_j.0).sum();
    let last_j = runs.iter().map(|run| run.oscillation_j.1).sum();
    if runs.iter().any(|run| run.diverged) {
        Some(Instability::Diverged)
    } else if runs.iter().any(|run| run.limits_exceeded) {
        Some(Instability::GovernorLimit)
    } else {
        monitor::grows(before_j, last_j).then_some(Instability::EnergyGrowth)
    }
}

fn haptic(runs: &[HostRun]) -> HapticSummary {
    let total = |count: fn(&Timing) -> u64| runs.iter().map(|run| count(&run.timing)).sum::<u64>();
    let (ticks, missed) = (total(|timing| timing.ticks), total(|timing| timing.missed));
    HapticSummary {
        hosts: runs.len() as u32,
        due: ticks + missed,
        ticks,
        missed,
        compute_us: percentiles(runs, |timing| &timing.compute_ns),
        lateness_us: percentiles(runs, |timing| &timing.lateness_ns),
    }
}

fn percentiles(runs: &[HostRun], of: fn(&Timing) -> &Histogram<u64>) -> Percentiles {
    let mut histograms = runs.iter().map(|run| of(&run.timing));
    let Some(mut all) = histograms.next().cloned() else { return Percentiles::default() };
    for histogram in histograms {
        all.add(histogram).expect("all have the same bounds");
    }
    Percentiles::of_nanoseconds(&all)
}

fn network(runs: &[HostRun]) -> NetworkSummary {
    let links = || runs.iter().flat_map(|run| &run.links);
    NetworkSummary {
        sent: links().map(|link| link.sent).sum(),
        received: links().map(|link| link.sequence.received).sum(),
        lost: links().map(|link| link.sequence.lost).sum(),
        round_trip_ms: round_trip(links()),
    }
}

/// Mean and standard deviation of all round trips of all links together.
fn round_trip<'a>(links: impl Iterator<Item = &'a LinkStatistics>) -> RoundTrip {
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for link in links {
        let trips = link.round_trip;
        let (n, mean, jitter) = (trips.count as f64, trips.mean_s * 1e3, trips.rms_jitter_s * 1e3);
        count += n;
        sum += n * mean;
        squares += n * (jitter * jitter + mean * mean);
    }
    if count == 0.0 {
        return RoundTrip::default();
    }
    let mean = sum / count;
    RoundTrip { mean: Some(mean), rms_jitter: Some((squares / count - mean * mean).max(0.0).sqrt()) }
}

fn objects(scene: &Scene, run: &HostRun) -> Vec<ObjectSummary> {
    let object = |(body, state): (Body, &BodyState)| {
        let turn = state.pose.orientation;
        ObjectSummary {
            name: body.name,
            position_m: state.pose.position.to_array(),
            orientation_wxyz: [turn.w, turn.x, turn.y, turn.z],
        }
    };
    scene.world_bodies().into_iter().zip(&run.bodies).map(object).collect()
}
