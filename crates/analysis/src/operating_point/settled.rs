//! The settled grasp of a scene: which finger presses where, which body can lie against which wall.

use cotouch_scene::geometry::Pose;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, Architecture, Body, SceneValues, Space, SpringDamper, WallSides};
use glam::{DMat3, DVec3};

use super::faces::{Place, corners_at_wall, has_surface, place, reach_m};
use super::point::{CornerContact, FingerContact, OperatingPoint};
use super::statics::{Push, balance};
use crate::contact::Gains;
use crate::left_out::LeftOut;

/// A finger that stands its ground touches a body when it starts nearer to it than this.
const NEAR_M: f64 = 0.01;

/// How readily a force that a script sets changes, against 1 for one that nobody sets.
const SET_READINESS: f64 = 1e-3;

/// A finger that can press on a body.
#[derive(Clone, Debug)]
pub(crate) struct Grip {
    /// "anna.finger1".
    pub(crate) name: String,
    pub(crate) user: HostIndex,
    pub(crate) finger: u8,
    pub(crate) body: usize,
    pub(super) place: Place,
    /// What its script says that it presses with, N.
    pub(super) set_force_n: Option<f64>,
}

/// A body that can lie against a wall.
#[derive(Clone, Debug)]
pub(crate) struct Lean {
    /// The wall's name, with the body's where there are several that move.
    pub(crate) name: String,
    pub(crate) wall: usize,
    pub(crate) body: usize,
    /// Body frame, m.
    pub(crate) corners: Vec<DVec3>,
    /// It also pulls, so it never switches.
    pub(crate) two_sided: bool,
}

/// Every contact that a scene can have about its start.
#[derive(Clone, Debug, Default)]
pub(crate) struct Settled {
    pub(crate) grips: Vec<Grip>,
    pub(crate) leans: Vec<Lean>,
    /// What can happen and was left out.
    pub(crate) left_out: Vec<LeftOut>,
}

impl Settled {
    pub(crate) fn of(scene: &SceneValues) -> Self {
        let bodies = scene.world_bodies();
        let poses = OperatingPoint::free(scene).poses.swap_remove(0);
        let mut settled = Self::default();
        settled.add_grips(scene, &bodies, &poses);
        settled.leans = leans(scene, &bodies, &poses);
        settled
    }

    /// The same with every finger: one that its script sends nowhere touches the moving body that is nearest to it.
    pub(crate) fn of_every_finger(scene: &SceneValues) -> Self {
        let mut settled = Self::of(scene);
        let bodies = scene.world_bodies();
        let poses = OperatingPoint::free(scene).poses.swap_remove(0);
        for host in scene.hosts() {
            for finger in 0..scene.users[host.index()].fingers.len() {
                let from = Start { scene, bodies: &bodies, poses: &poses, host, finger };
                if !settled.grips.iter().any(|grip| (grip.user, usize::from(grip.finger)) == (host, finger)) {
                    settled.grips.extend(from.reaching_nearest());
                }
            }
        }
        settled.grips.sort_by_key(|grip| (grip.user, grip.finger));
        settled
    }

    /// Contacts that never switch: places in `leans`.
    pub(crate) fn always(&self) -> Vec<usize> {
        (0..self.leans.len()).filter(|&lean| self.leans[lean].two_sided).collect()
    }

    fn add_grips(&mut self, scene: &SceneValues, bodies: &[Body], poses: &[Pose]) {
        let mut standing = Vec::new();
        for host in scene.hosts() {
            for finger in 0..scene.users[host.index()].fingers.len() {
                let from = Start { scene, bodies, poses, host, finger };
                if let Some(grip) = from.grasp(&mut self.left_out).or_else(|| from.push()) {
                    self.grips.push(grip);
                } else if let Some(grip) = from.stand() {
                    standing.push(grip);
                }
            }
        }
        // Who stands beside a body that nobody pushes need not touch it.
        standing.retain(|grip| self.grips.iter().any(|other| other.body == grip.body));
        self.grips.append(&mut standing);
        self.grips.sort_by_key(|grip| (grip.user, grip.finger));
    }

