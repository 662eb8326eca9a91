//! Whether a sample can be what its sender says: that it has what the scene has of that host, within reach, at speeds of hands and
//! bodies, and no further from the sample before than those speeds and the time between allow.
//!
//! With positions `x` and velocities `v` of two samples that are `t` apart (network steps times T_t), what moves by itself or by a hand
//! keeps to
//!
//! ```text
//! |x₂ − x₁| ≤ max(|v₁|, |v₂|)·t + a·t²/4 + x_0,    |v₂ − v₁| ≤ a·t + v_0
//! ```
//!
//! `a` being the largest acceleration: between two instants with known velocities the path is off their larger one by at most a·t²/4. `x_0`
//! and `v_0` are allowances for what is told late (filtered velocities, a contact between two samples). Rotations alike.

use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::limits::{MAX_FINGERS, WORLD_BOUND_M};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Scene};
use glam::DVec3;

use crate::packet::{Entry, StatePacket};

/// A finger is no further from where it starts than the scene is large, and this, m: beyond the reach of any device; a simulated hand that
/// nothing holds flies metres while its device fails or nothing is heard.
const REACH_MARGIN_M: f64 = 50.0;
/// A force or a torque that a server asks for is no more than so many times what a device may render: the governor cuts it off anyway.
const FORCE_MARGIN: f64 = 100.0;
/// A vector of a coordination scheme, whatever it means, in SI units.
const MAX_CHANNEL_VECTOR: f64 = 1e4;

/// How fast something may be, and how suddenly.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MotionLimits {
    speed_m_per_s: f64,
    acceleration_m_per_s2: f64,
    spin_rad_per_s: f64,
    spin_acceleration_rad_per_s2: f64,
}

/// A hand: the fists of Olympic boxers reach 9 m/s (Walilko et al. 2005), which no haptic device follows; and 50 times gravity.
const HAND: MotionLimits = MotionLimits {
    speed_m_per_s: 10.0,
    acceleration_m_per_s2: 500.0,
    spin_rad_per_s: 100.0,
    spin_acceleration_rad_per_s2: 1e4,
};

/// A simulated hand, which nothing holds but its mass, is driven by the largest force for so long at most, s: half a swing at 2 Hz.
const DRIVEN_S: f64 = 0.25;

/// A body, which is lighter than a hand and is also pushed by stiff contacts.
const BODY: MotionLimits = MotionLimits {
    speed_m_per_s: 100.0,
    acceleration_m_per_s2: 5000.0,
    spin_rad_per_s: 1000.0,
    spin_acceleration_rad_per_s2: 1e5,
};

/// x_0: what a position may be off the told speeds, m.
const POSITION_ALLOWANCE_M: f64 = 0.02;
/// v_0: what a speed may change at once, m/s.
const SPEED_ALLOWANCE_M_PER_S: f64 = 1.0;
/// The same of an angle, rad.
const ANGLE_ALLOWANCE_RAD: f64 = 0.2;
/// The same of an angular speed, rad/s.
const SPIN_ALLOWANCE_RAD_PER_S: f64 = 50.0;

/// Why a sample cannot be what its sender says.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Implausible {
    /// The bytes are no sample: a number that is not finite, a quaternion that is not of unit length, another layout.
    #[error("it sends what is no sample")]
    Unreadable,
    /// Something that the scene has at that host is missing.
    #[error("it leaves out {0}")]
    Missing(What),
    /// Something that the scene does not have at that host, or that is there already.
    #[error("it sends {0}, which is not its to send, or twice")]
    Surplus(What),
    /// Too far away.
    #[error("{what} is {found:.3e} m away; at most {allowed:.3} m")]
    Reach {
        /// What is too far away.
        what: What,
        /// How far it is, m.
        found: f64,
        /// How far it may be, m.
        allowed: f64,
    },
    /// Too fast.
    #[error("{what} moves at {found:.3e} m/s; at most {allowed} m/s")]
    Speed {
        /// What is too fast.
        what: What,
        /// How fast it is, m/s.
        found: f64,
        /// How fast it may be, m/s.
        allowed: f64,
    },
    /// Turns too fast.
    #[error("{what} turns at {found:.3e} rad/s; at most {allowed} rad/s")]
    Spin {
        /// What turns too fast.
        what: What,
        /// How fast it turns, rad/s.
        found: f64,
        /// How fast it may turn, rad/s.
        allowed: f64,
    },
    /// Not where its speeds can have brought it since the last sample.
    #[error("{what} jumps: {found:.3} m where {allowed:.3} m are possible")]
    Jump {
        /// What jumps.
        what: What,
        /// How far it is from where it was, m.
        found: f64,
        /// How far it may be, m.
        allowed: f64,
    },
    /// Not as fast as it can have become since the last sample.
    #[error("{what} speeds up by {found:.3} m/s; {allowed:.3} are possible")]
    Jolt {
        /// What speeds up.
        what: What,
        /// The change of velocity, m/s.
        found: f64,
        /// The largest that is possible, m/s.
        allowed: f64,
    },
    /// Not turned as its angular speeds can have turned it since the last sample.
    #[error("{what} turns in a jump: by {found:.3} rad, {allowed:.3} are possible")]
    Twist {
        /// What turns.
        what: What,
        /// The angle, or the change of angular velocity.
        found: f64,
        /// The largest that is possible.
        allowed: f64,
    },
    /// A force, a torque or a vector of the coordination that is too large.
    #[error("{what} is {found:.3e}; at most {allowed:.3e}")]
    Size {
        /// What is too large.
        what: What,
        /// How large it is, in SI units.
        found: f64,
        /// How large it may be.
        allowed: f64,
    },
}

