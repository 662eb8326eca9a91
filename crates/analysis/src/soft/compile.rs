//! From a scene with a soft object to the loops of its contact modes.

use cotouch_scene::Scene;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, SceneValues, WallSides};
use cotouch_soft::contact_stiffnesses;
use glam::DVec3;
use nalgebra::DMatrix;
use rayon::prelude::*;

use super::closed::closed_loop;
use super::closed_body::ClosedBodies;
use super::error::SoftAnalysisError;
use super::local_laws::HostLaw;
use super::prepared::{Bodies, Prepared};
use super::slow_body::SlowBody;
use super::touched::{Finger, Touched, touched_body};
use crate::compile::{ContactMode, compile_at, delay, sets_of_fingers};
use crate::left_out::LeftOut;
use crate::loop_spec::LoopSpec;
use crate::operating_point::OperatingPoint;

/// With more contact modes than this, not every set of fingers is analysed.
const MAX_SETS: usize = 16;

/// Every contact mode, and what was left out. Two-sided contacts are always closed; of one-sided ones,
/// every set of fingers is.
///
/// # Errors
/// When the scene has no soft object that can be linearised.
pub(crate) fn modes(
    scene: &Scene,
    bodies: &Bodies,
) -> Result<(Vec<ContactMode>, Vec<LeftOut>), SoftAnalysisError> {
    let prepared = bodies.prepared(scene)?;
    let fingers = fingers(scene);
    let mut left_out = Vec::new();
    let users: Vec<HostIndex> = fingers.iter().map(|finger| finger.user).collect();
    let sets = match scene.local_model.sides {
        WallSides::Two => vec![(0..fingers.len()).collect()],
        WallSides::One => sets_of_fingers(&users, MAX_SETS, &mut left_out),
    };
    if !prepared.converged {
        left_out.push(LeftOut::new(
            "The soft body in all its coordinates",
            "it was reduced to fewer than its contacts can tell from all",
        ));
    }
    let mode = |set: Vec<usize>| -> Result<ContactMode, SoftAnalysisError> {
        let name = |&slot: &usize| {
            let Finger { user, finger } = fingers[slot];
            format!("{}.finger{}", scene.users[user.index()].name, finger + 1)
        };
        let body = prepared.seen_from(&set);
        let of = described(scene, &prepared, &fingers, &set, &body, true)?;
        Ok(ContactMode {
            contacts: set.iter().map(name).collect(),
            settled: set.len() == fingers.len(),
            spec: match ClosedBodies::new(&of) {
                Some(closed) => closed_loop(&closed, of),
                None => touched_body(of),
            },
        })
    };
    Ok((sets.into_par_iter().map(mode).collect::<Result<_, _>>()?, left_out))
}

/// The loop of a scene with every finger in contact, its body in all its coordinates: for comparison with the running
/// session, on small meshes.
///
/// # Errors
/// When the scene has no soft object that can be linearised.
pub fn compile_unreduced(scene: &Scene) -> Result<LoopSpec, SoftAnalysisError> {
    let prepared = Bodies::default().prepared(scene)?;
    let fingers = fingers(scene);
    let set: Vec<usize> = (0..fingers.len()).collect();
    Ok(touched_body(described(scene, &prepared, &fingers, &set, &prepared.exact(&set)?, false)?))
}

/// All fingers of one user on the body, nobody else touching it.
pub(crate) struct UserTouch {
    pub(crate) spec: LoopSpec,
    /// Of the surface where each finger touches it at rest, unit.
    pub(crate) inward: Vec<DVec3>,
    /// The body's own between these contacts, m/N: three rows a finger.
    pub(crate) compliance: DMatrix<f64>,
}

/// Each user alone, with the hands that `hands` describes.
///
/// # Errors
/// When the scene has no soft object that can be linearised.
pub(crate) fn touches_of_users(
    scene: &Scene,
    hands: &SceneValues,
) -> Result<Vec<UserTouch>, SoftAnalysisError> {
    let prepared = Bodies::default().prepared(scene)?;
    let fingers = fingers(scene);
    let free = compile_at(hands, &OperatingPoint::free(hands));
    let of_user = |user: HostIndex| -> Result<UserTouch, SoftAnalysisError> {
        let set: Vec<usize> = (0..fingers.len()).filter(|&slot| fingers[slot].user == user).collect();
        let body = prepared.seen_from(&set);
        let mut spec = touched_body(described(scene, &prepared, &fingers, &set, &body, true)?);
        spec.bodies.clone_from(&free.bodies);
        let inward = set.iter().map(|&slot| -prepared.anchors[slot].normal).collect();
        Ok(UserTouch { spec, inward, compliance: prepared.compliance(&set) })
    };
    scene.hosts().map(of_user).collect()
}

/// In the order of the bodies of a free session's loop.
pub(super) fn fingers(scene: &Scene) -> Vec<Finger> {
    let of_user = |user: HostIndex| {
        let count = scene.users[user.index()].fingers.len() as u8;
        (0..count).map(move |finger| Finger { user, finger })
    };
    scene.hosts().flat_map(of_user).collect()
}

/// The session while the fingers of `set` touch `body`, which is seen from them. Where it is `reduced`, nothing acts along
/// axes of the world along which nothing ever moves.
pub(super) fn described<'a>(
    scene: &'a Scene,
    prepared: &Prepared,
    fingers: &[Finger],
    set: &[usize],
    body: &'a SlowBody,
    reduced: bool,
) -> Result<Touched<'a>, SoftAnalysisError> {
    let compliance = prepared.compliance(set);
    let ko_n_per_m = contact_stiffnesses(&compliance).ok_or(SoftAnalysisError::Rigid)?;
    let normals: Vec<DVec3> = set.iter().map(|&slot| prepared.anchors[slot].normal).collect();
    let law = HostLaw::new(scene, &ko_n_per_m, &normals, &compliance);
    let local = &scene.local_model;
    let spec = compile_at(scene, &OperatingPoint::free(scene));
    let idle_axes = if reduced { prepared.idle_axes(&spec.bodies) } else { [false; 3] };
    let centralized = scene.session.architecture == Architecture::Centralized;
    Ok(Touched {
        touching: set.iter().map(|&slot| (slot, fingers[slot])).collect(),
        hosts: if centralized { vec![HostIndex::FIRST] } else { scene.hosts().collect() },
        delay: Box::new(|from, to| delay(scene, from, to)),
        slow: scene.slow_schedule(),
        returned_force: local.returned_force,
        hold: local.hold,
        result_delay_periods: local.result_delay_periods,
        body,
        law,
        idle_axes,
        spec,
    })
}
