//! An admittance as a figure: magnitude and phase over frequency.

use cotouch_analysis::transparency::{Admittance, AdmittanceQuantity};

use crate::figure::chart::{Panel, Scale, Series, chart};

/// Curves over frequency.
pub(super) struct Bode {
    quantity: AdmittanceQuantity,
    magnitude: Vec<Series>,
    phase: Vec<Series>,
}

impl Bode {
    /// Every user's slow-rate response (solid) and exact fundamental (dashed), and the ideal system.
    pub(super) fn of(admittance: &Admittance) -> Self {
        let over_frequency = |values: &[f64]| -> Vec<(f64, f64)> {
            admittance.frequency_rad_s.iter().copied().zip(values.iter().copied()).collect()
        };
        let degrees =
            |radians: &[f64]| -> Vec<f64> { radians.iter().map(|value| value.to_degrees()).collect() };
        let (mut magnitude, mut phase) = (Vec::new(), Vec::new());
        for (colour, user) in admittance.users.iter().enumerate() {
            let exact = format!("{}, fundamental", user.name);
            magnitude.push(Series::solid(&user.name, colour, over_frequency(&user.magnitude)));
            magnitude.push(Series::dashed(&exact, colour, over_frequency(&user.fundamental_magnitude)));
            phase.push(Series::solid(&user.name, colour, over_frequency(&degrees(&user.phase_rad))));
            phase.push(Series::dashed(&exact, colour, over_frequency(&degrees(&user.fundamental_phase_rad))));
        }
        let of_all = admittance.users.iter().all(|user| user.ideal == admittance.ideal);
        for user in admittance.users.iter().take(if of_all { 1 } else { usize::MAX }) {
            let name = if of_all { "ideal".to_owned() } else { format!("ideal, {}", user.name) };
            let ideal = &user.ideal;
            magnitude.push(Series::dashed(&name, IDEAL_COLOUR, over_frequency(&ideal.magnitude)));
            phase.push(Series::dashed(&name, IDEAL_COLOUR, over_frequency(&degrees(&ideal.phase_rad))));
        }
        Self { quantity: admittance.quantity, magnitude, phase }
    }

    /// As SVG.
    pub(super) fn figure(self, headline: &str) -> anyhow::Result<String> {
        let label = match self.quantity {
            AdmittanceQuantity::Velocity => "velocity over force, m/s/N",
            AdmittanceQuantity::Position => "position over force, m/N",
        };
        let panel = |y_label: &str, y_scale, series| Panel {
            x_label: "frequency, rad/s".to_owned(),
            y_label: y_label.to_owned(),
            series,
            x_scale: Scale::Logarithmic,
            y_scale,
            ..Panel::default()
        };
        let panels = [
            panel(label, Scale::Logarithmic, self.magnitude),
            panel("phase, degrees", Scale::Linear, self.phase),
        ];
        chart(headline, &panels)
    }
}

/// Grey.
const IDEAL_COLOUR: usize = 7;
