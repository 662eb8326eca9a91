//! A session whose contacts open and close: its loop without them, and what each of them reads and acts on.

use cotouch_scene::names::{HostIndex, Part};
use cotouch_scene::scene::{Architecture, SceneValues, SpringDamper};
use cotouch_world::coordination;
use cotouch_world::wall::FixedPlane;
use cotouch_world::{ContactModel, ContactState, Sphere, touch_plane};
use glam::{DMat3, DVec3};

use super::session::{SessionLoop, point_axes};
use crate::contact::cross;
use crate::loop_spec::{BodyId, Columns, Dof, ForceGains, LineId, LoopSpec, Motion, Rows};
use crate::operating_point::{CornerContact, FingerContact, OperatingPoint, gains};

/// A session linearised about an operating point whose contacts open and close, one-sidedly and with friction.
#[derive(Clone, Debug)]
pub(crate) struct OneSidedLoop {
    /// The loop without them.
    pub(crate) spec: LoopSpec,
    /// In the order of the operating point: those of fingers first.
    pub(crate) contacts: Vec<OneSidedContact>,
    /// `[user][finger]`.
    pub(crate) hands: Vec<Vec<BodyId>>,
    /// `[host][body]`; none for what is fixed, or not kept at this host.
    pub(crate) copies: Vec<Vec<Option<BodyId>>>,
}

/// A sphere and a flat face that just touch where nothing has moved.
#[derive(Clone, Debug)]
pub(crate) struct OneSidedContact {
    /// Where the sphere's centre is relative to the surface's point at the same place (m), then how fast (m/s), along the
    /// axes in which points move.
    pub(crate) motion: ForceGains,
    /// What the force on the sphere does.
    pub(crate) effects: Vec<Effect>,
    /// Outward, world, of length 1.
    pub(crate) normal: DVec3,
    law: ContactModel,
}

/// `gain·F` (world, N) is one component of the force on a body, or of a force sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effect {
    pub(crate) on: Affected,
    pub(crate) component: usize,
    pub(crate) gain: DVec3,
}

/// What a contact's force acts on.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Affected {
    Body(BodyId),
    /// The samples that go back to a client.
    Sample(LineId),
}

impl OneSidedContact {
    /// One tick: the force on the sphere (world, N), given where it is relative to the surface (m) and how fast (m/s).
    pub(crate) fn force(&self, state: &mut ContactState, place: DVec3, velocity: DVec3) -> DVec3 {
        let plane = FixedPlane { point: DVec3::ZERO, normal: self.normal };
        let sphere = Sphere { centre: place, velocity, radius_m: 0.0 };
        touch_plane(&self.law, state, &plane, &sphere).map_or(DVec3::ZERO, |touch| touch.force)
    }
}

/// The session about `point`: contacts of fingers, and of corners with walls, are those of `candidates`; those that are closed
/// at `point` always are. Everything is linear about the operating point but the contacts themselves, whose faces are flat
/// and keep their direction. Pulses at a first contact are left out.
pub(crate) fn one_sided(
    scene: &SceneValues,
    point: &OperatingPoint,
    candidates: &OperatingPoint,
) -> OneSidedLoop {
    let schemes = coordination::gains(&scene.coupling).map(|gains| coordination::scheme(scene, gains));
    let mut session = SessionLoop::new(scene, point, &candidates.fingers, schemes);
    let mut contacts: Vec<_> = candidates.fingers.iter().map(|at| of_finger(&mut session, at)).collect();
    contacts.extend(candidates.corners.iter().filter_map(|at| of_corner(&session, at)));
    OneSidedLoop { spec: session.spec, contacts, hands: session.fingers, copies: session.copies }
}

fn of_finger(session: &mut SessionLoop, at: &FingerContact) -> OneSidedContact {
    let &FingerContact { host, user, finger, body, centre, normal, .. } = at;
    let hand = session.fingers[user.index()][usize::from(finger)];
    let copy = session.copies[host.index()][usize::from(body)];
    let pose = session.point.poses[host.index()][usize::from(body)];
    let arm = centre - pose.position;
    let sphere = if user == host {
        Motion::Current(hand)
    } else {
        Motion::Held(session.held(host, user, Part::Hand(finger), hand))
    };
    let on_finger = if user == host {
        Some(Affected::Body(hand))
    } else if session.scene.session.architecture == Architecture::Centralized {
        Some(Affected::Sample(returned(session, host, user, finger)))
    } else {
        None
    };
    let axes = point_axes(session.scene.space);
    let mut motion = RelativeMotion::new(axes);
    motion.add(sphere, session.spec.bodies[hand.0].axes, 1.0, DVec3::ZERO);
    let mut effects: Vec<_> =
        on_finger.into_iter().flat_map(|on| effects(on, axes, 1.0, DVec3::ZERO)).collect();
    if let Some(copy) = copy {
        let axes = session.spec.bodies[copy.0].axes;
        motion.add(Motion::Current(copy), axes, -1.0, arm);
        effects.extend(self::effects(Affected::Body(copy), axes, -1.0, arm));
    }
    let gains = gains(session.scene, host, user);
    let contact = &session.scene.contact;
    let friction = [contact.static_friction, contact.dynamic_friction];
    OneSidedContact {
        motion: motion.coupling,
        effects,
        normal: pose.orientation * normal,
        law: law(session.scene, [gains.normal, gains.tangential], friction),
    }
}

