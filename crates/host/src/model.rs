//! The constants of one host, derived from a scene once.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Coordination, PlayOut, Scene, SpringDamper, Wall};
use cotouch_scene::time::Schedule;
use cotouch_world::rigid::{Freedom, Stepper};
use glam::DVec3;

/// Most users of a session.
pub const MAX_USERS: usize = 16;

/// What a host does in its session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Distributed: keeps a copy of the object, coupled to the others' copies.
    Peer,
    /// Centralized: keeps the one object and sends forces back.
    Server,
    /// Centralized: renders the server's force.
    Client,
}

/// Everything about one host that does not change during a session.
#[derive(Clone, Debug, PartialEq)]
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
    /// The axis of the scene, a unit vector.
    pub axis: DVec3,
    pub(crate) play_out_periods: Vec<u32>,
    pub(crate) hand_object: SpringDamper,
    pub(crate) remote_hand_object: SpringDamper,
    pub(crate) object_object: SpringDamper,
    pub(crate) coordination: Coordination,
    pub(crate) object_damping_n_s_per_m: f64,
    pub(crate) wall: Wall,
    pub(crate) stepper: Stepper,
    pub(crate) fade_per_tick: f64,
}

impl HostModel {
    /// The constants of `host` in `scene`.
    #[must_use]
    pub fn new(scene: &Scene, host: HostIndex) -> Self {
        let axis = DVec3::X;
        let period_s = scene.rates.control_hz.period_s();
        Self {
            host,
            users: scene.session.users,
            role: role(scene.session.architecture, host),
            schedule: scene.schedule(),
            play_out: scene.link.play_out,
            axis,
            play_out_periods: scene.hosts().map(|from| scene.play_out_periods(from)).collect(),
            hand_object: scene.coupling.hand_object,
            remote_hand_object: scene.coupling.remote_hand_object,
            object_object: scene.coupling.object_object,
            coordination: scene.session.coordination,
            object_damping_n_s_per_m: scene.object.damping_n_s_per_m,
            wall: scene.wall.clone(),
            stepper: Stepper::new(
                scene.object.mass_kg,
                period_s,
                scene.session.integrator,
                Freedom::Line(axis),
            ),
            fade_per_tick: period_s / scene.session.peer_fade_s.max(period_s),
        }
    }

    /// The hosts that this one receives samples from.
    pub fn sources(&self) -> impl Iterator<Item = HostIndex> + Clone + use<> {
        let is_client = self.role == Role::Client;
        self.host.others(self.users).filter(move |&other| !is_client || other == HostIndex::FIRST)
    }
}

fn role(architecture: Architecture, host: HostIndex) -> Role {
    match architecture {
        Architecture::Distributed => Role::Peer,
        Architecture::Centralized if host == HostIndex::FIRST => Role::Server,
        Architecture::Centralized => Role::Client,
    }
}
