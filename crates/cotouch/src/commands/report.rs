//! A run's summary, for people.

use std::fmt::Write as _;

use cotouch_net::Rejections;
use cotouch_runtime::{
    DivergedSummary, ExpelledSummary, Percentiles, Predicted, ShakingSummary, SoftSummary, Summary, Unproven,
};

use super::{lateness, stretches};

/// Less energy than this out of a finger's port is not worth a word, J.
const LEAST_TOLD_J: f64 = 1e-3;

/// A run that was judged for less time than this, s, may shake or grow later.
const LEAST_JUDGED_S: f64 = 1.0;

/// Why a run may be quiet that was predicted to be unstable.
const NOT_SEEN: &str =
    "what would grow was not set off in this run, had too little time, or is slower than 8 Hz";

/// Of stretches of shaking; the others are counted.
const MAX_TOLD_STRETCHES: usize = 6;

/// What happened, in a short table.
pub(super) fn text(summary: &Summary) -> String {
    let mut text = format!("{}\n\n", verdict(summary));
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<10} {value}");
    };
    let haptic = &summary.haptic;
    let hosts = if haptic.hosts == 1 { "1 host".to_owned() } else { format!("{} hosts", haptic.hosts) };
    row("duration", format!("{:.2} s on {hosts}", summary.duration_s));
    row("ticks", format!("{} of {} due, {} missed", haptic.ticks, haptic.due, haptic.missed));
    if haptic.stood_still > 0 {
        row("no ticks", format!("forces were switched off {} times", haptic.stood_still));
    }
    if let Some(late) = microseconds(&haptic.lateness_us) {
        row("late", late);
    }
    if let Some(late) = lateness::in_words(summary) {
        row("lateness", late);
    }
    if let Some(took) = microseconds(&haptic.compute_us) {
        row("a tick took", took);
    }
    if let Some(soft) = &summary.soft {
        row("slow steps", slow_steps(soft));
    }
    row("network", network(summary));
    if summary.network.implausible > 0 {
        row("refused", format!("{} packets that cannot be what they say", summary.network.implausible));
    }
    if summary.network.stale > 0 {
        row("too old", format!("{} packets, which were not used", summary.network.stale));
    }
    if let Some(rejected) = rejected(&summary.network.rejected) {
        row("rejected", rejected);
    }
    for stretch in summary.shaking.iter().take(MAX_TOLD_STRETCHES) {
        row("shaking", shaking(stretch));
    }
    if let Some(more) = summary.shaking.len().checked_sub(MAX_TOLD_STRETCHES).filter(|&more| more > 0) {
        row("shaking", format!("and {more} more times"));
    }
    for object in &summary.objects {
        let [x, y, z] = object.position_m.map(|metres| metres * 1e3);
        let deformed = object.max_displacement_m.map_or_else(String::new, |metres| {
            format!(", at most {:.1} mm from where it rests", metres * 1e3)
        });
        row(&object.name, format!("at ({x:.1}, {y:.1}, {z:.1}) mm{deformed}"));
    }
    for user in &summary.users_detail {
        if let (Some(peak_force_n), Some(energy_j)) = (user.peak_force_n, user.energy_j) {
            let active = user.passivity.filter(|seen| seen.least_energy_j < -LEAST_TOLD_J);
            let from = if hands_put_in(summary) { " (from other hands, through the object)" } else { "" };
            let active = active.map_or_else(String::new, |seen| {
                let more_j = -seen.least_energy_j;
                format!("; up to {more_j:.4} J more came out at one finger than went in there{from}")
            });
            row(&user.name, format!("peak force {peak_force_n:.2} N, energy {energy_j:.4} J{active}"));
        }
        if let Some(faults) = &user.device_faults {
            row("device", format!("{} failed at {} ticks: {}", user.name, faults.ticks, faults.last));
        }
    }
    for ExpelledSummary { user, by, reason, at_s } in &summary.expelled {
        let when = at_s.map_or_else(String::new, |at_s| format!(" at {at_s:.1} s"));
        row("expelled", format!("{user} by {by}{when}: {reason}"));
    }
    for failure in summary.all_failures() {
        row("failed", failure.to_owned());
    }
    if let Some(file) = &summary.recording {
        row("recording", with_size(file));
    }
    for session in &summary.earlier {
        let verdict = session.verdict.in_words();
        let file = session.recording.as_deref().map_or_else(|| "not recorded".to_owned(), with_size);
        row("before", format!("{}, {:.1} s, {verdict}, {file}", session.scene, session.duration_s));
    }
    if let Some(file) = &summary.picture {
        row("picture", file.clone());
    }
    text
}

