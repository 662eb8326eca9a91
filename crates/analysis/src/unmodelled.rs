//! What acts in a running session and is in no loop.
//!
//! Every scene key that acts between the beginning of a session and its end is in the loops, or listed here, or harmless:
//!
//! - `governor.soft_start_s`, `governor.release_s`, `session.peer_fade_s` and `session.rejoin_s` act once, for a bounded time;
//! - `governor.watchdog_s` asks for ticks and readings that do not come, which is about a computer and no scene;
//! - `link.impairment.reorder_rate` lets packets overtake, and `duplicate_rate` sends them twice: without jitter or a queue, which
//!   are listed, nothing is overtaken, and a second copy comes when the first has;
//! - stops of a mechanism (`device.kind`) hold a finger without rebound, the ground's friction and a local model's thresholds
//!   take energy, and moment cancellation (`contact.moment_cancellation`) takes a finger's momentum at first contact;
//! - scripts decide what hands do, and events in them come one after the other: between two of them hands are in the loop.

mod limits;
mod link;

use cotouch_scene::ScriptedDemand;
use cotouch_scene::scene::{DeviceKind, Scene, StiffnessFrom};

use crate::left_out::LeftOut;

/// The limits of devices and governors that may act where scripts ask for `demand`, the keys named.
pub(crate) fn limits(scene: &Scene, demand: &ScriptedDemand) -> Vec<LeftOut> {
    limits::unmodelled(scene, demand)
}

/// All else that acts in a running session and is in no loop, the keys named.
pub(crate) fn unmodelled(scene: &Scene) -> Vec<LeftOut> {
    let mut left_out = Vec::new();
    add_of_device(scene, &mut left_out);
    left_out.extend(link::unmodelled(scene));
    if scene.governor.passivity_control {
        left_out.push(LeftOut::new(
            "The passivity controller (governor.passivity_control)",
            "its damping comes and goes with the energy that a finger got",
        ));
    }
    if scene.soft.exists() && scene.local_model.stiffness_from == StiffnessFrom::Estimate {
        left_out.push(LeftOut::new(
            "The estimate of K_o while the session runs (local_model.stiffness_from)",
            "the body's own is taken",
        ));
    }
    left_out
}

fn add_of_device(scene: &Scene, left_out: &mut Vec<LeftOut>) {
    let device = &scene.device;
    if device.kind == DeviceKind::Point {
        return;
    }
    if device.encoder_counts_per_turn > 0 {
        left_out.push(LeftOut::new(
            "The steps in which encoders count (device.encoder_counts_per_turn)",
            "positions are taken as exact, and rounding them can keep a loop moving that would settle",
        ));
    }
    if device.inertia {
        left_out.push(LeftOut::new(
            "How the inertia of the links changes as fingers move (device.inertia)",
            "it is taken as constant",
        ));
    }
}

#[cfg(test)]
mod tests;