    /// The operating point with these grips and leans (places in the lists) closed.
    pub(crate) fn point(&self, scene: &SceneValues, grips: &[usize], leans: &[usize]) -> OperatingPoint {
        let bodies = scene.world_bodies();
        let mut point = OperatingPoint::free(scene);
        let grips: Vec<&Grip> = grips.iter().map(|&grip| &self.grips[grip]).collect();
        let leans: Vec<&Lean> = leans.iter().map(|&lean| &self.leans[lean]).collect();
        for host in hosts_with_copies(scene) {
            for (index, body) in bodies.iter().enumerate() {
                let pose = point.poses[host.index()][index];
                let copy = Copy { scene, host, index, body, pose };
                let grips = grips.iter().copied().filter(|grip| grip.body == index);
                let leans = leans.iter().copied().filter(|lean| lean.body == index);
                copy.press(&grips.collect::<Vec<_>>(), &leans.collect::<Vec<_>>(), &mut point);
            }
        }
        point
    }
}

/// Every body that moves against every wall, by the corners that are nearest to it.
pub(super) fn leans(scene: &SceneValues, bodies: &[Body], poses: &[Pose]) -> Vec<Lean> {
    let moving = bodies.iter().filter(|body| !body.fixed).count();
    let mut leans = Vec::new();
    for (wall, plane) in scene.walls().iter().enumerate() {
        for (index, body) in bodies.iter().enumerate().filter(|(_, body)| !body.fixed) {
            let name = match moving {
                1 => plane.name.clone(),
                _ => format!("{}.{}", plane.name, body.name),
            };
            let corners = corners_at_wall(body, &poses[index], plane, scene.space);
            let two_sided = !has_surface(&body.shape) && scene.wall.sides == WallSides::Two;
            leans.push(Lean { name, wall, body: index, corners, two_sided });
        }
    }
    leans
}

impl OperatingPoint {
    /// The settled grasp of a scene: every finger that presses on a body in contact, no wall touched.
    #[must_use]
    pub fn settled_grasp(scene: &SceneValues) -> Self {
        let settled = Settled::of(scene);
        let all: Vec<usize> = (0..settled.grips.len()).collect();
        settled.point(scene, &all, &settled.always())
    }
}

/// Hosts that keep copies of bodies.
pub(crate) fn hosts_with_copies(scene: &SceneValues) -> impl Iterator<Item = HostIndex> + use<> {
    let centralized = scene.session.architecture == Architecture::Centralized;
    scene.hosts().filter(move |&host| !centralized || host == HostIndex::FIRST)
}

/// The springs and dampers between a user's finger and the copy at a host.
pub(crate) fn gains(scene: &SceneValues, host: HostIndex, user: HostIndex) -> Gains {
    let coupling = &scene.coupling;
    if host == user {
        Gains { normal: coupling.hand_object, tangential: coupling.hand_object_tangential }
    } else {
        Gains { normal: coupling.remote_hand_object, tangential: coupling.remote_hand_object_tangential }
    }
}

/// Where a finger starts, and what it is told.
pub(super) struct Start<'a> {
    pub(super) scene: &'a SceneValues,
    pub(super) bodies: &'a [Body],
    pub(super) poses: &'a [Pose],
    pub(super) host: HostIndex,
    pub(super) finger: usize,
}

