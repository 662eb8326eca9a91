//! `cotouch local-model choose`.

use cotouch_analysis::local_model::{ChosenGains, Compliances, SimulationLoop, choose as choose_gains};
use std::fmt::Write as _;

use serde::Serialize;

use super::words::{gain, how_it_is_closed, radius};
use crate::arguments::LocalModelChoose;
use crate::failure::{Failure, Verdict};
use crate::output::Output;

#[derive(Serialize)]
struct Answer {
    kh_n_per_m: f64,
    int_n_per_m: f64,
    /// On the nominal K_o, one contact alone.
    spectral_radius: f64,
    worst_spectral_radius: f64,
    /// Whether the worst is below 1.
    stable: bool,
    /// K_o over the compliance of the softest and the stiffest way in which the contacts move, errors included.
    softest_n_per_m: f64,
    stiffest_n_per_m: f64,
}

/// Chooses gains. Whatever comes out, the work is done: exit status 0.
pub(super) fn choose(asked: &LocalModelChoose, output: &Output) -> Result<Verdict, Failure> {
    let slow_loop = SimulationLoop::new(asked.ratio, asked.returned_force, asked.hold)?;
    let range = Compliances::correlated(asked.contacts, asked.correlation)?.with_error(asked.ko_error)?;
    let ChosenGains { model, spectral_radius, worst_spectral_radius } =
        choose_gains(&slow_loop, asked.ko, range)?;
    let answer = Answer {
        kh_n_per_m: model.kh_n_per_m(),
        int_n_per_m: model.int_n_per_m(),
        spectral_radius,
        worst_spectral_radius,
        stable: worst_spectral_radius < 1.0,
        softest_n_per_m: asked.ko / range.largest,
        stiffest_n_per_m: asked.ko / range.least,
    };
    output.answer_as(&answer, &text(asked, &answer))?;
    Ok(Verdict::Good)
}

fn text(asked: &LocalModelChoose, answer: &Answer) -> String {
    let contacts = match asked.contacts {
        1 => "one contact".to_owned(),
        n => format!("{n} contacts of correlation {}", asked.correlation),
    };
    let mut text = format!(
        "K_o = {} ± {} %, {contacts}: felt as {} to {}\n{}\n\n",
        gain(asked.ko),
        100.0 * asked.ko_error,
        gain(answer.softest_n_per_m),
        gain(answer.stiffest_n_per_m),
        how_it_is_closed(asked.ratio, asked.returned_force, asked.hold)
    );
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<18} {value}");
    };
    row("K_h", gain(answer.kh_n_per_m));
    row("INT", gain(answer.int_n_per_m));
    row("spectral radius", format!("{}, one contact on the nominal K_o", radius(answer.spectral_radius)));
    let word = if answer.stable { "stable" } else { "not stable: no gains are found for so wide a range" };
    row("worst", format!("{}, {word} (hand held still)", radius(answer.worst_spectral_radius)));
    text
}
