//! `cotouch analyze margin`.

use std::fmt::Write as _;

use cotouch_analysis::{Cure, DelayAndLoss, GainMargin, Margins, Outage, OutageDirection, margins};
use cotouch_scene::{Override, Scene};

use super::map::failure;
use super::prediction;
use crate::failure::{Failure, Verdict};
use crate::output::Output;

/// Changes that people are shown.
const MAX_CURES: usize = 3;

/// Outages that are told of besides one of a network period, s: hardly noticed, until hosts let go of each other, and long after that.
const OUTAGES_S: [f64; 3] = [0.05, 0.6, 3.0];
/// A return that pushes so many times as hard as without an outage is worth a sentence.
const NOTABLE: f64 = 2.0;

/// Says how far a scene is from instability, and what outages do: the usual ones and those of `outages_s`.
pub(super) fn margin(
    name: &str,
    outages_s: &[f64],
    overrides: &[Override],
    output: &Output,
) -> Result<Verdict, Failure> {
    let scene = cotouch_scene::load(name, overrides)?;
    let progress = output.progress("analysing");
    let show = |share| {
        progress.show(share);
        true
    };
    let margins = margins(&scene, &durations(&scene, outages_s), &show).map_err(failure)?;
    drop(progress);
    let title = format!("{}: {}", scene.name, prediction::who_and_how(&scene));
    output.answer_as(&margins, &text(&title, &margins))?;
    Ok(Verdict::Good)
}

/// The usual durations and others, s, in order.
fn durations(scene: &Scene, others_s: &[f64]) -> Vec<f64> {
    let period_s = scene.rates.network_hz.period_s();
    let mut durations: Vec<f64> =
        std::iter::once(period_s).chain(OUTAGES_S).chain(others_s.iter().copied()).collect();
    durations.sort_by(f64::total_cmp);
    durations.dedup();
    durations
}

fn text(title: &str, margins: &Margins) -> String {
    let word = if margins.stable { "stable" } else { "unstable" };
    let radius = prediction::radius(margins.spectral_radius);
    let mut text = format!("{title}\n{word} (spectral radius {radius}), the contacts that scripts make\n\n");
    if margins.stable {
        let delay = margins.delay_periods.map(|periods| format!("{periods} network periods"));
        let loss = margins.loss_rate.map(loss_limit);
        let untold = || "see the notes".to_owned();
        let _ = writeln!(text, "stays stable up to a delay of  {}", delay.unwrap_or_else(untold));
        let _ = writeln!(text, "and up to a loss of packets of {}", loss.unwrap_or_else(untold));
        for rate in &margins.rates {
            let hz = rate.hz.map_or_else(untold, |hz| format!("{} Hz", four_digits(hz)));
            let _ = writeln!(text, "and down to {:<18} {hz}", rate.key);
        }
        let together = margins.rates_together_hz.zip(margins.rates_together_factor);
        let together =
            together.map(|(hz, factor)| format!("{} Hz of the haptic rate, × {factor:.4}", four_digits(hz)));
        let _ = writeln!(text, "and down to both together      {}", together.unwrap_or_else(untold));
        write_delay_and_loss(&mut text, &margins.delay_and_loss);
        write_outages(&mut text, &margins.outages, margins.loss_rate);
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
    let _ = writeln!(
        text,
        "note: All of this is about the contacts that scripts make; whether a scene is stable in everything that its users can \
         touch, `cotouch analyze stability` says."
    );
    text
}

/// A limit of the share of lost packets. At 1 there is none: every loss short of everything is stood.
fn loss_limit(rate: f64) -> String {
    if rate >= 1.0 { none() } else { format!("{:.3} %", 100.0 * rate) }
}

/// Where there is more than one delay.
fn write_delay_and_loss(text: &mut String, rows: &[DelayAndLoss]) {
    if rows.len() < 2 {
        return;
    }
    let _ = writeln!(text, "\n{:<28} {:>12}", "delay, network periods", "loss up to");
    for DelayAndLoss { delay_periods, loss_rate } in rows {
        let loss = loss_rate.map_or_else(|| "unknown".to_owned(), loss_limit);
        let _ = writeln!(text, "{delay_periods:<28} {loss:>12}");
    }
}

fn write_outages(text: &mut String, outages: &[Outage], loss_rate: Option<f64>) {
    if outages.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "\n{:<24} {:>10} {:>10} {:>10} {:>10} {:>14}   felt by",
        "outage, s", "N per N", "expected", "m per N", "J per N²", "limited from N"
    );
    for outage in outages {
        let direction = match outage.direction {
            OutageDirection::Both => "both ways",
            OutageDirection::OneWay => "one way",
        };
        let what = format!("{} {direction}", four_digits(outage.duration_s));
        let worst = &outage.worst;
        let limited = outage.limited_from_n.map_or_else(|| "-".to_owned(), figure);
        let _ = writeln!(
            text,
            "{what:<24} {:>10} {:>10} {:>10} {:>10} {limited:>14}   {}.finger{} along {}",
            figure(outage.peak_force_n_per_n),
            figure(outage.expected_force_n_per_n),
            figure(outage.excursion_m_per_n),
            figure(outage.energy_j_per_n2),
            worst.user,
            worst.finger,
            worst.axis,
        );
    }
    let _ = writeln!(text, "{}", what_an_outage_does(outages, loss_rate));
}

