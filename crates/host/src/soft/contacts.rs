//! What one tick does with a soft body: a frame taken over, contacts moved on, forces on fingers and on the body.

use std::sync::Arc;

use arrayvec::ArrayVec;
use cotouch_scene::geometry::{Readings, Wrench};
use cotouch_scene::limits::{MAX_FINGERS, MAX_SOFT_CONTACTS};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{LocalModel, Scene, SurfaceHold};
use cotouch_scene::time::Schedule;
use cotouch_world::local::{LocalContact, LocalGains, LocalLaw, SurfaceInUse};
use glam::DVec3;

use super::present::Present;
use super::{SlowFrame, SoftHostState};
use crate::contacts::Touching;
use crate::forces::held_finger;
use crate::model::HostModel;
use crate::output::TickOutput;
use crate::state::HostState;

/// One value a finger slot.
pub(super) type Slots<T> = ArrayVec<T, MAX_SOFT_CONTACTS>;

/// The constants of a host's contacts with a soft body.
#[derive(Clone, Debug)]
pub(crate) struct SoftContacts {
    pub(super) law: LocalLaw,
    pub(super) model: LocalModel,
    /// Which tick begins which period of the slow simulation.
    pub(super) schedule: Schedule,
    /// Where every slot's finger starts, m.
    starts_m: Vec<DVec3>,
    /// Where each host's slots begin.
    first_slot: Vec<usize>,
}

impl SoftContacts {
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut starts_m = Vec::new();
        let mut first_slot = Vec::new();
        for user in &scene.users {
            first_slot.push(starts_m.len());
            let fingers = user.fingers.iter().take(MAX_FINGERS);
            starts_m.extend(fingers.map(|finger| finger.position_m));
        }
        starts_m.truncate(MAX_SOFT_CONTACTS);
        Self {
            law: LocalLaw::of(scene),
            model: scene.local_model.clone(),
            schedule: scene.slow_schedule(),
            starts_m,
            first_slot,
        }
    }

    fn slots(&self) -> usize {
        self.starts_m.len()
    }

    /// Ticks of the period that `tick` lies in.
    fn ticks_of_period(&self, tick: u64) -> u64 {
        let period = self.schedule.last_step_at(tick);
        self.schedule.tick_of_step(period + 1) - self.schedule.tick_of_step(period)
    }

    /// How far (0 to 1) it is from taking the frame in use over to having come to it.
    fn share_of_way(&self, soft: &SoftHostState, tick: u64) -> f64 {
        (tick.saturating_sub(soft.taken_at) as f64 / self.ticks_of_period(tick) as f64).min(1.0)
    }

    /// K_o of every slot at `tick`: linearly from the frame before to that in use.
    fn ko_n_per_m(&self, soft: &SoftHostState, tick: u64) -> Slots<f64> {
        let share = self.share_of_way(soft, tick);
        soft.ko_n_per_m.iter().map(|[before, after]| before + (after - before) * share).collect()
    }

    fn gains(&self, soft: &SoftHostState, tick: u64) -> Slots<LocalGains> {
        self.ko_n_per_m(soft, tick).iter().map(|&ko_n_per_m| self.gains_on(ko_n_per_m, tick)).collect()
    }

    fn gains_on(&self, ko_n_per_m: f64, tick: u64) -> LocalGains {
        let ticks = self.ticks_of_period(tick) as f64;
        let absolute_or =
            |absolute: f64, ratio: f64| if absolute > 0.0 { absolute } else { ratio * ko_n_per_m };
        let LocalModel { stiffness_n_per_m, stiffness_ratio, integral_n_per_m, integral_ratio, .. } =
            self.model;
        LocalGains {
            stiffness_n_per_m: absolute_or(stiffness_n_per_m, stiffness_ratio),
            integral_per_tick_n_per_m: absolute_or(integral_n_per_m, integral_ratio) / ticks,
            drain_ticks: self.model.drain_periods * ticks,
        }
    }

    fn surface<'a>(
        &self,
        soft: &SoftHostState,
        (frame, previous): (&'a SlowFrame, &'a SlowFrame),
        tick: u64,
    ) -> SurfaceInUse<'a> {
        let share = match self.model.hold {
            SurfaceHold::Zero => 1.0,
            SurfaceHold::First => self.share_of_way(soft, tick),
        };
        let way_s = self.ticks_of_period(tick) as f64 * self.schedule.control().period_s();
        let speed_per_s = if share < 1.0 { 1.0 / way_s } else { 0.0 };
        SurfaceInUse { latest: &frame.surface, before_m: &previous.positions_m, share, speed_per_s }
    }

    /// Whether the forces of `hold` are computed in this tick.
    fn is_hold_tick(&self, soft: &SoftHostState, tick: u64) -> bool {
        let is_first_of_period = soft.returned_ticks == 0 || soft.period != self.schedule.last_step_at(tick);
        is_first_of_period || soft.taken_at == tick
    }
}

impl HostModel {
    /// Whether this host simulates a soft body.
    #[must_use]
    pub fn has_soft_body(&self) -> bool {
        self.soft.is_some()
    }

    /// The period whose frame is to come into use at `tick`, if one is.
    #[must_use]
    pub fn frame_due(&self, tick: u64) -> Option<u64> {
        let soft = self.soft.as_ref()?;
        let present = soft.schedule.step_at(tick)?;
        present.checked_sub(1 + u64::from(soft.model.result_delay_periods))
    }

