//! What a host does at an instant: sample, receive, play out, respond, tick. The order is the session's, the same in
//! virtual and in real time.

use std::sync::Arc;

use cotouch_net::{Entry, StatePacket};
use cotouch_scene::geometry::{Reading, Readings, Wrench};
use cotouch_scene::names::HostIndex;
use glam::DVec3;

use crate::model::{HostModel, Role};
use crate::output::TickOutput;
use crate::peers::PeerState;
use crate::soft::SlowFrame;
use crate::state::HostState;
use crate::touching::Touching;
use crate::{centralized, samples};

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
    /// that still waits for the world's present state. One whose world has diverged says so by a packet without entries.
    ///
    /// No allocation, no lock, bounded work.
    #[must_use]
    pub fn sample(&self, state: &mut HostState, step: u64, readings: &Readings) -> Option<StatePacket> {
        if self.role == Role::Server || state.adopting {
            return None;
        }
        let mut packet = StatePacket { step, ..StatePacket::default() };
        if state.diverged {
            return Some(packet);
        }
        samples::push_hands(&mut packet, readings);
        if let Some(copies) = &self.copies {
            samples::push_bodies(&mut packet, self.bodies.moving(), &state.bodies);
            copies.sample(&self.bodies, &state.bodies, &mut state.peers, &mut packet);
        }
        Some(packet)
    }

    /// Takes a packet that arrived; it waits for its play-out. No allocation, bounded work.
    pub fn receive(&self, state: &mut HostState, from: HostIndex, packet: &StatePacket) {
        if let Some(peer) = state.peers.get_mut(from.index()) {
            peer.receive(packet);
        }
    }

    /// Phase 2 of an instant: puts into use the samples that are due at `tick`.
    pub fn play_out(&self, state: &mut HostState, tick: u64) {
        let due = self.step_due(state, tick);
        self.peers.play_out(&mut state.peers, due);
        self.adopt_world(state);
        if self.role == Role::Client {
            centralized::follow(&self.bodies, &mut state.bodies, &state.peers);
        }
    }

    /// The period of the slow simulation whose frame is to come into use at `tick`, if one is.
    #[must_use]
    pub fn frame_due(&self, tick: u64) -> Option<u64> {
        self.soft.as_ref()?.contacts.frame_due(tick)
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
            Some(soft) => soft.contacts.take_frame(&mut state.soft, tick, frame),
            None => Some(frame),
        }
    }

    /// The server's part of phase 2, after its play-out: what the fingers of `client` are to render, where the bodies
    /// are, and, where there is room, the server's own fingers; nothing of all that when its world has diverged.
    #[must_use]
    pub fn respond(
        &self,
        state: &HostState,
        step: u64,
        readings: &Readings,
        client: HostIndex,
    ) -> Option<StatePacket> {
        if self.role != Role::Server || client == self.host {
            return None;
        }
        let mut packet = StatePacket { step, ..StatePacket::default() };
        if state.diverged {
            return Some(packet);
        }
        let tick = self.schedule.tick_of_step(step);
        let soft = self
            .soft
            .as_ref()
            .map(|soft| soft.forces_on_held(&state.soft, &state.peers, tick, readings, client));
        let soft = soft.unwrap_or_default();
        for point in 0..self.fingers[client.index()] {
            let finger = usize::from(point);
            let force =
                self.force_on_held(state, client, finger) + soft.get(finger).copied().unwrap_or_default();
            samples::push(&mut packet, Entry::Force { point, wrench: Wrench::force(force) });
        }
        samples::push_bodies(&mut packet, self.bodies.moving(), &state.bodies);
        samples::push_hands(&mut packet, readings);
        Some(packet)
    }

    /// The force (N) of this instant on a held finger, from the present bodies. The tick that follows finds the same and
    /// moves contacts on; nothing moves here.
    fn force_on_held(&self, state: &HostState, host: HostIndex, finger: usize) -> DVec3 {
        let finger = Touching::held(&state.peers, host, finger);
        self.couplers.force(&state.bodies, finger)
            + self.contacts.force(&state.contacts, (&self.bodies, &state.bodies), finger)
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
        self.peers.fade(&mut state.peers);
        output.reset(self.own_fingers(), self.body_count());
        if state.diverged || state.adopting {
            output.diverged = state.diverged;
        } else if self.role == Role::Client {
            centralized::render(&state.peers, output);
        } else {
            state.diverged = !self.move_world(state, tick, readings, output);
            if state.diverged {
                output.reset(self.own_fingers(), self.body_count());
                output.diverged = true;
            }
        }
    }

    /// One period of the world. Whether it is still within bounds: once it has left them it stops for good.
    fn move_world(
        &self,
        state: &mut HostState,
        tick: u64,
        readings: &Readings,
        output: &mut TickOutput,
    ) -> bool {
        if !readings.iter().all(Reading::is_finite) {
            return false;
        }
        self.act(state, tick, readings, output);
        output.device.iter().all(Wrench::is_finite) && self.bodies.step(&mut state.bodies, &output.wrenches)
    }

    /// All forces of one tick at a host that keeps a world: own fingers, what acts on bodies by itself, held fingers and
    /// copies of others, corners, and the soft body.
    fn act(&self, state: &mut HostState, tick: u64, readings: &Readings, output: &mut TickOutput) {
        for (finger, reading) in readings.iter().enumerate() {
            let force = self.touch(state, output, Touching::own(self.host, finger, Some(reading)));
            output.device[finger] = Wrench::force(force);
        }
        self.bodies.act(&state.bodies, output);
        for peer in self.host.others(self.users) {
            for finger in 0..usize::from(self.fingers[peer.index()]) {
                let held = Touching::held(&state.peers, peer, finger);
                self.touch(state, output, held);
            }
            if let Some(copies) = &self.copies {
                copies.pull(&self.bodies, &state.bodies, &mut state.peers, peer, output);
            }
        }
        self.contacts.touch_corners(&mut state.contacts, (&self.bodies, &state.bodies), output);
        if let Some(soft) = &self.soft {
            soft.touch(&mut state.soft, &state.peers, tick, readings, output);
        }
    }

    /// Couples a finger to points and lets it touch surfaces. The force on it, N.
    fn touch(&self, state: &mut HostState, output: &mut TickOutput, finger: Touching) -> DVec3 {
        let HostState { bodies, contacts, .. } = state;
        self.couplers.pull(bodies, output, finger)
            + self.contacts.touch_bodies(contacts, (&self.bodies, bodies), output, finger)
    }

    /// A late joiner starts where the world is: it takes the bodies of the first peer that it hears. Where there is
    /// nobody to hear, it begins alone.
    fn adopt_world(&self, state: &mut HostState) {
        if !state.adopting {
            return;
        }
        let moving = self.bodies.moving();
        let has_bodies = |peer: &&PeerState| {
            let sample = peer.samples.held();
            sample.is_some_and(|sample| moving.iter().any(|&body| samples::body(sample, body).is_some()))
        };
        let heard = state.peers.iter().find(has_bodies);
        if let Some(sample) = heard.and_then(|peer| peer.samples.held()) {
            for &body in moving {
                state.bodies[body] = samples::body(sample, body).unwrap_or(state.bodies[body]);
            }
        }
        let waited_s = state.ticks_done as f64 * self.schedule.control().period_s();
        // Where nothing moves but a soft body, there is nothing to wait for.
        state.adopting = heard.is_none() && !moving.is_empty() && waited_s < LONGEST_WAIT_S;
    }
}
