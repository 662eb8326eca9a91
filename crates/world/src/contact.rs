//! The contact of a sphere with a surface: a spring and damper across it, another along it, and friction that sticks.
//!
//! With the depth `d` along the outward normal `n`, the sphere's centre `c` and the anchor `a` in the body's frame, and
//! `v` the velocity of the centre relative to the body's point at the same place:
//!
//! * across: `f_n = max(0, k_N·d + b_N·ḋ)`, never a pull;
//! * along, while it sticks: `f_t = −k_T·(I − n·nᵀ)(c − a) − b_T·(I − n·nᵀ)·v`, as long as `|f_t| ≤ μ_s·f_n` (7.3);
//! * along, while it slides: `|f_t| ≤ μ_k·f_n` (7.4). The anchor is dragged so that the sticking law would give just
//!   that force; so a contact that sticks again does so without a jump, and what sticks never creeps.
//!
//! The anchor is on the surface of spheres that just touch, at `c + d·n` where it is set: on a flat face that is the
//! same, and where the normal turns, at edges and between facets, what is deep does not count as slip.
//!
//! It sticks again where the tangential speed is at most `v_tr` (Fotoohi Ghiam 2006, Fig. 7.4). At first contact the device may be
//! pushed to a stop by pulses of its largest force, (7.1)–(7.2).
//!
//! The body gets the opposite force on the line through the sphere's centre. A tick allocates nothing.

use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::scene::SpringDamper;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::approach::Approach;
use crate::corner::CornerSphere;
use crate::probe::Probe;
use crate::shape::Surface;
use crate::wall::FixedPlane;

/// The constants of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactModel {
    /// k_N, b_N: across the surface.
    pub normal: SpringDamper,
    /// k_T, b_T: along the surface.
    pub tangential: SpringDamper,
    /// Coefficient of static friction μ_s.
    pub static_friction: f64,
    /// μ_k, at most μ_s.
    pub dynamic_friction: f64,
    /// v_tr: a contact that slides more slowly than this sticks.
    pub stick_speed_m_per_s: f64,
    /// T_c: time between ticks.
    pub period_s: f64,
    /// Whether, and how, the device is pushed to a stop on first contact.
    pub cancellation: Option<Cancellation>,
}

/// The device that moment cancellation pushes to a stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cancellation {
    /// F_max: the force of a pulse.
    pub max_force_n: f64,
    /// m_h: hand and device together.
    pub mass_kg: f64,
}

impl ContactModel {
    /// Ticks for which two must be apart before they touch for the first time again.
    fn rest_ticks(&self) -> u16 {
        (APART_S / self.period_s) as u16
    }

    /// The contact with a peer whose coupling fades in or out: `share` (0 to 1) of stiffness and damping, and no pulses
    /// unless it is all there.
    #[must_use]
    pub fn faded(self, share: f64) -> Self {
        let faded = |spring: SpringDamper| SpringDamper {
            stiffness_n_per_m: share * spring.stiffness_n_per_m,
            damping_n_s_per_m: share * spring.damping_n_s_per_m,
        };
        let cancellation = self.cancellation.filter(|_| share >= 1.0);
        Self { normal: faded(self.normal), tangential: faded(self.tangential), cancellation, ..self }
    }

    /// How many pulses of its largest force stop the device that meets a body of `inverse_mass_of_body_per_kg` at
    /// `approach_m_per_s`: ⌊m·v_c/(T_c·F_max)⌋, (7.2), with the reduced mass of the two.
    #[must_use]
    pub fn pulses(&self, approach_m_per_s: f64, inverse_mass_of_body_per_kg: f64) -> u32 {
        let Some(Cancellation { max_force_n, mass_kg }) = self.cancellation else { return 0 };
        let reduced_mass_kg = mass_kg / (1.0 + mass_kg * inverse_mass_of_body_per_kg);
        // A cast of what is not a number, or negative, gives 0.
        (reduced_mass_kg * approach_m_per_s / (self.period_s * max_force_n)).floor() as u32
    }

    fn has_force(&self) -> bool {
        self.normal.stiffness_n_per_m > 0.0 || self.normal.damping_n_s_per_m > 0.0
    }
}

/// What a contact does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Nothing: sphere and surface are apart.
    #[default]
    Free,
    /// It pushes the device to a stop.
    MomentCancellation {
        /// Ticks with the largest force, this one included.
        pulses_left: u32,
    },
    /// The sphere sticks to its anchor.
    PreSlide,
    /// The sphere slides along the surface.
    Slide,
}

