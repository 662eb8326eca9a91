//! Which contacts can open and close in a trajectory: one place for each finger, and one wall or none.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::SceneValues;
use glam::DVec3;

use crate::operating_point::{FingerContact, OperatingPoint};

/// At most so many arrangements are tried.
const MAX_ARRANGEMENTS: usize = 8;

/// Contacts that can open and close together: in it each finger meets one body, and bodies one wall.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Arrangement {
    /// Places among the candidates: of fingers, then of corners.
    pub(super) contacts: Vec<usize>,
    pub(super) names: Vec<String>,
    /// For each finger of each user, in order: the outward normal (world) of what it can touch.
    pub(super) normals: Vec<Option<DVec3>>,
    /// Whether weights act: a wall holds them.
    pub(super) weighs: bool,
}

/// Some that together have all candidates, or as many as there may be.
pub(super) fn arrangements(scene: &SceneValues, candidates: &OperatingPoint) -> Vec<Arrangement> {
    let fingers: Vec<Vec<u8>> = fingers(scene).map(|finger| bodies_of(candidates, finger)).collect();
    let walls = walls(candidates);
    let of_walls = if walls.is_empty() { 1 } else { walls.len() + 1 };
    let count = fingers.iter().map(Vec::len).max().unwrap_or(0).max(of_walls);
    (0..count.min(MAX_ARRANGEMENTS))
        .map(|index| arrangement(scene, candidates, &fingers, &walls, index))
        .collect()
}

/// Every finger of every user.
fn fingers(scene: &SceneValues) -> impl Iterator<Item = (HostIndex, u8)> + '_ {
    scene
        .hosts()
        .flat_map(|host| (0..scene.users[host.index()].fingers.len()).map(move |finger| (host, finger as u8)))
}

/// The bodies that a finger can touch.
fn bodies_of(candidates: &OperatingPoint, finger: (HostIndex, u8)) -> Vec<u8> {
    let of_finger = candidates.fingers.iter().filter(|at| (at.user, at.finger) == finger);
    let mut bodies: Vec<u8> = of_finger.map(|at| at.body).collect();
    bodies.sort_unstable();
    bodies.dedup();
    bodies
}

/// Walls and the bodies that can lie against them.
fn walls(candidates: &OperatingPoint) -> Vec<(usize, u8)> {
    let mut walls: Vec<_> = candidates.corners.iter().map(|at| (at.wall, at.body)).collect();
    walls.sort_unstable();
    walls.dedup();
    walls
}

fn arrangement(
    scene: &SceneValues,
    candidates: &OperatingPoint,
    of_fingers: &[Vec<u8>],
    walls: &[(usize, u8)],
    index: usize,
) -> Arrangement {
    let body = |bodies: &Vec<u8>| (!bodies.is_empty()).then(|| bodies[index % bodies.len()]);
    let bodies: Vec<Option<u8>> = of_fingers.iter().map(body).collect();
    let wall = (index % (walls.len() + 1)).checked_sub(1).map(|wall| walls[wall]);
    let planes = scene.walls();
    let of_wall = wall.map(|(wall, _)| planes[wall].normal.normalize());
    let (mut contacts, mut names, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    for ((user, finger), body) in fingers(scene).zip(bodies) {
        let meets = candidates.fingers.iter().enumerate();
        let meets = meets.filter(|(_, at)| (at.user, at.finger, Some(at.body)) == (user, finger, body));
        let (places, at): (Vec<usize>, Vec<&FingerContact>) = meets.unzip();
        let outward = |at: &&FingerContact| {
            candidates.poses[at.host.index()][usize::from(at.body)].orientation * at.normal
        };
        // Who is coupled to a body's centre pushes it against its wall.
        normals.push(at.first().map(outward).or(of_wall));
        if !places.is_empty() {
            names.push(format!("{}.finger{}", scene.users[user.index()].name, finger + 1));
        }
        contacts.extend(places);
    }
    if let Some((wall, _)) = wall {
        names.push(planes[wall].name.clone());
    }
    let corners = candidates.corners.iter().enumerate();
    let corners = corners.filter(|(_, at)| Some((at.wall, at.body)) == wall);
    contacts.extend(corners.map(|(place, _)| candidates.fingers.len() + place));
    let weighs = wall.is_some_and(|(wall, _)| planes[wall].normal.dot(scene.gravity_m_per_s2) < 0.0);
    Arrangement { contacts, names, normals, weighs }
}
