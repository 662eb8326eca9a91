//! Whether a scene is stable, and how nearly.

use cotouch_scene::scene::Scene;
use rayon::prelude::*;

use crate::compile::{ContactMode, compile};
use crate::coverage;
use crate::left_out::LeftOut;
use crate::modes::{contact_modes, contact_points};
use crate::poles::analyze_loop;
use crate::soft::Bodies;
use crate::switching::{self, Switched};
use crate::verdict::{AnalysisError, LoopStability, ModeStability, Stability, Switching, Worst};
use crate::warnings::warnings;

/// Analyses every contact mode of a scene, and searches what switching between them can do.
///
/// # Errors
/// When a loop is too large, a soft body cannot be linearised, or the eigenvalue iteration does not converge (never seen).
pub fn analyze(scene: &Scene) -> Result<Stability, AnalysisError> {
    analyze_with(scene, &switched)
}

/// Analyses every contact mode of a scene by itself: what maps and margins are about. Nothing is searched, so that switching
/// between several modes is unproven.
///
/// # Errors
/// As [`analyze`].
pub fn analyze_swept(scene: &Scene) -> Result<Stability, AnalysisError> {
    analyze_with(scene, &|_, modes| Ok(unsearched(modes)))
}

fn analyze_with(
    scene: &Scene,
    switched: &dyn Fn(&Scene, &[ContactMode]) -> Result<Switched, AnalysisError>,
) -> Result<Stability, AnalysisError> {
    let (modes, mut left_out) = contact_modes(scene, &Bodies::default())?;
    coverage::add_left_out(scene, &mut left_out);
    let verdicts = modes.par_iter().map(|mode| analyze_loop(&mode.spec)).collect::<Result<Vec<_>, _>>()?;
    let settled = modes.iter().position(|mode| mode.settled).unwrap_or(0);
    let (headline, spec) = (&verdicts[settled], &modes[settled].spec);
    let each_is_stable = verdicts.iter().all(|verdict| verdict.stable);
    let switched = switched(scene, &modes)?;
    let warnings = warnings(scene, &modes, &verdicts, &left_out, &switched);
    let Switched { switching, distance, found } = switched;
    let states = if spec.blocks.is_empty() { spec.coordinates()?.len() } else { spec.shared_states() };
    let period_s = spec.pattern_s();
    let mode = |(mode, verdict): (ContactMode, &LoopStability)| ModeStability {
        contacts: mode.contacts,
        spectral_radius: verdict.spectral_radius,
        stable: verdict.stable,
        axis: verdict.axis,
        toppling_per_s: verdict.toppling_per_s.first().copied(),
    };
    let modes: Vec<_> = modes.into_iter().zip(&verdicts).map(mode).collect();
    Ok(Stability {
        spectral_radius: modes.iter().map(|mode| mode.spectral_radius).fold(0.0, f64::max),
        stable: whole_verdict(each_is_stable, switching, &left_out),
        rigid_body_poles: headline.rigid_body_poles,
        drag_pole: headline.drag_pole,
        states,
        period_s,
        switching,
        switching_distance: distance,
        switching_found: found,
        worst: worst(&modes),
        left_out,
        warnings,
        modes,
    })
}

/// What is known about switching between modes.
fn switched(scene: &Scene, modes: &[ContactMode]) -> Result<Switched, AnalysisError> {
    if scene.soft.exists() {
        return Ok(unsearched(modes));
    }
    switching::search(scene, &compile, &contact_points(scene), &|| true)
}

/// Modes are analysed one by one; between several of them nothing is known.
fn unsearched(modes: &[ContactMode]) -> Switched {
    Switched::unsearched(if modes.len() > 1 { Switching::Unproven } else { Switching::None })
}

/// As in [`Stability::stable`].
fn whole_verdict(each_is_stable: bool, switching: Switching, left_out: &[LeftOut]) -> Option<bool> {
    let covered = left_out.is_empty() && switching != Switching::Unproven;
    (!each_is_stable || covered).then_some(each_is_stable)
}

fn worst(modes: &[ModeStability]) -> Option<Worst> {
    let worst = modes.iter().max_by(|one, other| {
        one.spectral_radius.total_cmp(&other.spectral_radius).then(other.stable.cmp(&one.stable))
    })?;
    Some(Worst { contacts: worst.contacts.clone(), place: None, gain: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stable_is_said_only_of_what_was_analysed_whole() {
        let gap = [LeftOut::new("something", "it was not")];
        for switching in [Switching::None, Switching::Searched, Switching::Unproven] {
            assert_eq!(whole_verdict(false, switching, &[]), Some(false));
            assert_eq!(whole_verdict(false, switching, &gap), Some(false));
            assert_eq!(whole_verdict(true, switching, &gap), None);
        }
        assert_eq!(whole_verdict(true, Switching::None, &[]), Some(true));
        assert_eq!(whole_verdict(true, Switching::Searched, &[]), Some(true));
        assert_eq!(whole_verdict(true, Switching::Unproven, &[]), None);
    }
}
