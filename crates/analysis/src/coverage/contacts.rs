//! The contacts that one body can have, and which of them can be closed at once.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Scene, Space};
use glam::{DQuat, DVec3};

use crate::operating_point::{Arrangement, Copies, Reach, hosts_with_copies};

/// A contact that opens and closes by itself: a finger or a wall at one host's copy of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Contact {
    pub(super) with: With,
    pub(super) copy: HostIndex,
}

/// What touches the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum With {
    /// A place in [`Reach::grips`].
    Finger(usize),
    /// A place in [`Reach::leans`].
    Wall(usize),
}

/// Contacts that are closed: places in [`BodyContacts::all`], in order.
pub(super) type Set = Vec<usize>;

/// The contacts of one body.
#[derive(Clone, Debug)]
pub(super) struct BodyContacts {
    pub(super) body: usize,
    pub(super) fixed: bool,
    pub(super) all: Vec<Contact>,
    /// Walls that pull as well, which never open.
    always: Vec<usize>,
}

impl BodyContacts {
    pub(super) fn of(scene: &Scene, reach: &Reach, body: usize) -> Self {
        let fixed = reach.bodies[body].fixed;
        let centralized = scene.session.architecture == Architecture::Centralized;
        let mut all = Vec::new();
        for (grip, at) in reach.grips.iter().enumerate().filter(|(_, grip)| grip.body == body) {
            // Only the host that renders on a finger feels what does not move.
            let feels = |copy: &HostIndex| !fixed || centralized || *copy == at.user;
            let copies = hosts_with_copies(scene).filter(feels);
            all.extend(copies.map(|copy| Contact { with: With::Finger(grip), copy }));
        }
        let mut always = Vec::new();
        for (lean, at) in reach.leans.iter().enumerate().filter(|(_, lean)| lean.body == body) {
            if at.two_sided {
                always.push(lean);
            } else {
                all.extend(hosts_with_copies(scene).map(|copy| Contact { with: With::Wall(lean), copy }));
            }
        }
        Self { body, fixed, all, always }
    }

    /// Fingers and walls, each once.
    pub(super) fn touching(&self, set: &[usize]) -> Vec<With> {
        let mut touching: Vec<With> = Vec::new();
        for &contact in set {
            let with = self.all[contact].with;
            if !touching.contains(&with) {
                touching.push(with);
            }
        }
        touching
    }

    /// Whether a body can have these contacts at once: walls that face each other only where there is no room between
    /// them, no more walls than there are directions, of what does not move one finger at a time, for nothing
    /// joins them, and on a line only where copies can be in such a row.
    pub(super) fn can_be(&self, scene: &Scene, reach: &Reach, set: &[usize]) -> bool {
        let walls: Vec<usize> = self
            .touching(set)
            .into_iter()
            .filter_map(|with| match with {
                With::Wall(lean) => Some(reach.leans[lean].wall),
                With::Finger(_) => None,
            })
            .collect();
        let most = match scene.space {
            Space::Line => 1,
            Space::Plane => 2,
            Space::Space => 3,
        };
        let planes = scene.walls();
        let pair = |one: usize, other: usize| {
            let (one, other) = (&planes[one], &planes[other]);
            let (along, against) = (one.normal.normalize(), other.normal.normalize());
            let turned = along.dot(against);
            let apart_m = (one.point_m - other.point_m).dot(along).abs();
            turned.abs() < 0.99 || (turned < 0.0 && apart_m < 2.0 * reach.radius_m(self.body))
        };
        let wedged =
            walls.iter().enumerate().all(|(n, &one)| walls[n + 1..].iter().all(|&other| pair(one, other)));
        let opposed = walls.len() <= most || scene.space == Space::Line && walls.len() == 2;
        let in_a_row = scene.space != Space::Line || self.can_be_in_a_row(scene, reach, set);
        (!self.fixed || set.len() <= 1) && wedged && opposed && in_a_row
    }