impl Start<'_> {
    fn script(&self) -> &[Action] {
        self.scene.users[self.host.index()].script_of(self.finger)
    }

    fn at(&self, body: usize) -> DVec3 {
        let position = self.scene.users[self.host.index()].fingers[self.finger].position_m;
        self.poses[body].to_local(position)
    }

    fn grip(&self, body: usize, set_force_n: Option<f64>) -> Option<Grip> {
        let place = place(&self.bodies[body].shape, self.at(body), self.scene.space)?;
        Some(self.grip_at(body, place, set_force_n))
    }

    /// What its script does to a body: a grasp, or a force that pushes it there.
    pub(super) fn told(&self) -> Option<Grip> {
        self.grasp(&mut Vec::new()).or_else(|| self.push())
    }

    /// On any body with a surface, wherever its script or a hand takes it: on the side from which it comes.
    pub(super) fn reaching(&self, body: usize) -> Option<Grip> {
        let shape = &self.bodies[body].shape;
        let from = self.at(body);
        // A finger that starts inside comes from some side, too.
        let outside = DVec3::X * (1.0 + 2.0 * reach_m(shape));
        let place = place(shape, from, self.scene.space)
            .or_else(|| place(shape, outside.copysign(from), self.scene.space))?;
        Some(self.grip_at(body, place, None))
    }

    /// On the nearest body with a surface that can move, if there is one.
    fn reaching_nearest(&self) -> Option<Grip> {
        let can_move = |&body: &usize| !self.bodies[body].fixed && has_surface(&self.bodies[body].shape);
        let grips = (0..self.bodies.len()).filter(can_move).filter_map(|body| self.reaching(body));
        let distance_m = |grip: &Grip| self.at(grip.body).distance(grip.place.point);
        grips.min_by(|one, other| distance_m(one).total_cmp(&distance_m(other)))
    }

    fn grip_at(&self, body: usize, place: Place, set_force_n: Option<f64>) -> Grip {
        let user = &self.scene.users[self.host.index()];
        let name = format!("{}.finger{}", user.name, self.finger + 1);
        let finger = self.finger as u8;
        Grip { name, user: self.host, finger, body, place, set_force_n }
    }

    /// By a `grasp` in its script.
    fn grasp(&self, left_out: &mut Vec<LeftOut>) -> Option<Grip> {
        let grasps = self.script().iter().find_map(|action| match action {
            Action::Grasp { body, force_n, .. } => Some((body, *force_n)),
            _ => None,
        });
        let (name, force_n) = grasps?;
        let body = self.bodies.iter().position(|body| body.name == *name)?;
        let grip = self.grip(body, Some(force_n));
        if grip.is_none() && has_surface(&self.bodies[body].shape) {
            left_out.push(LeftOut::new(
                format!(
                    "The grasp of {name} by finger {} of {}",
                    self.finger + 1,
                    self.scene.users[self.host.index()].name
                ),
                "the finger starts inside the body",
            ));
        }
        grip
    }

    /// By a force that pushes it at a body.
    fn push(&self) -> Option<Grip> {
        let force = self.script().iter().find_map(|action| match *action {
            Action::Force { force_n, .. } | Action::PushAndLetGo { force_n, .. } => Some((force_n, false)),
            Action::SinusoidalForce { amplitude_n, .. } => Some((amplitude_n, true)),
            _ => None,
        });
        let (force, swings) = force?;
        let pushed = self.ahead().filter_map(|(body, gap_m, normal)| {
            let press_n = -(self.poses[body].orientation * normal).dot(force);
            let pushes = if swings { press_n != 0.0 } else { press_n > 0.0 };
            pushes.then_some((body, gap_m, press_n))
        });
        let (body, _, press_n) = pushed.min_by(|one, other| one.1.total_cmp(&other.1))?;
        self.grip(body, (!swings).then_some(press_n))
    }

    /// By tracking a path beside a body.
    fn stand(&self) -> Option<Grip> {
        let near = self.ahead().filter(|&(_, gap_m, _)| gap_m <= NEAR_M);
        let (body, ..) = near.min_by(|one, other| one.1.total_cmp(&other.1))?;
        self.script().iter().any(Action::tracks).then(|| self.grip(body, None))?
    }

    /// Bodies that the finger would meet by going straight: gap (m) and normal (body frame).
    fn ahead(&self) -> impl Iterator<Item = (usize, f64, DVec3)> + '_ {
        (0..self.bodies.len()).filter_map(|body| {
            let from = self.at(body);
            let Place { point, normal, .. } = place(&self.bodies[body].shape, from, self.scene.space)?;
            let away = from - point;
            let height = away.dot(normal);
            let beside = (away - normal * height).length();
            (beside <= 1e-9).then_some((body, height - self.scene.hand.finger_radius_m, normal))
        })
    }
}

