//! What a session is, as typed values: the result of reading and checking a scene file.

mod body;
mod coupling;
mod hand;
mod link;
mod session;
mod soft;
mod user;

use std::ops::Deref;

use glam::DVec3;
use serde::Serialize;

use crate::names::HostIndex;
use crate::time::Schedule;

pub use crate::soft_mesh::FixedRegion;
pub use body::{Body, BodyImpedance, Ground, Object, Shape, ShapeKind, Space, Wall, WallPlane, WallSides};
pub use coupling::{Contact, Coupling, RotationalSpringDamper, SpringDamper};
pub use hand::{DeviceKind, DeviceSpec, GovernorLimits, Hand, HandImpedance, VelocityEstimate};
pub use link::{Impairment, Link, PlayOut, Way};
pub use session::{Architecture, Coordination, Integrator, Rates, Session};
pub use soft::{
    LocalModel, LocalModelKind, ReturnedForce, Soft, SoftMeshKind, SoftMeshSource, SoftModel, StiffnessFrom,
    SurfaceHold,
};
pub use user::{Action, Finger, User};

/// A valid session description: every value lies in its stated range, and all go together.
///
/// Its values are read like fields. [`crate::load`] and [`crate::parse`] make one, [`crate::with_override`] and [`Scene::edit`]
/// another from it; all of them check.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Scene(SceneValues);

impl Scene {
    /// The scene of values that the caller has checked.
    pub(crate) fn from_checked(values: SceneValues) -> Self {
        Self(values)
    }

    /// The scene with `change` made to its values, and nothing checked: for tests of what scenes never ask for.
    #[cfg(feature = "testing")]
    #[must_use]
    pub fn edit_unchecked(&self, change: impl FnOnce(&mut SceneValues)) -> Self {
        let mut values = self.0.clone();
        change(&mut values);
        Self(values)
    }
}

impl Deref for Scene {
    type Target = SceneValues;

    fn deref(&self) -> &SceneValues {
        &self.0
    }
}

/// All values of a scene, checked or not; units are in the field names. Their default is zeros and first words, which reading
/// starts from.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SceneValues {
    /// The scene's name: the built-in's name, or the file's stem.
    pub name: String,
    /// One sentence about the scene.
    pub description: String,
    /// Who takes part and how hosts share the world.
    pub session: Session,
    /// The rates of the loops.
    pub rates: Rates,
    /// The network between hosts.
    pub link: Link,
    /// The directions in which bodies and hands may move.
    pub space: Space,
    /// Acceleration that acts on every body that is not fixed.
    pub gravity_m_per_s2: DVec3,
    /// Every user's hand together with the moving part of the device.
    pub hand: Hand,
    /// What every user holds.
    pub device: DeviceSpec,
    /// The shared object, and what all bodies have in common.
    pub object: Object,
    /// `[[body]]`; where there is none, the world has one body, the object: see [`SceneValues::world_bodies`].
    pub bodies: Vec<Body>,
    /// The ground under bodies that move in a plane.
    pub ground: Ground,
    /// How fingers touch bodies, and bodies walls and each other.
    pub contact: Contact,
    /// The virtual couplers between hands, objects and copies.
    pub coupling: Coupling,
    /// The wall that the object meets.
    pub wall: Wall,
    /// Limits on every force that reaches a device.
    pub governor: GovernorLimits,
    /// The soft object, in a scene that has one; it then has no other body.
    pub soft: Soft,
    /// How hands feel the soft object at the haptic rate.
    pub local_model: LocalModel,
    /// What each user is called and does when simulated; exactly `session.users` entries.
    pub users: Vec<User>,
}

impl SceneValues {
    /// Which tick does which network step.
    ///
    /// # Panics
    /// When the rates do not go together; those of a scene do.
    #[must_use]
    pub fn schedule(&self) -> Schedule {
        Schedule::new(self.rates.control_hz, self.rates.network_hz).expect("the rates of a scene go together")
    }

    /// The rigid bodies of the world: `[[body]]`, or the one object; none where the object is soft.
    #[must_use]
    pub fn world_bodies(&self) -> Vec<Body> {
        if !self.bodies.is_empty() || self.soft.exists() {
            return self.bodies.clone();
        }
        let Object { mass_kg, shape, position_m, rotation_rad, .. } = &self.object;
        vec![Body {
            name: "object".to_owned(),
            shape: shape.clone(),
            mass_kg: *mass_kg,
            position_m: *position_m,
            rotation_rad: *rotation_rad,
            fixed: false,
        }]
    }

    /// What every finger of every user is to the ground, whatever it touches.
    #[must_use]
    pub fn hand_impedance(&self) -> HandImpedance {
        HandImpedance::new(&self.hand, &self.governor)
    }

    /// The walls of the world: `[[wall.plane]]`, or the one across the x axis; none without stiffness and damping.
    #[must_use]
    pub fn walls(&self) -> Vec<WallPlane> {
        if !self.wall.exists() {
            return Vec::new();
        }
        if !self.wall.planes.is_empty() {
            return self.wall.planes.clone();
        }
        let point_m = DVec3::X * self.wall.position_m;
        vec![WallPlane { name: "wall".to_owned(), point_m, normal: DVec3::NEG_X }]
    }

    /// Which tick begins which period of the slow simulation.
    ///
    /// # Panics
    /// When there is no soft object, and the rates do not go together: only with one they are checked.
    #[must_use]
    pub fn slow_schedule(&self) -> Schedule {
        Schedule::new(self.rates.control_hz, self.rates.simulation_hz)
            .expect("the rates of a scene go together")
    }

    /// All hosts of the session, one a user.
    pub fn hosts(&self) -> impl Iterator<Item = HostIndex> + Clone + use<> {
        HostIndex::all(self.session.users)
    }

    /// The impairment of the way from one host to another.
    #[must_use]
    pub fn impairment(&self, from: HostIndex, to: HostIndex) -> &Impairment {
        let of_way = self.link.ways.iter().rev().find(|way| way.from == from && way.to == to);
        of_way.map_or(&self.link.impairment, |way| &way.impairment)
    }

    /// What came apart is brought together slowly after a sample that is of more network steps than this after the one before it:
    /// `session.rejoin_after_s`, rounded up.
    #[must_use]
    pub fn rejoin_gap_steps(&self) -> u64 {
        (self.session.rejoin_after_s * self.rates.network_hz.hz()).ceil().max(1.0) as u64
    }

    /// Whole network periods that a packet from `from` is kept before use in the receiver, by `scheduled` play-out.
    ///
    /// Distributed: `link.delay_periods` each way. Centralized: the round trip is `link.delay_periods`, of which
    /// `link.return_delay_periods` lie on the force's way back and the rest on the position's way to the server.
    #[must_use]
    pub fn play_out_periods(&self, from: HostIndex) -> u32 {
        match self.session.architecture {
            Architecture::Distributed => self.link.delay_periods,
            Architecture::Centralized if from == HostIndex::FIRST => self.link.return_delay_periods,
            Architecture::Centralized => self.link.delay_periods - self.link.return_delay_periods,
        }
    }
}