/// Whether all hands together put in what came out at some: where they did not, the session made it.
fn hands_put_in(summary: &Summary) -> bool {
    summary.users_detail.iter().filter_map(|user| user.energy_j).sum::<f64>() >= 0.0
}

/// The outcome beside the prediction, in one sentence; of each of its settings, where they were changed.
pub(super) fn verdict(summary: &Summary) -> String {
    stretches::verdict(summary).unwrap_or_else(|| verdict_of_all(summary))
}

fn verdict_of_all(summary: &Summary) -> String {
    let word = summary.verdict.in_words();
    let what = what_happened(summary).map_or_else(String::new, |what| format!(": {what}"));
    let Some(Predicted { stable, open, .. }) = summary.predicted else {
        return format!("{word}{what}; nothing was predicted");
    };
    match stable {
        None => format!("{word}{what}; no prediction: {}", open.unwrap_or(Unproven::Coverage).in_words()),
        _ if summary.stable && summary.judged_s < LEAST_JUDGED_S => format!(
            "{word}, but only {:.1} s of it were judged, which is too short to say whether it is stable",
            summary.judged_s
        ),
        Some(true) if summary.stable => "quiet: stable, as predicted".to_owned(),
        Some(false) if summary.stable => {
            format!("{word}, although the prediction was unstable: {NOT_SEEN}")
        }
        Some(false) => format!("{word}, as predicted{what}"),
        Some(true) => format!("{word}, although the prediction was stable{what}; {}", what_else(summary)),
    }
}

/// The outcome in one sentence.
pub(super) fn outcome(summary: &Summary) -> String {
    if summary.stable && summary.judged_s < LEAST_JUDGED_S {
        return format!("not judged: {:.1} s of it are too short for that", summary.judged_s.max(0.0));
    }
    let what = what_happened(summary).map_or_else(String::new, |what| format!(": {what}"));
    format!("{}{what}", summary.verdict.in_words())
}

/// Who did not stay quiet, how and when; nothing of a quiet run.
fn what_happened(summary: &Summary) -> Option<String> {
    if let Some(DivergedSummary { cause, user, finger, at_s }) = &summary.diverged {
        let whose = match (user, finger) {
            (Some(user), Some(finger)) => format!(" at {user}'s finger {finger}"),
            _ => String::new(),
        };
        return Some(format!("{}{whose}, {at_s:.1} s after the start", cause.in_words()));
    }
    let strongest = summary.shaking.iter().max_by(|one, other| one.rms_n.total_cmp(&other.rms_n))?;
    Some(shaking(strongest))
}

fn shaking(ShakingSummary { user, finger, from_s, to_s, rms_n, hz }: &ShakingSummary) -> String {
    format!(
        "{user}'s finger {finger} shook by {rms_n:.2} N rms at {hz:.0} Hz from {from_s:.1} to {to_s:.1} s"
    )
}

/// What acts in a run that is not what was predicted.
fn what_else(summary: &Summary) -> String {
    match lateness::in_words(summary) {
        Some(late) => format!(
            "the loop was not the one that was predicted, since the computer or the network was late: {late}"
        ),
        None => "hands can make a stable loop shake for as long as they drive it (samples that are held between packets step under a \
                 hand that moves fast, blows and taps ring), or something acted that the analysis leaves out"
            .to_owned(),
    }
}