impl Implausible {
    /// Whether it may happen to an honest host: a finger whose device fell silent and is somewhere else when it comes back.
    #[must_use]
    pub const fn may_be_accident(&self) -> bool {
        let (Self::Jump { what, .. } | Self::Jolt { what, .. } | Self::Twist { what, .. }) = self else {
            return false;
        };
        matches!(what, What::Finger(_))
    }
}

/// What of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// A finger of the sender's user, from 0.
    Finger(u8),
    /// A body, from 0.
    Body(u8),
    /// The force for a finger of the receiver's user, from 0.
    Force(u8),
    /// What the coordination scheme says of a body, from 0.
    Channel(u8),
}

impl std::fmt::Display for What {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Finger(index) => write!(f, "finger {}", index + 1),
            Self::Body(index) => write!(f, "body {}", index + 1),
            Self::Force(index) => write!(f, "force {}", index + 1),
            Self::Channel(index) => write!(f, "channel {}", index + 1),
        }
    }
}

/// What a sender said before, from which a sample is to follow.
#[derive(Clone, Copy, Debug)]
pub struct Before<'a> {
    /// The sample from which fingers follow.
    pub fingers: &'a StatePacket,
    /// The network step since which they may have changed.
    pub fingers_since: u64,
    /// The sample from which bodies follow.
    pub bodies: &'a StatePacket,
    /// The network step since which they may have changed.
    pub bodies_since: u64,
}

impl<'a> Before<'a> {
    /// All follows from one sample.
    #[must_use]
    pub const fn sample(last: &'a StatePacket) -> Self {
        Self { fingers: last, fingers_since: last.step, bodies: last, bodies_since: last.step }
    }
}

/// What samples of a scene's hosts can be. A plain value; a check does not allocate.
#[derive(Clone, Debug, PartialEq)]
pub struct Plausibility {
    architecture: Architecture,
    sends_channels: bool,
    /// Where every finger of every user starts, m.
    fingers: Vec<Vec<DVec3>>,
    /// Bodies that move, a bit each.
    moving: u32,
    reach_m: f64,
    hand: MotionLimits,
    max_force: f64,
    period_s: f64,
}

