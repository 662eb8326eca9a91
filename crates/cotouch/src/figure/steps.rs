//! A step of the hand: surface and force over time.

use super::chart::{Panel, Series};
use cotouch_analysis::local_model::{HandStep, SimulationSample, StepResponse};

/// Two panels: the surface with the hand and where it comes to rest, and the force. `label` and `title` tell several
/// apart.
pub(crate) fn panels(step: &HandStep, response: &StepResponse, title: &str, label: &str) -> [Panel; 2] {
    let end_s = response.samples.len().saturating_sub(1) as f64 * step.period_s;
    let flat = |metres: f64| vec![(0.0, 1e3 * metres), (end_s, 1e3 * metres)];
    let named = |what: &str| if label.is_empty() { what.to_owned() } else { format!("{what}, {label}") };
    let surface = Panel {
        title: title.to_owned(),
        x_label: "time, s".to_owned(),
        y_label: "position, mm".to_owned(),
        series: vec![
            Series::dashed("hand", 7, flat(step.input_m)),
            Series::dashed("steady state", 2, flat(response.settling.steady_state_m)),
            Series::solid(&named("surface"), 0, curve(step, response, |sample| 1e3 * sample.surface_m)),
        ],
        ..Panel::default()
    };
    let force = Panel {
        title: title.to_owned(),
        x_label: "time, s".to_owned(),
        y_label: "force, N".to_owned(),
        series: vec![Series::solid(&named("force"), 1, curve(step, response, |sample| sample.force_n))],
        ..Panel::default()
    };
    [surface, force]
}

/// A value over time, with its jumps upright.
pub(crate) fn curve(
    step: &HandStep,
    response: &StepResponse,
    value: impl Fn(&SimulationSample) -> f64,
) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = Vec::with_capacity(response.samples.len());
    for (tick, sample) in response.samples.iter().enumerate() {
        let (time_s, value) = (tick as f64 * step.period_s, value(sample));
        if let Some(&(_, before)) = points.last().filter(|point| point.1 != value) {
            points.push((time_s, before));
        }
        points.push((time_s, value));
    }
    points
}
