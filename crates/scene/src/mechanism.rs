//! The mechanisms that haptic devices consist of: kinematics, statics and the inertia of their links.
//!
//! Everything is a pure function of the place of the haptic interface point in the mechanism's own frame (whose axes are
//! parallel to the world's), so that devices, simulations and analyses speak of the same mechanism:
//!
//! ```text
//! x = FK(q)      v = J(q)·q̇      τ = Jᵀ·f      Λ(x) = J⁻ᵀ·M(q)·J⁻¹      f = Λ(x)·a + b(x, v)
//! ```
//!
//! q are joint angles (rad), τ joint torques (N·m), f the force at the haptic interface point that moves the links (N), Λ their
//! inertia as felt there (kg), b what turns and bends them along (Coriolis and centrifugal forces, N). Links have no weight:
//! devices are balanced. A mechanism has stops: its [`workspace`](Mechanism::workspace) is a box that lies wholly where
//! it is far from singular.

mod pantograph;
mod phantom;
mod workspace;

use glam::{DMat3, DVec3};

pub use pantograph::{Assembly, Pantograph};
pub use phantom::Phantom;
pub use workspace::Workspace;

use crate::names::HostIndex;
use crate::scene::{DeviceKind, DeviceSpec, SceneValues};

/// A mechanism of one of the kinds that there are.
///
/// A planar one has two joints; the third number of its joints is its z, which passes through unchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mechanism {
    /// Planar, parallel, two joints.
    Pantograph(Pantograph),
    /// Spatial, three joints.
    Phantom(Phantom),
}

impl Mechanism {
    /// The mechanism of a kind of device; none for a point.
    #[must_use]
    pub fn of_kind(kind: DeviceKind) -> Option<Self> {
        match kind {
            DeviceKind::Point => None,
            DeviceKind::Pantograph => Some(Self::Pantograph(Pantograph::DESKTOP)),
            DeviceKind::Phantom => Some(Self::Phantom(Phantom::PUBLISHED)),
        }
    }

    /// How many joints have a motor and an encoder.
    #[must_use]
    pub const fn joints(&self) -> usize {
        match self {
            Self::Pantograph(_) => 2,
            Self::Phantom(_) => 3,
        }
    }

    /// Where its stops let the haptic interface point go.
    #[must_use]
    pub const fn workspace(&self) -> Workspace {
        match self {
            Self::Pantograph(pantograph) => pantograph.workspace,
            Self::Phantom(phantom) => phantom.workspace,
        }
    }

    /// Where the haptic interface point is (m) at `joints` (rad); none where the links do not meet.
    #[must_use]
    pub fn position(&self, joints: DVec3) -> Option<DVec3> {
        match self {
            Self::Pantograph(pantograph) => pantograph.position(joints),
            Self::Phantom(phantom) => Some(phantom.position(joints)),
        }
    }

    /// The joints (rad) at which the haptic interface point is at `position` (m); none out of reach.
    #[must_use]
    pub fn joints_at(&self, position: DVec3) -> Option<DVec3> {
        match self {
            Self::Pantograph(pantograph) => pantograph.joints_at(position),
            Self::Phantom(phantom) => phantom.joints_at(position),
        }
    }

    /// J in v = J·q̇, m/rad; none where it is infinite (the links do not meet, or a parallel mechanism is singular).
    #[must_use]
    pub fn jacobian(&self, joints: DVec3) -> Option<DMat3> {
        match self {
            Self::Pantograph(pantograph) => pantograph.jacobian(joints),
            Self::Phantom(phantom) => Some(phantom.jacobian(joints)),
        }
    }

    /// The joint torques (N·m) that render `force` (N): τ = Jᵀ·f.
    #[must_use]
    pub fn torques(&self, joints: DVec3, force: DVec3) -> Option<DVec3> {
        Some(self.jacobian(joints)?.transpose() * force)
    }

    /// The longest lever of a joint anywhere in the workspace, m: motors of torque τ render a force of at least τ divided
    /// by it in every direction, everywhere (found on a grid of 17 places along each axis).
    #[must_use]
    pub fn longest_lever_m(&self) -> f64 {
        const HALF: i32 = 8;
        let Workspace { centre, half_size } = self.workspace();
        let steps = |size: f64| if size > 0.0 { -HALF..=HALF } else { 0..=0 };
        let share = |step: i32| f64::from(step) / f64::from(HALF);
        let mut longest: f64 = 0.0;
        for x in steps(half_size.x) {
            for y in steps(half_size.y) {
                for z in steps(half_size.z) {
                    let place = centre + half_size * DVec3::new(share(x), share(y), share(z));
                    let jacobian = self.joints_at(place).and_then(|joints| self.jacobian(joints));
                    let Some(jacobian) = jacobian else { return f64::INFINITY };
                    for joint in 0..self.joints() {
                        longest = longest.max(jacobian.col(joint).length());
                    }
                }
            }
        }
        longest
    }