impl Plausibility {
    /// What samples can be in `scene`.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let starts = |user: &cotouch_scene::scene::User| {
            user.fingers.iter().take(MAX_FINGERS).map(|finger| finger.position_m).collect::<Vec<_>>()
        };
        let fingers: Vec<Vec<DVec3>> = scene.users.iter().map(starts).collect();
        let bodies = scene.world_bodies();
        let places = || fingers.iter().flatten().copied().chain(bodies.iter().map(|body| body.position_m));
        let apart = |from: DVec3| places().map(move |to| from.distance(to));
        let size_m = places().flat_map(apart).fold(0.0, f64::max);
        let moves = |(index, body): (usize, &cotouch_scene::scene::Body)| u32::from(!body.fixed) << index;
        Self {
            architecture: scene.session.architecture,
            sends_channels: scene.session.coordination.sends(),
            moving: bodies.iter().enumerate().map(moves).sum(),
            reach_m: size_m + REACH_MARGIN_M,
            hand: hand(scene),
            max_force: FORCE_MARGIN * scene.governor.max_force_n,
            period_s: scene.rates.network_hz.period_s(),
            fingers,
        }
    }

    /// Whether `packet`, which `from` sent to `to`, can be, after what that sender said before.
    ///
    /// # Errors
    /// The first thing that cannot be; fingers that jump come last.
    pub fn check(
        &self,
        from: HostIndex,
        to: HostIndex,
        before: Option<&Before<'_>>,
        packet: &StatePacket,
    ) -> Result<(), Implausible> {
        self.check_contents(from, to, before.map(|before| before.fingers), packet)?;
        for entry in &packet.entries {
            self.check_bounds(from, entry)?;
        }
        let Some(before) = before else { return Ok(()) };
        let apart_s = |since: u64| packet.step.abs_diff(since) as f64 * self.period_s;
        let (bodies_apart_s, fingers_apart_s) = (apart_s(before.bodies_since), apart_s(before.fingers_since));
        for entry in &packet.entries {
            check_body(entry, before.bodies, bodies_apart_s)?;
        }
        packet.entries.iter().try_for_each(|entry| self.check_finger(entry, before.fingers, fingers_apart_s))
    }

    /// Every entry that is to be there is there, once, and no other.
    fn check_contents(
        &self,
        from: HostIndex,
        to: HostIndex,
        last: Option<&StatePacket>,
        packet: &StatePacket,
    ) -> Result<(), Implausible> {
        let is_distributed = self.architecture == Architecture::Distributed;
        let is_server = !is_distributed && from == HostIndex::FIRST;
        let contents = Contents::of(packet)?;
        // A device may have fewer fingers than its user, and a server's answer less room; but always the same.
        let fingers = all(self.fingers_of(from));
        let first = u32::from(!is_server);
        let fewest = last.map_or(first, |last| Contents::of(last).map_or(first, |last| last.fingers));
        let most = last.map_or(fingers, |_| fewest);
        require(contents.fingers, fewest, most, What::Finger)?;
        let with_holes = contents.fingers & contents.fingers.wrapping_add(1);
        require(contents.fingers | with_holes, 0, contents.fingers & !with_holes, What::Finger)?;
        let bodies = if is_distributed || is_server { self.moving } else { 0 };
        require(contents.bodies, bodies, bodies, What::Body)?;
        let forces = if is_server { all(self.fingers_of(to)) } else { 0 };
        require(contents.forces, forces, forces, What::Force)?;
        let channels = if is_distributed && self.sends_channels { self.moving } else { 0 };
        require(contents.channels, 0, channels, What::Channel)
    }

    fn fingers_of(&self, host: HostIndex) -> usize {
        self.fingers.get(host.index()).map_or(0, Vec::len)
    }

    fn check_bounds(&self, from: HostIndex, entry: &Entry) -> Result<(), Implausible> {
        match entry {
            Entry::Hand { point, pose, twist } => {
                let start = self.fingers[from.index()][usize::from(*point)];
                let what = What::Finger(*point);
                check_reach(what, pose.position.distance(start), self.reach_m)?;
                check_speeds(what, twist, &self.hand)
            }
            Entry::Object { object, pose, twist } => {
                let what = What::Body(*object);
                check_reach(what, pose.position.length(), WORLD_BOUND_M)?;
                check_speeds(what, twist, &BODY)
            }
            Entry::Force { point, wrench: Wrench { force, torque } } => {
                let size = force.length().max(torque.length());
                check_size(What::Force(*point), size, self.max_force)
            }
            Entry::Channel { object, vectors, .. } => {
                let size = vectors.iter().map(|vector| vector.length()).fold(0.0, f64::max);
                check_size(What::Channel(*object), size, MAX_CHANNEL_VECTOR)
            }
        }
    }

    /// Whether a finger can have come to where an entry says from where it was.
    fn check_finger(&self, entry: &Entry, before: &StatePacket, apart_s: f64) -> Result<(), Implausible> {
        let Entry::Hand { point, pose, twist } = entry else { return Ok(()) };
        let before = before.entries.iter().find_map(|entry| match entry {
            Entry::Hand { point: other, pose, twist } if other == point => Some((pose, twist)),
            _ => None,
        });
        before.map_or(Ok(()), |before| {
            check_motion(What::Finger(*point), before, (pose, twist), apart_s, &self.hand)
        })
    }
}

/// Whether a body can have come to where an entry says from where it was.
fn check_body(entry: &Entry, before: &StatePacket, apart_s: f64) -> Result<(), Implausible> {
    let Entry::Object { object, pose, twist } = entry else { return Ok(()) };
    let before = before.entries.iter().find_map(|entry| match entry {
        Entry::Object { object: other, pose, twist } if other == object => Some((pose, twist)),
        _ => None,
    });
    before.map_or(Ok(()), |before| check_motion(What::Body(*object), before, (pose, twist), apart_s, &BODY))
}

/// A hand of `scene`, real or simulated.
fn hand(scene: &Scene) -> MotionLimits {
    let driven_m_per_s2 = scene.governor.max_force_n / scene.hand.mass_kg;
    MotionLimits {
        speed_m_per_s: HAND.speed_m_per_s + driven_m_per_s2 * DRIVEN_S,
        // From the largest force one way to that the other way.
        acceleration_m_per_s2: HAND.acceleration_m_per_s2 + 2.0 * driven_m_per_s2,
        ..HAND
    }
}