    /// Brings a frame into use at `tick`, after play-out and before the server responds and the tick is done; gives back
    /// what is not needed any more. The rest frame is taken over before the first tick. No allocation.
    pub fn take_frame(
        &self,
        state: &mut HostState,
        tick: u64,
        frame: Arc<SlowFrame>,
    ) -> Option<Arc<SlowFrame>> {
        let Some(soft) = &self.soft else { return Some(frame) };
        let state = &mut state.soft;
        let begins = state.frame.is_none();
        let present = soft.ko_n_per_m(state, tick);
        for (slot, ko_n_per_m) in state.ko_n_per_m.iter_mut().enumerate() {
            let next = frame.ko_of_slots_n_per_m[slot];
            // A spring that grows stiffer while it is stretched would push a finger off.
            let [from, most] = match (begins, state.contacts[slot].touching) {
                (true, _) => [next, next],
                (false, true) => [present[slot]; 2],
                (false, false) => [present[slot], f64::INFINITY],
            };
            *ko_n_per_m = [from, next.min(most)];
        }
        state.taken_at = tick;
        if begins {
            state.previous = Some(frame.clone());
            if frame.period.is_none() {
                soft.anchor_for_good(state, &frame);
            }
        }
        let kept = state.frame.replace(frame);
        if begins { None } else { std::mem::replace(&mut state.previous, kept) }
    }

    /// Fingers of all users that may touch the soft body; none where there is no such body here.
    pub(crate) fn soft_slots(&self) -> usize {
        self.soft.as_ref().map_or(0, SoftContacts::slots)
    }

    /// Every finger of every user, own ones as read, others as held, in the order of slots.
    fn soft_fingers(&self, soft: &SoftContacts, state: &HostState, readings: &Readings) -> Slots<Touching> {
        let own = |finger: usize| Touching {
            host: self.host,
            finger,
            place: readings.get(finger).map(|reading| (reading.pose.position, reading.twist.linear)),
            fade: 1.0,
        };
        let mut fingers = Slots::new();
        for host in HostIndex::all(self.users) {
            for finger in 0..usize::from(self.fingers[host.index()]) {
                let touching = if host == self.host { own(finger) } else { held_finger(state, host, finger) };
                let _ = fingers.try_push(touching);
            }
        }
        fingers.truncate(soft.slots());
        fingers
    }

    /// All contacts with the soft body, one tick on: forces on own fingers into `output`, those on the body summed up, and
    /// told to the slow simulation when a period's are known.
    pub(crate) fn touch_soft_body(
        &self,
        state: &mut HostState,
        tick: u64,
        readings: &Readings,
        output: &mut TickOutput,
    ) {
        let Some(soft) = &self.soft else { return };
        let (Some(frame), Some(previous)) = (state.soft.frame.clone(), state.soft.previous.clone()) else {
            return;
        };
        let fingers = self.soft_fingers(soft, state, readings);
        let present = soft.present(&state.soft, (&frame, &previous), tick);
        let forces = present.act(&mut state.soft.contacts, &fingers);
        for (slot, (finger, &force)) in fingers.iter().zip(&forces).enumerate() {
            if finger.host == self.host {
                output.device[finger.finger] = Wrench::force(output.device[finger.finger].force + force);
            }
            let slot_of_coupler = self.finger_slot(finger.host, finger.finger, 0);
            present.record(output, (slot, &state.soft.contacts[slot]), finger, slot_of_coupler);
        }
        output.slow = soft.sum_up(&mut state.soft, tick, &fingers, &forces);
    }
}

impl SoftContacts {
    fn present<'a>(
        &'a self,
        soft: &SoftHostState,
        (frame, previous): (&'a SlowFrame, &'a SlowFrame),
        tick: u64,
    ) -> Present<'a> {
        Present {
            law: &self.law,
            gains: self.gains(soft, tick),
            surface: self.surface(soft, (frame, previous), tick),
            frame,
            is_hold_tick: self.is_hold_tick(soft, tick),
        }
    }

    /// Two-sided contacts hold the points that are nearest to where the fingers start.
    fn anchor_for_good(&self, state: &mut SoftHostState, rest: &SlowFrame) {
        if !self.law.two_sided {
            return;
        }
        let surface =
            SurfaceInUse { latest: &rest.surface, before_m: &rest.positions_m, share: 1.0, speed_per_s: 0.0 };
        for (contact, start) in state.contacts.iter_mut().zip(&self.starts_m) {
            contact.hold_nearest(&self.law, &surface, *start);
        }
    }
}

/// What the server's next tick, that of network step `step`, will find for the fingers of `client`, N; nothing moves on.
pub(crate) fn force_on_fingers(
    model: &HostModel,
    state: &HostState,
    step: u64,
    readings: &Readings,
    client: HostIndex,
) -> ArrayVec<DVec3, MAX_FINGERS> {
    let Some(soft) = &model.soft else { return ArrayVec::new() };
    let (Some(frame), Some(previous)) = (&state.soft.frame, &state.soft.previous) else {
        return ArrayVec::new();
    };
    let fingers = model.soft_fingers(soft, state, readings);
    let mut contacts: Slots<LocalContact> =
        state.soft.contacts.iter().copied().take(MAX_SOFT_CONTACTS).collect();
    let present = soft.present(&state.soft, (frame, previous), model.schedule.tick_of_step(step));
    let forces = present.act(&mut contacts, &fingers);
    let first = soft.first_slot[client.index()];
    let of_client = fingers.iter().zip(&forces).skip(first).take(usize::from(model.fingers[client.index()]));
    of_client.map(|(finger, force)| finger.fade * *force).collect()
}
