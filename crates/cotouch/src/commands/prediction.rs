//! What the analysis says about a scene, in words.

use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;

use anyhow::anyhow;
use cotouch_analysis::{ContactPlace, Stability, Switching};
use cotouch_runtime::{LOOK_PERIOD, Predicted, Unproven};
use cotouch_scene::Scene;
use cotouch_scene::scene::{Architecture, PlayOut, Rates};

use crate::failure::Failure;
use crate::progress::Stop;
use crate::whole_verdict::whole_verdict;

/// What the analysis says; nothing, and a note, where the loop is too large for it. It is left at work when the user wants
/// the end before it has an answer, which is a failure.
pub(super) fn analyze_until(scene: &Scene, stop: &Stop) -> Result<Option<Stability>, Failure> {
    let (said, answer) = mpsc::channel();
    let scene = scene.clone();
    // Nobody hears the answer when the user has gone on.
    thread::spawn(move || drop(said.send(whole_verdict(&scene, &|| true))));
    let answer = loop {
        match answer.recv_timeout(LOOK_PERIOD) {
            Ok(answer) => break answer,
            Err(RecvTimeoutError::Timeout) if stop.is_set() => {
                return Err(anyhow!("interrupted before the prediction was there").into());
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Err(anyhow!("the analysis failed").into()),
        }
    };
    match answer {
        Ok(stability) => Ok(Some(stability)),
        Err(error) if error.is_too_large() => {
            tell!("note: no prediction: {error}");
            Ok(None)
        }
        Err(error) => Err(Failure::Running(error.into())),
    }
}

/// The part of it that a run is held to.
pub(super) fn predicted(stability: &Stability) -> Predicted {
    let Stability { stable, spectral_radius, .. } = *stability;
    Predicted { stable, spectral_radius, open: open(stability) }
}

/// What the analysis leaves open.
fn open(stability: &Stability) -> Option<Unproven> {
    let why = if stability.left_out.is_empty() { Unproven::Switching } else { Unproven::Coverage };
    stability.stable.is_none().then_some(why)
}

/// What is predicted of a scene; nothing, and a note, where nothing can be.
pub(super) fn predicted_if_possible(scene: &Scene) -> Option<Predicted> {
    match whole_verdict(scene, &|| true) {
        Ok(stability) => Some(predicted(&stability)),
        Err(error) => {
            tell!("note: no prediction: {error}");
            None
        }
    }
}

/// Who takes part, under which architecture, at which rates.
pub(super) fn who_and_how(scene: &Scene) -> String {
    let architecture = match scene.session.architecture {
        Architecture::Centralized => "centralized".to_owned(),
        Architecture::Distributed => format!("distributed ({})", scene.session.coordination),
    };
    let delay = match (scene.link.play_out, scene.link.delay_periods) {
        (PlayOut::OnArrival, _) => "samples used on arrival".to_owned(),
        (PlayOut::Scheduled, 1) => "delay 1 network period".to_owned(),
        (PlayOut::Scheduled, n) => format!("delay {n} network periods"),
    };
    let Rates { control_hz, network_hz, simulation_hz } = scene.rates;
    let soft = match scene.soft.exists() {
        true => format!(", soft object at {simulation_hz} Hz, local model {}", local_model(scene)),
        false => String::new(),
    };
    match scene.session.users {
        1 => format!("1 user, haptic rate {control_hz} Hz{soft}"),
        users => format!(
            "{architecture}, {users} users, haptic rate {control_hz} Hz, network rate {network_hz} Hz, {delay}{soft}"
        ),
    }
}

/// The local model in the scene's words.
fn local_model(scene: &Scene) -> String {
    scene.get("local_model.kind").map(|kind| kind.to_string()).unwrap_or_default().replace('"', "")
}

/// The verdict in one sentence.
pub(super) fn verdict(stability: &Stability) -> String {
    let radius = format!(
        "spectral radius {} per {}",
        radius(stability.spectral_radius),
        milliseconds(stability.period_s)
    );
    format!("{} ({radius}{}{})", word(stability.stable), modes(stability), coverage(stability))
}

/// What a verdict is called.
pub(crate) const fn word(stable: Option<bool>) -> &'static str {
    match stable {
        Some(true) => "stable",
        Some(false) => "unstable",
        None => "not proven",
    }
}

/// Which mode is worst, where, and which gain moves it most.
pub(super) fn worst(stability: &Stability) -> Option<String> {
    let worst = stability.worst.as_ref()?;
    let contacts = match &worst.contacts[..] {
        [] => "no contact".to_owned(),
        contacts => contacts.join(" + "),
    };
    let at = |ContactPlace { contact, body, at_m: [x, y, z] }: &ContactPlace| {
        let [x, y, z] = [x, y, z].map(|metres| metres * 1e3);
        format!("{contact} at ({x:.1}, {y:.1}, {z:.1}) mm of {body}")
    };
    let place = worst.place.iter().flatten().map(at).collect::<Vec<_>>().join(", ");
    let place = if place.is_empty() { place } else { format!(", with {place}") };
    let gain = worst.gain.as_ref().map_or_else(String::new, |gain| {
        let way = if gain.slope > 0.0 { "lower" } else { "raise" };
        format!(": {way} {} to calm it, which moves it most", gain.key)
    });
    let radius = radius(worst.spectral_radius);
    Some(format!("The worst is {contacts}{place}, with {radius}{gain}."))
}

fn modes(stability: &Stability) -> String {
    let unstable = stability.modes.iter().filter(|mode| !mode.stable).count();
    match (stability.modes.len(), unstable, stability.switching) {
        (1, ..) => String::new(),
        (all, 0, Switching::None) => format!("; each of {all} contact modes is stable"),
        (all, 0, Switching::Searched) => {
            let distance = stability.switching_distance;
            let distance =
                distance.map_or_else(String::new, |factor| format!(" up to {factor:.3} times the gains"));
            format!("; each of {all} contact modes is stable{distance}, nothing was found between them")
        }
        (all, 0, Switching::Unproven) => {
            format!("; each of {all} contact modes is stable, switching between them is unproven")
        }
        (all, some, _) => format!("; {some} of {all} contact modes unstable"),
    }
}

/// That something was left out, where this is what keeps the scene from being called stable.
fn coverage(stability: &Stability) -> &'static str {
    match open(stability) {
        Some(Unproven::Coverage) => "; not all that can happen was analysed",
        Some(Unproven::Switching) | None => "",
    }
}

/// As near to 1 as rounding lets the analysis see.
const NEUTRAL: f64 = 1e-11;

/// A spectral radius so that the side of 1 on which it lies can be seen.
pub(super) fn radius(radius: f64) -> String {
    let short = format!("{radius:.4}");
    match short.as_str() {
        _ if radius.is_infinite() => "beyond all figures".to_owned(),
        "1.0000" if (radius - 1.0).abs() < NEUTRAL => "1 (neutral)".to_owned(),
        "1.0000" => format!("{radius:.9}"),
        _ if radius > 1e4 => format!("{radius:.3e}"),
        _ => short,
    }
}

fn milliseconds(seconds: f64) -> String {
    format!("{:.4} ms", seconds * 1e3)
}
