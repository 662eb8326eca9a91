//! What a verdict does not cover, in plain sentences.

use cotouch_scene::scene::{
    Architecture, DeviceKind, Impairment, LocalModelKind, PlayOut, Scene, Space, StiffnessFrom, WallSides,
};

use crate::compile::ContactMode;
use crate::left_out::LeftOut;
use crate::operating_point::{FingerContact, OperatingPoint, has_surface};
use crate::rigid::has_untied_copies;
use crate::switching::{MIN_DISTANCE, Switched};
use crate::verdict::{LoopStability, ModeStability, Switching};

/// What the scene has that the verdict does not cover.
pub(crate) fn warnings(
    scene: &Scene,
    modes: &[ModeStability],
    (settled, headline): (&ContactMode, &LoopStability),
    left_out: &[LeftOut],
    switched: &Switched,
) -> Vec<String> {
    let mut warnings = Vec::new();
    warn_of_link(scene, &mut warnings);
    if modes.len() > 1 {
        warn_of_modes(scene, modes.iter().all(|mode| mode.stable), switched, &mut warnings);
    }
    warnings.extend(left_out.iter().map(LeftOut::to_string));
    warn_of_contact(scene, &mut warnings);
    warn_of_soft_contact(scene, &mut warnings);
    warn_of_device(scene, &mut warnings);
    if has_untied_copies(&settled.spec) {
        warnings.push(
            "No force ties the copies of an object to each other; each part of the session is judged by itself."
                .to_owned(),
        );
    }
    let topple: Vec<f64> = modes.iter().filter_map(|mode| mode.toppling_per_s).collect();
    if let Some(fastest_per_s) = topple.iter().copied().reduce(f64::max) {
        warnings.push(format!(
            "In {} of {} contact modes a body topples or slips away by its statics alone, with perfect devices and no delay too (up to {fastest_per_s:.3} /s). That leads to another contact mode and does not count.",
            topple.len(),
            modes.len()
        ));
    }
    if headline.loose_parts > 0 {
        warnings.push(
            "A part that no stiffness ties to the rest stays wherever it drifts, which does not count as stable."
                .to_owned(),
        );
    }
    warnings
}

fn warn_of_modes(scene: &Scene, each_is_stable: bool, switched: &Switched, warnings: &mut Vec<String>) {
    let has_surfaces = scene.world_bodies().iter().any(|body| has_surface(&body.shape));
    let soft = scene.soft.exists();
    let one_sided = !scene.walls().is_empty() && scene.wall.sides == WallSides::One;
    let what = match (has_surfaces || soft, one_sided) {
        (true, _) => "Contacts open and close",
        (false, true) => "The wall is one-sided",
        (false, false) => "Hands may be held in several ways",
    };
    warnings.push(format!("{what}: {}.", of_switching(each_is_stable, switched)));
}

fn of_switching(each_is_stable: bool, switched: &Switched) -> String {
    let Switched { switching, distance, found } = switched;
    match (switching, distance, found) {
        (_, _, Some(found)) => format!("each contact mode is stable, but {}", found.told()),
        (Switching::Searched, Some(distance), None) => format!(
            "each contact mode is stable, and an adversary that switches contacts found nothing that keeps moving; they may be \
             {distance:.2} times as stiff before a mode is unstable"
        ),
        (_, Some(distance), None) if *distance < MIN_DISTANCE => format!(
            "each contact mode is stable, switching between the modes is unproven this close to the line: an adversary found \
             nothing, but that means something only where contacts may be {MIN_DISTANCE:.2} times as stiff, and here it is \
             {distance:.2} times"
        ),
        _ if each_is_stable => {
            "each contact mode is stable, switching between the modes is unproven".to_owned()
        }
        _ => "not every contact mode is stable, switching between the modes is unproven".to_owned(),
    }
}