/// The same for the top of a picture, where there is room for a line.
pub(super) fn headline(summary: &Summary) -> String {
    let word = summary.verdict.in_words();
    if let Some(agreement) = stretches::agreement(summary) {
        return format!("{}: {word}, {agreement}", summary.scene);
    }
    let predicted = match summary.predicted.and_then(|predicted| predicted.stable) {
        None => "",
        Some(stable) if stable == summary.stable => ", as predicted",
        Some(true) => ", but predicted stable",
        Some(false) => ", but predicted unstable",
    };
    format!("{}: {word}{predicted}", summary.scene)
}

/// How the simulations of a soft object went.
fn slow_steps(soft: &SoftSummary) -> String {
    let SoftSummary { steps, late, missed, compute_us } = soft;
    let took = match (compute_us.p50, compute_us.max) {
        (Some(p50), Some(max)) => format!(", {:.2} ms median, {:.2} ms at most", p50 / 1e3, max / 1e3),
        _ => String::new(),
    };
    format!("{steps}, {late} late, {missed} missed{took}")
}

/// A file and how large it is, where it is there.
fn with_size(file: impl AsRef<str>) -> String {
    let file = file.as_ref();
    std::fs::metadata(file)
        .map_or_else(|_| file.to_owned(), |facts| format!("{file} ({:.1} MB)", facts.len() as f64 * 1e-6))
}

fn network(summary: &Summary) -> String {
    let network = &summary.network;
    let counts = format!("{} sent, {} received, {} lost", network.sent, network.received, network.lost);
    match (network.round_trip_ms.mean, network.round_trip_ms.rms_jitter) {
        (Some(mean), Some(jitter)) => format!("{counts}, round trip {mean:.3} ms, jitter {jitter:.3} ms"),
        _ => counts,
    }
}

/// What came from somebody without the keys, or damaged. What came twice is the network's way, and no news.
fn rejected(rejected: &Rejections) -> Option<String> {
    let kinds = [
        (rejected.forged, "forged or damaged"),
        (rejected.without_ticket, "without the ticket"),
        (rejected.unknown, "for no channel"),
        (rejected.foreign, "foreign"),
        (rejected.other_version, "of another version"),
        (rejected.throttled, "beyond the rate of calls"),
    ];
    let all = kinds.iter().map(|(count, _)| count).sum::<u64>();
    let told = kinds.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}"));
    let told = told.collect::<Vec<_>>().join(", ");
    (all > 0).then(|| format!("{all} packets, which did nothing: {told}"))
}

