//! What a host knows of its peers: whether they are there, how far their couplings have faded in, and their samples.

use cotouch_net::{PlayOutBuffer, StatePacket};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{PlayOut, Scene};
use cotouch_world::Offset;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::rejoining::{BodyOffset, FingerOffset};

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
    /// What the coordination scheme remembers about it: for each body that moves, the vectors of ticks and then those of
    /// network steps, of the channel for translation and then of that for rotation.
    pub memory: Vec<DVec3>,
    /// How far its copy of each body counts as displaced, at a host that has copies of its own.
    pub bodies: Vec<BodyOffset>,
    /// How far each of its fingers does, at a host that has a world.
    pub fingers: Vec<FingerOffset>,
    /// What is taken off the forces that it says, at a client, N.
    pub forces: Vec<Offset>,
    /// Set in the tick in which its coupling begins to fade in.
    pub begins: bool,
}

impl PeerState {
    /// Takes note that the peer is there, or is not any more; its coupling fades.
    pub(crate) fn set_present(&mut self, present: bool) {
        self.going |= self.present && !present;
        self.present = present;
    }

    /// Takes a packet that arrived; it waits for its play-out.
    pub(crate) fn receive(&mut self, packet: &StatePacket) {
        if !self.going {
            self.samples.insert(packet.clone());
        }
    }
}

/// How much a host remembers of a peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PeerMemory {
    /// Of the coordination scheme.
    pub(crate) vectors: usize,
    pub(crate) bodies: usize,
    pub(crate) fingers: usize,
    pub(crate) forces: usize,
}

impl PeerMemory {
    /// Whether a state has it.
    pub(crate) fn fits(self, peer: &PeerState) -> bool {
        let found = Self {
            vectors: peer.memory.len(),
            bodies: peer.bodies.len(),
            fingers: peer.fingers.len(),
            forces: peer.forces.len(),
        };
        self == found
    }
}

/// How peers come and go, and when their samples are used.
#[derive(Clone, Debug)]
pub(crate) struct Peers {
    play_out: PlayOut,
    /// n of each host's samples.
    play_out_periods: Vec<u32>,
    fade_per_tick: f64,
}

impl Peers {
    pub(crate) fn new(scene: &Scene) -> Self {
        let period_s = scene.rates.control_hz.period_s();
        Self {
            play_out: scene.link.play_out,
            play_out_periods: scene.hosts().map(|from| scene.play_out_periods(from)).collect(),
            fade_per_tick: period_s / scene.session.peer_fade_s.max(period_s),
        }
    }

    /// Every peer absent, one entry a host, with so much memory of each.
    pub(crate) fn start(&self, memory: impl Fn(HostIndex) -> PeerMemory) -> Vec<PeerState> {
        let peer = |(host, &periods): (HostIndex, &u32)| {
            let memory = memory(host);
            PeerState {
                present: false,
                fade: 0.0,
                going: false,
                samples: PlayOutBuffer::new(self.play_out, periods),
                memory: vec![DVec3::ZERO; memory.vectors],
                bodies: vec![BodyOffset::default(); memory.bodies],
                fingers: vec![FingerOffset::default(); memory.fingers],
                forces: vec![Offset::default(); memory.forces],
                begins: false,
            }
        };
        (0..).map(HostIndex).zip(&self.play_out_periods).map(peer).collect()
    }

    /// Samples of a host that wait or are held at most, roughly from above.
    pub(crate) fn max_samples(&self, host: HostIndex) -> usize {
        self.play_out_periods[host.index()] as usize + 18
    }

    /// Puts into use what is due of a peer at a tick, which is that of network step `due` if it is one.
    pub(crate) fn play_out(&self, peer: &mut PeerState, due: Option<u64>) {
        match (self.play_out, due) {
            (PlayOut::Scheduled, Some(step)) => _ = peer.samples.due_at_step(step),
            (PlayOut::Scheduled, None) => {}
            (PlayOut::OnArrival, _) => _ = peer.samples.due_at_tick(),
        }
    }

    /// One tick of every coupling's fading in or out.
    pub(crate) fn fade(&self, peers: &mut [PeerState]) {
        for peer in peers {
            // A coupling needs a sample to be coupled to; from then on it fades in, and out again when the peer is gone.
            let rises = peer.present && !peer.going && peer.samples.held().is_some();
            let change = if rises { self.fade_per_tick } else { -self.fade_per_tick };
            peer.begins = rises && peer.fade == 0.0;
            peer.fade = (peer.fade + change).clamp(0.0, 1.0);
            if peer.going && peer.fade == 0.0 {
                peer.going = false;
                peer.samples.restart();
                peer.memory.fill(DVec3::ZERO);
                peer.bodies.fill(BodyOffset::default());
                peer.fingers.fill(FingerOffset::default());
                peer.forces.fill(Offset::default());
            }
        }
    }
}
