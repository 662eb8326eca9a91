//! `cotouch analyze stability --check`.

use std::fmt::Write as _;

use cotouch_analysis::{ModeCheck, RouteCheck, Stability, cross_check};
use cotouch_scene::Scene;
use serde::Serialize;

use crate::commands::prediction;
use crate::output::Output;

/// The verdict, and how other ways to the same maps agree with it.
#[derive(Serialize)]
struct CheckedStability<'a> {
    #[serde(flatten)]
    stability: &'a Stability,
    check: &'a [ModeCheck],
}

/// Answers with the verdict, `text` in words, and with what each route finds of the maps behind it.
pub(super) fn answer(
    scene: &Scene,
    stability: &Stability,
    text: String,
    output: &Output,
) -> anyhow::Result<()> {
    let progress = output.progress("checking");
    let check = cross_check(scene, &|share| progress.show(share))?;
    drop(progress);
    let text = text + &in_words(&check, stability.modes.len());
    output.answer_as(&CheckedStability { stability, check: &check }, &text)
}

fn in_words(check: &[ModeCheck], modes: usize) -> String {
    let mut text = "\nthe same maps by other routes\n".to_owned();
    for mode in check {
        let contacts =
            if mode.contacts.is_empty() { "no contact".to_owned() } else { mode.contacts.join(" + ") };
        let place = if mode.place.is_some() { ", where the worst was found" } else { "" };
        let radius = prediction::radius(mode.spectral_radius);
        let _ = writeln!(
            text,
            "{contacts}{place}: {radius}, {} states where receivers share no samples",
            mode.states
        );
        for route in &mode.routes {
            let _ = writeln!(text, "  {:<18} {}", route.name, found(route));
        }
    }
    if check.len() < modes {
        let _ = writeln!(
            text,
            "of {modes} contact modes and what was searched from them, these were checked, the largest radius first"
        );
    }
    text
}

fn found(route: &RouteCheck) -> String {
    match (route.spectral_radius, route.difference, &route.note) {
        (Some(radius), Some(difference), _) => {
            format!(
                "{:<22} map differs by {difference:.1e} of its largest element",
                prediction::radius(radius)
            )
        }
        (_, _, note) => note.clone().unwrap_or_default(),
    }
}