fn microseconds(times: &Percentiles) -> Option<String> {
    let Percentiles { p50: Some(p50), p99: Some(p99), p999: Some(p999), max: Some(max) } = *times else {
        return None;
    };
    Some(format!("{p50:.1} µs median, {p99:.1} µs p99, {p999:.1} µs p99.9, {max:.1} µs at most"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cotouch_runtime::{Divergence, PassivitySummary, PredictedForDelay, RunVerdict};

    fn summary() -> Summary {
        let scene = cotouch_scene::load("single-axis", &[]).expect("a built-in scene");
        let mut summary = Summary::new(&scene);
        summary.predicted = Some(Predicted { stable: Some(true), spectral_radius: 0.97, open: None });
        (summary.duration_s, summary.judged_s) = (10.0, 9.5);
        summary.haptic.hosts = 2;
        (summary.haptic.due, summary.haptic.ticks, summary.haptic.missed) = (20_480, 20_479, 1);
        summary.haptic.lateness_us =
            Percentiles { p50: Some(3.2), p99: Some(40.0), p999: Some(120.5), max: Some(980.0) };
        (summary.network.sent, summary.network.received) = (2560, 2560);
        (summary.users_detail[0].peak_force_n, summary.users_detail[0].energy_j) = (Some(1.25), Some(0.5));
        summary
    }

    #[test]
    fn a_run_reads_well() {
        insta::assert_snapshot!(text(&summary()), @r"
        quiet: stable, as predicted

        duration   10.00 s on 2 hosts
        ticks      20479 of 20480 due, 1 missed
        late       3.2 µs median, 40.0 µs p99, 120.5 µs p99.9, 980.0 µs at most
        network    2560 sent, 2560 received, 0 lost
        anna       peak force 1.25 N, energy 0.5000 J
        ");
    }

    #[test]
    fn energy_comes_from_other_hands_where_hands_put_it_in() {
        let told = |others_j: f64| {
            let mut summary = summary();
            summary.users_detail[0].energy_j = Some(-3.0);
            summary.users_detail[0].passivity =
                Some(PassivitySummary { least_energy_j: -4.0, ..PassivitySummary::default() });
            (summary.users_detail[1].peak_force_n, summary.users_detail[1].energy_j) =
                (Some(1.0), Some(others_j));
            text(&summary)
        };
        assert!(
            told(5.0).contains("4.0000 J more came out at one finger than went in there (from other hands")
        );
        assert!(!told(-1.0).contains("from other hands"), "{}", told(-1.0));
    }

    #[test]
    fn disagreement_is_said_plainly() {
        let mut summary = summary();
        assert_eq!(verdict(&summary), "quiet: stable, as predicted");
        (summary.stable, summary.verdict) = (false, RunVerdict::Shaking);
        let [early, late] = [(1.0, 0.06), (3.0, 0.5)].map(|(from_s, rms_n)| ShakingSummary {
            user: "ben".to_owned(),
            finger: 2,
            from_s,
            to_s: from_s + 1.5,
            rms_n,
            hz: 31.4,
        });
        summary.shaking = vec![early, late];
        summary.haptic.missed = 0;
        assert_eq!(
            verdict(&summary),
            "shaking, although the prediction was stable: ben's finger 2 shook by 0.50 N rms at 31 Hz from 3.0 to 4.5 s; hands can make a stable loop shake for as long as they drive it (samples that are held between packets step under a hand that moves fast, blows and taps ring), or something acted that the analysis leaves out"
        );
        (summary.lateness.missed_ticks, summary.lateness.late_packets) = (7, 40);
        summary.lateness.data_excess_periods = 2;
        summary.lateness.predicted_for =
            Some(PredictedForDelay { delay_periods: 3, stable: Some(false), spectral_radius: 1.02 });
        assert!(verdict(&summary).ends_with(
            "the loop was not the one that was predicted, since the computer or the network was late: 7 of 20480 ticks were left out, \
             40 packets came after they were due, data were up to 2 network periods older than intended; \
             with a delay of 3 network periods, as it was then, the prediction is: unstable"
        ));
        summary.predicted = Some(Predicted { stable: Some(false), spectral_radius: 1.2, open: None });
        assert!(verdict(&summary).starts_with("shaking, as predicted: ben's finger 2"));
        summary.verdict = RunVerdict::Diverging;
        summary.diverged = Some(DivergedSummary {
            cause: Divergence::GovernorLimit,
            user: Some("ben".to_owned()),
            finger: Some(2),
            at_s: 4.26,
        });
        assert_eq!(
            verdict(&summary),
            "diverging, as predicted: a force limit acted for more than 20 ms on end at ben's finger 2, 4.3 s after the start"
        );
        (summary.stable, summary.verdict) = (true, RunVerdict::Quiet);
        assert!(verdict(&summary).contains("although the prediction was unstable"));
        assert!(verdict(&summary).ends_with(NOT_SEEN));
        summary.judged_s = 0.3;
        assert!(verdict(&summary).contains("only 0.3 s of it were judged"));
        summary.predicted = None;
        (summary.diverged, summary.shaking) = (None, Vec::new());
        assert_eq!(verdict(&summary), "quiet; nothing was predicted");
        for (open, said) in
            [(Unproven::Switching, "switching between them"), (Unproven::Coverage, "not all that can happen")]
        {
            summary.predicted = Some(Predicted { stable: None, spectral_radius: 0.97, open: Some(open) });
            let verdict = verdict(&summary);
            assert!(verdict.starts_with("quiet; no prediction: each") && verdict.contains(said), "{verdict}");
            assert_eq!(headline(&summary), "single-axis: quiet");
            assert_eq!(summary.disagrees(), None);
        }
    }
}
