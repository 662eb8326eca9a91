//! What a run's hosts leave behind, put together into a [`Summary`].

use std::collections::BTreeMap;
use std::sync::Arc;

use cotouch_device::Device;
use cotouch_host::SlowFrame;
use cotouch_net::{Endpoint, Expelled, LinkStatistics, Rejections, printable};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Body, Scene};
use cotouch_scene::time::SessionTime;
use cotouch_world::BodyState;
use glam::DVec3;
use hdrhistogram::Histogram;

use crate::faults::DeviceFaults;
use crate::observer::{Diverged, RunVerdict, Shaking};
use crate::settings_log::SettingsRun;
use crate::slow::{SlowCounts, SlowPort};
use crate::station::Station;
use crate::summary::{
    DeviceFaultSummary, DivergedSummary, ExpelledSummary, HapticSummary, LatenessSummary, NetworkSummary,
    ObjectSummary, PassivitySummary, Percentiles, RoundTripSummary, SettingsSummary, ShakingSummary,
    SoftSummary, Summary,
};
use crate::timing::Timing;

/// What one host leaves behind.
#[derive(Clone, Debug)]
pub(crate) struct HostRun {
    host: HostIndex,
    bodies: Vec<BodyState>,
    verdict: RunVerdict,
    diverged: Option<Diverged>,
    shaking: Vec<Shaking>,
    judged_ticks: u64,
    settings: Vec<SettingsRun>,
    settings_left_out: u32,
    peak_force_n: f64,
    energy_j: f64,
    passivity: PassivitySummary,
    device_faults: Option<DeviceFaultSummary>,
    soft: Option<SoftRun>,
    late_packets: u64,
    data_excess_periods: u32,
    timing: Timing,
    links: Vec<LinkStatistics>,
    expelled: Vec<Expelled>,
}

impl HostRun {
    pub(crate) fn new<D: Device>(station: &Station<D>, timing: Timing) -> Self {
        Self {
            host: station.model.host,
            bodies: station.state.host.bodies.clone(),
            verdict: station.observer.verdict(),
            diverged: station.observer.diverged(),
            shaking: station.observer.shaking().collect(),
            judged_ticks: station.observer.judged_ticks(),
            settings: station.settings().runs(&station.observer),
            settings_left_out: station.settings().left_out(),
            peak_force_n: station.peak_force_n(),
            energy_j: station.energy_j(),
            passivity: station.passivity(),
            device_faults: device_faults(station.device_faults()),
            soft: station.soft().map(|port| SoftRun::new(station, port)),
            late_packets: station.state.host.peers.iter().map(|peer| peer.samples.counts().late).sum(),
            data_excess_periods: station.data_age().excess_periods(),
            timing,
            links: Vec::new(),
            expelled: Vec::new(),
        }
    }

    /// The same with what its end of the session has seen of its peers.
    pub(crate) fn with_network(mut self, endpoint: &Endpoint) -> Self {
        self.links = endpoint.peers().filter_map(|peer| endpoint.statistics(peer.host)).collect();
        self.expelled = endpoint.expelled().to_vec();
        self
    }
}

/// What its soft object leaves behind.
#[derive(Clone, Debug)]
struct SoftRun {
    counts: SlowCounts,
    rest: Arc<SlowFrame>,
    in_use: Arc<SlowFrame>,
}

impl SoftRun {
    fn new<D: Device>(station: &Station<D>, port: &SlowPort) -> Self {
        let (rest, frame) = (port.rest_frame(), &station.state.host.soft.frame);
        Self { counts: port.counts().clone(), in_use: frame.as_ref().unwrap_or(&rest).clone(), rest }
    }

    /// Where it is, in the form of any other object. `triangles` are of its surface.
    fn object(&self, triangles: &[[u32; 3]]) -> ObjectSummary {
        let mut nodes = triangles.concat();
        nodes.sort_unstable();
        nodes.dedup();
        let positions_m = &self.in_use.positions_m;
        let sum: DVec3 = nodes.iter().filter_map(|&node| positions_m.get(node as usize)).sum();
        let moved = positions_m.iter().zip(&self.rest.positions_m).map(|(at, rest)| at.distance(*rest));
        ObjectSummary {
            name: "soft".to_owned(),
            position_m: (sum / nodes.len().max(1) as f64).to_array(),
            orientation_wxyz: [1.0, 0.0, 0.0, 0.0],
            max_displacement_m: Some(moved.fold(0.0, f64::max)),
        }
    }
}

