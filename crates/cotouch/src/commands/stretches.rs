//! A run whose settings were changed, in words: what was predicted and what ran, stretch by stretch.

use std::fmt::Write as _;

use cotouch_runtime::{RunVerdict, SettingsSummary, Summary};

/// Of stretches in one sentence; the others are counted.
const MAX_TOLD: usize = 12;

/// What was predicted and what ran with each of the settings, in one sentence; nothing where none were changed.
pub(super) fn verdict(summary: &Summary) -> Option<String> {
    let agreement = agreement(summary)?;
    let tried = tried(summary);
    let mut text = format!("{}, {agreement}", summary.verdict.in_words());
    let is_one_scene = tried.iter().all(|settings| settings.scene == tried[0].scene);
    let mut before = None;
    for (index, settings) in tried.iter().take(MAX_TOLD).enumerate() {
        let separator = if index == 0 { ": " } else { "; " };
        let scene = Some(settings.scene).filter(|scene| !is_one_scene && before != Some(scene));
        let scene = scene.map_or_else(String::new, |scene| format!("{scene}, "));
        let _ = write!(text, "{separator}{scene}{}", told(settings));
        before = Some(&settings.scene);
    }
    if let Some(more) = tried.len().checked_sub(MAX_TOLD).filter(|&more| more > 0) {
        let _ = write!(text, "; and {more} more settings");
    }
    Some(text)
}

/// Settings that ran until others did, in one session or in several.
struct Tried<'a> {
    scene: &'a str,
    first: &'a SettingsSummary,
    verdict: Option<RunVerdict>,
}

/// All settings in order.
fn tried(summary: &Summary) -> Vec<Tried<'_>> {
    let earlier = summary.earlier.iter().map(|session| (session.scene.as_str(), &session.predictions));
    let sessions = earlier.chain([(summary.scene.as_str(), &summary.predictions)]);
    let stretches = sessions.flat_map(|(scene, stretches)| stretches.iter().map(move |first| (scene, first)));
    let mut all: Vec<Tried<'_>> = Vec::new();
    for (scene, stretch) in stretches {
        match all.last_mut() {
            Some(last) if last.scene == scene && last.first.settings == stretch.settings => {
                // What was too short to tell takes nothing from what was seen.
                last.verdict = last.verdict.max(stretch.verdict);
            }
            _ => all.push(Tried { scene, first: stretch, verdict: stretch.verdict }),
        }
    }
    all
}

fn told(&Tried { first: stretch, verdict, .. }: &Tried<'_>) -> String {
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
    let ran = match verdict {
        Some(RunVerdict::Quiet) => "quiet",
        Some(RunVerdict::Shaking) => "shook",
        Some(RunVerdict::Diverging) => "diverged",
        None => "too short to tell",
    };
    format!("{when}: {predicted}, {ran}")
}

/// Whether runs were as predicted, in words; nothing where no settings were changed.
pub(super) fn agreement(summary: &Summary) -> Option<String> {
    let tried = tried(summary);
    if tried.len() < 2 {
        return None;
    }
    let agrees =
        |settings: &Tried<'_>| Some(settings.first.stable? == (settings.verdict? == RunVerdict::Quiet));
    let known: Vec<bool> = tried.iter().filter_map(agrees).collect();
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
        assert!(text.contains("settings: at first: predicted stable"), "{text}");
        let of_500 = "coupling.object_object.stiffness_n_per_m = 500: predicted stable, quiet";
        assert!(text.ends_with(&format!("as at first: predicted stable, quiet; {of_500}")), "{text}");
        summary.scene = "other".to_owned();
        let text = verdict(&summary).unwrap();
        assert!(text.contains("settings: single-axis, at first: predicted stable, quiet; from"), "{text}");
        assert!(text.ends_with(&format!("; other, {of_500}")), "{text}");
    }

    #[test]
    fn scripts_that_began_anew_are_no_other_settings() {
        let mut summary = lesson();
        summary.predictions.truncate(1);
        summary.earlier = vec![EarlierSession::from(&summary.clone()); 3];
        assert_eq!((verdict(&summary), agreement(&summary)), (None, None));
        // Nor does one that was cut short hide what another was.
        summary.predictions[0].verdict = None;
        summary.earlier[1].predictions[0].verdict = Some(RunVerdict::Shaking);
        summary.predictions.push(stretch(9.0, Some(1.0), Some(true), Some(RunVerdict::Quiet)));
        assert_eq!(agreement(&summary).unwrap(), "as predicted with 1 of 2 settings");
    }

    #[test]
    fn a_run_without_changes_has_one_verdict() {
        let mut summary = lesson();
        summary.predictions.truncate(1);
        assert_eq!((verdict(&summary), agreement(&summary)), (None, None));
    }
}
