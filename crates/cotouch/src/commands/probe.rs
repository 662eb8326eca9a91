//! `cotouch probe`: one end measures a link, the other sends its packets back.

use std::fmt::Write as _;
use std::time::Duration;

use cotouch_net::{ProbeReport, RateSweep, Route};
use cotouch_scene::time::Rate;
use serde_json::{Value, json};

use super::address::{post, ticket};
use crate::arguments::Probe;
use crate::failure::{Failure, Verdict};
use crate::output::Output;
use crate::probing::{LinkProbe, Reflector};
use crate::progress::{Progress, Stop};
use crate::tickets;

/// How long to wait for a reflector on the same computer to come.
const PATIENCE: Duration = Duration::from_secs(1);
/// Rates that a sweep stops at, Hz.
const HIGHEST_SWEEP_HZ: f64 = 64_000.0;
/// How much of a sweep the bar calls done after a rate; the number of rates is not known beforehand.
const SWEEP_SHARE: f64 = 0.1;

/// Sends probes back until Ctrl-C.
pub(super) fn serve(listen: Route, output: &Output) -> Result<Verdict, Failure> {
    let stop = Stop::on_interrupt()?;
    let reflector = Reflector::listen(listen)?;
    let ticket = reflector.ticket();
    let _posted = post(ticket);
    output.say(format_args!("measure with: cotouch probe {}", tickets::for_others(ticket)));
    tell!("sending probes back at {}; Ctrl-C ends it", ticket.address);
    let reflected = reflector.run(&stop)?;
    output.answer_as(&json!({ "reflected": reflected }), &format!("{reflected} probes sent back"))?;
    Ok(Verdict::Good)
}

/// Measures the link to `probe.server`.
pub(super) fn probe(probe: &Probe, output: &Output) -> Result<Verdict, Failure> {
    let stop = Stop::on_interrupt()?;
    let ticket = ticket(&probe.server, "cotouch probe serve", PATIENCE, &stop)?;
    let server = ticket.address;
    let mut prober = LinkProbe::connect(ticket, &stop)?;
    let progress = output.progress(&format!("probing {server}"));
    let share = if probe.sweep { SWEEP_SHARE } else { 1.0 };
    let report =
        prober.measure(probe.rate, probe.duration_s, &stop, &mut |done| progress.show(share * done))?;
    if report.received == 0 {
        let reason = format!(
            "nothing came back from {server}; is `cotouch probe serve` running there, and do datagrams get through?"
        );
        return Err(Failure::Running(anyhow::anyhow!(reason)));
    }
    let achievable_hz =
        if probe.sweep { sweep(probe, &mut prober, &report, &stop, &progress)? } else { None };
    drop(progress);
    let text = text(server, probe, &report, achievable_hz);
    output.answer_and_file(
        &to_json(probe, &report, achievable_hz),
        &text,
        &link_file(server, probe, &report),
    )?;
    Ok(Verdict::Good)
}

/// The largest rate with less than 0.1 % lost, from the first one upwards.
fn sweep(
    probe: &Probe,
    prober: &mut LinkProbe,
    first: &ProbeReport,
    stop: &Stop,
    progress: &Progress,
) -> anyhow::Result<Option<f64>> {
    let mut sweep = RateSweep::new(probe.rate.hz(), HIGHEST_SWEEP_HZ);
    sweep.record(probe.rate.hz(), first);
    let mut done = SWEEP_SHARE;
    while let Some(hz) = sweep.next_rate().filter(|_| !stop.is_set()) {
        let rate = Rate::new((hz * 1000.0).round() as u64, 1000)?;
        let report = prober.measure(rate, probe.duration_s, stop, &mut |_| {})?;
        sweep.record(hz, &report);
        done += SWEEP_SHARE * (1.0 - done);
        progress.show(done);
    }
    Ok(sweep.achievable_rate_hz())
}

/// Milliseconds, or nothing where nothing came back.
fn milliseconds(report: &ProbeReport, seconds: f64) -> Option<f64> {
    (report.round_trip.count > 0).then_some(seconds * 1e3)
}

