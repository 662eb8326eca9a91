//! A run whose settings were changed, in words: what was predicted and what ran, stretch by stretch.

use std::fmt::Write as _;

use cotouch_runtime::{RunVerdict, SettingsSummary, Summary};

/// Of stretches in one sentence; the others are counted.
const MAX_TOLD: usize = 12;

/// What was predicted and what ran with each of the settings, in one sentence; nothing where none were changed.
pub(super) fn verdict(summary: &Summary) -> Option<String> {
    let agreement = agreement(summary)?;
    let mut text = format!("{}, {agreement}", summary.verdict.in_words());
    for session in &summary.earlier {
        let _ = write!(text, "; before, in {}", session.scene);
        push(&mut text, &session.predictions);
    }
    if !summary.earlier.is_empty() {
        let _ = write!(text, "; then, in {}", summary.scene);
    }
    push(&mut text, &summary.predictions);
    Some(text)
}

fn push(text: &mut String, stretches: &[SettingsSummary]) {
    for (index, stretch) in stretches.iter().take(MAX_TOLD).enumerate() {
        let separator = if index == 0 { ": " } else { "; " };
        let _ = write!(text, "{separator}{}", told(stretch));
    }
    if let Some(more) = stretches.len().checked_sub(MAX_TOLD).filter(|&more| more > 0) {
        let _ = write!(text, "; and {more} more settings");
    }
}

fn told(stretch: &SettingsSummary) -> String {
    let settings: Vec<String> =
        stretch.settings.iter().map(|(key, value)| format!("{key} = {value}")).collect();
    let settings = if settings.is_empty() { "as at first".to_owned() } else { settings.join(", ") };
    let when = if stretch.from_s == 0.0 { String::new() } else { format!("from {:.1} s, ", stretch.from_s) };
    let when =
        if when.is_empty() && stretch.settings.is_empty() { "at first".to_owned() } else { when + &settings };
    let predicted = match (stretch.stable, stretch.spectral_radius) {
        (Some(true), _) => "predicted stable",
        (Some(false), _) => "predicted unstable",
        (None, Some(_)) => "not proven stable",
        (None, None) => "not predicted",
    };
    let ran = match stretch.verdict {
        Some(RunVerdict::Quiet) => "quiet",
        Some(RunVerdict::Shaking) => "shook",
        Some(RunVerdict::Diverging) => "diverged",
        None => "too short to tell",
    };
    format!("{when}: {predicted}, {ran}")
}

/// Whether runs were as predicted, in words; nothing where no settings were changed.
pub(super) fn agreement(summary: &Summary) -> Option<String> {
    let earlier = summary.earlier.iter().flat_map(|session| &session.predictions);
    let stretches: Vec<&SettingsSummary> = earlier.chain(&summary.predictions).collect();
    if stretches.len() < 2 {
        return None;
    }
    let agrees =
        |stretch: &&SettingsSummary| Some(stretch.stable? == (stretch.verdict? == RunVerdict::Quiet));
    let known: Vec<bool> = stretches.iter().filter_map(agrees).collect();
    let agreeing = known.iter().filter(|&&agrees| agrees).count();
    Some(match (agreeing, known.len()) {
        (_, 0) => "which no prediction can be held against".to_owned(),
        (some, all) if some == all => format!("as predicted with each of {all} settings"),
        (some, all) => format!("as predicted with {some} of {all} settings"),
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use cotouch_runtime::{EarlierSession, SettingValue};

    fn stretch(
        from_s: f64,
        value: Option<f64>,
        stable: Option<bool>,
        verdict: Option<RunVerdict>,
    ) -> SettingsSummary {
        let key = "coupling.object_object.stiffness_n_per_m".to_owned();
        SettingsSummary {
            from_s,
            to_s: from_s + 8.0,
            settings: value
                .map(|value| (key, SettingValue::Number(value)))
                .into_iter()
                .collect::<BTreeMap<_, _>>(),
            stable,
            spectral_radius: stable.map(|_| 0.9),
            verdict,
            shaking: 0,
            judged_s: 7.0,
            scene: None,
        }
    }

    fn lesson() -> Summary {
        let scene = cotouch_scene::load("single-axis", &[]).expect("a built-in scene");
        let mut summary = Summary::new(&scene);
        summary.verdict = RunVerdict::Shaking;
        summary.predictions = vec![
            stretch(0.0, None, Some(true), Some(RunVerdict::Quiet)),
            stretch(12.0, Some(3000.0), Some(false), Some(RunVerdict::Shaking)),
            stretch(20.1, None, Some(true), Some(RunVerdict::Quiet)),
        ];
        summary
    }

    #[test]
    fn a_lesson_past_the_line_and_back_is_as_predicted() {
        insta::assert_snapshot!(verdict(&lesson()).unwrap(), @"shaking, as predicted with each of 3 settings: at first: predicted stable, quiet; from 12.0 s, coupling.object_object.stiffness_n_per_m = 3000: predicted unstable, shook; from 20.1 s, as at first: predicted stable, quiet");
    }

    #[test]
    fn what_is_not_as_predicted_or_not_known_is_counted_so() {
        let mut summary = lesson();
        summary.predictions[2].verdict = Some(RunVerdict::Diverging);
        summary.predictions[0].stable = None;
        summary.predictions.push(stretch(30.0, Some(1.0), Some(true), None));
        assert_eq!(agreement(&summary).unwrap(), "as predicted with 1 of 2 settings");
        let text = verdict(&summary).unwrap();
        assert!(text.contains("at first: not proven stable, quiet"), "{text}");
        assert!(text.ends_with("predicted stable, too short to tell"), "{text}");
    }

    #[test]
    fn sessions_that_follow_each_other_are_told_in_order() {
        let mut summary = lesson();
        summary.earlier.push(EarlierSession::from(&summary.clone()));
        summary.predictions = vec![stretch(0.0, Some(500.0), Some(true), Some(RunVerdict::Quiet))];
        let text = verdict(&summary).unwrap();
        assert!(text.contains("; before, in single-axis: at first: predicted stable"), "{text}");
        assert!(text.ends_with("; then, in single-axis: coupling.object_object.stiffness_n_per_m = 500: predicted stable, quiet"), "{text}");
    }

    #[test]
    fn a_run_without_changes_has_one_verdict() {
        let mut summary = lesson();
        summary.predictions.truncate(1);
        assert_eq!((verdict(&summary), agreement(&summary)), (None, None));
    }
}
