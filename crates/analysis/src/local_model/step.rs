//! How surface and force answer when the hand steps into the object (Figs 7–9).

use super::error::LocalModelError;
use super::gains::PiLocalModel;
use super::simulation::{ContactSides, Simulation, SimulationSample, SimulationState, Threshold};
use super::simulation_loop::SimulationLoop;

/// A step of the hand at t = 0, from rest on the surface.
#[derive(Clone, Debug)]
pub struct HandStep {
    /// Gains and object.
    pub model: PiLocalModel,
    /// N, returned force, hold.
    pub slow_loop: SimulationLoop,
    /// T, s.
    pub period_s: f64,
    /// How far into the object, m.
    pub input_m: f64,
    /// The local model pushes and never pulls.
    pub one_sided: bool,
}

/// What comes of it.
#[derive(Clone, Debug, PartialEq)]
pub struct StepResponse {
    /// One for each haptic tick, from t = 0.
    pub samples: Vec<SimulationSample>,
    /// How it comes to rest.
    pub settling: Settling,
}

/// How a step comes to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settling {
    /// Where the surface comes to rest, m: (5), and the hand's place with an integral. Where the loop is unstable it
    /// would rest there, but does not.
    pub steady_state_m: f64,
    /// From when on the surface stays within 5 % of that, s. `None` when it never does.
    pub to_5_percent_s: Option<f64>,
    /// Likewise 2 %.
    pub to_2_percent_s: Option<f64>,
    /// How far the surface goes beyond, as a share of the steady state. `None` where it goes on for ever, or there is
    /// no steady state to compare with.
    pub overshoot: Option<f64>,
    /// The largest absolute eigenvalue of a slow period with the hand held still.
    pub spectral_radius: f64,
}

/// Longest response that is recorded, ticks.
const MAX_RECORDED: f64 = 5e6;
/// Longest response that is waited for, ticks.
const MAX_WAITED_FOR: f64 = 2e7;

impl HandStep {
    /// The response over `duration_s`, or over a time that shows it settle or grow, 1 to 20 s.
    ///
    /// # Errors
    /// When the step, the period or the duration is not positive, or it has more than 5 million ticks.
    pub fn response(&self, duration_s: Option<f64>) -> Result<StepResponse, LocalModelError> {
        let simulation = self.simulation()?;
        let settling = self.settling(&simulation);
        let duration_s = duration_s.unwrap_or_else(|| self.telling_duration_s(&settling));
        let ticks = (duration_s / self.period_s).round() + 1.0;
        // Also where the duration is no number.
        if !(1.0..=MAX_RECORDED).contains(&ticks) {
            return Err(LocalModelError::TooLong(ticks, MAX_RECORDED));
        }
        let samples = simulation.run(std::iter::repeat_n(self.input_m, ticks as usize));
        Ok(StepResponse { samples, settling })
    }

    fn simulation(&self) -> Result<Simulation, LocalModelError> {
        if !(self.input_m.is_finite() && self.input_m > 0.0) {
            let (what, allowed) = ("the step of the hand, m,", "above 0");
            return Err(LocalModelError::Number { what, allowed, found: self.input_m });
        }
        let contact = if self.one_sided { ContactSides::OneSided } else { ContactSides::TwoSided };
        Simulation::new(self.model, self.slow_loop.clone(), self.period_s, contact, Threshold::None)
    }

    /// Waits until the transient is over, if it ends.
    fn settling(&self, simulation: &Simulation) -> Settling {
        const OVER: f64 = 1e-7;
        let spectral_radius = self.slow_loop.spectral_radius(&self.model);
        let steady_state_m = self.model.steady_share() * self.input_m;
        let stable = self.slow_loop.is_stable(&self.model);
        // Twenty more for what the powers of a multiple root have in front of them.
        let periods = if stable { OVER.ln() / spectral_radius.ln() + 20.0 } else { 400.0 };
        let ticks = (periods * self.slow_loop.ratio() as f64).min(MAX_WAITED_FOR) as u64;
        let mut state = SimulationState::default();
        let (mut outside_5, mut outside_2, mut highest) = (None, None, 0.0_f64);
        for tick in 0..ticks {
            let deviation = simulation.tick(&mut state, self.input_m).surface_m - steady_state_m;
            highest = highest.max(deviation);
            let is_within = |share: f64| deviation.abs() <= share * steady_state_m;
            if !is_within(0.05) {
                outside_5 = Some(tick);
            }
            if !is_within(0.02) {
                outside_2 = Some(tick);
            }
        }
        let from = |outside: Option<u64>| match outside {
            None => stable.then_some(0.0),
            Some(last) => (stable && last + 1 < ticks).then(|| (last + 1) as f64 * self.period_s),
        };
        let bounded = stable || self.one_sided;
        Settling {
            steady_state_m,
            to_5_percent_s: from(outside_5),
            to_2_percent_s: from(outside_2),
            overshoot: (bounded && steady_state_m > 0.0).then(|| highest / steady_state_m),
            spectral_radius,
        }
    }

    /// A quarter longer than it takes to settle, or until it has grown a thousandfold.
    fn telling_duration_s(&self, settling: &Settling) -> f64 {
        let slow_period_s = self.period_s * self.slow_loop.ratio() as f64;
        let telling_s = match settling.to_2_percent_s {
            Some(settled_s) => 1.25 * settled_s,
            None if settling.spectral_radius > 1.0 => {
                1e3_f64.ln() / settling.spectral_radius.ln() * slow_period_s
            }
            None => f64::INFINITY,
        };
        // Whole slow periods end where a new one begins.
        (telling_s.clamp(1.0, 20.0) / slow_period_s).ceil() * slow_period_s
    }
}
