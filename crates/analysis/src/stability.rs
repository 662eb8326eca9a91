//! Whether a loop is stable, and how nearly.

use cotouch_scene::scene::Scene;
use rayon::prelude::*;

use crate::compile::ContactMode;
use crate::modes::contact_modes;
use crate::soft::Bodies;
use crate::warnings::warnings;

use crate::poles::analyze_loop;
use crate::verdict::{AnalysisError, LoopStability, ModeStability, Stability, Switching};

/// Analyses every contact mode of a scene.
///
/// # Errors
/// When a loop is too large, a soft body cannot be linearised, or the eigenvalue iteration does not converge (never seen).
pub fn analyze(scene: &Scene) -> Result<Stability, AnalysisError> {
    let (modes, notes) = contact_modes(scene, &Bodies::default())?;
    let verdicts = modes.par_iter().map(|mode| analyze_loop(&mode.spec)).collect::<Result<Vec<_>, _>>()?;
    let settled = modes.iter().position(|mode| mode.settled).unwrap_or(0);
    let (headline, spec) = (&verdicts[settled], &modes[settled].spec);
    let switching = if modes.len() > 1 { Switching::Unproven } else { Switching::None };
    let warnings = warnings(scene, &modes, &verdicts, notes);
    let states = if spec.blocks.is_empty() { spec.coordinates()?.len() } else { spec.shared_states() };
    let period_s = spec.pattern_s();
    let mode = |(mode, verdict): (ContactMode, &LoopStability)| ModeStability {
        contacts: mode.contacts,
        spectral_radius: verdict.spectral_radius,
        stable: verdict.stable,
        axis: verdict.axis,
    };
    Ok(Stability {
        spectral_radius: verdicts.iter().map(|verdict| verdict.spectral_radius).fold(0.0, f64::max),
        stable: verdicts.iter().all(|verdict| verdict.stable),
        rigid_body_poles: headline.rigid_body_poles,
        drag_pole: headline.drag_pole,
        states,
        period_s,
        switching,
        warnings,
        modes: modes.into_iter().zip(&verdicts).map(mode).collect(),
    })
}
