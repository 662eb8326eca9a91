//! Contacts open and close: whether an adversary finds a motion that does not settle although every contact mode is stable.
//!
//! Every mode stable is not yet stable: a session switches between its modes, and a sequence of stable ones may feed a motion
//! (Liberzon 2003, §2). What is searched here are trajectories of the session itself, between contacts stepped by the very maps
//! whose eigenvalues are judged, with contacts that follow the running law: they push while they are deep, never pull, and stick
//! along the surface until friction lets them slide.

mod adversary;
mod arrangement;
mod distance;
mod ensemble;
mod fast_force;
mod hands;
mod random;
#[cfg(test)]
mod tests;
mod told;
mod worst_mode;

use cotouch_scene::scene::SceneValues;

use crate::compile::{ContactMode, one_sided};
use crate::operating_point::OperatingPoint;
use adversary::Adversary;
use arrangement::arrangements;
pub use distance::MAX_DISTANCE;
pub use told::{Found, Policy, Switched};
use worst_mode::worst_motion;

/// What an adversary finds that knows the worst of these modes; contacts that are closed at `point` always are, those of
/// `candidates` open and close. None where `wanted` says that nobody wants to know any more.
fn find(
    scene: &SceneValues,
    (point, candidates): (&OperatingPoint, &OperatingPoint),
    worst: &[&ContactMode],
    wanted: &(dyn Fn() -> bool + Sync),
) -> Option<Option<Found>> {
    let session = one_sided(scene, point, candidates);
    let worst: Vec<_> = worst.iter().filter_map(|mode| worst_motion(&mode.spec)).collect();
    let arrangements = arrangements(scene, candidates);
    Adversary { scene, session: &session, arrangements: &arrangements, worst: &worst }.search(wanted)
}
