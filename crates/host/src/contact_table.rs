//! Which spheres meet which surfaces at a host: a fixed table, made once, so that a contact's state has its place.
//!
//! Fingers meet bodies; spheres in the corners of bodies meet walls and other bodies.

use cotouch_scene::names::HostIndex;

use crate::bodies::BodyModel;
use crate::output::ContactSurface;

/// Where each contact's state lies.
#[derive(Clone, Debug)]
pub(crate) struct ContactTable {
    /// Bodies with a surface, by their index; none at a client.
    surfaces: Vec<usize>,
    /// Where each host's fingers begin; each finger has a contact a surface.
    first_finger: Vec<usize>,
    groups: Vec<Group>,
    len: usize,
}

/// What corners may meet.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Obstacle {
    Body(u8),
    Wall(u8),
}

impl From<Obstacle> for ContactSurface {
    fn from(obstacle: Obstacle) -> Self {
        match obstacle {
            Obstacle::Body(index) => Self::Body(index),
            Obstacle::Wall(index) => Self::Wall(index),
        }
    }
}

/// All corners of one body against one surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    pub(crate) body: usize,
    pub(crate) against: Obstacle,
    /// The contact of its first corner.
    pub(crate) first: usize,
    pub(crate) corners: usize,
}

impl ContactTable {
    /// For users with so many fingers each, and so many walls.
    pub(crate) fn new(fingers: &[u8], bodies: &[BodyModel], surfaces: Vec<usize>, walls: usize) -> Self {
        let mut len = 0;
        let mut take = |count: usize| {
            len += count;
            len - count
        };
        let first_finger =
            fingers.iter().map(|&fingers| take(usize::from(fingers) * surfaces.len())).collect();
        let groups = groups(bodies, &surfaces, walls, &mut take);
        Self { surfaces, first_finger, groups, len }
    }

    /// Places for the states of contacts.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Bodies with a surface, by their index.
    pub(crate) fn surfaces(&self) -> &[usize] {
        &self.surfaces
    }

    /// All that corners may meet.
    pub(crate) fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// The contact of a finger with the `nth` surface.
    pub(crate) fn finger(&self, host: HostIndex, finger: usize, nth: usize) -> usize {
        self.first_finger[host.index()] + finger * self.surfaces.len() + nth
    }
}

/// Corners of every body that moves against every wall, then of every body against every other; two that are fixed
/// never meet.
fn groups(
    bodies: &[BodyModel],
    surfaces: &[usize],
    walls: usize,
    take: &mut impl FnMut(usize) -> usize,
) -> Vec<Group> {
    let mut groups = Vec::new();
    for &body in surfaces {
        let corners = bodies[body].surface.corners().len();
        let walls = (0..walls).filter(|_| !bodies[body].is_fixed()).map(|wall| Obstacle::Wall(wall as u8));
        let meets = |other: usize| other != body && !(bodies[body].is_fixed() && bodies[other].is_fixed());
        let others = surfaces.iter().filter(|&&other| meets(other));
        for against in walls.chain(others.map(|&other| Obstacle::Body(other as u8))) {
            groups.push(Group { body, against, first: take(corners), corners });
        }
    }
    groups
}
