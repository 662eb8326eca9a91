//! A run's summary, for people.

use std::fmt::Write as _;

use cotouch_runtime::{Percentiles, SoftSummary, Summary};

/// Less energy than this out of a finger's port is not worth a word, J.
const LEAST_TOLD_J: f64 = 1e-3;

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
    if let Some(late) = microseconds(&haptic.lateness_us) {
        row("late", late);
    }
    if let Some(took) = microseconds(&haptic.compute_us) {
        row("a tick took", took);
    }
    if let Some(soft) = &summary.soft {
        row("slow steps", slow_steps(soft));
    }
    row("network", network(summary));
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
            let active = active.map_or_else(String::new, |seen| {
                format!("; a finger got up to {:.4} J more out than was put in", -seen.least_energy_j)
            });
            row(&user.name, format!("peak force {peak_force_n:.2} N, energy {energy_j:.4} J{active}"));
        }
        if let Some(faults) = &user.device_faults {
            row("device", format!("{} failed at {} ticks: {}", user.name, faults.ticks, faults.last));
        }
    }
    if let Some(file) = &summary.recording {
        row("recording", file.clone());
    }
    for session in &summary.earlier {
        let verdict = if session.stable { "stable" } else { "unstable" };
        let file = session.recording.as_deref().unwrap_or("not recorded");
        row("before", format!("{}, {:.1} s, {verdict}, {file}", session.scene, session.duration_s));
    }
    if let Some(file) = &summary.picture {
        row("picture", file.clone());
    }
    text
}

/// The outcome beside the prediction, in one sentence.
pub(super) fn verdict(summary: &Summary) -> String {
    let outcome = match summary.instability {
        Some(instability) => format!("unstable: {}", instability.in_words()),
        None if summary.stable => "stable".to_owned(),
        None => "unstable".to_owned(),
    };
    match summary.disagrees() {
        None => format!("{outcome}; nothing was predicted"),
        Some(false) => format!("{outcome}, as predicted"),
        Some(true) if summary.stable => format!(
            "{outcome} by its energy, although the prediction was unstable: in the run's last quarter nothing grew; a quiet end, friction or a force limit can hide or bound an oscillation"
        ),
        Some(true) => format!(
            "{outcome}, although the prediction was stable: something acted that the analysis leaves out"
        ),
    }
}

/// The same for the top of a picture, where there is room for a line.
pub(super) fn headline(summary: &Summary) -> String {
    let word = |stable| if stable { "stable" } else { "unstable" };
    let outcome = match summary.instability {
        Some(instability) => format!("unstable ({})", instability.in_words()),
        None => word(summary.stable).to_owned(),
    };
    match (summary.disagrees(), summary.predicted) {
        (Some(false), _) => format!("{}: {outcome}, as predicted", summary.scene),
        (_, Some(predicted)) => {
            format!("{}: {outcome}, but predicted {}", summary.scene, word(predicted.stable))
        }
        (_, None) => format!("{}: {outcome}", summary.scene),
    }
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

fn network(summary: &Summary) -> String {
    let network = &summary.network;
    let counts = format!("{} sent, {} received, {} lost", network.sent, network.received, network.lost);
    match (network.round_trip_ms.mean, network.round_trip_ms.rms_jitter) {
        (Some(mean), Some(jitter)) => format!("{counts}, round trip {mean:.3} ms, jitter {jitter:.3} ms"),
        _ => counts,
    }
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
    use cotouch_runtime::{Instability, Predicted};

    fn summary() -> Summary {
        let scene = cotouch_scene::load("single-axis", &[]).expect("a built-in scene");
        let mut summary = Summary::new(&scene);
        summary.predicted = Some(Predicted { stable: true, spectral_radius: 0.97 });
        summary.duration_s = 10.0;
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
        stable, as predicted

        duration   10.00 s on 2 hosts
        ticks      20479 of 20480 due, 1 missed
        late       3.2 µs median, 40.0 µs p99, 120.5 µs p99.9, 980.0 µs at most
        network    2560 sent, 2560 received, 0 lost
        anna       peak force 1.25 N, energy 0.5000 J
        ");
    }

    #[test]
    fn disagreement_is_said_plainly() {
        let mut summary = summary();
        assert_eq!(verdict(&summary), "stable, as predicted");
        (summary.stable, summary.instability) = (false, Some(Instability::EnergyGrowth));
        assert!(verdict(&summary).contains("although the prediction was stable"));
        summary.predicted = Some(Predicted { stable: false, spectral_radius: 1.2 });
        assert!(verdict(&summary).ends_with("as predicted"));
        (summary.stable, summary.instability) = (true, None);
        assert!(verdict(&summary).contains("although the prediction was unstable"));
        summary.predicted = None;
        assert_eq!(verdict(&summary), "stable; nothing was predicted");
    }
}
