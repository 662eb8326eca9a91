//! What one tick does with a soft body: a frame taken over, contacts moved on, forces on fingers and on the body.

use std::sync::Arc;

use cotouch_scene::limits::{MAX_FINGERS, MAX_SOFT_CONTACTS};
use cotouch_scene::scene::{LocalModel, Scene, SurfaceHold};
use cotouch_scene::time::Schedule;
use cotouch_world::local::{
    FingerForces, LocalContact, LocalFinger, LocalGains, LocalLaw, LocalTick, Slots, SoftContactModel,
    SurfaceInUse, local_law,
};
use glam::DVec3;

use super::frame::SlowFrame;
use super::input::SlowInput;
use super::returned::Returned;
use super::state::SoftHostState;

/// The constants of a host's contacts with a soft body.
#[derive(Clone, Debug)]
pub(crate) struct SoftContacts {
    law: &'static dyn LocalLaw,
    constants: SoftContactModel,
    model: LocalModel,
    /// Which tick begins which period of the slow simulation.
    schedule: Schedule,
    /// Where every slot's finger starts, m.
    starts_m: Vec<DVec3>,
}

/// What came of one tick of all contacts.
pub(crate) struct SoftTouch {
    /// The forces on the fingers, N.
    pub(crate) forces: FingerForces,
    /// The contacts that are not free, by finger slot.
    pub(crate) contacts: Slots<Option<SoftContactOutput>>,
    /// What goes to the simulation after this tick, if anything does.
    pub(crate) slow: Option<SlowInput>,
}

/// A contact that is not free, its force not faded.
#[derive(Clone, Copy)]
pub(crate) struct SoftContactOutput {
    pub(crate) sliding: bool,
    pub(crate) force: DVec3,
    pub(crate) depth_m: f64,
}

impl SoftContacts {
    pub(crate) fn new(scene: &Scene) -> Self {
        let fingers = scene.users.iter().flat_map(|user| user.fingers.iter().take(MAX_FINGERS));
        Self {
            law: local_law(scene.local_model.kind),
            constants: SoftContactModel::new(scene),
            model: scene.local_model.clone(),
            schedule: scene.slow_schedule(),
            starts_m: fingers.map(|finger| finger.position_m).take(MAX_SOFT_CONTACTS).collect(),
        }
    }

    /// Fingers of all users that may touch, counted in the users' order.
    pub(crate) fn slots(&self) -> usize {
        self.starts_m.len()
    }

    /// The period whose frame is to come into use at `tick`, if one is.
    pub(crate) fn frame_due(&self, tick: u64) -> Option<u64> {
        let present = self.schedule.step_at(tick)?;
        present.checked_sub(1 + u64::from(self.model.result_delay_periods))
    }

    /// Brings a frame into use; gives back what is not needed any more.
    pub(crate) fn take_frame(
        &self,
        state: &mut SoftHostState,
        tick: u64,
        frame: Arc<SlowFrame>,
    ) -> Option<Arc<SlowFrame>> {
        let begins = state.frame.is_none();
        let present = self.ko_n_per_m(state, tick);
        for (slot, ko_n_per_m) in state.ko_n_per_m.iter_mut().enumerate() {
            let next = frame.slot_ko_n_per_m[slot];
            // A spring that grows stiffer while it is stretched would push a finger off.
            let [from, max] = match (begins, state.contacts[slot].touching) {
                (true, _) => [next, next],
                (false, true) => [present[slot]; 2],
                (false, false) => [present[slot], f64::INFINITY],
            };
            *ko_n_per_m = [from, next.min(max)];
        }
        state.taken_at = tick;
        if begins {
            state.previous = Some(frame.clone());
            if frame.period.is_none() {
                self.anchor_for_good(state, &frame);
            }
        }
        let kept = state.frame.replace(frame);
        if begins { None } else { std::mem::replace(&mut state.previous, kept) }
    }

    /// A contact begins anew, but for one that is two-sided: it holds its point for good.
    pub(crate) fn begin_anew(&self, contact: &mut LocalContact) {
        if !self.constants.two_sided {
            *contact = LocalContact::default();
        }
    }

