//! `cotouch local-model step`.

use cotouch_analysis::local_model::{HandStep, PiLocalModel, SimulationLoop, SimulationSample, StepResponse};
use std::fmt::Write as _;

use cotouch_scene::time::Rate;
use serde::Serialize;

use super::words::{gain, how_it_is_closed, radius};
use crate::arguments::LocalModelStep;
use crate::experiments::csv;
use crate::failure::{Failure, Verdict};
use crate::figure::chart::chart;
use crate::figure::steps::panels;
use crate::output::Output;

#[derive(Serialize)]
struct Answer {
    time_s: Vec<f64>,
    surface_m: Vec<f64>,
    force_n: Vec<f64>,
    settling_s: SettlingTimes,
    overshoot: Option<f64>,
    steady_state_m: f64,
    steady_state_error_m: f64,
    spectral_radius: f64,
    stable: bool,
}

#[derive(Serialize)]
struct SettlingTimes {
    #[serde(rename = "5%")]
    to_5_percent: Option<f64>,
    #[serde(rename = "2%")]
    to_2_percent: Option<f64>,
}

/// Steps the hand into the object. A file that ends in .svg gets a picture, one that ends in .csv a table.
pub(super) fn step(asked: &LocalModelStep, output: &Output) -> Result<Verdict, Failure> {
    let ratio = ratio(asked.slow_hz, asked.fast_hz)?;
    let step = HandStep {
        model: PiLocalModel::new(asked.kh, asked.int, asked.ko)?,
        slow_loop: SimulationLoop::new(ratio, asked.returned_force, asked.hold)?,
        period_s: asked.fast_hz.period_s(),
        input_m: asked.input_m,
        one_sided: asked.unilateral,
    };
    let response = step.response(asked.duration_s)?;
    let answer = Answer::new(&step, asked.fast_hz, &response);
    let text = text(asked, ratio, &answer);
    let ending = output.file.as_ref().and_then(|file| file.extension()).and_then(|ending| ending.to_str());
    match ending {
        Some("svg") => {
            let headline = format!("{}: {}", title(asked), verdict(&answer));
            let picture = chart(&headline, &panels(&step, &response, "", ""))?;
            output.answer_and_file(&answer, &text, &picture)?;
        }
        Some("csv") => {
            let header = ["time_s", "surface_m", "force_n"].map(str::to_owned);
            let table = csv(&header, &[&answer.time_s, &answer.surface_m, &answer.force_n]);
            output.answer_and_file(&answer, &text, &table)?;
        }
        _ => output.answer_as(&answer, &text)?,
    }
    Ok(Verdict::Good)
}

/// Haptic ticks in a slow period.
fn ratio(slow: Rate, fast: Rate) -> Result<u32, Failure> {
    let up = u128::from(fast.numerator()) * u128::from(slow.denominator());
    let down = u128::from(fast.denominator()) * u128::from(slow.numerator());
    let whole = (up.is_multiple_of(down)).then(|| up / down).and_then(|ratio| u32::try_from(ratio).ok());
    whole.filter(|ratio| (1..=10_000).contains(ratio)).ok_or_else(|| {
        Failure::usage(format!(
            "--fast-hz must be a whole multiple of --slow-hz, 1 to 10000 times; {fast} Hz is {:.6} times {slow} Hz",
            fast.hz() / slow.hz()
        ))
    })
}

impl Answer {
    fn new(step: &HandStep, fast: Rate, response: &StepResponse) -> Self {
        let of = |value: fn(&SimulationSample) -> f64| response.samples.iter().map(value).collect::<Vec<_>>();
        let settling = response.settling;
        let time_s = |tick: usize| tick as f64 * fast.denominator() as f64 / fast.numerator() as f64;
        Self {
            time_s: (0..response.samples.len()).map(time_s).collect(),
            surface_m: of(|sample| sample.surface_m),
            force_n: of(|sample| sample.force_n),
            settling_s: SettlingTimes {
                to_5_percent: settling.to_5_percent_s,
                to_2_percent: settling.to_2_percent_s,
            },
            overshoot: settling.overshoot,
            steady_state_m: settling.steady_state_m,
            steady_state_error_m: step.input_m - settling.steady_state_m,
            spectral_radius: settling.spectral_radius,
            stable: step.slow_loop.is_stable(&step.model),
        }
    }
}

fn title(asked: &LocalModelStep) -> String {
    let integral = if asked.int > 0.0 { format!(", INT = {}", gain(asked.int)) } else { String::new() };
    format!("K_o = {}, K_h = {}{integral}", gain(asked.ko), gain(asked.kh))
}

fn verdict(answer: &Answer) -> String {
    let word = if answer.stable { "stable" } else { "unstable" };
    format!("{word}, spectral radius {}", radius(answer.spectral_radius))
}

fn text(asked: &LocalModelStep, ratio: u32, answer: &Answer) -> String {
    let sides = if asked.unilateral { "pushes only" } else { "pushes and pulls" };
    let mut text = format!(
        "{}; the hand steps {:.4} mm in, contact {sides}\n{}\n\n",
        title(asked),
        1e3 * asked.input_m,
        how_it_is_closed(ratio, asked.returned_force, asked.hold)
    );
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<18} {value}");
    };
    row("slow loop", verdict(answer));
    let rest = format!("{:.4} mm", 1e3 * answer.steady_state_m);
    let error = format!("{:.4} mm short of the hand", 1e3 * answer.steady_state_error_m);
    let would = if answer.stable { "" } else { ", if it came to rest" };
    row("surface rests at", format!("{rest}, {error}{would}"));
    let settled =
        |time: Option<f64>| time.map_or_else(|| "never".to_owned(), |time| format!("after {time:.3} s"));
    row("within 5 %", settled(answer.settling_s.to_5_percent));
    row("within 2 %", settled(answer.settling_s.to_2_percent));
    let overshoot = |share: f64| format!("{:.2} % of that", 100.0 * share);
    let none = if answer.stable { "none" } else { "without end" };
    row("overshoot", answer.overshoot.map_or_else(|| none.to_owned(), overshoot));
    let end_s = answer.time_s.last().copied().unwrap_or(0.0);
    row("computed", format!("{end_s:.3} s; --json has every tick, --out x.svg draws, --out x.csv tabulates"));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_have_whole_ratios() {
        let ratio = |slow: &str, fast: &str| ratio(slow.parse().unwrap(), fast.parse().unwrap());
        assert_eq!(ratio("20", "1000").unwrap(), 50);
        assert_eq!(ratio("1024/10", "1024").unwrap(), 10);
        for (slow, fast) in [("30", "1000"), ("1000", "20"), ("0.01", "1000")] {
            let Failure::Usage(reason) = ratio(slow, fast).unwrap_err() else { panic!("{slow} {fast}") };
            assert!(reason.contains("whole multiple"), "{reason}");
        }
    }
}
