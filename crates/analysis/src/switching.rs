//! Contacts open and close: whether an adversary finds a motion that does not settle although every contact mode is stable.
//!
//! Every mode stable is not yet stable: a session switches between its modes, and a sequence of stable ones may feed a motion
//! (Liberzon 2003, ch. 2). What is searched are trajectories of the session itself, between contacts stepped by the very maps
//! whose eigenvalues are judged, with contacts that follow the running law: they push while they are deep, never pull, and stick
//! along the surface until friction lets them slide. Hands do what they can to excite it, then push constantly: what then keeps
//! shaking at a finger, as an observer of a run would say, is a find.
//!
//! A search that finds nothing means something only at some distance from the line at which a mode turns unstable.

mod adversary;
mod arrangement;
mod distance;
mod ensemble;
mod fast_force;
mod hands;
mod random;
#[cfg(test)]
mod tests;
mod worst_mode;

use cotouch_scene::Scene;
use cotouch_scene::scene::SceneValues;
use rayon::prelude::*;

use crate::compile::{ContactMode, one_sided};
use crate::operating_point::OperatingPoint;
use crate::poles::judge;
use crate::verdict::{AnalysisError, LoopStability, Switching, UnsettledMotion};
use adversary::Adversary;
use arrangement::arrangements;
pub use distance::MAX_DISTANCE;
use distance::{Modes, distance};
pub(crate) use distance::{Scaled, stiffer};
use worst_mode::{WorstMotion, worst_motion};

/// The least distance to the line at which a search that finds nothing means something; `docs/VERDICTS.md` has the trial.
pub const MIN_DISTANCE: f64 = 1.0 / 0.7;
/// Modes whose slowest motions the adversary tries to feed.
const FED: usize = 3;

/// What is known about switching between the contact modes of a scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Switched {
    /// Whether anything can switch, and whether a search of it means something.
    pub(crate) switching: Switching,
    /// As in [`crate::Stability`].
    pub(crate) distance: Option<f64>,
    /// What an adversary keeps moving.
    pub(crate) found: Option<UnsettledMotion>,
}

impl Switched {
    /// Nothing was searched.
    pub(crate) const fn unsearched(switching: Switching) -> Self {
        Self { switching, distance: None, found: None }
    }

    /// The same where more is known to turn unstable at this distance.
    pub(crate) fn at(self, distance: f64) -> Self {
        let switching = if distance < MIN_DISTANCE { Switching::Unproven } else { self.switching };
        Self { switching, distance: Some(distance), ..self }
    }
}

/// What can be said of switching between the contact modes that `modes` makes of a scene, whatever its gains are. Nothing was
/// searched where `wanted` says that nobody wants to know any more.
///
/// # Errors
/// When a loop cannot be analysed.
pub(crate) fn search(
    scene: &Scene,
    modes: Modes,
    points: &ContactPoints,
    wanted: &(dyn Fn() -> bool + Sync),
) -> Result<Switched, AnalysisError> {
    let here = modes(scene);
    if here.len() < 2 {
        return Ok(Switched::unsearched(Switching::None));
    }
    let verdicts = here.par_iter().map(|mode| judge(&mode.spec, false)).collect::<Result<Vec<_>, _>>()?;
    if verdicts.iter().any(|verdict| !verdict.stable) {
        return Ok(Switched::unsearched(Switching::Unproven));
    }
    let radii: Vec<_> = verdicts.iter().map(|verdict| verdict.spectral_radius).collect();
    let distance = distance(scene, &radii, modes)?;
    let searched = find(scene, points, &fed(&here, &verdicts), wanted);
    let is_searched = searched == Some(None) && distance >= MIN_DISTANCE;
    Ok(Switched {
        switching: if is_searched { Switching::Searched } else { Switching::Unproven },
        distance: Some(distance),
        found: searched.flatten(),
    })
}

/// About what a scene is linear, and which contacts switch.
#[derive(Clone, Debug)]
pub(crate) struct ContactPoints {
    /// With the contacts that are always closed.
    pub(crate) always: OperatingPoint,
    /// With the contacts that open and close.
    pub(crate) switching: OperatingPoint,
}

/// The slowest motions of some of the worst modes.
fn fed(modes: &[ContactMode], verdicts: &[LoopStability]) -> Vec<WorstMotion> {
    let mut worst: Vec<_> = modes.iter().zip(verdicts).collect();
    worst.sort_by(|(_, one), (_, other)| other.spectral_radius.total_cmp(&one.spectral_radius));
    let motions = worst.iter().filter_map(|(mode, verdict)| worst_motion(&mode.spec, &verdict.eigenvalues));
    motions.take(FED).collect()
}

/// What an adversary finds. None where `wanted` says that nobody wants to know any more.
fn find(
    scene: &SceneValues,
    points: &ContactPoints,
    fed: &[WorstMotion],
    wanted: &(dyn Fn() -> bool + Sync),
) -> Option<Option<UnsettledMotion>> {
    let session = one_sided(scene, &points.always, &points.switching);
    let arrangements = arrangements(scene, &points.switching);
    Adversary { scene, session: &session, arrangements: &arrangements, fed }.search(wanted)
}