    /// All contacts one tick on, with one of `fingers` a slot; `None` before the first frame.
    pub(crate) fn touch(
        &self,
        state: &mut SoftHostState,
        tick: u64,
        fingers: &[LocalFinger],
    ) -> Option<SoftTouch> {
        let (frame, previous) = (state.frame.clone()?, state.previous.clone()?);
        let present = self.local_tick(state, (&frame, &previous), tick);
        let forces = self.law.forces(&present, &mut state.contacts, fingers);
        let contacts = state.contacts.iter().zip(fingers);
        let contacts =
            contacts.map(|(contact, finger)| contact_output(contact, &present.surface, finger)).collect();
        let returned = Returned { which: self.model.returned_force, schedule: self.schedule };
        let slow = returned.sum_up(state, tick, fingers, &forces);
        Some(SoftTouch { forces, contacts, slow })
    }

    /// The forces on all fingers that the tick will find, N; nothing moves on. Empty before the first frame.
    pub(crate) fn forces(&self, state: &SoftHostState, tick: u64, fingers: &[LocalFinger]) -> FingerForces {
        let (Some(frame), Some(previous)) = (&state.frame, &state.previous) else {
            return FingerForces::new();
        };
        let mut contacts: Slots<LocalContact> =
            state.contacts.iter().copied().take(MAX_SOFT_CONTACTS).collect();
        let present = self.local_tick(state, (frame, previous), tick);
        self.law.forces(&present, &mut contacts, fingers)
    }

    fn local_tick<'a>(
        &'a self,
        state: &SoftHostState,
        (frame, previous): (&'a SlowFrame, &'a SlowFrame),
        tick: u64,
    ) -> LocalTick<'a> {
        let ticks = self.ticks_of_period(tick);
        let gains = |&ko_n_per_m: &f64| LocalGains::new(&self.model, ko_n_per_m, ticks);
        let is_first_of_period =
            state.returned_ticks == 0 || state.period != self.schedule.last_step_at(tick);
        LocalTick {
            model: &self.constants,
            gains: self.ko_n_per_m(state, tick).iter().map(gains).collect(),
            surface: self.surface(state, (frame, previous), tick),
            frame: frame.joint_compliance(),
            begins_period: is_first_of_period || state.taken_at == tick,
        }
    }

    /// Ticks of the period that `tick` lies in.
    fn ticks_of_period(&self, tick: u64) -> u64 {
        let period = self.schedule.last_step_at(tick);
        self.schedule.tick_of_step(period + 1) - self.schedule.tick_of_step(period)
    }

    /// How far (0 to 1) it is from taking the frame in use over to having come to it.
    fn share_of_way(&self, state: &SoftHostState, tick: u64) -> f64 {
        (tick.saturating_sub(state.taken_at) as f64 / self.ticks_of_period(tick) as f64).min(1.0)
    }

    /// K_o of every slot at `tick`: linearly from the frame before to that in use.
    fn ko_n_per_m(&self, state: &SoftHostState, tick: u64) -> Slots<f64> {
        let share = self.share_of_way(state, tick);
        state.ko_n_per_m.iter().map(|[before, after]| before + (after - before) * share).collect()
    }

    fn surface<'a>(
        &self,
        state: &SoftHostState,
        (frame, previous): (&'a SlowFrame, &'a SlowFrame),
        tick: u64,
    ) -> SurfaceInUse<'a> {
        let share = match self.model.hold {
            SurfaceHold::Zero => 1.0,
            SurfaceHold::First => self.share_of_way(state, tick),
        };
        let way_s = self.ticks_of_period(tick) as f64 * self.schedule.control().period_s();
        let speed_per_s = if share < 1.0 { 1.0 / way_s } else { 0.0 };
        SurfaceInUse { latest: &frame.surface, before_m: &previous.positions_m, share, speed_per_s }
    }

    /// Two-sided contacts hold the points that are nearest to where the fingers start.
    fn anchor_for_good(&self, state: &mut SoftHostState, rest: &SlowFrame) {
        if !self.constants.two_sided {
            return;
        }
        let surface =
            SurfaceInUse { latest: &rest.surface, before_m: &rest.positions_m, share: 1.0, speed_per_s: 0.0 };
        for (contact, start) in state.contacts.iter_mut().zip(&self.starts_m) {
            contact.hold_nearest(&self.constants, &surface, *start);
        }
    }
}

/// What there is to tell of a contact; `None` of one that is free.
fn contact_output(
    contact: &LocalContact,
    surface: &SurfaceInUse<'_>,
    finger: &LocalFinger,
) -> Option<SoftContactOutput> {
    let (centre, _) = finger.place?;
    (contact.touching || contact.force != DVec3::ZERO).then(|| SoftContactOutput {
        sliding: contact.sliding,
        force: contact.force,
        depth_m: if contact.touching { contact.depth_m(surface, centre) } else { 0.0 },
    })
}