    /// The force (N) that joint torques (N·m) render: f = J⁻ᵀ·τ; none where the mechanism is singular.
    #[must_use]
    pub fn force(&self, joints: DVec3, torques: DVec3) -> Option<DVec3> {
        let inverse = self.jacobian(joints)?.transpose().inverse();
        inverse.is_finite().then(|| inverse * torques)
    }

    /// Distance to singularity: the smallest singular value of J over the largest; 1 is isotropic, 0 singular.
    #[must_use]
    pub fn reciprocal_condition(&self, joints: DVec3) -> f64 {
        match self {
            Self::Pantograph(pantograph) => pantograph.reciprocal_condition(joints),
            Self::Phantom(phantom) => phantom.reciprocal_condition(joints),
        }
    }

    /// M(q): the kinetic energy of the links is q̇ᵀ·M·q̇/2, kg·m².
    #[must_use]
    pub fn joint_inertia(&self, joints: DVec3) -> Option<DMat3> {
        match self {
            Self::Pantograph(pantograph) => pantograph.joint_inertia(joints),
            Self::Phantom(phantom) => Some(phantom.joint_inertia(joints)),
        }
    }

    /// Λ(x) = J⁻ᵀ·M·J⁻¹: the links' inertia as felt at the haptic interface point, kg.
    #[must_use]
    pub fn link_inertia(&self, position: DVec3) -> Option<DMat3> {
        match self {
            Self::Pantograph(pantograph) => pantograph.link_inertia(position),
            Self::Phantom(phantom) => phantom.link_inertia(position),
        }
    }

    /// Λ(x) (kg) and b(x, v) (N): the force f = Λ·a + b gives the haptic interface point at `position`, moving at `velocity`, the
    /// acceleration a.
    #[must_use]
    pub fn dynamics(&self, position: DVec3, velocity: DVec3) -> Option<(DMat3, DVec3)> {
        match self {
            Self::Pantograph(pantograph) => pantograph.dynamics(position, velocity),
            Self::Phantom(phantom) => phantom.dynamics(position, velocity),
        }
    }
}

/// A mechanism that stands so that the centre of its workspace is where a finger is at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// What stands there.
    pub mechanism: Mechanism,
    /// What to add to a place in the world to get the mechanism's own, m.
    pub offset: DVec3,
}

impl Placed {
    /// The device of a finger that starts at `start` (m, world); none for a point.
    #[must_use]
    pub fn of_finger(device: &DeviceSpec, start: DVec3) -> Option<Self> {
        let mechanism = Mechanism::of_kind(device.kind)?;
        Some(Self { mechanism, offset: mechanism.workspace().centre - start })
    }
}

/// The inertia (kg) at `position` (m, world) of a finger that starts at `start`: that of the hand, and of the links where
/// the scene's device has them ([`DeviceSpec::inertia`]). Out of a mechanism's reach the hand's alone.
#[must_use]
pub fn endpoint_inertia(device: &DeviceSpec, hand_mass_kg: f64, start: DVec3, position: DVec3) -> DMat3 {
    let hand = DMat3::from_diagonal(DVec3::splat(hand_mass_kg));
    let placed = Placed::of_finger(device, start).filter(|_| device.inertia);
    let links = placed.and_then(|placed| placed.mechanism.link_inertia(position + placed.offset));
    links.map_or(hand, |links| hand + links)
}

/// The inertia (kg) of a finger of a scene's user where it is, at `position` (m, world): that of the hand and, where the scene's
/// device adds them, of the links.
///
/// # Panics
/// When the scene has no such user or finger.
#[must_use]
pub fn finger_inertia(scene: &SceneValues, user: HostIndex, finger: u8, position: DVec3) -> DMat3 {
    let start = scene.users[user.index()].fingers[usize::from(finger)].position_m;
    endpoint_inertia(&scene.device, scene.hand_impedance().mass_kg, start, position)
}
