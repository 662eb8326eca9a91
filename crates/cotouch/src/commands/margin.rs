//! `cotouch analyze margin`.

use std::fmt::Write as _;

use cotouch_analysis::{Cure, DelayAndLoss, GainMargin, Margins, margins};
use cotouch_scene::Override;

use super::map::failure;
use super::prediction;
use crate::failure::{Failure, Verdict};
use crate::output::Output;

/// Changes that people are shown.
const MAX_CURES: usize = 3;

/// Says how far a scene is from instability.
pub(super) fn margin(name: &str, overrides: &[Override], output: &Output) -> Result<Verdict, Failure> {
    let scene = cotouch_scene::load(name, overrides)?;
    let progress = output.progress("analysing");
    let show = |share| {
        progress.show(share);
        true
    };
    let margins = margins(&scene, &show).map_err(failure)?;
    drop(progress);
    let title = format!("{}: {}", scene.name, prediction::who_and_how(&scene));
    output.answer_as(&margins, &text(&title, &margins))?;
    Ok(Verdict::Good)
}

fn text(title: &str, margins: &Margins) -> String {
    let word = if margins.stable { "stable" } else { "unstable" };
    let radius = prediction::radius(margins.spectral_radius);
    let mut text = format!("{title}\n{word} (spectral radius {radius})\n\n");
    if margins.stable {
        let delay = margins.delay_periods.map(|periods| format!("{periods} network periods"));
        let loss = margins.loss_rate.map(|rate| format!("{:.3} % of packets", 100.0 * rate));
        let untold = || "see the notes".to_owned();
        let _ = writeln!(text, "stays stable up to a delay of  {}", delay.unwrap_or_else(untold));
        let _ = writeln!(text, "and up to a loss of            {}", loss.unwrap_or_else(untold));
        for rate in &margins.rates {
            let hz = rate.hz.map_or_else(untold, |hz| format!("{} Hz", four_digits(hz)));
            let _ = writeln!(text, "and down to {:<18} {hz}", rate.key);
        }
        let together = margins.rates_together_hz.zip(margins.rates_together_factor);
        let together =
            together.map(|(hz, factor)| format!("{} Hz of the haptic rate, × {factor:.4}", four_digits(hz)));
        let _ = writeln!(text, "and down to both together      {}", together.unwrap_or_else(untold));
        write_delay_and_loss(&mut text, &margins.delay_and_loss);
        let _ = writeln!(
            text,
            "\n{:<58} {:>10} {:>12} {:>12}",
            "gain, multiplied alone", "value", "down to", "up to"
        );
    }
    for GainMargin { key, value, factor, lower_factor } in &margins.gains {
        let times = |factor: &Option<f64>| match *factor {
            None => none(),
            Some(0.0) => "above 0".to_owned(),
            Some(factor) => format!("× {factor:.5}"),
        };
        let _ = writeln!(text, "{key:<58} {value:>10} {:>12} {:>12}", times(lower_factor), times(factor));
    }
    write_cures(&mut text, &margins.cures);
    for note in &margins.notes {
        let _ = writeln!(text, "note: {note}");
    }
    text
}

/// Where there is more than one delay.
fn write_delay_and_loss(text: &mut String, rows: &[DelayAndLoss]) {
    if rows.len() < 2 {
        return;
    }
    let _ = writeln!(text, "\n{:<28} {:>12}", "delay, network periods", "loss up to");
    for DelayAndLoss { delay_periods, loss_rate } in rows {
        let loss = loss_rate.map_or_else(|| "unknown".to_owned(), |rate| format!("{:.3} %", 100.0 * rate));
        let _ = writeln!(text, "{delay_periods:<28} {loss:>12}");
    }
}

fn write_cures(text: &mut String, cures: &[Cure]) {
    if cures.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "{:<58} {:>10} {:>10} {:>16}",
        "stable with one change", "value", "to", "spectral radius"
    );
    for Cure { key, value, to, limit, spectral_radius } in cures.iter().take(MAX_CURES) {
        let radius = prediction::radius(*spectral_radius);
        let _ = write!(text, "{key:<58} {value:>10} {to:>10} {radius:>16}");
        let _ = match limit {
            Some(limit) => writeln!(text, "   (stable from {})", four_digits(*limit)),
            None => writeln!(text),
        };
    }
    text.push('\n');
}

/// Of a positive number.
fn four_digits(value: f64) -> String {
    let digits = (3 - value.log10().floor() as i32).clamp(0, 9) as usize;
    format!("{value:.digits$}")
}

fn none() -> String {
    "no limit".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unstable_scene_says_so_and_what_would_make_it_stable() {
        let settings = ["link.delay_periods=9".parse().unwrap()];
        let scene = cotouch_scene::load("single-axis", &settings).unwrap();
        let margins = margins(&scene, &|_| true).unwrap();
        let text = text("title", &margins);
        assert!(text.contains("unstable") && text.contains("note: ") && !text.contains("up to"), "{text}");
        let line = text.lines().find(|line| line.starts_with("link.delay_periods")).unwrap();
        assert_eq!(line.split_whitespace().skip(1).take(2).collect::<Vec<_>>(), ["9", "2"], "{text}");
    }

    #[test]
    fn loss_is_told_beside_delay() {
        let scene = cotouch_scene::load("single-axis-centralized", &[]).unwrap();
        let margins = margins(&scene, &|_| true).unwrap();
        let rows = &margins.delay_and_loss;
        assert!(rows.len() > 1 && rows[0].loss_rate == margins.loss_rate, "{rows:?}");
        let text = text("title", &margins);
        assert!(text.contains("delay, network periods"), "{text}");
    }
}