fn to_json(probe: &Probe, report: &ProbeReport, achievable_hz: Option<f64>) -> Value {
    let ms = |seconds| milliseconds(report, seconds);
    let trip = &report.round_trip;
    json!({
        "sent": report.sent,
        "received": report.received,
        "lost": report.lost,
        "reordered": report.reordered,
        "duplicates": report.duplicates,
        "rate_hz": probe.rate.hz(),
        "sent_rate_hz": report.sent_rate_hz,
        "round_trip_ms": { "mean": ms(trip.mean_s), "p50": ms(trip.p50_s), "p99": ms(trip.p99_s), "max": ms(trip.max_s) },
        "rms_jitter_ms": ms(trip.rms_jitter_s),
        "achievable_rate_hz": achievable_hz,
    })
}

fn text(server: Route, probe: &Probe, report: &ProbeReport, achievable_hz: Option<f64>) -> String {
    let trip = &report.round_trip;
    let mut text = format!("{server}, {} packets a second\n\n", probe.rate);
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<16} {value}");
    };
    let share = 100.0 * report.loss_rate();
    row("sent", format!("{} ({:.1} a second)", report.sent, report.sent_rate_hz));
    row("received", format!("{}, {} of them out of order", report.received, report.reordered));
    row("lost", format!("{} ({share:.3} %)", report.lost));
    let [mean, p50, p99, max] =
        [trip.mean_s, trip.p50_s, trip.p99_s, trip.max_s].map(|seconds| seconds * 1e3);
    row("round trip", format!("{mean:.3} ms mean, {p50:.3} ms median, {p99:.3} ms p99, {max:.3} ms at most"));
    row("rms jitter", format!("{:.3} ms", trip.rms_jitter_s * 1e3));
    if probe.sweep {
        let found =
            achievable_hz.map_or_else(|| "none that was tried".to_owned(), |hz| format!("{hz:.0} Hz"));
        row("achievable rate", format!("{found} (less than 0.1 % lost)"));
    }
    text
}

/// The link file: the impairment of one way, and what was measured.
fn link_file(server: Route, probe: &Probe, report: &ProbeReport) -> String {
    let way = report.impairment();
    let trip = &report.round_trip;
    format!(
        "# Measured by `cotouch probe {server} --rate {rate} --duration {duration}`; both ways are taken as alike.\n\
         # A scene takes it with link.include = \"<this file>\" or with --set link.include=<this file>.\n\n\
         [impairment]\n\
         latency_s = {latency:?}\n\
         jitter_s = {jitter:?}\n\
         loss_rate = {loss:?}\n\
         loss_burst_packets = {burst:?}\n\
         reorder_rate = {reorder:?}\n\
         duplicate_rate = {duplicate:?}\n\
         rate_limit_bytes_per_s = 0.0\n\n\
         [measured]\n\
         sent = {sent}\n\
         received = {received}\n\
         reordered = {reordered}\n\
         round_trip_mean_s = {mean:?}\n\
         round_trip_p50_s = {p50:?}\n\
         round_trip_p99_s = {p99:?}\n\
         round_trip_max_s = {max:?}\n\
         rms_jitter_s = {rms:?}\n",
        rate = probe.rate,
        duration = probe.duration_s,
        latency = way.latency_s,
        jitter = way.jitter_s,
        loss = way.loss_rate,
        // The scene refuses bursts shorter than the loss allows, loss_rate/(1 - loss_rate).
        burst = way.loss_burst_packets.max(way.loss_rate / (1.0 - way.loss_rate)),
        reorder = way.reorder_rate,
        duplicate = way.duplicate_rate,
        sent = report.sent,
        received = report.received,
        reordered = report.reordered,
        mean = trip.mean_s,
        p50 = trip.p50_s,
        p99 = trip.p99_s,
        max = trip.max_s,
        rms = trip.rms_jitter_s,
    )
}
