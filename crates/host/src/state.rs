//! Everything about one host that changes: a plain value that can be copied, compared, saved and restored.

use cotouch_net::play_out::PlayOutBuffer;
use cotouch_scene::names::HostIndex;
use cotouch_world::{BodyState, ContactState};
use serde::{Deserialize, Serialize};

use crate::model::HostModel;
use crate::soft::SoftHostState;

/// A host's state between two ticks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HostState {
    /// Ticks done so far.
    pub ticks_done: u64,
    /// The last network step that was done.
    pub last_step: Option<u64>,
    /// This host's copy of every body, in the scene's order; at a client, the server's bodies as last heard of.
    pub bodies: Vec<BodyState>,
    /// One entry a contact that there can be at this host, in an order that the model keeps; none at a client.
    pub contacts: Vec<ContactState>,
    /// Which groups of corners are near the surface that they may touch.
    pub near: Vec<bool>,
    /// What there is of a soft body; empty where there is none, and at a client.
    pub soft: SoftHostState,
    /// One entry a host; the own entry stays empty.
    pub peers: Vec<PeerState>,
    /// Set while a late joiner waits for the world's present state.
    pub adopting: bool,
    /// Set for good when the world left all bounds; it no longer moves and no force is rendered.
    pub diverged: bool,
}

/// What a host knows of one peer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PeerState {
    /// Whether the peer takes part.
    pub present: bool,
    /// How far its coupling has faded in, 0 to 1.
    pub fade: f64,
    /// Set from when it went until its coupling has faded out: a return waits for that, so that nothing jumps.
    pub going: bool,
    /// Its samples: the one in use and those that wait.
    pub samples: PlayOutBuffer,
}

impl HostState {
    /// The state before the first tick: everything at rest where the scene puts it, every peer absent.
    #[must_use]
    pub fn new(model: &HostModel) -> Self {
        let peer = |from: HostIndex| PeerState {
            present: false,
            fade: 0.0,
            going: false,
            samples: PlayOutBuffer::new(model.play_out, model.play_out_periods[from.index()]),
        };
        Self {
            ticks_done: 0,
            last_step: None,
            bodies: model.bodies.iter().map(|body| body.start).collect(),
            contacts: vec![ContactState::default(); model.contacts.slots()],
            near: vec![false; model.contacts.groups()],
            soft: SoftHostState::new(model.soft_slots()),
            peers: HostIndex::all(model.users).map(peer).collect(),
            adopting: false,
            diverged: false,
        }
    }

    /// Whether this is a state of `model`: one that was read may be of another scene.
    #[must_use]
    pub fn fits(&self, model: &HostModel) -> bool {
        self.bodies.len() == model.bodies.len()
            && self.contacts.len() == model.contacts.slots()
            && self.near.len() == model.contacts.groups()
            && self.soft.contacts.len() == model.soft_slots()
            && self.soft.returned_n.len() == model.soft_slots()
            && self.peers.len() == usize::from(model.users)
    }
}
