//! The copies of bodies at this host, coupled to those that its peers sample: Fotoohi Ghiam 2006, Fig. 4.4, any number of
//! users. How they are coupled is the scheme's ([`cotouch_world::coordination`]).

use std::ops::Range;
use std::sync::Arc;

use cotouch_net::{ChannelVectors, Entry, StatePacket};
use cotouch_scene::geometry::Wrench;
use cotouch_scene::limits::MAX_CHANNEL_VECTORS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Scene, Space};
use cotouch_world::BodyState;
use cotouch_world::coordination::{CouplingGains, OwnMotion, Scheme, SchemeSize, TickMotion, gains, scheme};
use cotouch_world::coupler::Stretch;
use glam::DVec3;

use crate::bodies::Bodies;
use crate::output::TickOutput;
use crate::peers::PeerState;
use crate::rejoining::BodyOffset;
use crate::samples;

/// The channels between the own copy of every body that moves and the copies of the peers.
#[derive(Clone, Debug)]
pub(crate) struct CopyCoupling {
    host: HostIndex,
    channels: Vec<Channel>,
    /// Vectors that are remembered for one body and one peer.
    memory_per_body: usize,
}

/// The own ends of all channels of one kind.
#[derive(Clone, Debug)]
struct Channel {
    kind: ChannelKind,
    scheme: Arc<dyn Scheme>,
    size: SchemeSize,
    /// Where its memory begins in that of a body and a peer: ticks', then network steps'.
    first: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ChannelKind {
    Translation,
    Rotation,
}

impl CopyCoupling {
    /// With the scheme that the scene names.
    pub(crate) fn new(scene: &Scene, host: HostIndex, bodies: &Bodies) -> Self {
        Self::with_schemes(scene, host, bodies, |gains| scheme(scene, gains))
    }

    /// With whatever scheme is made for the gains of translation, and for those of rotation where bodies turn and have
    /// surfaces.
    pub(crate) fn with_schemes(
        scene: &Scene,
        host: HostIndex,
        bodies: &Bodies,
        scheme: impl Fn(CouplingGains) -> Arc<dyn Scheme>,
    ) -> Self {
        let turns = scene.space != Space::Line && bodies.have_surfaces();
        let kinds = [ChannelKind::Translation, ChannelKind::Rotation];
        let mut coupling = Self { host, channels: Vec::new(), memory_per_body: 0 };
        for (kind, gains) in kinds.into_iter().zip(gains(&scene.coupling)) {
            if kind == ChannelKind::Rotation && !turns {
                continue;
            }
            let scheme = scheme(gains);
            let (size, first) = (scheme.size(), coupling.memory_per_body);
            coupling.memory_per_body += size.tick_memory + size.step_memory;
            coupling.channels.push(Channel { kind, scheme, size, first });
        }
        coupling
    }

    /// Vectors that are remembered for each peer.
    pub(crate) fn memory_per_peer(&self, bodies: &Bodies) -> usize {
        self.memory_per_body * bodies.moving().len()
    }

    /// Where a vector of the channel for translation or rotation of a body lies in what is remembered of a peer.
    pub(crate) fn memory_place(&self, bodies: &Bodies, object: u8, turns: bool, vector: u8) -> Option<usize> {
        let body = bodies.moving().iter().position(|&moving| moving == usize::from(object))?;
        let channel =
            self.channels.iter().find(|channel| (channel.kind == ChannelKind::Rotation) == turns)?;
        let vector = usize::from(vector);
        let is_there = vector < channel.size.tick_memory + channel.size.step_memory;
        is_there.then(|| body * self.memory_per_body + channel.first + vector)
    }

