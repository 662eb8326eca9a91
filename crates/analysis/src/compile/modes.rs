//! A loop for each set of contacts that is analysed.

#[cfg(test)]
use std::sync::Arc;

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::SceneValues;
#[cfg(test)]
use cotouch_world::coordination::{CouplingGains, Scheme};

use super::session::compile_at;
#[cfg(test)]
use super::session::compile_with;
use crate::left_out::LeftOut;
use crate::loop_spec::LoopSpec;
use crate::operating_point::{OperatingPoint, Settled};

/// At most so many modes are analysed one by one.
const MAX_MODES: usize = 256;

/// The loop of a scene while a given set of switching contacts is closed.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactMode {
    /// The switching contacts that are closed, such as `["wall"]` or `["anna.finger1", "wall"]`. A two-sided wall and a
    /// hand that is coupled to a point never switch.
    pub contacts: Vec<String>,
    /// Whether every finger that presses on something is in contact, and no wall is touched.
    pub settled: bool,
    /// The loop.
    pub spec: LoopSpec,
}

/// The loops of a scene, one for each contact mode; the free one first.
///
/// Fingers that press on bodies with surfaces give a mode for each set of them; each wall gives these again with the
/// body against it. Where a finger touches, it touches all copies of the body. Each mode is linear about the scene's
/// settled grasp ([`crate::operating_point::OperatingPoint::settled_grasp`]), with forces that are in balance in that mode. A body without a
/// surface, and a one-sided wall, give two modes: all copies of the object off it, and all against it. Links are taken
/// with their constant latency; loss, jitter and rate limits are not part of the linear loop.
#[must_use]
pub fn compile(scene: &SceneValues) -> Vec<ContactMode> {
    modes(scene).0
}

/// Every contact mode, the free one first, and what was left out.
pub(crate) fn modes(scene: &SceneValues) -> (Vec<ContactMode>, Vec<LeftOut>) {
    modes_with(scene, &Settled::of(scene), &|point| compile_at(scene, point))
}

/// The modes of a session in which every finger touches something at times, whatever its script does.
pub(crate) fn every_finger(scene: &SceneValues) -> Vec<ContactMode> {
    modes_with(scene, &Settled::of_every_finger(scene), &|point| compile_at(scene, point)).0
}

fn modes_with(
    scene: &SceneValues,
    settled: &Settled,
    compile_at: &dyn Fn(&OperatingPoint) -> LoopSpec,
) -> (Vec<ContactMode>, Vec<LeftOut>) {
    let mut left_out = settled.left_out.clone();
    let walls = wall_sets(settled, &mut left_out);
    let fingers = finger_sets(settled, walls.len(), &mut left_out);
    let always = settled.always();
    let mut modes = Vec::new();
    for wall in &walls {
        for set in &fingers {
            let leans: Vec<usize> = always.iter().chain(wall).copied().collect();
            let point = settled.point(scene, set, &leans);
            let of_fingers = set.iter().map(|&grip| settled.grips[grip].name.clone());
            let of_walls = wall.iter().map(|lean: &usize| settled.leans[*lean].name.clone());
            modes.push(ContactMode {
                contacts: of_fingers.chain(of_walls).collect(),
                settled: wall.is_none() && set.len() == settled.grips.len(),
                spec: compile_at(&point),
            });
        }
    }
    (modes, left_out)
}

/// The loops of a scene with schemes that are made for the gains of translation and of rotation, whatever the scene names.
#[cfg(test)]
pub(crate) fn compile_with_schemes(
    scene: &SceneValues,
    scheme: impl Fn(CouplingGains) -> Arc<dyn Scheme>,
) -> Vec<ContactMode> {
    let schemes = cotouch_world::coordination::gains(&scene.coupling).map(scheme);
    modes_with(scene, &Settled::of(scene), &|point| compile_with(scene, point, schemes.clone())).0
}

/// No wall, and each one alone.
fn wall_sets(settled: &Settled, left_out: &mut Vec<LeftOut>) -> Vec<Option<usize>> {
    let switching = (0..settled.leans.len()).filter(|&lean| !settled.leans[lean].two_sided);
    let sets: Vec<_> = std::iter::once(None).chain(switching.map(Some)).collect();
    if sets.len() > 2 {
        left_out
            .push(LeftOut::new("Two walls touched at once", "a body is taken to lie against one at a time"));
    }
    sets
}

fn finger_sets(settled: &Settled, walls: usize, left_out: &mut Vec<LeftOut>) -> Vec<Vec<usize>> {
    let users: Vec<HostIndex> = settled.grips.iter().map(|grip| grip.user).collect();
    sets_of_fingers(&users, MAX_MODES / walls, left_out)
}

/// Every set of fingers, given whose each is; where these are too many, the ones nearest to none and to all.
pub(crate) fn sets_of_fingers(
    users: &[HostIndex],
    most: usize,
    left_out: &mut Vec<LeftOut>,
) -> Vec<Vec<usize>> {
    let fingers = users.len();
    let all = u32::try_from(fingers).ok().and_then(|fingers| 1usize.checked_shl(fingers));
    if let Some(all) = all.filter(|&all| all <= most) {
        let members = |set: usize| (0..fingers).filter(|&finger| set >> finger & 1 == 1).collect();
        return (0..all).map(members).collect();
    }
    left_out.push(LeftOut::new(
        format!("Most sets of the {fingers} fingers"),
        "they are too many: analysed are none, each finger alone, each user alone, all but one finger, all but one user, and all",
    ));
    let keep =
        |is_in: &dyn Fn(usize) -> bool| (0..fingers).filter(|&finger| is_in(finger)).collect::<Vec<_>>();
    let mut each = users.to_vec();
    each.dedup();
    let mut sets = vec![Vec::new()];
    for finger in 0..fingers {
        sets.push(vec![finger]);
        sets.push(keep(&|other| other != finger));
    }
    for user in each {
        sets.push(keep(&|finger| users[finger] == user));
        sets.push(keep(&|finger| users[finger] != user));
    }
    sets.push((0..fingers).collect());
    sets.sort_by_key(|set| (set.len(), set.clone()));
    sets.dedup();
    sets
}
