//! Whether a session with a soft body is stable.

use cotouch_scene::Scene;
use cotouch_scene::scene::{LocalModelKind, StiffnessFrom, WallSides};
use nalgebra::DMatrix;

use super::compile::{Bodies, SoftMode, SoftModes, modes};
use super::{Hand, SoftAnalysisError, SoftLoop};
use crate::discretise::Step;
use crate::eigenvalues::{eigenvalues, spectral_radius};
use crate::evaluator::PointVerdict;
use crate::loop_spec::{Dynamics, Plant};
use crate::stability::{AnalysisError, ModeStability, Stability, Switching, has_outgrown, is_stable};
use crate::warnings::{warn_of_device, warn_of_link};

/// Numbers in a state, at most: some ten seconds of work for eigenvalues.
const MOST_STATES: usize = 2000;
/// Ticks of a pattern times numbers in a state, at most: some ten seconds of stepping.
const MOST_WORK: f64 = 1e8;

/// What is known of one mode.
struct ModeVerdict {
    spectral_radius: f64,
    rigid_body_poles: usize,
    states: usize,
    axis: Option<&'static str>,
}

/// Analyses every contact mode of a scene with a soft object.
pub(crate) fn analyze(scene: &Scene, bodies: &Bodies) -> Result<Stability, AnalysisError> {
    let SoftModes { modes, notes } = modes(scene, bodies)?;
    let verdicts = modes.iter().map(judge).collect::<Result<Vec<_>, _>>()?;
    // The mode in which most fingers touch.
    let settled = (0..modes.len()).max_by_key(|&mode| modes[mode].contacts.len()).unwrap_or(0);
    let Some((headline, of)) = verdicts.get(settled).zip(modes.get(settled)) else {
        return Err(SoftAnalysisError::NoLinearisation.into());
    };
    let radius = verdicts.iter().map(|verdict| verdict.spectral_radius).fold(0.0, f64::max);
    let stable = is_stable(radius, 0);
    Ok(Stability {
        spectral_radius: radius,
        stable,
        rigid_body_poles: headline.rigid_body_poles as u8,
        drag_pole: None,
        states: headline.states,
        period_s: of.of.ticks_per_pattern() as f64 * of.of.network.control().period_s(),
        switching: if modes.len() > 1 { Switching::Unproven } else { Switching::None },
        warnings: warnings(scene, modes.len(), stable, notes),
        modes: modes
            .into_iter()
            .zip(verdicts)
            .map(|(mode, ModeVerdict { spectral_radius, axis, .. })| ModeStability {
                contacts: mode.contacts,
                spectral_radius,
                stable: is_stable(spectral_radius, 0),
                axis,
            })
            .collect(),
    })
}

/// The worst of all modes.
pub(crate) fn point_verdict(scene: &Scene, bodies: &Bodies) -> Result<PointVerdict, AnalysisError> {
    let mut radius = 0.0_f64;
    for mode in &modes(scene, bodies)?.modes {
        radius = radius.max(judge(mode)?.spectral_radius);
    }
    Ok(PointVerdict { spectral_radius: radius, stable: is_stable(radius, 0) })
}

fn judge(mode: &SoftMode) -> Result<ModeVerdict, AnalysisError> {
    check_size(&mode.of)?;
    let map = mode.of.lift_shared();
    let mut verdict = ModeVerdict {
        spectral_radius: 0.0,
        rigid_body_poles: 0,
        states: map.matrix.nrows(),
        axis: only_axis(mode),
    };
    verdict.spectral_radius =
        if has_outgrown(&map.matrix) { f64::INFINITY } else { spectral_radius(&eigenvalues(&map.matrix)?) };
    for hand in &mode.free {
        let alone = FreeHand::new(hand, &mode.of)?;
        verdict.states += hand.body.states.len();
        verdict.rigid_body_poles += alone.rigid_body_poles;
        verdict.spectral_radius = verdict.spectral_radius.max(alone.spectral_radius);
    }
    Ok(verdict)
}

/// The axis of the largest motion, where there is no question: everything moves along one.
fn only_axis(mode: &SoftMode) -> Option<&'static str> {
    let mut hands = mode.of.hands.iter().chain(&mode.free);
    hands.all(|hand| hand.body.axes.len() == 1).then_some("x")
}

fn check_size(of: &SoftLoop) -> Result<(), SoftAnalysisError> {
    let (states, ticks) = (of.states(), of.ticks_per_pattern());
    if states > MOST_STATES || states as f64 * ticks as f64 > MOST_WORK {
        return Err(SoftAnalysisError::TooLarge { states, ticks });
    }
    Ok(())
}

/// A hand that touches nothing, over a pattern.
struct FreeHand {
    spectral_radius: f64,
    rigid_body_poles: usize,
}

impl FreeHand {
    fn new(hand: &Hand, of: &SoftLoop) -> Result<Self, AnalysisError> {
        let axes = hand.body.axes.len();
        let step = Step::new(&hand.body, of.network.control().period_s());
        let braked = &step.a - &step.b * step.c.rows(axes, axes) * hand.damping_n_s_per_m;
        let mut values: Vec<f64> = eigenvalues(&braked)?.iter().map(|value| value.norm()).collect();
        // A hand that nothing pulls back stays where it is, and without damping goes on as it goes.
        let (held, damped) = is_held(hand);
        let rigid_body_poles = if held { 0 } else { axes * if damped { 1 } else { 2 } };
        values.sort_by(|one, other| (one - 1.0).abs().total_cmp(&(other - 1.0).abs()));
        let largest = values.into_iter().skip(rigid_body_poles).fold(0.0, f64::max);
        Ok(Self { spectral_radius: largest.powf(of.ticks_per_pattern() as f64), rigid_body_poles })
    }
}

/// Whether a stiffness pulls a hand back, and whether anything damps it.
fn is_held(hand: &Hand) -> (bool, bool) {
    let (Dynamics::Plant(Plant { a, .. }) | Dynamics::Sensed { plant: Plant { a, .. }, .. }) =
        &hand.body.dynamics
    else {
        return (false, hand.damping_n_s_per_m != 0.0);
    };
    let axes = hand.body.axes.len();
    let is_there = |part: DMatrix<f64>| part.iter().any(|&value| value != 0.0);
    let part = |column: usize| a.view((axes, column), (axes, axes)).into_owned();
    (is_there(part(0)), is_there(part(axes)) || hand.damping_n_s_per_m != 0.0)
}

fn warnings(scene: &Scene, modes: usize, stable: bool, notes: Vec<String>) -> Vec<String> {
    let local = &scene.local_model;
    let mut warnings = Vec::new();
    warn_of_link(scene, &mut warnings);
    if modes > 1 {
        let each = if stable { "each contact mode is stable" } else { "not every contact mode is stable" };
        warnings.push(format!("Contacts open and close: {each}, switching between the modes is unproven."));
    }
    warnings.extend(notes);
    if local.sides == WallSides::One {
        warnings.push(
            "The loop is linear about the body at rest, each finger on the nearest point of the surface from where it starts; elsewhere and under load the body is stiffer or softer, and contacts that slide are not analysed."
                .to_owned(),
        );
    }
    if local.kind == LocalModelKind::Pi && local.threshold_force_n > 0.0 {
        warnings.push(
            "The threshold of (11) that grows with the integral's force is taken as constant; while it grows the integral leaks, which only takes force away."
                .to_owned(),
        );
    }
    if local.stiffness_from == StiffnessFrom::Estimate {
        warnings
            .push("K_o is estimated while the session runs; the analysis takes the body's own.".to_owned());
    }
    warn_of_device(scene, &mut warnings);
    warnings
}
