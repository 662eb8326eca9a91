//! What came late in a run, and what the analysis says of such lateness.

use cotouch_runtime::{LatenessSummary, PredictedForDelay, Summary};
use cotouch_scene::Scene;

use super::prediction;

/// Says what is predicted of `scene` with the delay that its data had, where they were older than intended.
pub(super) fn complete(summary: &mut Summary, scene: &Scene) {
    let excess = summary.lateness.data_excess_periods;
    if excess == 0 || summary.lateness.late_packets == 0 {
        return;
    }
    let delay_periods = scene.link.delay_periods + excess;
    // A delay beyond what scenes may have is nothing that can be predicted.
    let Ok(delayed) = scene.edit(|scene| scene.link.delay_periods = delay_periods) else { return };
    let predicted = prediction::predicted_if_possible(&delayed);
    summary.lateness.predicted_for = predicted.map(|predicted| PredictedForDelay {
        delay_periods,
        stable: predicted.stable,
        spectral_radius: predicted.spectral_radius,
    });
}

/// What was late, with figures, and what is predicted of it; nothing where nothing was.
pub(super) fn in_words(summary: &Summary) -> Option<String> {
    let late @ LatenessSummary { missed_ticks, late_ticks, late_packets, data_excess_periods, .. } =
        summary.lateness;
    if !late.is_any() {
        return None;
    }
    let mut words = Vec::new();
    if missed_ticks > 0 {
        words.push(format!("{missed_ticks} of {} ticks were left out", summary.haptic.due));
    }
    if late_ticks > 0 {
        let worst = late.worst_tick_ms.map_or_else(String::new, |ms| format!(", at most {ms:.1} ms"));
        words.push(format!("{late_ticks} began more than a period late{worst}"));
    }
    if late_packets > 0 {
        words.push(format!("{late_packets} packets came after they were due"));
    }
    if data_excess_periods > 0 {
        words.push(format!("data were up to {data_excess_periods} network periods older than intended"));
    }
    let predicted =
        late.predicted_for.map_or_else(String::new, |PredictedForDelay { delay_periods, stable, .. }| {
            let word = prediction::word(stable);
            format!(
                "; with a delay of {delay_periods} network periods, as it was then, the prediction is: {word}"
            )
        });
    Some(format!("{}{predicted}", words.join(", ")))
}
