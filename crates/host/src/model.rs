//! The constants of one host, derived from a scene once: those of its parts.

#[cfg(feature = "testing")]
use std::sync::Arc;

use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Scene};
use cotouch_scene::time::Schedule;
#[cfg(feature = "testing")]
use cotouch_world::coordination::{CouplingGains, Scheme};
use glam::DQuat;

use crate::bodies::Bodies;
use crate::contacts::Contacts;
use crate::coordination::CopyCoupling;
use crate::couplers::PointCouplers;
use crate::peers::{PeerMemory, Peers};
use crate::rejoining::Rejoining;
use crate::soft_fingers::SoftFingers;

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
    /// Fingers of every host's user, 1 to [`MAX_FINGERS`].
    pub fingers: Vec<u8>,
    /// The orientation of every body from which the coordinates [`Rotation`](cotouch_scene::names::Quantity::Rotation)
    /// are counted, in own states and in samples: that of the start, unless something else is set here.
    pub about: Vec<DQuat>,
    pub(crate) peers: Peers,
    pub(crate) rejoining: Rejoining,
    pub(crate) bodies: Bodies,
    pub(crate) couplers: PointCouplers,
    pub(crate) contacts: Contacts,
    /// At a distributed peer.
    pub(crate) copies: Option<CopyCoupling>,
    /// At a host that simulates a soft body.
    pub(crate) soft: Option<SoftFingers>,
}

impl HostModel {
    /// The constants of `host` in `scene`.
    #[must_use]
    pub fn new(scene: &Scene, host: HostIndex) -> Self {
        let role = role(scene.session.architecture, host);
        let fingers = |user: &cotouch_scene::scene::User| user.fingers.len().clamp(1, MAX_FINGERS) as u8;
        let fingers: Vec<u8> = scene.users.iter().map(fingers).collect();
        let bodies = Bodies::new(scene);
        let has_world = role != Role::Client;
        Self {
            host,
            users: scene.session.users,
            role,
            schedule: scene.schedule(),
            about: bodies.start().iter().map(|body| body.pose.orientation).collect(),
            peers: Peers::new(scene),
            rejoining: Rejoining::new(scene),
            couplers: PointCouplers::new(&scene.coupling, &bodies),
            contacts: Contacts::new(scene, has_world, &fingers, &bodies),
            copies: (role == Role::Peer).then(|| CopyCoupling::new(scene, host, &bodies)),
            soft: (scene.soft.exists() && has_world).then(|| SoftFingers::new(scene, host, &fingers)),
            fingers,
            bodies,
        }
    }

    /// The same with coordination schemes that are made for the gains of translation and of rotation, whatever the scene
    /// names.
    #[cfg(feature = "testing")]
    #[must_use]
    pub fn with_schemes(
        scene: &Scene,
        host: HostIndex,
        scheme: impl Fn(CouplingGains) -> Arc<dyn Scheme>,
    ) -> Self {
        let model = Self::new(scene, host);
        let copies = CopyCoupling::with_schemes(scene, host, &model.bodies, scheme);
        Self { copies: model.copies.is_some().then_some(copies), ..model }
    }

    /// Whether this host simulates a soft body.
    #[must_use]
    pub fn has_soft_body(&self) -> bool {
        self.soft.is_some()
    }

    /// Fingers of all users that may touch the soft body; none where there is no such body here.
    pub(crate) fn soft_slots(&self) -> usize {
        self.soft.as_ref().map_or(0, |soft| soft.contacts.slots())
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
        self.bodies.models().len()
    }

    /// Whether bodies have surfaces that fingers touch. Where they have none, fingers are coupled to centres.
    #[must_use]
    pub fn has_surfaces(&self) -> bool {
        self.bodies.have_surfaces()
    }

    /// What is remembered of a peer.
    pub(crate) fn memory_of(&self, peer: HostIndex) -> PeerMemory {
        let is_client = self.role == Role::Client;
        PeerMemory {
            vectors: self.copies.as_ref().map_or(0, |copies| copies.memory_per_peer(&self.bodies)),
            bodies: if self.copies.is_some() { self.body_count() } else { 0 },
            fingers: if is_client { 0 } else { usize::from(self.fingers[peer.index()]) },
            forces: if is_client && peer == HostIndex::FIRST { self.own_fingers() } else { 0 },
        }
    }

    /// The largest encoding of this host's state, bytes, roughly from above.
    #[must_use]
    pub fn state_bytes(&self) -> usize {
        const ENTRY: usize = 112;
        const CONTACT: usize = 192;
        const SOFT_CONTACT: usize = 320;
        const VECTOR: usize = 24;
        const OFFSET: usize = 96;
        let entries =
            |host: HostIndex| usize::from(self.fingers[host.index()]) + self.body_count() + MAX_FINGERS;
        let samples = |host: HostIndex| self.peers.max_samples(host) * (16 + entries(host) * ENTRY);
        let memory = |host: HostIndex| {
            let memory = self.memory_of(host);
            memory.vectors * VECTOR + (2 * memory.bodies + memory.fingers + memory.forces) * OFFSET
        };
        let peers: usize = self.sources().map(|host| 256 + memory(host) + samples(host)).sum();
        4096 + peers
            + self.body_count() * ENTRY
            + self.contacts.len() * CONTACT
            + self.own_fingers() * OFFSET
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
