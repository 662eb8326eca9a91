//! Whether a scene is stable, and how nearly.

use cotouch_scene::ScriptedDemand;
use cotouch_scene::scene::Scene;
use rayon::prelude::*;

use crate::compile::{ContactMode, every_finger};
use crate::coverage::{self, Covered, JudgedSets};
use crate::left_out::LeftOut;
use crate::modes::{contact_modes, contact_points};
use crate::poles::{analyze_loop, check_size};
use crate::soft::Bodies;
use crate::switching::{self, Scaled, Switched, stiffer};
use crate::unmodelled::{limits, unmodelled};
use crate::verdict::{AnalysisError, LoopStability, ModeStability, Stability, Switching, Worst};
use crate::warnings::warnings;

/// Analyses all that the users of a scene can do: every contact of every finger and wall with every copy of a body, by
/// script, by a device or by a hand taken on the page; and searches what switching between these contacts can do.
///
/// Where every mode is stable, `demand` is asked for the largest forces that the scene's scripts ask of devices: where these may meet
/// a limit, the loop is not the one that was analysed. `cotouch_runtime::scripted_demand` finds them by running the scripts.
///
/// # Errors
/// When a loop is too large, a soft body cannot be linearised, or the eigenvalue iteration does not converge (never seen).
pub fn analyze(
    scene: &Scene,
    demand: impl FnOnce(&Scene) -> ScriptedDemand,
) -> Result<Stability, AnalysisError> {
    if scene.soft.exists() {
        let mut stability = analyze_settled(scene)?;
        let mut gaps: Vec<LeftOut> = coverage::of_soft_contact(scene).into_iter().collect();
        if stability.each_mode_is_stable() {
            gaps.extend(limits(scene, &demand(scene)));
        }
        stability.warnings.extend(gaps.iter().map(LeftOut::to_string));
        stability.left_out.extend(gaps);
        stability.stable =
            whole_verdict(stability.each_mode_is_stable(), stability.switching, &stability.left_out);
        return Ok(stability);
    }
    let (modes, _) = contact_modes(scene, &Bodies::default())?;
    let settled = modes.iter().find(|mode| mode.settled).unwrap_or(&modes[0]);
    let headline = analyze_loop(&settled.spec)?;
    let Covered { modes: covered, spectral_radius, worst, mut left_out, judged, .. } =
        coverage::cover(scene)?;
    left_out.extend(unmodelled(scene));
    let each_is_stable = covered.iter().all(|mode| mode.stable);
    if each_is_stable {
        left_out.extend(limits(scene, &demand(scene)));
    }
    let mut switched = match each_is_stable {
        true => switching::search(scene, &every_finger, &contact_points(scene), &|| true)?,
        false => Switched::unsearched(Switching::Unproven),
    };
    if whole_verdict(each_is_stable, switched.switching, &left_out) == Some(true) {
        switched = with_every_set(scene, switched, &judged)?;
    }
    let warnings = warnings(scene, &covered, (settled, &headline), &left_out, &switched);
    let Switched { switching, distance, found } = switched;
    Ok(Stability {
        spectral_radius,
        stable: whole_verdict(each_is_stable, switching, &left_out),
        rigid_body_poles: headline.rigid_body_poles,
        drag_pole: headline.drag_pole,
        states: states(settled)?,
        period_s: settled.spec.pattern_s(),
        switching,
        switching_distance: distance,
        switching_found: found,
        worst: Some(worst),
        left_out,
        warnings,
        modes: covered,
    })
}

/// Analyses the contact modes of the settled grasp alone, those of [`crate::compile()`]: what maps and margins are about, and
/// a run that goes as its scripts say. Of a scene with a soft body, every mode that there is. Nothing is searched, so that
/// switching between several modes is unproven, and limits of forces are taken not to act: nobody asks what scripts ask for.
///
/// # Errors
/// As [`analyze`].
pub fn analyze_settled(scene: &Scene) -> Result<Stability, AnalysisError> {
    let (modes, mut left_out) = contact_modes(scene, &Bodies::default())?;
    left_out.extend(unmodelled(scene));
    // Before any is judged: that takes long where one is too large.
    modes.iter().try_for_each(|mode| check_size(&mode.spec))?;
    let verdicts = modes.par_iter().map(|mode| analyze_loop(&mode.spec)).collect::<Result<Vec<_>, _>>()?;
    let settled = modes.iter().position(|mode| mode.settled).unwrap_or(0);
    let (headline, spec) = (&verdicts[settled], &modes[settled].spec);
    let each_is_stable = verdicts.iter().all(|verdict| verdict.stable);
    let switched = unsearched(&modes);
    let (states, period_s) = (states(&modes[settled])?, spec.pattern_s());
    let mode = |(mode, verdict): (&ContactMode, &LoopStability)| ModeStability {
        contacts: mode.contacts.clone(),
        spectral_radius: verdict.spectral_radius,
        stable: verdict.stable,
        axis: verdict.axis,
        toppling_per_s: verdict.toppling_per_s.first().copied(),
    };
    let judged: Vec<_> = modes.iter().zip(&verdicts).map(mode).collect();
    let warnings = warnings(scene, &judged, (&modes[settled], headline), &left_out, &switched);
    let Switched { switching, distance, found } = switched;
    let modes = judged;
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

/// Numbers in the state of a mode's loop.
fn states(ContactMode { spec, .. }: &ContactMode) -> Result<usize, AnalysisError> {
    Ok(if spec.blocks.is_empty() { spec.coordinates()?.len() } else { spec.shared_states() })
}

/// Modes are analysed one by one; between several of them nothing is known.
fn unsearched(modes: &[ContactMode]) -> Switched {
    Switched::unsearched(if modes.len() > 1 { Switching::Unproven } else { Switching::None })
}

/// The same with a distance up to which every judged set of contacts is stable, and not only those in which each finger
/// touches all copies.
fn with_every_set(scene: &Scene, switched: Switched, judged: &JudgedSets) -> Result<Switched, AnalysisError> {
    let Some(mut distance) = switched.distance else { return Ok(switched) };
    for scaled in Scaled::EACH {
        distance = judged.stable_up_to(&|factor| stiffer(scene, scaled, factor), distance)?;
    }
    Ok(switched.at(distance))
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
    let (contacts, spectral_radius) = (worst.contacts.clone(), worst.spectral_radius);
    Some(Worst { contacts, spectral_radius, place: None, gain: None })
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
