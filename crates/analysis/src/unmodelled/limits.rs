//! Limits of force, slew and torque, where they may act in the session as scripted.
//!
//! The analysis is handed what the scripts ask for ([`ScriptedDemand`], found by running them with all limits lifted). A limit leaves
//! the loop linear that is above
//!
//! ```text
//! F = 1.5·(largest force or change of force of that run) + 2·1 N
//! ```
//!
//! 1.5 times, for what one run does not show: repeated scripts that meet at another phase, hosts that join at another time, other links. A
//! pointer on the page counts as 1 N, as in the adversary's hands; it moves an undamped spring to twice where it rests under it.

use cotouch_scene::mechanism::Placed;
use cotouch_scene::scene::Scene;
use cotouch_scene::{AskedForce, DemandExtent, ScriptedDemand};
use glam::DVec3;

use crate::left_out::LeftOut;

/// What another phase of the scripts may ask for, over what their run did.
const FOR_OTHER_RUNS: f64 = 1.5;
/// What a pointer on the page may ask for besides, N.
const POINTER_N: f64 = 2.0;

/// The limits that what scripts ask for may meet, and what of the scripts is not known.
pub(super) fn unmodelled(scene: &Scene, demand: &ScriptedDemand) -> Vec<LeftOut> {
    let governor = &scene.governor;
    let force_n = governor.max_force_n;
    let step_n = governor.max_slew_n_per_s / scene.rates.control_hz.hz();
    let motors_n = motors_render_n(scene);
    let limits = [
        (format!("The limit of forces at {force_n} N (governor.max_force_n)"), force_n, &demand.force, ""),
        (
            format!("The limit of slew at {step_n:.3} N a tick (governor.max_slew_n_per_s)"),
            step_n,
            &demand.change,
            " more within one tick",
        ),
        (
            format!("The limit of torques, which is {motors_n:.3} N somewhere (device.max_joint_torque_n_m)"),
            motors_n,
            &demand.force,
            "",
        ),
    ];
    let met = limits.into_iter().filter_map(|(what, limit_n, asked, within)| {
        let may_act = FOR_OTHER_RUNS * asked.newtons + POINTER_N > limit_n;
        may_act.then(|| LeftOut::new(what, in_words(scene, asked, limit_n, within)))
    });
    met.chain(unknown(&demand.extent)).collect()
}

/// Who asks for how much when, and why that is too much.
fn in_words(scene: &Scene, asked: &AskedForce, limit_n: f64, within: &str) -> String {
    let AskedForce { newtons, ref user, finger, at_s } = *asked;
    if newtons == 0.0 {
        return format!(
            "forces are taken as rendered in full, and a hand on the page may ask for {POINTER_N} N{within}"
        );
    }
    let several = scene.users.iter().any(|one| one.name == *user && one.fingers.len() > 1);
    let finger = if several { format!(" at finger {}", finger + 1) } else { String::new() };
    let asks = format!("{user}'s script asks for {newtons:.3} N{within}{finger} at {at_s:.3} s");
    match newtons > limit_n {
        true => format!("forces are taken as rendered in full, and {asks}"),
        false => format!(
            "forces are taken as rendered in full, and {asks}; {FOR_OTHER_RUNS} times that, for other runs than the one that was looked \
             at, and {POINTER_N} N for a hand on the page are more than the limit"
        ),
    }
}

/// What scripts do that was not looked at.
fn unknown(extent: &DemandExtent) -> Option<LeftOut> {
    match extent {
        DemandExtent::Whole => None,
        DemandExtent::Until { at_s } => Some(LeftOut::new(
            format!("What scripts ask for after {at_s:.1} s"),
            "they go on, and were run for so long to see whether they meet a limit",
        )),
        DemandExtent::Diverged { at_s } => Some(LeftOut::new(
            format!("Scripts by which the world leaves all bounds at {at_s:.3} s"),
            "what comes then is no loop",
        )),
        DemandExtent::NotRun { why } => {
            Some(LeftOut::new("What scripts ask for", format!("they could not be run to see it: {why}")))
        }
    }
}

/// The force (N) that motors render everywhere in the workspace and in every direction; infinite where nothing limits them.
fn motors_render_n(scene: &Scene) -> f64 {
    let limit_n_m = scene.device.max_joint_torque_n_m;
    let lever_m =
        Placed::of_finger(&scene.device, DVec3::ZERO).map(|placed| placed.mechanism.longest_lever_m());
    lever_m.filter(|_| limit_n_m > 0.0).map_or(f64::INFINITY, |lever_m| limit_n_m / lever_m)
}
