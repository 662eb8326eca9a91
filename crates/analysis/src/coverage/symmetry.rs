//! Sets of contacts that differ only in who is who, or are mirror images: their loops have the same eigenvalues.
//!
//! A symmetry is a permutation of users together with a reflection of the world's axes through the middle of a body,
//! that changes nothing: not the body, its walls, its weight, the ways between hosts, the hands, nor where fingers touch.

use cotouch_scene::geometry::Pose;
use cotouch_scene::mechanism::finger_inertia;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Scene, Space};
use glam::{DMat3, DVec3};

use super::contacts::{BodyContacts, Contact, Set, With};
use super::hands;
use crate::compile::delay;
use crate::operating_point::{Reach, hosts_with_copies};

/// With more users, none are taken to be alike.
const MAX_USERS: usize = 5;

/// Where each contact goes, by every symmetry of a body; the identity among them.
pub(super) fn symmetries(scene: &Scene, reach: &Reach, contacts: &BodyContacts) -> Vec<Vec<usize>> {
    let identity: Vec<usize> = (0..contacts.all.len()).collect();
    let mut found = vec![identity];
    if contacts.fixed {
        return found;
    }
    for users in permutations(scene.users.len()) {
        if !keeps_users(scene, &users) {
            continue;
        }
        for mirror in mirrors(scene.space) {
            let symmetry = Symmetry { scene, reach, contacts, users: &users, mirror };
            if let Some(places) = symmetry.places()
                && !found.contains(&places)
            {
                found.push(places);
            }
        }
    }
    found
}

/// The first of all sets that are like this one.
pub(super) fn representative(set: &[usize], symmetries: &[Vec<usize>]) -> Set {
    let image = |places: &Vec<usize>| {
        let mut image: Set = set.iter().map(|&contact| places[contact]).collect();
        image.sort_unstable();
        image
    };
    symmetries.iter().map(image).min().unwrap_or_default()
}

fn permutations(users: usize) -> Vec<Vec<usize>> {
    if users > MAX_USERS {
        return vec![(0..users).collect()];
    }
    let mut all = vec![Vec::new()];
    for user in 0..users {
        let longer = all.iter().flat_map(|shorter: &Vec<usize>| {
            (0..=user).map(move |at| {
                let mut longer = shorter.clone();
                longer.insert(at, user);
                longer
            })
        });
        all = longer.collect();
    }
    all
}

/// Reflections of the axes that a space has.
fn mirrors(space: Space) -> Vec<DVec3> {
    let signs = |axis: usize| {
        let has = match space {
            Space::Line => axis < 1,
            Space::Plane => axis < 2,
            Space::Space => true,
        };
        if has { &[1.0, -1.0][..] } else { &[1.0][..] }
    };
    let all = signs(0).iter().flat_map(move |&x| {
        signs(1).iter().flat_map(move |&y| signs(2).iter().map(move |&z| DVec3::new(x, y, z)))
    });
    all.collect()
}

fn host(index: usize) -> HostIndex {
    HostIndex(index as u8)
}

/// Whether hands and ways are the same when users change places.
fn keeps_users(scene: &Scene, users: &[usize]) -> bool {
    let same_hands = users.iter().enumerate().all(|(user, &image)| {
        let (one, other) = (&scene.users[user], &scene.users[image]);
        one.fingers.len() == other.fingers.len() && hands::springs(one) == hands::springs(other)
    });
    let keepers: Vec<_> = hosts_with_copies(scene).collect();
    let same_copies = keepers.iter().all(|keeper| keepers.contains(&host(users[keeper.index()])));
    let same_ways = (0..users.len()).all(|from| {
        (0..users.len())
            .filter(|&to| to != from)
            .all(|to| delay(scene, host(from), host(to)) == delay(scene, host(users[from]), host(users[to])))
    });
    same_hands && same_copies && same_ways
}

struct Symmetry<'a> {
    scene: &'a Scene,
    reach: &'a Reach,
    contacts: &'a BodyContacts,
    users: &'a [usize],
    /// What each axis is multiplied by.
    mirror: DVec3,
}

impl Symmetry<'_> {
    /// Where each contact goes; nothing where something changes.
    fn places(&self) -> Option<Vec<usize>> {
        if !self.keeps_body() {
            return None;
        }
        self.contacts.all.iter().map(|contact| self.place(contact)).collect()
    }

    fn pose(&self) -> &Pose {
        &self.reach.poses[self.contacts.body]
    }

    fn keeps_body(&self) -> bool {
        let scene = self.scene;
        let body = &self.reach.bodies[self.contacts.body];
        let turn = DMat3::from_quat(self.pose().orientation);
        let inertia = turn * body.shape.mass_properties(body.mass_kg).inertia_kg_m2 * turn.transpose();
        let weight = scene.gravity_m_per_s2;
        let mirrored = self.mirrored(inertia);
        near(self.mirror * weight, weight)
            && (0..3)
                .all(|column| mirrored.col(column).distance(inertia.col(column)) <= 1e-12 * largest(&inertia))
    }

    fn mirrored(&self, matrix: DMat3) -> DMat3 {
        let mirror = DMat3::from_diagonal(self.mirror);
        mirror * matrix * mirror
    }

    fn place(&self, contact: &Contact) -> Option<usize> {
        let copy = host(self.users[contact.copy.index()]);
        self.contacts
            .all
            .iter()
            .position(|other| other.copy == copy && self.is_image(contact.with, other.with))
    }

    fn is_image(&self, with: With, other: With) -> bool {
        match (with, other) {
            (With::Finger(one), With::Finger(other)) => self.is_image_of_finger(one, other),
            (With::Wall(one), With::Wall(other)) => self.is_image_of_wall(one, other),
            _ => false,
        }
    }

    fn is_image_of_finger(&self, one: usize, other: usize) -> bool {
        let (one, other) = (&self.reach.grips[one], &self.reach.grips[other]);
        if self.users[one.user.index()] != other.user.index() {
            return false;
        }
        let orientation = self.pose().orientation;
        let map = |local: DVec3| orientation.conjugate() * (self.mirror * (orientation * local));
        one.is_mapped_to(other, &map) && self.keeps_inertia(one, other)
    }

    /// Of the devices at the two fingers.
    fn keeps_inertia(
        &self,
        one: &crate::operating_point::Grip,
        other: &crate::operating_point::Grip,
    ) -> bool {
        let inertia = |grip: &crate::operating_point::Grip| {
            let at = self.pose().to_world(grip.touches_at());
            finger_inertia(self.scene, grip.user, grip.finger, at)
        };
        let (one, other) = (self.mirrored(inertia(one)), inertia(other));
        (0..3).all(|column| one.col(column).distance(other.col(column)) <= 1e-9 * largest(&other))
    }

    fn is_image_of_wall(&self, one: usize, other: usize) -> bool {
        let planes = self.scene.walls();
        let (one, other) = (&self.reach.leans[one], &self.reach.leans[other]);
        let normals = [one, other].map(|lean| planes[lean.wall].normal.normalize());
        let orientation = self.pose().orientation;
        let image = |&corner: &DVec3| {
            let moved = orientation.conjugate() * (self.mirror * (orientation * corner));
            other.corners.iter().any(|&corner| near(moved, corner))
        };
        near(self.mirror * normals[0], normals[1])
            && one.corners.len() == other.corners.len()
            && one.corners.iter().all(image)
    }
}

fn near(one: DVec3, other: DVec3) -> bool {
    one.distance(other) <= 1e-9 * (1.0 + other.length())
}

fn largest(matrix: &DMat3) -> f64 {
    matrix.to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max)
}