/// The summary of the hosts of this process after `duration_s` of session time.
pub(crate) fn summarise(scene: &Scene, duration_s: f64, runs: &[HostRun]) -> Summary {
    let mut summary = Summary::new(scene);
    summary.duration_s = duration_s;
    summary.verdict = runs.iter().map(|run| run.verdict).max().unwrap_or_default();
    summary.stable = summary.verdict == RunVerdict::Quiet;
    summary.diverged = diverged(scene, runs);
    summary.shaking = shaking(scene, runs);
    let judged_ticks = runs.iter().map(|run| run.judged_ticks).min().unwrap_or(0);
    summary.judged_s = judged_ticks as f64 * scene.rates.control_hz.period_s();
    summary.predictions = predictions(scene, runs);
    summary.predictions_left_out = runs.iter().map(|run| run.settings_left_out).max().unwrap_or(0);
    summary.haptic = haptic(runs);
    summary.network = network(runs);
    summary.lateness = lateness(scene, runs);
    summary.expelled = expelled(scene, runs);
    summary.soft = soft(runs);
    summary.objects = runs.first().map(|run| objects(scene, run)).unwrap_or_default();
    for run in runs {
        if let Some(user) = summary.users_detail.get_mut(run.host.index()) {
            (user.peak_force_n, user.energy_j) = (Some(run.peak_force_n), Some(run.energy_j));
            user.passivity = Some(run.passivity);
            user.device_faults.clone_from(&run.device_faults);
        }
    }
    summary
}

fn device_faults(faults: &DeviceFaults) -> Option<DeviceFaultSummary> {
    let summary = || DeviceFaultSummary { ticks: faults.ticks(), last: faults.last().to_string() };
    (faults.ticks() > 0).then(summary)
}

fn user_name(scene: &Scene, host: HostIndex) -> String {
    scene.users.get(host.index()).map(|user| user.name.clone()).unwrap_or_default()
}

/// The first of all hosts.
fn diverged(scene: &Scene, runs: &[HostRun]) -> Option<DivergedSummary> {
    let hosts = runs.iter().filter_map(|run| Some((run.host, run.diverged?)));
    let (host, Diverged { cause, tick, finger }) = hosts.min_by_key(|(_, diverged)| diverged.tick)?;
    Some(DivergedSummary {
        cause,
        user: finger.map(|_| user_name(scene, host)),
        finger: finger.map(|finger| finger + 1),
        at_s: scene.rates.control_hz.instant(tick).as_secs_f64(),
    })
}

/// By whom and in which order they were.
fn expelled(scene: &Scene, runs: &[HostRun]) -> Vec<ExpelledSummary> {
    let told = |by: HostIndex, expelled: &Expelled| ExpelledSummary {
        user: user_name(scene, expelled.host),
        by: user_name(scene, by),
        reason: printable(&expelled.reason),
        at_s: expelled.at.map(SessionTime::as_secs_f64),
    };
    runs.iter().flat_map(|run| run.expelled.iter().map(move |expelled| told(run.host, expelled))).collect()
}

/// User by user, finger by finger.
fn shaking(scene: &Scene, runs: &[HostRun]) -> Vec<ShakingSummary> {
    let seconds = |tick: u64| scene.rates.control_hz.instant(tick).as_secs_f64();
    let of = |run: &HostRun| {
        let user = user_name(scene, run.host);
        let told = move |&Shaking { finger, from, to, rms_n, hz }: &Shaking| ShakingSummary {
            user: user.clone(),
            finger: finger + 1,
            from_s: seconds(from),
            to_s: seconds(to + 1),
            rms_n,
            hz,
        };
        run.shaking.iter().map(told).collect::<Vec<_>>()
    };
    runs.iter().flat_map(of).collect()
}

