//! The fingers of all users on a host's soft body: own ones as read, those of others as held.

use arrayvec::ArrayVec;
use cotouch_scene::geometry::{Readings, Wrench};
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::names::HostIndex;
use cotouch_world::Phase;
use cotouch_world::local::{LocalFinger, Slots};
use glam::DVec3;

use crate::contacts::Touching;
use crate::forces::held_finger;
use crate::model::HostModel;
use crate::output::{ContactPoint, ContactRecord, ContactSurface, CouplerOutput, TickOutput};
use crate::soft::{SoftContactOutput, SoftContacts};
use crate::state::HostState;

/// All contacts with the soft body, one tick on: forces on own fingers and what goes to the simulation, into `output`.
pub(crate) fn touch_soft_body(
    model: &HostModel,
    state: &mut HostState,
    tick: u64,
    readings: &Readings,
    output: &mut TickOutput,
) {
    let Some(soft) = &model.soft else { return };
    let fingers = fingers(model, soft, state, readings);
    let Some(touch) = soft.touch(&mut state.soft, tick, &as_local(&fingers)) else { return };
    for ((finger, &force), contact) in fingers.iter().zip(&touch.forces).zip(&touch.contacts) {
        if finger.host == model.host {
            output.device[finger.finger] = Wrench::force(output.device[finger.finger].force + force);
        }
        if let Some(contact) = contact {
            record(output, finger, model.finger_slot(finger.host, finger.finger, 0), contact);
        }
    }
    output.slow = touch.slow;
}

/// What the server's next tick, that of network step `step`, will find for the fingers of `client`, N; nothing moves on.
pub(crate) fn soft_forces_on_client(
    model: &HostModel,
    state: &HostState,
    step: u64,
    readings: &Readings,
    client: HostIndex,
) -> ArrayVec<DVec3, MAX_FINGERS> {
    let Some(soft) = &model.soft else { return ArrayVec::new() };
    let fingers = fingers(model, soft, state, readings);
    let forces = soft.forces(&state.soft, model.schedule.tick_of_step(step), &as_local(&fingers));
    let on_client = fingers.iter().zip(&forces).filter(|(finger, _)| finger.host == client);
    on_client.map(|(finger, force)| finger.fade * *force).collect()
}

/// Every finger of every user, in the order of slots.
fn fingers(
    model: &HostModel,
    soft: &SoftContacts,
    state: &HostState,
    readings: &Readings,
) -> Slots<Touching> {
    let own = |finger: usize| Touching {
        host: model.host,
        finger,
        place: readings.get(finger).map(|reading| (reading.pose.position, reading.twist.linear)),
        fade: 1.0,
    };
    let all = HostIndex::all(model.users)
        .flat_map(|host| (0..usize::from(model.fingers[host.index()])).map(move |finger| (host, finger)));
    all.take(soft.slots())
        .map(|(host, finger)| if host == model.host { own(finger) } else { held_finger(state, host, finger) })
        .collect()
}

fn as_local(fingers: &[Touching]) -> Slots<LocalFinger> {
    fingers.iter().map(|finger| LocalFinger { place: finger.place, fade: finger.fade }).collect()
}

/// Lists a contact that is not free.
fn record(output: &mut TickOutput, finger: &Touching, coupler: u16, contact: &SoftContactOutput) {
    // What finds no place in the list counts all the same.
    let _ = output.contacts.try_push(ContactRecord {
        point: ContactPoint::Finger { host: finger.host, finger: finger.finger as u8 },
        surface: ContactSurface::Soft,
        phase: if contact.sliding { Phase::Slide } else { Phase::PreSlide },
        force: finger.fade * contact.force,
        depth_m: contact.depth_m,
    });
    let stiffness = contact.stiffness_n_per_m;
    let _ = output.couplers.try_push(CouplerOutput {
        slot: coupler,
        held: true,
        stiffness_n_per_m: finger.fade * stiffness,
        stretch: if stiffness > 0.0 { contact.force / stiffness } else { DVec3::ZERO },
    });
}