/// What of contacts is not linear.
fn warn_of_contact(scene: &Scene, warnings: &mut Vec<String>) {
    let bodies = scene.world_bodies();
    let with_surface = || bodies.iter().filter(|body| has_surface(&body.shape));
    if with_surface().next().is_none() {
        return;
    }
    if let Some(contact) = slips(scene) {
        warnings.push(format!(
            "The settled grasp needs more friction than {contact} has; contacts are taken to stick."
        ));
    }
    let ground = &scene.ground;
    if scene.space == Space::Plane
        && (ground.friction_coefficient > 0.0 || ground.rotational_friction_coefficient > 0.0)
    {
        warnings.push("The ground's friction is not linear and left out; it only takes energy.".to_owned());
    }
    if scene.contact.moment_cancellation {
        warnings.push("Moment cancellation acts on first contact only and is left out.".to_owned());
    }
}

/// What of local models on a soft body is not linear.
fn warn_of_soft_contact(scene: &Scene, warnings: &mut Vec<String>) {
    let local = &scene.local_model;
    if !scene.soft.exists() {
        return;
    }
    if local.kind == LocalModelKind::Pi && local.threshold_force_n > 0.0 {
        warnings.push(
            "The threshold of (11) that grows with the integral's force is taken as constant; while it grows the integral leaks, which only takes force away."
                .to_owned(),
        );
    }
    if local.stiffness_from == StiffnessFrom::Estimate {
        warnings
            .push("K_o is estimated while the session runs; the analysis takes the body's own.".to_owned());
    }
}

/// A finger whose contact would slide in the settled grasp.
fn slips(scene: &Scene) -> Option<String> {
    let point = OperatingPoint::settled_grasp(scene);
    let slips = |contact: &&FingerContact| {
        let pose = &point.poses[contact.host.index()][usize::from(contact.body)];
        let normal = pose.orientation * contact.normal;
        let press_n = contact.force.dot(normal);
        let along_n = (contact.force - normal * press_n).length();
        along_n > scene.contact.static_friction * press_n + 1e-9
    };
    let contact = point.fingers.iter().find(slips)?;
    Some(format!("finger {} of {}", contact.finger + 1, scene.users[contact.user.index()].name))
}

/// What of devices is not linear.
fn warn_of_device(scene: &Scene, warnings: &mut Vec<String>) {
    let device = &scene.device;
    if device.kind == DeviceKind::Point {
        return;
    }
    if device.encoder_counts_per_turn > 0 {
        warnings.push("Encoders count in steps; the analysis takes positions as exact.".to_owned());
    }
    if device.max_joint_torque_n_m > 0.0 {
        warnings.push("Joint torques are limited; the analysis takes forces as rendered in full.".to_owned());
    }
}

fn warn_of_link(scene: &Scene, warnings: &mut Vec<String>) {
    let used = || impairments(scene);
    let worst = |value: fn(&Impairment) -> f64| used().map(value).fold(0.0, f64::max);
    let (loss, jitter) = (worst(|link| link.loss_rate), worst(|link| link.jitter_s));
    if loss > 0.0 {
        warnings.push(format!(
            "Up to {:.3} % of the packets are lost; the analysis assumes that every sample arrives.",
            loss * 100.0
        ));
    }
    if jitter > 0.0 {
        warnings.push(format!(
            "Transit times vary by {:.3} ms in the mean; the analysis takes the constant part of the latency.",
            jitter * 1e3
        ));
    }
    if worst(|link| link.rate_limit_bytes_per_s) > 0.0 {
        warnings.push("The link limits its rate; the analysis has no queues.".to_owned());
    }
    if scene.link.play_out == PlayOut::OnArrival && scene.link.delay_periods > 0 {
        warnings.push("Samples are used on arrival, so link.delay_periods has no effect.".to_owned());
    }
}

/// The impairments of all ways that samples take.
fn impairments(scene: &Scene) -> impl Iterator<Item = &Impairment> {
    let is_used = |from: usize, to: usize| match scene.session.architecture {
        Architecture::Distributed => true,
        Architecture::Centralized => from == 0 || to == 0,
    };
    scene.hosts().flat_map(move |from| {
        let others = from.others(scene.session.users);
        others.filter(move |to| is_used(from.index(), to.index())).map(move |to| scene.impairment(from, to))
    })
}
