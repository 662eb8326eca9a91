//! `cotouch analyze margin`.

use std::fmt::Write as _;

use cotouch_analysis::{GainMargin, Margins, margins};
use cotouch_scene::Override;

use super::map::failure;
use super::prediction;
use crate::failure::{Failure, Verdict};
use crate::output::Output;
use crate::progress::Progress;

/// Says how far a scene is from instability.
pub(super) fn margin(name: &str, overrides: &[Override], output: &Output) -> Result<Verdict, Failure> {
    let scene = cotouch_scene::load(name, overrides)?;
    let progress = Progress::new("analysing");
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
    for note in &margins.notes {
        let _ = writeln!(text, "note: {note}");
    }
    text
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
    fn an_unstable_scene_says_so_and_nothing_else() {
        let settings = ["link.delay_periods=9".parse().unwrap()];
        let scene = cotouch_scene::load("single-axis", &settings).unwrap();
        let margins = margins(&scene, &|_| true).unwrap();
        let text = text("title", &margins);
        assert!(text.contains("unstable") && text.contains("note: ") && !text.contains("up to"), "{text}");
    }
}
