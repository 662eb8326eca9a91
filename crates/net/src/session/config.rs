//! What an endpoint must know beforehand.

use cotouch_scene::limits::MAX_USERS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, PlayOut, Scene};
use cotouch_scene::time::{Rate, SessionTime};

use crate::plausibility::Plausibility;
use crate::text::MAX_TEXT_BYTES;

/// One millisecond in nanoseconds.
pub(super) const MILLISECOND: i64 = 1_000_000;

/// A host is expelled when all that it sends in so long cannot be, s: sooner than a silent one is lost.
const EXPELLED_AFTER_S: f64 = 0.2;
/// And not before so many samples.
const FEWEST_IMPLAUSIBLE: f64 = 8.0;

/// When tick 0 is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartWhen {
    /// When the server is made; the others come late.
    Immediately,
    /// [`Config::start_delay_ns`] after so many hosts, the server included, are present with their clocks agreed upon.
    Hosts(u8),
}

/// What an endpoint must know beforehand.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Hash of the scene; the same on all hosts.
    pub scene_hash: u64,
    /// The scene as text, for newcomers that have none; the server hands it out. May be empty.
    pub scene_text: String,
    /// How often every host ticks.
    pub control_hz: Rate,
    /// How often every host sends states.
    pub network_hz: Rate,
    /// The users' names; user `i` is at host `i`.
    pub names: Vec<String>,
    /// Distributed: every host exchanges data with every other. Centralized: with host 0 only.
    pub architecture: Architecture,
    /// When samples are used; decides which count as late.
    pub play_out: PlayOut,
    /// How many network periods pass between sampling and use, by sender.
    pub play_out_periods: Vec<u32>,
    /// A peer that is silent for so long is lost, ns.
    pub peer_timeout_ns: i64,
    /// What samples can be; `None` believes whatever can be read.
    pub plausibility: Option<Plausibility>,
    /// The user that a newcomer wants to be; `None` for any that is free. The server is always the first.
    pub user: Option<String>,
    /// When tick 0 is (the server decides).
    pub start: StartWhen,
    /// From the decision to start until tick 0, ns: time for all to learn of it.
    pub start_delay_ns: i64,
    /// A newcomer gives up after so long, ns.
    pub join_timeout_ns: i64,
    /// Whether what carries datagrams proves that they come from where it says, as the secured layer does. A join is not
    /// challenged then.
    pub routes_are_proven: bool,
    /// Of the random ids. Every endpoint needs its own: two with the same seed are taken for one and the same.
    pub seed: u64,
}

/// Why a scene cannot be shared by this protocol.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// The scene has no users, or more than a session may have.
    #[error("a session has at most {MAX_USERS} users; the scene has {0}")]
    Users(usize),
    /// A user has a name that does not fit into a message.
    #[error("a user's name has at most {MAX_TEXT_BYTES} bytes; found {0:?}")]
    Name(String),
}

impl Config {
    /// The configuration for `scene`; start: when all users are there. The other fields can be changed afterwards.
    ///
    /// # Errors
    /// When there are too many users or a name is too long.
    pub fn new(scene: &Scene, scene_hash: u64, seed: u64) -> Result<Self, ConfigError> {
        let names: Vec<String> = scene.users.iter().map(|user| user.name.clone()).collect();
        if names.is_empty() || names.len() > MAX_USERS {
            return Err(ConfigError::Users(names.len()));
        }
        if let Some(name) = names.iter().find(|name| name.len() > MAX_TEXT_BYTES) {
            return Err(ConfigError::Name(name.clone()));
        }
        Ok(Self {
            scene_hash,
            scene_text: String::new(),
            control_hz: scene.rates.control_hz,
            network_hz: scene.rates.network_hz,
            architecture: scene.session.architecture,
            play_out: scene.link.play_out,
            play_out_periods: scene.hosts().map(|host| scene.play_out_periods(host)).collect(),
            peer_timeout_ns: (scene.session.peer_timeout_s * 1e9).round() as i64,
            plausibility: Some(Plausibility::new(scene)),
            user: None,
            start: StartWhen::Hosts(names.len() as u8),
            start_delay_ns: 500 * MILLISECOND,
            join_timeout_ns: 10_000 * MILLISECOND,
            names,
            routes_are_proven: false,
            seed,
        })
    }

    /// The user at `host`; empty when the scene has none.
    pub(super) fn name_of(&self, host: HostIndex) -> String {
        self.names.get(host.index()).cloned().unwrap_or_default()
    }

    /// A sample is too old to be used after so long, ns: what would have come in time, and the peer time-out.
    pub(super) fn max_age_ns(&self, from: HostIndex) -> i64 {
        let periods = self.play_out_periods.get(from.index()).copied().unwrap_or(0);
        self.peer_timeout_ns.saturating_add(self.network_hz.instant(periods.into()).0)
    }

    /// So many samples that cannot be, one after another, and their sender is expelled.
    pub(super) fn max_implausible(&self) -> u32 {
        (EXPELLED_AFTER_S * self.network_hz.hz()).ceil().max(FEWEST_IMPLAUSIBLE) as u32
    }

    /// When the sample of `step` is to be used at the latest; `None` where it is used on arrival.
    pub(super) fn due(&self, from: HostIndex, step: u64) -> Option<SessionTime> {
        if self.play_out != PlayOut::Scheduled {
            return None;
        }
        let periods = self.play_out_periods.get(from.index()).copied().unwrap_or(0);
        Some(self.network_hz.instant(step.saturating_add(periods.into())))
    }
}