/// The samples of the force that goes back to a client's finger; all its contacts add to the same.
fn returned(session: &mut SessionLoop, server: HostIndex, client: HostIndex, finger: u8) -> LineId {
    let is_it = |line: &crate::loop_spec::Line| {
        (line.host, line.from, line.part) == (client, server, Part::Force(finger))
    };
    match session.spec.lines.iter().position(is_it) {
        Some(line) => LineId(line),
        None => {
            let nothing = ForceGains::new(point_axes(session.scene.space).len());
            session.send_force(server, client, usize::from(finger), nothing)
        }
    }
}

/// None where the body is fixed.
fn of_corner(session: &SessionLoop, at: &CornerContact) -> Option<OneSidedContact> {
    let &CornerContact { host, wall, body, corner, .. } = at;
    let copy = session.copies[host.index()][usize::from(body)]?;
    let arm = session.point.poses[host.index()][usize::from(body)].orientation * corner;
    let axes = session.spec.bodies[copy.0].axes;
    let mut motion = RelativeMotion::new(point_axes(session.scene.space));
    motion.add(Motion::Current(copy), axes, 1.0, arm);
    let wall_law = &session.scene.wall;
    let spring = |stiffness_n_per_m, damping_n_s_per_m| SpringDamper { stiffness_n_per_m, damping_n_s_per_m };
    let springs = [
        spring(wall_law.stiffness_n_per_m, wall_law.damping_n_s_per_m),
        spring(wall_law.tangential_stiffness_n_per_m, wall_law.tangential_damping_n_s_per_m),
    ];
    Some(OneSidedContact {
        motion: motion.coupling,
        effects: effects(Affected::Body(copy), axes, 1.0, arm).collect(),
        normal: session.scene.walls()[wall].normal.normalize(),
        law: law(session.scene, springs, [wall_law.static_friction, wall_law.dynamic_friction]),
    })
}

fn law(scene: &SceneValues, springs: [SpringDamper; 2], friction: [f64; 2]) -> ContactModel {
    ContactModel {
        normal: springs[0],
        tangential: springs[1],
        static_friction: friction[0],
        dynamic_friction: friction[1],
        stick_speed_m_per_s: scene.contact.stick_speed_m_per_s,
        period_s: scene.rates.control_hz.period_s(),
        cancellation: None,
    }
}

/// Where a point is and how fast, as what bodies do adds up.
struct RelativeMotion {
    coupling: ForceGains,
    axes: &'static [Dof],
}

impl RelativeMotion {
    fn new(axes: &'static [Dof]) -> Self {
        Self { coupling: ForceGains::new(2 * axes.len()), axes }
    }

    /// `sign` times the motion of a body's point at `arm` from its centre (m).
    fn add(&mut self, motion: Motion, moves: &'static [Dof], sign: f64, arm: DVec3) {
        for (turns, lever) in [(false, DMat3::IDENTITY), (true, -cross(arm))] {
            for velocity in [false, true] {
                let first = self.coupling.terms.len();
                let rows = Rows { axes: self.axes, turns: false };
                self.coupling.add(rows, (motion, moves), Columns { turns, velocity }, &(lever * sign));
                let later = if velocity { self.axes.len() } else { 0 };
                self.coupling.terms[first..].iter_mut().for_each(|term| term.component += later);
            }
        }
    }
}

/// What `sign` times a force at `arm` from a body's centre (m) does along and about its axes.
fn effects(on: Affected, axes: &'static [Dof], sign: f64, arm: DVec3) -> impl Iterator<Item = Effect> {
    axes.iter().enumerate().map(move |(component, dof)| {
        let axis = DVec3::AXES[dof.axis().index()];
        // (r×F)·e = F·(e×r)
        let gain = if dof.turns() { axis.cross(arm) } else { axis };
        Effect { on, component, gain: gain * sign }
    })
}
