//! Where commands meet the runtime: a session is started, watched and summed up here and nowhere else.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;

use anyhow::Context as _;
use cotouch_runtime::real_time::{self, RealTimeOptions};
use cotouch_runtime::record::{RecordKind, TickRecord};
use cotouch_runtime::recording::RecordingReader;
use cotouch_runtime::replay::{self, Replayed};
use cotouch_runtime::session_handle::{LOOK_PERIOD, SessionHandle};
use cotouch_runtime::summary::{Predicted, Summary};
use cotouch_runtime::virtual_run;
use cotouch_scene::Scene;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Impairment;
use cotouch_viewer::{About, Viewer};

use crate::output::Output;
use crate::progress::{Progress, Stop};
use crate::trace::Trace;

/// What a session is to do besides running.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// s of session time; until `stop` when nothing is said.
    pub(crate) duration_s: Option<f64>,
    /// Where the recording goes.
    pub(crate) recording: Option<PathBuf>,
    /// What every way out of this process does to packets, besides what the network does.
    pub(crate) impairment: Option<Impairment>,
    /// Where the page is served.
    pub(crate) viewer: Option<SocketAddr>,
}

/// Runs a whole session in simulated time.
pub(crate) fn run_virtual(scene: &Scene, plan: &Plan, stop: &Stop) -> anyhow::Result<Summary> {
    let duration_s = plan.duration_s.context("a run in virtual time needs a duration")?;
    let progress = Progress::new("simulating");
    let keep_on = |elapsed_s: f64| {
        progress.show(elapsed_s / duration_s);
        !stop.is_set()
    };
    Ok(virtual_run::run(scene, duration_s, plan.recording.as_deref(), keep_on)?)
}

/// Runs `scene` in simulated time, unrecorded; `observe` sees every tick of every host.
pub(crate) fn simulate(
    scene: &Scene,
    duration_s: f64,
    observe: impl FnMut(HostIndex, &TickRecord),
) -> anyhow::Result<Summary> {
    Ok(virtual_run::run_observed(scene, duration_s, None, |_| true, observe)?)
}

/// Starts all hosts of `scene` in this process.
pub(crate) fn start_local(scene: &Scene, plan: &Plan) -> anyhow::Result<SessionHandle> {
    Ok(real_time::run_local(scene, &options(plan))?)
}

/// Starts the first host of `scene`, open to others.
pub(crate) fn start_serving(scene: &Scene, listen: SocketAddr, plan: &Plan) -> anyhow::Result<SessionHandle> {
    Ok(real_time::serve(scene, listen, &options(plan))?)
}

/// Joins a session; its scene comes from the server.
pub(crate) fn start_joining(
    server: SocketAddr,
    user: Option<&str>,
    plan: &Plan,
) -> anyhow::Result<(Scene, SessionHandle)> {
    Ok(real_time::join(server, user, &options(plan))?)
}

fn options(plan: &Plan) -> RealTimeOptions {
    RealTimeOptions {
        duration_s: plan.duration_s,
        recording: plan.recording.clone(),
        impairment: plan.impairment.clone(),
    }
}

/// A server that is gone for so many looks does not come back as the same session.
const LOOKS_FOR_THE_SERVER: u32 = 60;

/// Shows the session until it ends or `stop` is set, and says what happened.
pub(crate) fn watch(
    handle: SessionHandle,
    predicted: Option<Predicted>,
    plan: &Plan,
    stop: &Stop,
    output: &Output,
) -> anyhow::Result<Summary> {
    let handle = Arc::new(handle);
    let viewer = plan.viewer.and_then(|address| start_viewer(&handle, predicted, address, output));
    let progress = plan.duration_s.map(|_| Progress::new("running"));
    let mut warned = false;
    let is_whole = handle.hosts().len() == usize::from(handle.scene().session.users);
    let mut looks_without_server = 0;
    while !handle.has_ended() {
        if !is_whole {
            handle.take_news().iter().for_each(|news| eprintln!("note: {news}"));
        }
        looks_without_server = if handle.has_lost_the_server() { looks_without_server + 1 } else { 0 };
        if looks_without_server == LOOKS_FOR_THE_SERVER {
            eprintln!("note: the server has not come back; this host lets go and ends");
            handle.stop();
        }
        if stop.is_set() {
            handle.stop();
        }
        if let (Some(warning), false) = (handle.warning(), warned) {
            warned = true;
            eprintln!("warning: {warning}");
        }
        if let (Some(progress), Some(duration_s)) = (&progress, plan.duration_s) {
            progress.show(handle.elapsed_s() / duration_s);
        }
        thread::sleep(LOOK_PERIOD);
    }
    drop(progress);
    // The page shows the last picture until here; its server held the handle too.
    drop(viewer);
    let handle = Arc::into_inner(handle).context("something still watches the session")?;
    Ok(handle.finish()?)
}

/// The page of a session; without one the session goes on.
fn start_viewer(
    handle: &Arc<SessionHandle>,
    predicted: Option<Predicted>,
    address: SocketAddr,
    output: &Output,
) -> Option<Viewer> {
    let about = About::new(handle.scene(), move || serde_json::to_value(predicted).unwrap_or_default());
    let watched = Arc::clone(handle);
    match Viewer::start(address, about, move || watched.snapshot()) {
        Ok(viewer) => {
            output.say(format_args!("watch it on http://{}", viewer.address()));
            if !viewer.address().ip().is_loopback() {
                eprintln!(
                    "note: anyone who reaches this address can watch the session; nothing is encrypted"
                );
            }
            Some(viewer)
        }
        Err(error) => {
            eprintln!("warning: {error}");
            None
        }
    }
}

/// What a recorded run looked like.
pub(crate) fn trace_of(scene: &Scene, recording: &Path) -> anyhow::Result<Trace> {
    let mut trace = Trace::new(scene);
    for item in RecordingReader::open(recording)? {
        let item = item?;
        if let RecordKind::Tick(tick) = &item.kind {
            trace.observe(item.host, tick);
        }
    }
    Ok(trace)
}

/// Re-simulates a recording and compares it byte for byte.
pub(crate) fn replay(file: &Path) -> anyhow::Result<Replayed> {
    let progress = Progress::unmeasured("replaying");
    let name = || file.display().to_string();
    let recording = RecordingReader::open(file).with_context(name)?;
    replay::replay(recording, |ticks| progress.count(ticks)).with_context(name)
}