/// In a sentence.
fn what_an_outage_does(outages: &[Outage], loss_rate: Option<f64>) -> String {
    let mut both = outages.iter().filter(|outage| outage.direction == OutageDirection::Both);
    let is_notable =
        |outage: &&Outage| outage.peak_force_n_per_n >= NOTABLE * outage.undisturbed_force_n_per_n;
    let told = |outage: &Outage| {
        format!(
            "after {} s without packets the return pushes with up to {} N for each newton that a hand pushed meanwhile ({} N without \
             an outage).",
            four_digits(outage.duration_s),
            figure(outage.peak_force_n_per_n),
            figure(outage.undisturbed_force_n_per_n)
        )
    };
    match (both.clone().find(is_notable), loss_rate) {
        (Some(outage), Some(rate)) if rate >= 1.0 => {
            format!(
                "No limit of loss in the mean square; but things come apart while nothing arrives: {}",
                told(outage)
            )
        }
        (Some(outage), _) => format!("Things come apart while nothing arrives: {}", told(outage)),
        (None, _) => both
            .next_back()
            .map_or_else(String::new, |outage| format!("Outages do little here: {}", told(outage))),
    }
}

/// With three digits, large and small.
fn figure(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let exponent = value.abs().log10().floor();
    if (-3.0..5.0).contains(&exponent) {
        let digits = (2.0 - exponent).max(0.0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.2e}")
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
        let margins = margins(&scene, &[], &|_| true).unwrap();
        let text = text("title", &margins);
        assert!(text.contains("unstable") && text.contains("note: ") && !text.contains("up to"), "{text}");
        let line = text.lines().find(|line| line.starts_with("link.delay_periods")).unwrap();
        assert_eq!(line.split_whitespace().skip(1).take(2).collect::<Vec<_>>(), ["9", "2"], "{text}");
    }

    #[test]
    fn outages_are_told_where_loss_has_no_limit() {
        let scene = cotouch_scene::load("single-axis", &[]).unwrap();
        let durations = durations(&scene, &[1.0, 0.6]);
        assert_eq!(durations, [0.0078125, 0.05, 0.6, 1.0, 3.0]);
        let margins = margins(&scene, &durations, &|_| true).unwrap();
        let text = text("title", &margins);
        assert!(text.contains("No limit of loss in the mean square; but"), "{text}");
        assert!(text.contains("after 1.000 s without packets the return pushes with up to"), "{text}");
        let rows = text.lines().filter(|line| line.contains("both ways") || line.contains("one way"));
        assert_eq!(rows.count(), 10, "{text}");
        assert_eq!(["0.00512", "12.3", "123", "1.23e7"], [0.005_12, 12.34, 123.4, 12_340_000.0].map(figure));
    }

    #[test]
    fn loss_is_told_beside_delay() {
        let scene = cotouch_scene::load("single-axis-centralized", &[]).unwrap();
        let margins = margins(&scene, &[], &|_| true).unwrap();
        let rows = &margins.delay_and_loss;
        assert!(rows.len() > 1 && rows[0].loss_rate == margins.loss_rate, "{rows:?}");
        let text = text("title", &margins);
        assert!(text.contains("delay, network periods"), "{text}");
    }
}
