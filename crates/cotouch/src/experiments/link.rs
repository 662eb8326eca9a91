//! Table 1.1: what a link does to packets, by time-tagged packets that are sent back.

use std::net::{Ipv4Addr, SocketAddr};

use cotouch_net::{ProbeConfig, ProbeReport, Prober, SimulatedLink, reflect_probe};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Impairment;
use cotouch_scene::time::{LocalTime, Rate};
use serde_json::{Value as Json, json};

use super::outcome::{Claim, Experiment, Outcome};
use crate::probing;
use crate::progress::Stop;

pub(super) const TABLE_1_1: Experiment = Experiment {
    id: "table1.1",
    title: "Characteristics of a link: round trip, jitter, loss, packet rate",
    run,
};

const SEED_ROUND_TRIP_MS: f64 = 2.4395;
const SEED_RMS_JITTER_MS: f64 = 0.4871;
const SEED_PACKETS: f64 = 2.7e6;
const SEED_LOST: f64 = 2.0;
const SEED_RATE_HZ: f64 = 128.0;
/// 2.7 million packets in 36 minutes.
const RATE_HZ: u64 = 1250;
/// How long this computer's loopback is measured, s.
const LOOPBACK_S: f64 = 4.0;

fn run() -> anyhow::Result<Outcome> {
    let simulated = measure_simulated(&seeds_link())?;
    let loopback = measure_loopback()?;
    let near = |value: f64, seed: f64| (value / seed - 1.0).abs() < 0.05;
    let (mean_ms, jitter_ms) = (1e3 * simulated.round_trip.mean_s, 1e3 * simulated.round_trip.rms_jitter_s);
    let agrees = near(mean_ms, SEED_ROUND_TRIP_MS) && near(jitter_ms, SEED_RMS_JITTER_MS);
    let period_ms = 1e3 / SEED_RATE_HZ;
    let claims = vec![
        Claim::new(
            "the round trip is a fraction of the network period of 1/128 s",
            mean_ms < period_ms && 1e3 * loopback.round_trip.mean_s < period_ms,
        ),
        Claim::new("packet loss is negligible", simulated.loss_rate() < 1e-5),
    ];
    let row = |name: &str, seed: String, of: &dyn Fn(&ProbeReport) -> String| {
        [name.to_owned(), seed, format!("{}; this computer's loopback: {}", of(&simulated), of(&loopback))]
    };
    let rows = vec![
        row("mean round trip", format!("{SEED_ROUND_TRIP_MS} ms"), &|report| {
            format!("{:.4} ms", 1e3 * report.round_trip.mean_s)
        }),
        row("rms jitter", format!("{SEED_RMS_JITTER_MS} ms"), &|report| {
            format!("{:.4} ms", 1e3 * report.round_trip.rms_jitter_s)
        }),
        row("lost", "2 of 2.7 million".to_owned(), &|report| format!("{} of {}", report.lost, report.sent)),
        row("packet rate", "1/128 s".to_owned(), &|report| format!("{:.0} Hz", report.sent_rate_hz)),
    ];
    Ok(Outcome {
        published_value: json!({
            "round_trip_ms": SEED_ROUND_TRIP_MS,
            "rms_jitter_ms": SEED_RMS_JITTER_MS,
            "lost": SEED_LOST,
            "sent": SEED_PACKETS,
            "achievable_rate_hz": SEED_RATE_HZ,
        }),
        value: json!({ "simulated_link": to_json(&simulated), "loopback": to_json(&loopback) }),
        agrees,
        note: "The network of Fotoohi Ghiam 2006 is not here. Its numbers are given to a simulated link, and the probe finds them \
               again; beside that, the loopback of this computer, whose figures vary from run to run. 2.7 million \
               packets in 36 minutes are 1250 a second, not 128; that rate is used."
            .to_owned(),
        claims,
        rows,
        figure: None,
        table: None,
        commands: vec![
            "cotouch probe serve --listen 127.0.0.1:7801".to_owned(),
            "cotouch probe 127.0.0.1:7801 --rate 1250 --duration 60".to_owned(),
        ],
    })
}

fn to_json(report: &ProbeReport) -> Json {
    json!({
        "round_trip_ms": 1e3 * report.round_trip.mean_s,
        "rms_jitter_ms": 1e3 * report.round_trip.rms_jitter_s,
        "lost": report.lost,
        "sent": report.sent,
        "sent_rate_hz": report.sent_rate_hz,
    })
}

/// One way of a link with the seed's round trip: two independent exponential jitters make up its standard deviation.
fn seeds_link() -> Impairment {
    let jitter_s = 1e-3 * SEED_RMS_JITTER_MS / std::f64::consts::SQRT_2;
    let latency_s = 0.5e-3 * SEED_ROUND_TRIP_MS - jitter_s;
    Impairment { latency_s, jitter_s, loss_rate: 0.5 * SEED_LOST / SEED_PACKETS, ..Impairment::NONE }
}

fn config() -> anyhow::Result<ProbeConfig> {
    let duration_s = SEED_PACKETS / RATE_HZ as f64;
    Ok(ProbeConfig { rate_hz: Rate::new(RATE_HZ, 1)?, duration_s, datagram_bytes: 128, linger_s: 0.5, id: 1 })
}

/// The probe over two simulated links, there and back, in virtual time.
fn measure_simulated(way: &Impairment) -> anyhow::Result<ProbeReport> {
    let target = SocketAddr::from((Ipv4Addr::LOCALHOST, 1)).into();
    let (near, far) = (HostIndex(0), HostIndex(1));
    let mut there = SimulatedLink::new(way, 1, near, far);
    let mut back = SimulatedLink::new(way, 1, far, near);
    let mut prober = Prober::new(config()?, target, LocalTime(0));
    let mut now = LocalTime(0);
    while !prober.is_finished(now) {
        while let Some(transmit) = prober.poll_transmit(now) {
            there.send(now.0, &transmit.bytes);
        }
        while let Some((at, bytes)) = there.poll_delivery(now.0) {
            if let Some(echo) = reflect_probe(bytes) {
                back.send(at, &echo);
            }
        }
        while let Some((at, bytes)) = back.poll_delivery(now.0) {
            prober.handle_datagram(LocalTime(at), target, bytes);
        }
        let due = prober.poll_timeout().map(|time| time.0);
        let next = [due, there.next_delivery(), back.next_delivery()].into_iter().flatten().min();
        let Some(next) = next else { break };
        now = LocalTime(next.max(now.0 + 1));
    }
    Ok(prober.report())
}

/// The probe over this computer's loopback, in real time.
fn measure_loopback() -> anyhow::Result<ProbeReport> {
    let reflector = probing::Reflector::listen(SocketAddr::from((Ipv4Addr::LOCALHOST, 0)).into())?;
    let (ticket, stop) = (reflector.ticket(), Stop::default());
    std::thread::scope(|scope| {
        let serving = scope.spawn(|| reflector.run(&stop));
        let mut prober = probing::LinkProbe::connect(ticket, &stop)?;
        let report = prober.measure(Rate::new(RATE_HZ, 1)?, LOOPBACK_S, &stop, &mut |_| {});
        stop.set();
        serving.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        report
    })
}
