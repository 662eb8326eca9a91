//! The constants of one host, derived from a scene once.

use cotouch_scene::limits::{MAX_BODIES, MAX_FINGERS};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{
    Architecture, Coordination, PlayOut, RotationalSpringDamper, Scene, Space, SpringDamper,
};
use cotouch_scene::time::Schedule;
use glam::DQuat;

use crate::bodies::BodyModel;
use crate::contacts::Contacts;
use crate::soft::SoftContacts;

/// What a host does in its session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Distributed: keeps a copy of every body, coupled to the others' copies.
    Peer,
    /// Centralized: keeps the one world and sends forces back.
    Server,
    /// Centralized: renders the server's forces.
    Client,
}

/// Everything about one host that does not change during a session.
#[derive(Clone, Debug)]
pub struct HostModel {
    /// Which host this is.
    pub host: HostIndex,
    /// Users of the session.
    pub users: u8,
    /// What it does.
    pub role: Role,
    /// Which tick does which network step.
    pub schedule: Schedule,
    /// When a received sample is used.
    pub play_out: PlayOut,
    /// Fingers of every host's user, 1 to [`MAX_FINGERS`].
    pub fingers: Vec<u8>,
    /// The orientation of every body from which the coordinates [`Rotation`](cotouch_scene::names::Quantity::Rotation)
    /// are counted, in own states and in samples: that of the start, unless something else is set here.
    pub about: Vec<DQuat>,
    pub(crate) bodies: Vec<BodyModel>,
    /// Bodies that are not fixed, by their index.
    pub(crate) moving: Vec<usize>,
    /// Those of them that have no surface: fingers are coupled to their centres.
    pub(crate) points: Vec<usize>,
    pub(crate) contacts: Contacts,
    /// At a host that simulates a soft body.
    pub(crate) soft: Option<SoftContacts>,
    /// Whether copies are coupled in how they are turned: where bodies turn, and have surfaces.
    pub(crate) turns: bool,
    pub(crate) finger_radius_m: f64,
    pub(crate) play_out_periods: Vec<u32>,
    pub(crate) hand_object: SpringDamper,
    pub(crate) remote_hand_object: SpringDamper,
    pub(crate) object_object: SpringDamper,
    pub(crate) object_object_rotational: RotationalSpringDamper,
    pub(crate) coordination: Coordination,
    pub(crate) fade_per_tick: f64,
}

impl HostModel {
    /// The constants of `host` in `scene`.
    #[must_use]
    pub fn new(scene: &Scene, host: HostIndex) -> Self {
        let period_s = scene.rates.control_hz.period_s();
        let role = role(scene.session.architecture, host);
        let fingers = |user: &cotouch_scene::scene::User| user.fingers.len().clamp(1, MAX_FINGERS) as u8;
        let fingers: Vec<u8> = scene.users.iter().map(fingers).collect();
        let bodies: Vec<BodyModel> =
            scene.world_bodies().iter().take(MAX_BODIES).map(|body| BodyModel::new(scene, body)).collect();
        let moving: Vec<usize> = (0..bodies.len()).filter(|&body| !bodies[body].fixed).collect();
        Self {
            host,
            users: scene.session.users,
            role,
            schedule: scene.schedule(),
            play_out: scene.link.play_out,
            about: bodies.iter().map(|body| body.start.pose.orientation).collect(),
            contacts: Contacts::new(scene, role, &fingers, &bodies),
            soft: (scene.soft.exists() && role != Role::Client).then(|| SoftContacts::new(scene)),
            turns: scene.space != Space::Line && bodies.iter().any(|body| body.surface.exists()),
            finger_radius_m: scene.hand.finger_radius_m,
            play_out_periods: scene.hosts().map(|from| scene.play_out_periods(from)).collect(),
            hand_object: scene.coupling.hand_object,
            remote_hand_object: scene.coupling.remote_hand_object,
            object_object: scene.coupling.object_object,
            object_object_rotational: scene.coupling.object_object_rotational,
            coordination: scene.session.coordination,
            fade_per_tick: period_s / scene.session.peer_fade_s.max(period_s),
            points: moving.iter().copied().filter(|&body| !bodies[body].surface.exists()).collect(),
            moving,
            fingers,
            bodies,
        }
    }

    /// Whether this host simulates a soft body.
    #[must_use]
    pub fn has_soft_body(&self) -> bool {
        self.soft.is_some()
    }

    /// Fingers of all users that may touch the soft body; none where there is no such body here.
    pub(crate) fn soft_slots(&self) -> usize {
        self.soft.as_ref().map_or(0, SoftContacts::slots)
    }

    /// The hosts that this one receives samples from.
    pub fn sources(&self) -> impl Iterator<Item = HostIndex> + Clone + use<> {
        let is_client = self.role == Role::Client;
        self.host.others(self.users).filter(move |&other| !is_client || other == HostIndex::FIRST)
    }

    /// Fingers of this host's user.
    #[must_use]
    pub fn own_fingers(&self) -> usize {
        usize::from(self.fingers[self.host.index()])
    }

    /// Bodies of the world, fixed ones included.
    #[must_use]
    pub fn body_count(&self) -> usize {
        self.bodies.len()
    }

    /// Whether bodies have surfaces that fingers touch. Where they have none, fingers are coupled to centres.
    #[must_use]
    pub fn has_surfaces(&self) -> bool {
        self.bodies.iter().any(|body| body.surface.exists())
    }

    /// The largest encoding of this host's state, bytes, roughly from above.
    #[must_use]
    pub fn state_bytes(&self) -> usize {
        const ENTRY: usize = 112;
        const CONTACT: usize = 192;
        const SOFT_CONTACT: usize = 320;
        let entries =
            |host: HostIndex| usize::from(self.fingers[host.index()]) + self.bodies.len() + MAX_FINGERS;
        let samples = |host: HostIndex| self.play_out_periods[host.index()] as usize + 18;
        let peers: usize =
            self.sources().map(|host| 256 + samples(host) * (16 + entries(host) * ENTRY)).sum();
        4096 + peers
            + self.bodies.len() * ENTRY
            + self.contacts.slots() * CONTACT
            + self.soft_slots() * SOFT_CONTACT
    }
}

fn role(architecture: Architecture, host: HostIndex) -> Role {
    match architecture {
        Architecture::Distributed => Role::Peer,
        Architecture::Centralized if host == HostIndex::FIRST => Role::Server,
        Architecture::Centralized => Role::Client,
    }
}
