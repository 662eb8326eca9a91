//! `cotouch run`, `serve` and `join`: what is predicted, then the session, then what happened.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use cotouch_net::Route;
use cotouch_runtime::{DeviceChoice, LiveSession, OwnLimits, Predicted, Summary, plain_name, real_time};
use cotouch_scene::scene::{Impairment, Link};
use cotouch_scene::{Override, Scene};
use cotouch_viewer::Base;

use super::address::{self, post};
use super::{lateness, prediction, report, settings};
use crate::arguments::{Host, Recording, Run};
use crate::failure::{Failure, Verdict, in_one_sentence};
use crate::figure;
use crate::output::{Output, make_folder_of, write_file};
use crate::progress::Stop;
use crate::session::{self, Plan};
use crate::tickets;

/// How long a joiner waits for a server on the same computer to come.
const SERVER_PATIENCE: Duration = Duration::from_secs(10);

/// Runs all hosts in this process, in real or in simulated time.
pub(super) fn run(run: &Run, overrides: &[Override], output: &Output) -> Result<Verdict, Failure> {
    let stop = Stop::on_interrupt()?;
    if run.in_virtual_time {
        // The simulated link takes its impairment from the scene.
        let overrides = [overrides, &run.host.impair].concat();
        let scene = limited(cotouch_scene::load(&run.scene, &overrides)?, &run.host);
        check_users(&scene, &run.host.devices)?;
        let predicted = predict(&scene, &stop, output)?;
        let plan = plan(&run.host, &scene.name, None)?;
        let summary = session::run_virtual(&scene, &plan, &stop, output)?;
        return conclude(&scene, &scene, summary, predicted, output);
    }
    let scene = limited(load_realisable(&run.scene, overrides)?, &run.host);
    check_users(&scene, &run.host.devices)?;
    let plan = plan(&run.host, &scene.name, impairment(&run.host.impair)?)?;
    let predicted = predict(&on_this_network(&scene, &plan), &stop, output)?;
    let progress = output.progress("preparing");
    let live = session::start_local(&scene, &plan)?;
    drop(progress);
    finish(live, Some(base(&run.scene, overrides)), predicted, &plan, &stop, output)
}

/// Runs the first host of a session that others join.
pub(super) fn serve(
    name: &str,
    listen: Route,
    host: &Host,
    overrides: &[Override],
    output: &Output,
) -> Result<Verdict, Failure> {
    let stop = Stop::on_interrupt()?;
    check_no_users(&host.devices)?;
    let scene = limited(load_realisable(name, overrides)?, host);
    let plan = plan(host, &scene.name, impairment(&host.impair)?)?;
    let predicted = predict(&on_this_network(&scene, &plan), &stop, output)?;
    output.say(format_args!(
        "the prediction is for all {} users; the loops are others while some are absent",
        scene.session.users
    ));
    let live = session::start_serving(&scene, listen, &plan)?;
    let _posted = live.ticket().and_then(|ticket| {
        output.say(format_args!("others join with: cotouch join {}", tickets::for_others(ticket)));
        post(ticket)
    });
    finish(live, Some(base(name, overrides)), predicted, &plan, &stop, output)
}

/// Joins a session as one of its users.
pub(super) fn join(
    server: &str,
    user: Option<&str>,
    host: &Host,
    output: &Output,
) -> Result<Verdict, Failure> {
    let stop = Stop::on_interrupt()?;
    check_no_users(&host.devices)?;
    let ticket = address::ticket(server, "cotouch serve", SERVER_PATIENCE, &stop)?;
    let plan = plan(host, "joined", impairment(&host.impair)?)?;
    let (scene, live) = session::start_joining(ticket, user, &plan, &stop)?;
    // The hand is in the session already: whoever interrupts wants it released, not an error.
    let predicted = predict(&on_this_network(&scene, &plan), &stop, output)
        .or_else(|failure| if stop.is_set() { Ok(None) } else { Err(failure) })?;
    finish(live, None, predicted, &plan, &stop, output)
}

fn base(scene: &str, overrides: &[Override]) -> Base {
    Base { scene: scene.to_owned(), overrides: overrides.to_vec() }
}

/// Refuses a device for somebody who does not take part.
fn check_users(scene: &Scene, devices: &[DeviceChoice]) -> Result<(), Failure> {
    let names: Vec<&str> =
        scene.users[..usize::from(scene.session.users)].iter().map(|user| user.name.as_str()).collect();
    let named = devices.iter().filter_map(|choice| choice.user.as_deref());
    match named.into_iter().find(|user| !names.contains(user)) {
        Some(user) => Err(Failure::usage(format!(
            "--device {user}=…: the users of {} are {}",
            scene.name,
            names.join(", ")
        ))),
        None => Ok(()),
    }
}

/// Refuses devices for users by name where a process has one user.
fn check_no_users(devices: &[DeviceChoice]) -> Result<(), Failure> {
    match devices.iter().find_map(|choice| choice.user.as_deref()) {
        Some(user) => Err(Failure::usage(format!(
            "--device {user}=…: one user has this host; --device SPEC says it all"
        ))),
        None => Ok(()),
    }
}

/// The prediction is of the scene that began; what was changed on the page is predicted when all is over.
fn finish(
    live: LiveSession,
    base: Option<Base>,
    predicted: Option<Predicted>,
    plan: &Plan,
    stop: &Stop,
    output: &Output,
) -> Result<Verdict, Failure> {
    let (began_with, _) = live.scene();
    let ticket = live.ticket().map(|ticket| tickets::for_others(ticket).to_string());
    let (mut summary, scene) = session::watch(live, base, plan, stop, output)?;
    summary.ticket = ticket;
    conclude(&began_with, &scene, summary, predicted, output)
}