/// A host's copy of a body.
pub(super) struct Copy<'a> {
    pub(super) scene: &'a SceneValues,
    pub(super) host: HostIndex,
    pub(super) index: usize,
    pub(super) body: &'a Body,
    pub(super) pose: Pose,
}

impl Copy<'_> {
    /// Adds the contacts of this copy, with forces that keep it still.
    pub(super) fn press(&self, grips: &[&Grip], leans: &[&Lean], point: &mut OperatingPoint) {
        let walls = self.scene.walls();
        let of_grips = grips.iter().map(|grip| self.push_of(grip));
        let of_leans = leans.iter().flat_map(|lean| {
            let normal = walls[lean.wall].normal.normalize();
            let push = move |&corner: &DVec3| Push {
                arm: self.pose.orientation * corner,
                normal,
                force: DVec3::ZERO,
                readiness: 1.0,
            };
            lean.corners.iter().map(push)
        });
        let mut pushes: Vec<Push> = of_grips.chain(of_leans).collect();
        if !self.body.fixed {
            let turns = has_surface(&self.body.shape);
            let free = match self.scene.space {
                Space::Line => [true, false, false, false, false, false],
                Space::Plane => [true, true, false, false, false, turns],
                Space::Space => [true, true, true, turns, turns, turns],
            };
            balance(&mut pushes, self.scene.gravity_m_per_s2 * self.body.mass_kg, free);
        }
        for push in &mut pushes {
            // No contact pulls.
            push.force -= push.normal * push.force.dot(push.normal).min(0.0);
        }
        let (fingers, corners) = pushes.split_at(grips.len());
        point.fingers.extend(grips.iter().zip(fingers).map(|(grip, push)| self.finger(grip, push)));
        let at = leans.iter().flat_map(|lean| lean.corners.iter().map(move |&corner| (lean.wall, corner)));
        point.corners.extend(at.zip(corners).map(|((wall, corner), push)| CornerContact {
            host: self.host,
            wall,
            body: self.index as u8,
            corner,
            force: push.force,
        }));
    }

    /// What a finger does to this copy when nothing needs to be balanced: its own copy feels the script's force, and a
    /// softer one is pressed in as far.
    fn push_of(&self, grip: &Grip) -> Push {
        let felt_by = match self.scene.session.architecture {
            Architecture::Distributed => grip.user,
            Architecture::Centralized => HostIndex::FIRST,
        };
        let felt = gains(self.scene, felt_by, grip.user).normal.stiffness_n_per_m;
        let here = gains(self.scene, self.host, grip.user).normal.stiffness_n_per_m;
        let share = if felt > 0.0 { here / felt } else { 1.0 };
        let normal = -(self.pose.orientation * grip.place.normal);
        Push {
            arm: self.pose.orientation * grip.place.centre(self.scene.hand.finger_radius_m, 0.0),
            normal,
            force: normal * (share * grip.set_force_n.unwrap_or(0.0)),
            readiness: if grip.set_force_n.is_some() { SET_READINESS } else { 1.0 },
        }
    }

    fn finger(&self, grip: &Grip, push: &Push) -> FingerContact {
        let Gains { normal, tangential } = gains(self.scene, self.host, grip.user);
        let over = |force: DVec3, SpringDamper { stiffness_n_per_m, .. }: SpringDamper| {
            if stiffness_n_per_m > 0.0 { force / stiffness_n_per_m } else { DVec3::ZERO }
        };
        let force = -push.force;
        let local = self.pose.orientation.conjugate() * force;
        let across = grip.place.normal * local.dot(grip.place.normal);
        let depth_m = over(across, normal).length();
        let radius_m = self.scene.hand.finger_radius_m;
        let centre = grip.place.centre(radius_m, depth_m);
        FingerContact {
            host: self.host,
            user: grip.user,
            finger: grip.finger,
            body: self.index as u8,
            centre: self.pose.to_world(centre),
            normal: grip.place.normal,
            anchor: centre + over(across, normal) + over(local - across, tangential),
            curvature: if normal.stiffness_n_per_m > 0.0 {
                grip.place.curvature(radius_m, depth_m)
            } else {
                DMat3::ZERO
            },
            force,
            slides: None,
        }
    }
}
