//! `cotouch analyze stability`.

mod check;

use std::fmt::Write as _;

use cotouch_analysis::{ModeStability, Stability};
use cotouch_scene::Override;

use super::prediction;
use crate::failure::{Failure, Verdict};
use crate::output::Output;
use crate::whole_verdict::whole_verdict;

/// Contact modes that people are shown.
const MAX_MODES: usize = 16;

/// Says whether a scene is stable, and `with_check` what other ways to the same maps say. Answers with exit status 0
/// whatever the verdict.
pub(super) fn stability(
    name: &str,
    with_check: bool,
    overrides: &[Override],
    output: &Output,
) -> Result<Verdict, Failure> {
    let scene = cotouch_scene::load(name, overrides)?;
    let progress = output.progress("analysing");
    let stability = whole_verdict(&scene, &|| true).map_err(anyhow::Error::from)?;
    drop(progress);
    let title = format!("{}: {}", scene.name, prediction::who_and_how(&scene));
    let text = text(&title, &stability);
    if with_check {
        check::answer(&scene, &stability, text, output)?;
    } else {
        output.answer_as(&stability, &text)?;
    }
    Ok(Verdict::Good)
}

fn text(title: &str, stability: &Stability) -> String {
    let mut text = format!("{title}\n{}\n\n", prediction::verdict(stability));
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<20} {value}");
    };
    row("states", stability.states.to_string());
    row("rigid-body poles", format!("{} (left out)", stability.rigid_body_poles));
    let drag = |pole: f64| format!("{} ({})", prediction::radius(pole), drag_in_words(pole));
    row("drag pole", stability.drag_pole.map_or_else(|| "none".to_owned(), drag));
    let listed = listed(&stability.modes);
    for mode in &listed {
        let contacts =
            if mode.contacts.is_empty() { "no contact".to_owned() } else { mode.contacts.join(" + ") };
        let word = if mode.stable { "stable" } else { "unstable" };
        let axis = mode.axis.map_or_else(String::new, |axis| format!(", {axis}"));
        let radius = prediction::radius(mode.spectral_radius);
        let topples =
            mode.toppling_per_s.map_or_else(String::new, |rate| format!(", topples at {rate:.3} /s"));
        row("contact mode", format!("{:<22} {contacts}{topples}", format!("{radius} {word}{axis}")));
    }
    let more = stability.modes.len() - listed.len();
    if more > 0 {
        let _ = writeln!(
            text,
            "and {more} more contact modes, less critical than those above; --json has all of them"
        );
    }
    if let Some(sentence) = prediction::worst(stability) {
        let _ = writeln!(text, "{sentence}");
    }
    for warning in &stability.warnings {
        let _ = writeln!(text, "note: {warning}");
    }
    text
}

/// All modes where there are few, else those that come nearest to growing, worst first.
fn listed(modes: &[ModeStability]) -> Vec<&ModeStability> {
    let mut listed: Vec<&ModeStability> = modes.iter().collect();
    if listed.len() > MAX_MODES {
        // Modes that only repeat a radius are kept in the order of the analysis: the sort is stable.
        listed.sort_by(|a, b| a.stable.cmp(&b.stable).then(b.spectral_radius.total_cmp(&a.spectral_radius)));
        listed.truncate(MAX_MODES);
    }
    listed
}

fn drag_in_words(pole: f64) -> &'static str {
    match pole {
        pole if pole < 1.0 => "held data damp the drift of the whole",
        pole if pole > 1.0 => "the drift of the whole grows",
        _ => "the drift of the whole is neither damped nor driven",
    }
}
