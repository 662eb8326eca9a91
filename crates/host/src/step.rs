//! What a host does at an instant: sample, receive, play out, respond, tick. The order is the session's, the same in
//! virtual and in real time.

use arrayvec::ArrayVec;
use cotouch_net::packet::{Entry, StatePacket};
use cotouch_scene::geometry::{Reading, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{PlayOut, SpringDamper};
use cotouch_world::coupler::Stretch;
use cotouch_world::rigid::BodyState;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::model::{HostModel, MAX_USERS, Role};
use crate::state::{HostState, PeerState};
use crate::{centralized, distributed};

/// An object beyond this distance (m) or speed (m/s) has left the world.
const WORLD_BOUND: f64 = 1e3;

/// A late joiner that hears nobody for so long begins alone.
const LONGEST_WAIT_S: f64 = 1.0;

/// Most couplers at one host: the own hand's, and two a host.
pub const MAX_COUPLERS: usize = 2 * MAX_USERS + 1;

/// What came of one tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TickOutput {
    /// The wrench that the host asks the device to render until the next tick, N and N·m.
    pub device: Wrench,
    /// The force on this host's copy of the object, N.
    pub object_force: DVec3,
    /// Every coupler that this host evaluated.
    pub couplers: ArrayVec<CouplerOutput, MAX_COUPLERS>,
    /// Whether the object touches the wall.
    pub touches_wall: bool,
    /// Whether the world left all bounds, now or before.
    pub diverged: bool,
}

/// One evaluated coupler.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CouplerOutput {
    /// Which coupler: 0 is the own hand's, then two a host: its hand's and its object copy's.
    pub slot: u8,
    /// N/m, faded.
    pub stiffness_n_per_m: f64,
    /// m.
    pub stretch: DVec3,
}

impl HostModel {
    /// The network step that is due at tick `tick`, if one is: on schedule, or overdue because its tick was skipped.
    #[must_use]
    pub fn step_due(&self, state: &HostState, tick: u64) -> Option<u64> {
        let step = self.schedule.last_step_at(tick);
        (state.last_step.is_none_or(|last| last < step)).then_some(step)
    }

    /// Phase 1 of an instant with network step `step`: what this host tells the others about itself. A server has
    /// nothing to tell before it has heard the clients (see [`HostModel::respond`]), nor has a host that still waits for
    /// the world's present state.
    ///
    /// No allocation, no lock, bounded work.
    #[must_use]
    pub fn sample(&self, state: &HostState, step: u64, reading: &Reading) -> Option<StatePacket> {
        if self.role == Role::Server || state.adopting {
            return None;
        }
        let mut packet = StatePacket { step, entries: ArrayVec::new() };
        packet.entries.push(Entry::Hand { point: 0, pose: reading.pose, twist: reading.twist });
        if self.role == Role::Peer {
            packet.entries.push(object_entry(&state.object));
        }
        Some(packet)
    }

    /// Takes a packet that arrived; it waits for its play-out. No allocation, bounded work.
    pub fn receive(&self, state: &mut HostState, from: HostIndex, packet: &StatePacket) {
        if let Some(peer) = state.peers.get_mut(from.index()).filter(|peer| !peer.going) {
            peer.samples.insert(packet.clone());
        }
    }

    /// Phase 2 of an instant: puts into use the samples that are due at `tick`.
    pub fn play_out(&self, state: &mut HostState, tick: u64) {
        let due = self.step_due(state, tick);
        for peer in &mut state.peers {
            match (self.play_out, due) {
                (PlayOut::Scheduled, Some(step)) => _ = peer.samples.due_at_step(step),
                (PlayOut::Scheduled, None) => {}
                (PlayOut::OnArrival, _) => _ = peer.samples.due_at_tick(),
            }
        }
        self.adopt_world(state);
        if self.role == Role::Client {
            centralized::show_servers_object(state);
        }
    }

    /// The server's part of phase 2, after its play-out: what `client` is to render, and where the object is.
    #[must_use]
    pub fn respond(
        &self,
        state: &HostState,
        step: u64,
        reading: &Reading,
        client: HostIndex,
    ) -> Option<StatePacket> {
        if self.role != Role::Server || client == self.host {
            return None;
        }
        let wrench = Wrench::force(centralized::force_on_client(self, state, client));
        let mut packet = StatePacket { step, entries: ArrayVec::new() };
        packet.entries.push(Entry::Force { point: 0, wrench });
        packet.entries.push(object_entry(&state.object));
        packet.entries.push(Entry::Hand { point: 0, pose: reading.pose, twist: reading.twist });
        Some(packet)
    }

