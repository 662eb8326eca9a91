//! What users can touch: every contact that a script, a device or a hand taken on the page can make.

use cotouch_scene::geometry::Pose;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Body, SceneValues, Shape, Space};
use glam::{DQuat, DVec3};

use super::faces::{Place, face_normals, has_surface, places, reach_m};
use super::point::OperatingPoint;
use super::settled::{Copy, Grip, Lean, Start, hosts_with_copies, leans};

/// A set of hosts' copies of a body: bit h for host h.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Copies(pub(crate) u32);

impl Copies {
    pub(crate) fn has(self, host: HostIndex) -> bool {
        self.0 >> host.index() & 1 == 1
    }

    pub(crate) fn with(self, host: HostIndex) -> Self {
        Self(self.0 | 1 << host.index())
    }
}

/// All contacts of fingers and of walls with the bodies of a scene.
#[derive(Clone, Debug)]
pub(crate) struct Reach {
    pub(crate) bodies: Vec<Body>,
    pub(crate) poses: Vec<Pose>,
    /// Every finger on every body with a surface.
    pub(crate) grips: Vec<Grip>,
    /// Every moving body on every wall.
    pub(crate) leans: Vec<Lean>,
}

/// Contacts of one body that are closed at once.
#[derive(Clone, Debug)]
pub(crate) struct Arrangement {
    pub(crate) body: usize,
    /// How the body is turned from where the scene has it at the start.
    pub(crate) turned: DQuat,
    pub(crate) grips: Vec<(Grip, Copies)>,
    pub(crate) leans: Vec<(Lean, Copies)>,
    /// In which direction (world, of length 1) all fingers slide past the body that can; none where all stick.
    pub(crate) slides: Option<DVec3>,
}

impl Reach {
    pub(crate) fn of(scene: &SceneValues) -> Self {
        let bodies = scene.world_bodies();
        let poses = OperatingPoint::free(scene).poses.swap_remove(0);
        let leans = leans(scene, &bodies, &poses);
        let mut grips = Vec::new();
        for host in scene.hosts() {
            for finger in 0..scene.users[host.index()].fingers.len() {
                let from = Start { scene, bodies: &bodies, poses: &poses, host, finger };
                let told = from.told();
                for body in (0..bodies.len()).filter(|&body| has_surface(&bodies[body].shape)) {
                    let told = told.clone().filter(|grip| grip.body == body);
                    grips.extend(told.or_else(|| from.reaching(body)));
                }
            }
        }
        Self { bodies, poses, grips, leans }
    }

    /// The walls that a body meets when it is turned, each with the corners that are then nearest to it.
    pub(crate) fn leans_turned(&self, scene: &SceneValues, body: usize, turned: DQuat) -> Vec<Lean> {
        let mut poses = self.poses.clone();
        poses[body].orientation = turned * poses[body].orientation;
        leans(scene, &self.bodies, &poses)
    }

    /// Turns that lay a flat face of a hull or a mesh on a wall.
    pub(crate) fn turns_onto_faces(&self, scene: &SceneValues, body: usize, wall: usize) -> Vec<DQuat> {
        let into_wall = -scene.walls()[wall].normal.normalize();
        let orientation = self.poses[body].orientation;
        let normals = face_normals(&self.bodies[body].shape, scene.space);
        normals.into_iter().map(|normal| DQuat::from_rotation_arc(orientation * normal, into_wall)).collect()
    }

    /// Where a session has these contacts, with forces that are in balance in them, and no other.
    pub(crate) fn point(&self, scene: &SceneValues, arrangement: &Arrangement) -> OperatingPoint {
        let Arrangement { body: index, turned, grips, leans, slides } = arrangement;
        let mut point = OperatingPoint::free(scene);
        for host in hosts_with_copies(scene) {
            let pose = &mut point.poses[host.index()][*index];
            pose.orientation = *turned * pose.orientation;
            let copy = Copy { scene, host, index: *index, body: &self.bodies[*index], pose: *pose };
            let grips: Vec<&Grip> =
                grips.iter().filter(|(_, copies)| copies.has(host)).map(|(grip, _)| grip).collect();
            let leans: Vec<&Lean> =
                leans.iter().filter(|(_, copies)| copies.has(host)).map(|(lean, _)| lean).collect();
            copy.press(&grips, &leans, &mut point);
        }
        for contact in &mut point.fingers {
            let orientation = point.poses[contact.host.index()][usize::from(contact.body)].orientation;
            contact.slides = slides.and_then(|direction| {
                let local = orientation.conjugate() * direction;
                let along = local - contact.normal * local.dot(contact.normal);
                // What presses along the direction does not slide along it.
                along.try_normalize().filter(|_| along.length() > 0.1)
            });
        }
        point
    }

    /// Other places of the body that a finger may touch, pressing as its weight needs and no script says; none on a line, where it stays on its side.
    pub(crate) fn elsewhere(&self, scene: &SceneValues, grip: &Grip) -> Vec<Grip> {
        if scene.space == Space::Line {
            return Vec::new();
        }
        let shape: &Shape = &self.bodies[grip.body].shape;
        let there = |place| Grip { place, set_force_n: None, ..grip.clone() };
        places(shape, scene.space).into_iter().map(there).collect()
    }

    /// No point of a body is farther than this from its centre, m.
    pub(crate) fn radius_m(&self, body: usize) -> f64 {
        reach_m(&self.bodies[body].shape)
    }
}

impl Grip {
    /// Whether a script presses there.
    pub(crate) fn is_told(&self) -> bool {
        self.set_force_n.is_some()
    }

    /// Where it touches, body frame, m.
    pub(crate) fn touches_at(&self) -> DVec3 {
        self.place.point
    }

    /// Whether a motion of the whole session that maps positions and directions by `map` takes this contact to `other`.
    pub(crate) fn is_mapped_to(&self, other: &Self, map: &dyn Fn(DVec3) -> DVec3) -> bool {
        let near = |one: DVec3, other: DVec3| one.distance(other) <= 1e-9 * (1.0 + other.length());
        let Place { point, normal, .. } = self.place;
        self.set_force_n == other.set_force_n
            && near(map(point), other.place.point)
            && near(map(normal), other.place.normal)
            && self.place.is_curved_like(&other.place)
    }
}
