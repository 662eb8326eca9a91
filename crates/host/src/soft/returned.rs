//! Which forces go back to the simulation (Barbagli et al. 2003, algorithm, Step 3), and when they are known.

use cotouch_scene::scene::ReturnedForce;
use cotouch_scene::time::Schedule;
use cotouch_world::local::LocalFinger;
use glam::DVec3;

use super::input::{SlowContact, SlowInput};
use super::state::SoftHostState;

/// Which forces of a slow period go back to the simulation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Returned {
    pub(super) which: ReturnedForce,
    /// Which tick begins which period of the slow simulation.
    pub(super) schedule: Schedule,
}

impl Returned {
    /// Adds the forces on fingers (N) of one tick to those of its period; what the simulation is told after this tick, if
    /// anything. A period whose last tick was left out is told at the next.
    pub(super) fn sum_up(
        &self,
        soft: &mut SoftHostState,
        tick: u64,
        fingers: &[LocalFinger],
        forces: &[DVec3],
    ) -> Option<SlowInput> {
        let period = self.schedule.last_step_at(tick);
        let mut late = None;
        if soft.period != period {
            late = self.tell(soft, fingers);
            (soft.period, soft.told, soft.returned_ticks) = (period, false, 0);
            soft.returned_n.fill(DVec3::ZERO);
        }
        self.add(soft, fingers, forces);
        let is_known = match self.which {
            ReturnedForce::First => true,
            ReturnedForce::Mean | ReturnedForce::Last => self.schedule.tick_of_step(period + 1) == tick + 1,
        };
        if is_known { self.tell(soft, fingers).or(late) } else { late }
    }

    fn add(&self, soft: &mut SoftHostState, fingers: &[LocalFinger], forces: &[DVec3]) {
        let is_first = soft.returned_ticks == 0;
        for ((returned, finger), &force) in soft.returned_n.iter_mut().zip(fingers).zip(forces) {
            let on_body = -finger.fade * force;
            match self.which {
                ReturnedForce::First if is_first => *returned = on_body,
                ReturnedForce::First => {}
                ReturnedForce::Mean => *returned += on_body,
                ReturnedForce::Last => *returned = on_body,
            }
        }
        soft.returned_ticks += 1;
    }

    /// What is known of the present period, once.
    fn tell(&self, soft: &mut SoftHostState, fingers: &[LocalFinger]) -> Option<SlowInput> {
        if soft.told || soft.returned_ticks == 0 {
            return None;
        }
        soft.told = true;
        let share = match self.which {
            ReturnedForce::Mean => 1.0 / f64::from(soft.returned_ticks),
            ReturnedForce::First | ReturnedForce::Last => 1.0,
        };
        let mut input = SlowInput { period: soft.period, ..SlowInput::default() };
        let slots = fingers.iter().zip(&soft.contacts).zip(&soft.returned_n);
        for (slot, ((finger, contact), returned)) in (0..).zip(slots) {
            let acts = *returned != DVec3::ZERO;
            let Some((centre_m, _)) = finger.place.or(acts.then_some((DVec3::ZERO, DVec3::ZERO))) else {
                continue;
            };
            let anchor = (contact.touching || acts).then_some(contact.anchor);
            // There is a place for every slot.
            let _ =
                input.contacts.try_push(SlowContact { slot, anchor, force_n: *returned * share, centre_m });
        }
        Some(input)
    }
}