    /// Phase 3 of an instant: forces from what is known now, and the own object one period on.
    ///
    /// No allocation, no lock, no system call; the work grows with the number of users only.
    pub fn tick(&self, state: &mut HostState, tick: u64, reading: &Reading) -> TickOutput {
        if let Some(step) = self.step_due(state, tick) {
            state.last_step = Some(step);
        }
        state.ticks_done += 1;
        state.peers.iter_mut().for_each(|peer| self.fade(peer));
        if state.diverged || state.adopting {
            return TickOutput { diverged: state.diverged, ..TickOutput::default() };
        }
        let mut output = match self.role {
            Role::Peer => distributed::forces(self, state, reading),
            Role::Server => centralized::server_forces(self, state, reading),
            Role::Client => centralized::client_forces(state),
        };
        if self.role != Role::Client {
            output.touches_wall =
                cotouch_world::wall::touches(&self.wall, self.axis, state.object.pose.position);
            self.step_object(state, &mut output);
        }
        output
    }

    /// The forces on the object that only concern the object itself: compensation and wall.
    pub(crate) fn grounded_force(&self, object: &BodyState) -> DVec3 {
        let (position, velocity) = object.point();
        -self.object_damping_n_s_per_m * velocity
            + cotouch_world::wall::force(&self.wall, self.axis, position, velocity)
    }

    fn step_object(&self, state: &mut HostState, output: &mut TickOutput) {
        let before = state.object;
        self.stepper.step(&mut state.object, output.object_force);
        if !state.object.is_within(WORLD_BOUND) || !output.device.is_finite() {
            state.object = before;
            state.diverged = true;
            *output = TickOutput { diverged: true, ..TickOutput::default() };
        }
    }

    fn fade(&self, peer: &mut PeerState) {
        // A coupling needs a sample to be coupled to; from then on it fades in, and out again when the peer is gone.
        let rises = peer.present && !peer.going && peer.samples.held().is_some();
        let change = if rises { self.fade_per_tick } else { -self.fade_per_tick };
        peer.fade = (peer.fade + change).clamp(0.0, 1.0);
        if peer.going && peer.fade == 0.0 {
            peer.going = false;
            peer.samples.restart();
        }
    }

    /// A late joiner starts where the world is: it takes the object of the first peer that it hears. Where there is
    /// nobody to hear, it begins alone.
    fn adopt_world(&self, state: &mut HostState) {
        if !state.adopting {
            return;
        }
        let heard = state.peers.iter().find_map(|peer| peer.samples.held().and_then(object_of));
        if let Some(object) = heard {
            state.object = object;
        }
        let waited_s = state.ticks_done as f64 * self.schedule.control().period_s();
        state.adopting = heard.is_none() && waited_s < LONGEST_WAIT_S;
    }
}

impl HostState {
    /// Takes note that a peer is there, or is not any more; its coupling fades.
    pub fn set_present(&mut self, peer: HostIndex, present: bool) {
        if let Some(peer) = self.peers.get_mut(peer.index()) {
            peer.going |= peer.present && !present;
            peer.present = present;
        }
    }

    /// The network step of the sample in use from each host.
    #[must_use]
    pub fn steps_in_use(&self) -> ArrayVec<Option<u64>, MAX_USERS> {
        self.peers.iter().map(|peer| peer.samples.held().map(|packet| packet.step)).collect()
    }
}

/// The own hand's coupler.
pub(crate) const OWN_HAND: u8 = 0;

/// The coupler to the hand of host `peer`.
pub(crate) fn hand_slot(peer: usize) -> u8 {
    (1 + 2 * peer) as u8
}

/// The coupler to the object copy of host `peer`.
pub(crate) fn object_slot(peer: usize) -> u8 {
    (2 + 2 * peer) as u8
}

/// The force of a coupler on its near end, `fade` times its nominal gains; also lists the coupler.
pub(crate) fn couple(
    output: &mut TickOutput,
    slot: u8,
    spring: SpringDamper,
    fade: f64,
    stretch: Stretch,
) -> DVec3 {
    let stiffness_n_per_m = fade * spring.stiffness_n_per_m;
    output.couplers.push(CouplerOutput { slot, stiffness_n_per_m, stretch: stretch.position });
    fade * cotouch_world::coupler::force(spring, stretch)
}

/// Position and velocity of a hand in a sample.
pub(crate) fn hand_of(packet: &StatePacket) -> Option<(DVec3, DVec3)> {
    packet.entries.iter().find_map(|entry| match entry {
        Entry::Hand { point: 0, pose, twist } => Some((pose.position, twist.linear)),
        _ => None,
    })
}

/// The object in a sample.
pub(crate) fn object_of(packet: &StatePacket) -> Option<BodyState> {
    packet.entries.iter().find_map(|entry| match entry {
        Entry::Object { object: 0, pose, twist } => Some(BodyState { pose: *pose, twist: *twist }),
        _ => None,
    })
}

fn object_entry(object: &BodyState) -> Entry {
    Entry::Object { object: 0, pose: object.pose, twist: object.twist }
}