/// Which entries a sample has, a bit each.
#[derive(Clone, Copy, Debug, Default)]
struct Contents {
    fingers: u32,
    bodies: u32,
    forces: u32,
    channels: u32,
}

impl Contents {
    /// What is in `packet`; nothing may be there twice.
    fn of(packet: &StatePacket) -> Result<Self, Implausible> {
        let mut contents = Self::default();
        let mut to_each = [0_u32; cotouch_scene::limits::MAX_USERS];
        for entry in &packet.entries {
            let (bits, index, what): (&mut u32, u8, fn(u8) -> What) = match entry {
                Entry::Hand { point, .. } => (&mut contents.fingers, *point, What::Finger),
                Entry::Object { object, .. } => (&mut contents.bodies, *object, What::Body),
                Entry::Force { point, .. } => (&mut contents.forces, *point, What::Force),
                Entry::Channel { to, object, .. } => {
                    let object = *object;
                    let told =
                        to_each.get_mut(to.index()).ok_or(Implausible::Surplus(What::Channel(object)))?;
                    contents.channels |= bit(object);
                    (told, object, What::Channel)
                }
            };
            let bit = bit(index);
            if bit == 0 || *bits & bit != 0 {
                return Err(Implausible::Surplus(what(index)));
            }
            *bits |= bit;
        }
        Ok(contents)
    }
}

/// The bit of an index; none for one that no scene has.
fn bit(index: u8) -> u32 {
    1_u32.checked_shl(index.into()).unwrap_or(0)
}

fn all(count: usize) -> u32 {
    (1 << count) - 1
}

/// All of `fewest` and nothing beyond `most`.
fn require(found: u32, fewest: u32, most: u32, what: fn(u8) -> What) -> Result<(), Implausible> {
    let (missing, surplus) = (fewest & !found, found & !most);
    match (missing, surplus) {
        (0, 0) => Ok(()),
        (0, surplus) => Err(Implausible::Surplus(what(surplus.trailing_zeros() as u8))),
        (missing, _) => Err(Implausible::Missing(what(missing.trailing_zeros() as u8))),
    }
}

fn check_reach(what: What, found: f64, allowed: f64) -> Result<(), Implausible> {
    at_most(found, allowed, || Implausible::Reach { what, found, allowed })
}

fn check_size(what: What, found: f64, allowed: f64) -> Result<(), Implausible> {
    at_most(found, allowed, || Implausible::Size { what, found, allowed })
}

fn check_speeds(what: What, twist: &Twist, limits: &MotionLimits) -> Result<(), Implausible> {
    let (found, allowed) = (twist.linear.length(), limits.speed_m_per_s);
    at_most(found, allowed, || Implausible::Speed { what, found, allowed })?;
    let (found, allowed) = (twist.angular.length(), limits.spin_rad_per_s);
    at_most(found, allowed, || Implausible::Spin { what, found, allowed })
}

/// What is no number is not at most anything.
fn at_most(found: f64, allowed: f64, why: impl FnOnce() -> Implausible) -> Result<(), Implausible> {
    if found <= allowed { Ok(()) } else { Err(why()) }
}

fn check_motion(
    what: What,
    before: (&Pose, &Twist),
    now: (&Pose, &Twist),
    apart_s: f64,
    limits: &MotionLimits,
) -> Result<(), Implausible> {
    let ((from, v1), (to, v2)) = (before, now);
    let speed = v1.linear.length().max(v2.linear.length());
    let found = from.position.distance(to.position);
    let allowed = reached(speed, limits.acceleration_m_per_s2, apart_s) + POSITION_ALLOWANCE_M;
    at_most(found, allowed, || Implausible::Jump { what, found, allowed })?;

    let found = v1.linear.distance(v2.linear);
    let allowed = limits.acceleration_m_per_s2 * apart_s + SPEED_ALLOWANCE_M_PER_S;
    at_most(found, allowed, || Implausible::Jolt { what, found, allowed })?;

    let spin = v1.angular.length().max(v2.angular.length());
    let found = from.orientation.angle_between(to.orientation);
    let allowed = reached(spin, limits.spin_acceleration_rad_per_s2, apart_s) + ANGLE_ALLOWANCE_RAD;
    at_most(found, allowed, || Implausible::Twist { what, found, allowed })?;

    let found = v1.angular.distance(v2.angular);
    let allowed = limits.spin_acceleration_rad_per_s2 * apart_s + SPIN_ALLOWANCE_RAD_PER_S;
    at_most(found, allowed, || Implausible::Twist { what, found, allowed })
}

/// The longest way between two instants at which it was no faster than `speed`, with that acceleration.
fn reached(speed: f64, acceleration: f64, apart_s: f64) -> f64 {
    speed * apart_s + 0.25 * acceleration * apart_s * apart_s
}
