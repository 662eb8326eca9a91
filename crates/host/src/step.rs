//! What a host does at an instant: sample, receive, play out, respond, tick. The order is the session's, the same in
//! virtual and in real time.

use std::sync::Arc;

use arrayvec::ArrayVec;
use cotouch_net::packet::StatePacket;
use cotouch_scene::geometry::{Reading, Readings};
use cotouch_scene::limits::{MAX_BODIES, MAX_USERS};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::PlayOut;
use cotouch_world::BodyState;

use crate::model::{HostModel, Role};
use crate::output::TickOutput;
use crate::packets::{for_client, object_of, of_self};
use crate::soft::SlowFrame;
use crate::state::{HostState, PeerState};
use crate::{centralized, forces, soft_forces};

/// A body beyond this distance (m) or speed (m/s) has left the world.
const WORLD_BOUND: f64 = 1e3;

/// A late joiner that hears nobody for so long begins alone.
const LONGEST_WAIT_S: f64 = 1.0;

impl HostModel {
    /// The network step that is due at tick `tick`, if one is: on schedule, or overdue because its tick was skipped.
    #[must_use]
    pub fn step_due(&self, state: &HostState, tick: u64) -> Option<u64> {
        let step = self.schedule.last_step_at(tick);
        (state.last_step.is_none_or(|last| last < step)).then_some(step)
    }

    /// Phase 1 of an instant with network step `step`: what this host tells the others about itself, with one reading a
    /// finger. A server has nothing to tell before it has heard the clients (see [`HostModel::respond`]), nor has a host
    /// that still waits for the world's present state.
    ///
    /// No allocation, no lock, bounded work.
    #[must_use]
    pub fn sample(&self, state: &HostState, step: u64, readings: &Readings) -> Option<StatePacket> {
        let speaks = self.role != Role::Server && !state.adopting;
        speaks.then(|| of_self(self, state, step, readings, self.role == Role::Peer))
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
            centralized::show_servers_bodies(self, state);
        }
    }

    /// The period of the slow simulation whose frame is to come into use at `tick`, if one is.
    #[must_use]
    pub fn frame_due(&self, tick: u64) -> Option<u64> {
        self.soft.as_ref()?.frame_due(tick)
    }

    /// Brings a frame into use at `tick`, after play-out and before the server responds and the tick is done; gives back
    /// what is not needed any more. The rest frame is taken over before the first tick. No allocation.
    pub fn take_frame(
        &self,
        state: &mut HostState,
        tick: u64,
        frame: Arc<SlowFrame>,
    ) -> Option<Arc<SlowFrame>> {
        match &self.soft {
            Some(soft) => soft.take_frame(&mut state.soft, tick, frame),
            None => Some(frame),
        }
    }

    /// The server's part of phase 2, after its play-out: what the fingers of `client` are to render, and where the bodies
    /// are.
    #[must_use]
    pub fn respond(
        &self,
        state: &HostState,
        step: u64,
        readings: &Readings,
        client: HostIndex,
    ) -> Option<StatePacket> {
        let answers = self.role == Role::Server && client != self.host;
        answers.then(|| for_client(self, state, step, readings, client))
    }

    /// Phase 3 of an instant: forces from what is known now, and the own bodies one period on. `readings` has one element
    /// a finger; a finger without one touches nothing.
    ///
    /// No allocation, no lock, no system call; the work grows with the numbers of fingers, bodies and users only.
    pub fn tick(&self, state: &mut HostState, tick: u64, readings: &Readings) -> TickOutput {
        let mut output = TickOutput::default();
        self.tick_into(state, tick, readings, &mut output);
        output
    }

    /// As [`tick`](Self::tick), into an output that is used again: it is large, and moving it takes longer than a tick.
    pub fn tick_into(&self, state: &mut HostState, tick: u64, readings: &Readings, output: &mut TickOutput) {
        if let Some(step) = self.step_due(state, tick) {
            state.last_step = Some(step);
        }
        state.ticks_done += 1;
        state.peers.iter_mut().for_each(|peer| self.fade(peer));
        output.reset(self);
        if state.diverged || state.adopting {
            output.diverged = state.diverged;
        } else if self.role == Role::Client {
            centralized::client_forces(state, output);
        } else if readings.iter().all(Reading::is_finite) {
            forces::of_world(self, state, readings, output);
            soft_forces::touch_soft_body(self, state, tick, readings, output);
            self.step_bodies(state, output);
        } else {
            self.give_up(state, output);
        }
    }

    fn step_bodies(&self, state: &mut HostState, output: &mut TickOutput) {
        let mut before = ArrayVec::<BodyState, MAX_BODIES>::new();
        before.extend(state.bodies.iter().copied());
        for &index in &self.moving {
            self.bodies[index].step(&mut state.bodies[index], &output.wrenches[index]);
        }
        let is_sound = self.moving.iter().all(|&index| state.bodies[index].is_within(WORLD_BOUND))
            && output.device.iter().all(cotouch_scene::geometry::Wrench::is_finite);
        if !is_sound {
            state.bodies.copy_from_slice(&before);
            self.give_up(state, output);
        }
    }

    /// The world has left all bounds: it stops for good.
    fn give_up(&self, state: &mut HostState, output: &mut TickOutput) {
        state.diverged = true;
        output.reset(self);
        output.diverged = true;
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

    /// A late joiner starts where the world is: it takes the bodies of the first peer that it hears. Where there is
    /// nobody to hear, it begins alone.
    fn adopt_world(&self, state: &mut HostState) {
        if !state.adopting {
            return;
        }
        let has_bodies = |peer: &&PeerState| {
            let sample = peer.samples.held();
            sample.is_some_and(|sample| self.moving.iter().any(|&body| object_of(sample, body).is_some()))
        };
        let heard = state.peers.iter().find(has_bodies);
        if let Some(sample) = heard.and_then(|peer| peer.samples.held()) {
            for &body in &self.moving {
                state.bodies[body] = object_of(sample, body).unwrap_or(state.bodies[body]);
            }
        }
        let waited_s = state.ticks_done as f64 * self.schedule.control().period_s();
        // Where nothing moves but a soft body, there is nothing to wait for.
        state.adopting = heard.is_none() && !self.moving.is_empty() && waited_s < LONGEST_WAIT_S;
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