/// What a contact remembers between ticks: a plain value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactState {
    /// What the contact does in the present tick.
    pub phase: Phase,
    /// Where the centre of a sphere that just touches is held along the surface, body frame, m. Only its tangential part
    /// counts; being on the surface, it counts the same for the next face.
    pub anchor: DVec3,
    /// From which side the sphere came.
    pub proxy: Approach,
    /// Ticks that the two must still be apart before a contact counts as a first one again. A sphere that rattles on a
    /// surface, or whose velocity is told in coarse steps, would else be pushed to a stop again and again.
    pub rest_ticks: u16,
}

/// So long must sphere and surface be apart for the next contact to be a first one, s.
const APART_S: f64 = 0.1;

impl ContactState {
    /// Of a sphere that is not seen to come: it is no first contact.
    #[must_use]
    pub fn begun_anew(model: &ContactModel) -> Self {
        Self { rest_ticks: model.rest_ticks(), ..Self::default() }
    }

    /// Apart, still knowing the side.
    fn release(&mut self) {
        let rest_ticks = self.rest_ticks.saturating_sub(1);
        *self = Self { proxy: self.proxy, rest_ticks, ..Self::default() };
    }
}

/// A sphere that touches: a finger, or a corner of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Where the centre is in the world's frame, m.
    pub centre: DVec3,
    /// Of the centre, world, m/s.
    pub velocity: DVec3,
    /// Radius of the sphere, m.
    pub radius_m: f64,
}

impl Sphere {
    /// A corner of a body that is at a pose, with a twist.
    #[must_use]
    pub fn from_corner(corner: &CornerSphere, (pose, twist): (&Pose, &Twist)) -> Self {
        let arm = pose.orientation * corner.centre;
        let velocity = twist.linear + twist.angular.cross(arm);
        Self { centre: pose.position + arm, velocity, radius_m: corner.radius_m }
    }
}

/// What a contact does in one tick, in the world's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactForce {
    /// On the sphere, N; the body gets the opposite at `point`.
    pub force: DVec3,
    /// Where it acts on both: the sphere's centre, m.
    pub point: DVec3,
    /// The surface's outward unit normal.
    pub normal: DVec3,
    /// How far the sphere reaches beneath the surface, m.
    pub depth_m: f64,
    /// What the contact did.
    pub phase: Phase,
    /// Size of the force's part along the normal, N.
    pub normal_force_n: f64,
    /// Size of the rest, N.
    pub tangential_force_n: f64,
}

impl ContactForce {
    /// On the body whose surface is touched and whose centre of mass is at `position` (m): about that.
    #[must_use]
    pub fn on_surface(&self, position: DVec3) -> Wrench {
        wrench(-self.force, self.point - position)
    }

    /// On the body that the sphere is a corner of, about its centre of mass at `position` (m).
    #[must_use]
    pub fn on_sphere(&self, position: DVec3) -> Wrench {
        wrench(self.force, self.point - position)
    }
}

fn wrench(force: DVec3, arm: DVec3) -> Wrench {
    Wrench { force, torque: arm.cross(force) }
}

/// One tick of the contact of `sphere` with the `surface` of a body at a pose, with a twist. `None` where they are
/// apart, or the model has no force.
///
/// To be called in every tick; a caller who knows that the two are far apart may set `state` to its default instead.
#[must_use]
pub fn touch(
    model: &ContactModel,
    state: &mut ContactState,
    surface: &Surface,
    (pose, twist): (&Pose, &Twist),
    sphere: &Sphere,
    inverse_mass_of_body_per_kg: f64,
) -> Option<ContactForce> {
    let arm = sphere.centre - pose.position;
    let reach = surface.bounding_radius_m() + sphere.radius_m;
    if !surface.exists() || arm.length_squared() > reach * reach {
        *state = ContactState {
            proxy: surface.seen_far(pose.orientation.conjugate() * arm),
            ..ContactState::default()
        };
        return None;
    }
    let to_body = pose.orientation.conjugate();
    let centre = to_body * arm;
    let velocity = to_body * (sphere.velocity - twist.linear - twist.angular.cross(arm));
    let Some(probe) = surface.probe(&mut state.proxy, centre, sphere.radius_m) else {
        state.release();
        return None;
    };
    let moving = Relative { centre, velocity, inverse_mass_of_body_per_kg };
    let mut force = respond(model, state, &probe, &moving)?;
    force.force = pose.orientation * force.force;
    force.normal = pose.orientation * force.normal;
    force.point = sphere.centre;
    Some(force)
}