    /// One network step of every channel to a peer that is there: what that is told goes into the packet.
    pub(crate) fn sample(
        &self,
        bodies: &Bodies,
        states: &[BodyState],
        peers: &mut [PeerState],
        packet: &mut StatePacket,
    ) {
        let sends = self.channels.iter().any(|channel| channel.size.sent > 0);
        for (to, peer) in (0..).map(HostIndex).zip(peers).filter(|(_, peer)| peer.present) {
            for (place, &object) in bodies.moving().iter().enumerate() {
                let memory = &mut peer.memory[place * self.memory_per_body..];
                let mut vectors = ChannelVectors::default();
                for channel in &self.channels {
                    channel.network_step(memory, &channel.own(bodies, states, object), &mut vectors);
                }
                if sends {
                    samples::push(packet, Entry::Channel { to, object: object as u8, vectors });
                }
            }
        }
    }

    /// One tick of the channels to the copies that `from` sampled: wrenches on the own copies, into `output`.
    pub(crate) fn pull(
        &self,
        bodies: &Bodies,
        states: &[BodyState],
        peers: &mut [PeerState],
        from: HostIndex,
        output: &mut TickOutput,
    ) {
        let present_peers = peers.iter().map(|peer| peer.fade).sum();
        let PeerState { fade, samples, memory, bodies: displaced, .. } = &mut peers[from.index()];
        let Some(sample) = samples.held() else { return };
        for (place, &object) in bodies.moving().iter().enumerate() {
            let Some(copy) = samples::body(sample, object) else { continue };
            let received = samples::channel(sample, self.host, object);
            let memory = &mut memory[place * self.memory_per_body..];
            let displaced = displaced.get(object).copied().unwrap_or_default();
            for channel in &self.channels {
                let own = channel.own(bodies, states, object);
                let motion = TickMotion {
                    apart: channel.apart(&states[object], &copy, &displaced),
                    own,
                    received: &received[channel.vectors()],
                };
                let share = channel.scheme.weight(present_peers) * *fade;
                let force = share * channel.scheme.tick(channel.tick_memory(memory), &motion);
                channel.push(&mut output.wrenches[object], force);
            }
        }
    }
}

impl Channel {
    fn own<'a>(&self, bodies: &Bodies, states: &'a [BodyState], object: usize) -> OwnMotion<'a> {
        let body = &states[object];
        match self.kind {
            ChannelKind::Translation => OwnMotion::Translation(body),
            ChannelKind::Rotation => {
                OwnMotion::Rotation { body, start: bodies.models()[object].start.pose.orientation }
            }
        }
    }

    fn apart(&self, own: &BodyState, copy: &BodyState, displaced: &BodyOffset) -> Stretch {
        let turning = |body: &BodyState| (body.pose.orientation, body.twist.angular);
        let (apart, offset) = match self.kind {
            ChannelKind::Translation => (Stretch::between(own.point(), copy.point()), displaced.translation),
            ChannelKind::Rotation => {
                (Stretch::between_orientations(turning(own), turning(copy)), displaced.rotation)
            }
        };
        apart - offset.value()
    }

    fn push(&self, on_body: &mut Wrench, force: DVec3) {
        match self.kind {
            ChannelKind::Translation => on_body.force += force,
            ChannelKind::Rotation => on_body.torque += force,
        }
    }

    /// Its vectors in a sample.
    fn vectors(&self) -> Range<usize> {
        let first = match self.kind {
            ChannelKind::Translation => 0,
            ChannelKind::Rotation => MAX_CHANNEL_VECTORS,
        };
        first..first + self.size.sent
    }

    /// `memory` is that of the body and the peer.
    fn tick_memory<'a>(&self, memory: &'a mut [DVec3]) -> &'a mut [DVec3] {
        &mut memory[self.first..][..self.size.tick_memory]
    }

    fn network_step(&self, memory: &mut [DVec3], own: &OwnMotion<'_>, vectors: &mut ChannelVectors) {
        let (ticks, steps) = memory[self.first..].split_at_mut(self.size.tick_memory);
        let steps = &mut steps[..self.size.step_memory];
        self.scheme.network_step(ticks, steps, own, &mut vectors[self.vectors()]);
    }
}