/// One a set of settings, of all hosts together; the analysis has yet to say something of each.
fn predictions(scene: &Scene, runs: &[HostRun]) -> Vec<SettingsSummary> {
    let instant_s = |tick: u64| scene.rates.control_hz.instant(tick).as_secs_f64();
    let mut stretches: BTreeMap<u64, SettingsSummary> = BTreeMap::new();
    for SettingsRun { scene: ran, seen } in runs.iter().flat_map(|run| &run.settings) {
        let judged_s = seen.judged_ticks as f64 * scene.rates.control_hz.period_s();
        let stretch = stretches.entry(seen.from).or_insert_with(|| SettingsSummary {
            from_s: instant_s(seen.from),
            to_s: instant_s(seen.to),
            settings: SettingsSummary::differences(ran, scene),
            stable: None,
            spectral_radius: None,
            verdict: seen.verdict,
            shaking: 0,
            judged_s,
            scene: Some(Arc::clone(ran)),
        });
        stretch.verdict = RunVerdict::worse(stretch.verdict, seen.verdict);
        stretch.judged_s = stretch.judged_s.min(judged_s);
        stretch.shaking += seen.shaking;
    }
    stretches.into_values().collect()
}

fn haptic(runs: &[HostRun]) -> HapticSummary {
    let total = |count: fn(&Timing) -> u64| runs.iter().map(|run| count(&run.timing)).sum::<u64>();
    let (ticks, missed) = (total(|timing| timing.ticks), total(|timing| timing.missed));
    HapticSummary {
        hosts: runs.len() as u32,
        due: ticks + missed,
        ticks,
        missed,
        stood_still: 0,
        compute_us: percentiles(runs, |timing| &timing.compute_ns),
        lateness_us: percentiles(runs, |timing| &timing.lateness_ns),
    }
}

fn lateness(scene: &Scene, runs: &[HostRun]) -> LatenessSummary {
    let period_ns = (1e9 * scene.rates.control_hz.period_s()) as u64;
    let latest = |run: &HostRun| (!run.timing.lateness_ns.is_empty()).then(|| run.timing.lateness_ns.max());
    LatenessSummary {
        missed_ticks: runs.iter().map(|run| run.timing.missed).sum(),
        late_ticks: runs.iter().map(|run| run.timing.late_ticks(period_ns)).sum(),
        worst_tick_ms: runs.iter().filter_map(latest).max().map(|latest_ns| latest_ns as f64 * 1e-6),
        late_packets: runs.iter().map(|run| run.late_packets).sum(),
        data_excess_periods: runs.iter().map(|run| run.data_excess_periods).max().unwrap_or(0),
        predicted_for: None,
    }
}

fn soft(runs: &[HostRun]) -> Option<SoftSummary> {
    let mut counts = runs.iter().filter_map(|run| run.soft.as_ref()).map(|soft| &soft.counts);
    let mut all = counts.next()?.clone();
    for other in counts {
        all.steps += other.steps;
        all.late += other.late;
        all.missed += other.missed;
        all.compute_ns.add(&other.compute_ns).expect("all have the same bounds");
    }
    let compute_us = Percentiles::of_nanoseconds(&all.compute_ns);
    Some(SoftSummary { steps: all.steps, late: all.late, missed: all.missed, compute_us })
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
        stale: links().map(|link| link.stale).sum(),
        implausible: links().map(|link| link.implausible).sum(),
        // Known to those who have the links: nothing is rejected on simulated ones.
        rejected: Rejections::default(),
        receive_buffer_bytes: None,
        round_trip_ms: round_trip(links()),
    }
}

/// Mean and standard deviation of all round trips of all links together.
fn round_trip<'a>(links: impl Iterator<Item = &'a LinkStatistics>) -> RoundTripSummary {
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for link in links {
        let trips = link.round_trip;
        let (n, mean, jitter) = (trips.count as f64, trips.mean_s * 1e3, trips.rms_jitter_s * 1e3);
        count += n;
        sum += n * mean;
        squares += n * (jitter * jitter + mean * mean);
    }
    if count == 0.0 {
        return RoundTripSummary::default();
    }
    let mean = sum / count;
    RoundTripSummary { mean: Some(mean), rms_jitter: Some((squares / count - mean * mean).max(0.0).sqrt()) }
}

fn objects(scene: &Scene, run: &HostRun) -> Vec<ObjectSummary> {
    let object = |(body, state): (Body, &BodyState)| {
        let turn = state.pose.orientation;
        ObjectSummary {
            name: body.name,
            position_m: state.pose.position.to_array(),
            orientation_wxyz: [turn.w, turn.x, turn.y, turn.z],
            max_displacement_m: None,
        }
    };
    let rigid = scene.world_bodies().into_iter().zip(&run.bodies).map(object);
    let soft = run.soft.as_ref().zip(scene.soft.nodes.as_ref());
    rigid.chain(soft.map(|(soft, mesh)| soft.object(&mesh.triangles))).collect()
}