/// One tick of the contact of `sphere` with a plane that never moves; the anchor is in the world's frame.
#[must_use]
pub fn touch_plane(
    model: &ContactModel,
    state: &mut ContactState,
    plane: &FixedPlane,
    sphere: &Sphere,
) -> Option<ContactForce> {
    let height = plane.height(sphere.centre);
    let depth_m = sphere.radius_m - height;
    if depth_m.is_nan() || depth_m <= 0.0 {
        state.release();
        return None;
    }
    let probe = Probe { normal: plane.normal, depth_m, point: sphere.centre - height * plane.normal };
    let moving =
        Relative { centre: sphere.centre, velocity: sphere.velocity, inverse_mass_of_body_per_kg: 0.0 };
    respond(model, state, &probe, &moving)
}

/// The sphere as the body sees it: m, m/s in the body's frame.
struct Relative {
    centre: DVec3,
    velocity: DVec3,
    inverse_mass_of_body_per_kg: f64,
}

/// The force in the body's frame.
fn respond(
    model: &ContactModel,
    state: &mut ContactState,
    probe: &Probe,
    sphere: &Relative,
) -> Option<ContactForce> {
    if !model.has_force() {
        state.release();
        return None;
    }
    let approach = -sphere.velocity.dot(probe.normal);
    // The sphere's centre, if it were outside and just touched.
    let outside = sphere.centre + probe.depth_m * probe.normal;
    if state.phase == Phase::Free {
        let is_first = state.rest_ticks == 0;
        let pulses = model.pulses(approach, sphere.inverse_mass_of_body_per_kg);
        let pulses_left = if is_first { pulses } else { 0 };
        state.anchor = outside;
        state.phase =
            if pulses_left > 0 { Phase::MomentCancellation { pulses_left } } else { Phase::PreSlide };
    }
    state.rest_ticks = model.rest_ticks();
    let pulse = pulse(model, state);
    let (phase, normal_force_n, tangential) = if let Some((phase, force)) = pulse {
        state.anchor = outside;
        (phase, force, DVec3::ZERO)
    } else {
        let push = model.normal.stiffness_n_per_m * probe.depth_m + model.normal.damping_n_s_per_m * approach;
        let normal_force_n = push.max(0.0);
        let tangential = friction(model, state, probe.normal, (outside, sphere.velocity), normal_force_n);
        (state.phase, normal_force_n, tangential)
    };
    Some(ContactForce {
        force: normal_force_n * probe.normal + tangential,
        point: sphere.centre,
        normal: probe.normal,
        depth_m: probe.depth_m,
        phase,
        normal_force_n,
        tangential_force_n: tangential.length(),
    })
}

/// The pulse of this tick, if there is one, N; the contact sticks after the last.
fn pulse(model: &ContactModel, state: &mut ContactState) -> Option<(Phase, f64)> {
    let Phase::MomentCancellation { pulses_left } = state.phase else { return None };
    let phase = state.phase;
    state.phase = match pulses_left {
        0 | 1 => Phase::PreSlide,
        more => Phase::MomentCancellation { pulses_left: more - 1 },
    };
    let force = model.cancellation.filter(|_| pulses_left > 0)?.max_force_n;
    Some((phase, force))
}

/// The force along the surface on a sphere that would touch at `outside` and moves with `velocity`.
fn friction(
    model: &ContactModel,
    state: &mut ContactState,
    normal: DVec3,
    (outside, velocity): (DVec3, DVec3),
    normal_force_n: f64,
) -> DVec3 {
    let along = |vector: DVec3| vector - normal * vector.dot(normal);
    let SpringDamper { stiffness_n_per_m: stiffness, damping_n_s_per_m: damping } = model.tangential;
    let velocity = along(velocity);
    let trial = -stiffness * along(outside - state.anchor) - damping * velocity;
    let size = trial.length();
    let slow = state.phase != Phase::Slide || velocity.length() <= model.stick_speed_m_per_s;
    if slow && size <= model.static_friction * normal_force_n {
        state.phase = Phase::PreSlide;
        return trial;
    }
    state.phase = Phase::Slide;
    let limit = model.dynamic_friction * normal_force_n;
    if size <= limit {
        // The sphere turned back: the spring lets go of what it holds before the anchor is dragged again.
        return trial;
    }
    let direction = trial / size;
    let force = limit * direction;
    let stretch = if stiffness > 0.0 { -(force + damping * velocity) / stiffness } else { DVec3::ZERO };
    // The damper alone may be stronger than friction; the anchor is then at the sphere, never ahead of it.
    let ahead = stretch.dot(direction).max(0.0) * direction;
    state.anchor = outside - (stretch - ahead);
    force
}