/// The scene with the impairment that a session on real sockets meets: none that the scene simulates, but the one that
/// was asked for.
fn on_this_network(scene: &Scene, plan: &Plan) -> Scene {
    let meet = |link: &mut Link| {
        link.ways.clear();
        link.impairment = plan.impairment.clone().unwrap_or(Impairment::NONE);
    };
    scene.edit(|scene| meet(&mut scene.link)).expect("an impairment is checked when it is asked for")
}

/// What `--max-force` allows.
fn limits(host: &Host) -> Option<OwnLimits> {
    host.max_force_n.map(OwnLimits::max_force)
}

/// The scene with forces that this host allows; what it asks for beyond is told.
fn limited(scene: Scene, host: &Host) -> Scene {
    let Some(limits) = limits(host) else { return scene };
    limits.refusal(&scene).into_iter().for_each(|refusal| tell!("note: {refusal}"));
    limits.apply(&scene)
}

/// The scene as a real network can play it.
fn load_realisable(name: &str, overrides: &[Override]) -> Result<Scene, Failure> {
    let (scene, difference) = real_time::realisable(&cotouch_scene::load(name, overrides)?);
    if let Some(difference) = difference {
        tell!("note: {difference}");
    }
    Ok(scene)
}

/// Says what will run and what the analysis says about it.
fn predict(scene: &Scene, stop: &Stop, output: &Output) -> Result<Option<Predicted>, Failure> {
    output.say(format_args!("{}: {}", scene.name, prediction::who_and_how(scene)));
    let progress = output.progress("predicting");
    let stability = prediction::analyze_until(scene, stop)?;
    drop(progress);
    let Some(stability) = stability else { return Ok(None) };
    output.say(format_args!("predicted: {}", prediction::verdict(&stability)));
    for warning in &stability.warnings {
        output.say(format_args!("note: {warning}"));
    }
    Ok(Some(prediction::predicted(&stability)))
}

fn plan(host: &Host, scene: &str, impairment: Option<Impairment>) -> Result<Plan, Failure> {
    let recording = match &host.recording {
        Recording::Off => None,
        Recording::To(file) => Some(file.clone()),
        Recording::Named => Some(named_recording(scene)),
    };
    if let Some(file) = &recording {
        make_folder_of(file)?;
    }
    let Host { duration_s, while_watched, viewer, ref devices, .. } = *host;
    let (devices, limits) = (devices.clone(), limits(host));
    Ok(Plan { duration_s, while_watched, recording, impairment, viewer, devices, limits })
}

/// `recordings/SCENE-TIME.mcap`, with TIME as in 20261122T101500Z.
fn named_recording(scene: &str) -> PathBuf {
    #[expect(
        clippy::disallowed_methods,
        reason = "a file's name tells people when it was made; nothing computes with it"
    )]
    let now = SystemTime::now();
    let time = humantime::format_rfc3339_seconds(now).to_string().replace(['-', ':'], "");
    Path::new("recordings").join(format!("{}-{time}.mcap", plain_name(scene)))
}

/// What `--impair` asks a real link to do: only what it names.
fn impairment(impair: &[Override]) -> Result<Option<Impairment>, Failure> {
    if impair.is_empty() {
        return Ok(None);
    }
    // Checked by the same rules as a scene's link.
    let scene = cotouch_scene::load(crate::arguments::DEFAULT_SCENE, impair)?;
    Ok(Some(scene.link.impairment.clone()))
}

/// A picture of more than this much of a recording, bytes, would take long and show nothing that one can tell apart.
const LARGEST_DRAWN: u64 = 256 << 20;

fn is_drawn(recording: &Path) -> bool {
    let is_small = recording.metadata().is_ok_and(|facts| facts.len() <= LARGEST_DRAWN);
    if !is_small {
        tell!("note: no picture is drawn of a recording of more than {} MB", LARGEST_DRAWN >> 20);
    }
    is_small
}

/// Writes the picture, says what happened, and judges. The session began with one scene and ended with another, perhaps.
fn conclude(
    began_with: &Scene,
    scene: &Scene,
    mut summary: Summary,
    predicted: Option<Predicted>,
    output: &Output,
) -> Result<Verdict, Failure> {
    settings::complete(&mut summary, began_with, predicted, output);
    lateness::complete(&mut summary, scene);
    // Of the session that ran last, where there were several.
    if let Some(recording) = summary.recording.as_deref().map(Path::new).filter(|file| is_drawn(file)) {
        // What came of the run is not lost with its picture.
        match draw(scene, recording, &report::headline(&summary)) {
            Ok(picture) => summary.picture = Some(picture),
            Err(error) => summary.failures.push(in_one_sentence(&error)),
        }
    }
    let text = report::text(&summary);
    output.answer_as(&summary, &format!("\n{text}"))?;
    let is_good = summary.stable && summary.all_failures().next().is_none();
    Ok(if is_good { Verdict::Good } else { Verdict::Bad })
}

/// Draws the picture of a recording beside it, and says where.
fn draw(scene: &Scene, recording: &Path, headline: &str) -> anyhow::Result<String> {
    let picture = recording.with_extension("svg");
    let trace = session::trace_of(scene, recording)?;
    write_file(&picture, &figure::session_picture(scene, &trace, headline)?)?;
    Ok(picture.display().to_string())
}
