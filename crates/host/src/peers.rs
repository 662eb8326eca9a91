//! What a host knows of its peers: whether they are there, how far their couplings have faded in, and their samples.

use cotouch_net::{PlayOutBuffer, StatePacket};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{PlayOut, Scene};
use glam::DVec3;
use serde::{Deserialize, Serialize};

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

    /// Every peer absent, one entry a host, with so many vectors of memory.
    pub(crate) fn start(&self, memory: usize) -> Vec<PeerState> {
        let peer = |&periods: &u32| PeerState {
            present: false,
            fade: 0.0,
            going: false,
            samples: PlayOutBuffer::new(self.play_out, periods),
            memory: vec![DVec3::ZERO; memory],
        };
        self.play_out_periods.iter().map(peer).collect()
    }

    /// Samples of a host that wait or are held at most, roughly from above.
    pub(crate) fn max_samples(&self, host: HostIndex) -> usize {
        self.play_out_periods[host.index()] as usize + 18
    }

    /// Puts into use what is due at a tick, which is that of network step `due` if it is one.
    pub(crate) fn play_out(&self, peers: &mut [PeerState], due: Option<u64>) {
        for peer in peers {
            match (self.play_out, due) {
                (PlayOut::Scheduled, Some(step)) => _ = peer.samples.due_at_step(step),
                (PlayOut::Scheduled, None) => {}
                (PlayOut::OnArrival, _) => _ = peer.samples.due_at_tick(),
            }
        }
    }

    /// One tick of every coupling's fading in or out.
    pub(crate) fn fade(&self, peers: &mut [PeerState]) {
        for peer in peers {
            // A coupling needs a sample to be coupled to; from then on it fades in, and out again when the peer is gone.
            let rises = peer.present && !peer.going && peer.samples.held().is_some();
            let change = if rises { self.fade_per_tick } else { -self.fade_per_tick };
            peer.fade = (peer.fade + change).clamp(0.0, 1.0);
            if peer.going && peer.fade == 0.0 {
                peer.going = false;
                peer.samples.restart();
                peer.memory.fill(DVec3::ZERO);
            }
        }
    }
}