    /// On a line copies are in a row, in whichever order: what touches from the left touches those that are farthest to the
    /// left, so that of two on one side one touches all that the other does, and both leave the farthest to the right.
    fn can_be_in_a_row(&self, scene: &Scene, reach: &Reach, set: &[usize]) -> bool {
        let all = all_copies(scene);
        // The left end of the row, as far as what is on either side says.
        let left_end = |&with: &With| {
            let Copies(touched) = self.copies(set, with);
            if self.is_on_the_left(reach, with) { touched } else { all.0 & !touched }
        };
        let ends: Vec<u32> = self.touching(set).iter().map(left_end).collect();
        let nested = |one: u32, other: u32| one & other == one || one & other == other;
        ends.iter().enumerate().all(|(n, &one)| ends[n + 1..].iter().all(|&other| nested(one, other)))
    }

    fn is_on_the_left(&self, reach: &Reach, with: With) -> bool {
        let orientation = reach.poses[self.body].orientation;
        let at = match with {
            With::Finger(grip) => reach.grips[grip].touches_at(),
            With::Wall(lean) => reach.leans[lean].corners.iter().sum(),
        };
        (orientation * at).x < 0.0
    }

    /// The copies at which one of a set's fingers or walls touches.
    fn copies(&self, set: &[usize], with: With) -> Copies {
        let closed = set.iter().map(|&contact| self.all[contact]).filter(|contact| contact.with == with);
        closed.fold(Copies(0), |copies, contact| copies.with(contact.copy))
    }

    /// Where a session has these contacts.
    pub(super) fn arrangement(&self, scene: &Scene, reach: &Reach, set: &[usize]) -> Arrangement {
        let touching = self.touching(set);
        let grips = touching.iter().filter_map(|&with| match with {
            With::Finger(grip) => Some((reach.grips[grip].clone(), self.copies(set, with))),
            With::Wall(_) => None,
        });
        let walls = touching.iter().filter_map(|&with| match with {
            With::Wall(lean) => Some((reach.leans[lean].clone(), self.copies(set, with))),
            With::Finger(_) => None,
        });
        let always = self.always.iter().map(|&lean| (reach.leans[lean].clone(), all_copies(scene)));
        Arrangement {
            body: self.body,
            turned: DQuat::IDENTITY,
            grips: grips.collect(),
            leans: walls.chain(always).collect(),
            slides: None,
        }
    }
}

/// Every copy that there is.
pub(super) fn all_copies(scene: &Scene) -> Copies {
    hosts_with_copies(scene).fold(Copies(0), Copies::with)
}

/// What a mode's contacts are called.
pub(super) fn names(scene: &Scene, reach: &Reach, arrangement: &Arrangement) -> Vec<String> {
    let several =
        reach.bodies.iter().filter(|body| crate::operating_point::has_surface(&body.shape)).count() > 1;
    let fingers = arrangement.grips.iter().map(|(grip, copies)| {
        // Where a script presses, the body goes without saying.
        let on = if several && !grip.is_told() {
            format!(" on {}", reach.bodies[grip.body].name)
        } else {
            String::new()
        };
        let sliding = if arrangement.slides.is_some() { " sliding" } else { "" };
        let copies =
            if reach.bodies[grip.body].fixed { String::new() } else { copies_in_words(scene, *copies) };
        format!("{}{on}{copies}{sliding}", grip.name)
    });
    let walls = arrangement.leans.iter().filter(|(lean, _)| !lean.two_sided);
    let walls = walls.map(|(lean, copies)| format!("{}{}", lean.name, copies_in_words(scene, *copies)));
    fingers.chain(walls).collect()
}

/// Whose copies, where it is not all of them.
fn copies_in_words(scene: &Scene, copies: Copies) -> String {
    if copies == all_copies(scene) {
        return String::new();
    }
    let whose = scene.hosts().filter(|&host| copies.has(host));
    let whose: Vec<String> = whose.map(|host| format!("{}'s", scene.users[host.index()].name)).collect();
    let word = if whose.len() == 1 { "copy" } else { "copies" };
    format!(" ({} {word})", whose.join(" and "))
}

/// Directions in which fingers can slide past a body.
pub(super) fn directions(space: Space) -> Vec<DVec3> {
    let axes = match space {
        // A finger on a line has no way along a surface.
        Space::Line => 0,
        Space::Plane => 2,
        Space::Space => 3,
    };
    DVec3::AXES[..axes].iter().flat_map(|&axis| [axis, -axis]).collect()
}
