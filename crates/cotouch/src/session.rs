//! Where commands meet the runtime: a session is started, watched and summed up here and nowhere else.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;

use anyhow::Context as _;
use cotouch_net::{Route, Ticket};
use cotouch_runtime::{
    DeviceChoice, LOOK_PERIOD, LiveSession, OwnLimits, RealTimeOptions, RecordingReader, Replayed, Summary,
    TickRecord, numbered_path, real_time, virtual_run,
};
use cotouch_scene::Scene;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Impairment;
use cotouch_viewer::{Base, Show, Viewer};

use crate::output::Output;
use crate::predictor::Analyst;
use crate::progress::{Progress, Shown, Stop};
use crate::trace::Trace;

/// What a session is to do besides running.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// s of session time; until `stop` when nothing is said.
    pub(crate) duration_s: Option<f64>,
    /// Whether it goes on after that for as long as a browser watches.
    pub(crate) while_watched: bool,
    /// Where the recording goes.
    pub(crate) recording: Option<PathBuf>,
    /// What every way out of this process does to packets, besides what the network does.
    pub(crate) impairment: Option<Impairment>,
    /// Where the page is served.
    pub(crate) viewer: Option<SocketAddr>,
    /// Who has which device.
    pub(crate) devices: Vec<DeviceChoice>,
    /// What this host allows at most, if that was said.
    pub(crate) limits: Option<OwnLimits>,
}

/// Runs a whole session in simulated time.
pub(crate) fn run_virtual(
    scene: &Scene,
    plan: &Plan,
    stop: &Stop,
    output: &Output,
) -> anyhow::Result<Summary> {
    let duration_s = plan.duration_s.context("a run in virtual time needs a duration")?;
    let progress = output.progress("simulating");
    let keep_on = |elapsed_s: f64| {
        progress.show(elapsed_s / duration_s);
        !stop.is_set()
    };
    let recording = plan.recording.as_deref();
    let tell = |note: String| tell!("note: {note}");
    Ok(virtual_run::run_with_devices(scene, &plan.devices, tell, duration_s, recording, keep_on)?)
}

/// Runs `scene` in simulated time, unrecorded; `observe` sees every tick of every host.
pub(crate) fn simulate(
    scene: &Scene,
    duration_s: f64,
    observe: impl FnMut(HostIndex, &TickRecord),
) -> anyhow::Result<Summary> {
    Ok(virtual_run::run_observed(scene, duration_s, None, |_| true, observe)?)
}

/// Starts all hosts of `scene` in this process; its settings can be changed while it runs.
pub(crate) fn start_local(scene: &Scene, plan: &Plan) -> anyhow::Result<LiveSession> {
    Ok(LiveSession::run_local(scene, options(plan))?)
}

/// Starts the first host of `scene`, open to others.
pub(crate) fn start_serving(scene: &Scene, listen: Route, plan: &Plan) -> anyhow::Result<LiveSession> {
    Ok(LiveSession::fixed(real_time::serve(scene, listen, &options(plan))?))
}

/// Joins a session, unless `stop` is set before it answers; its scene comes from the server.
pub(crate) fn start_joining(
    ticket: Ticket,
    user: Option<&str>,
    plan: &Plan,
    stop: &Stop,
) -> anyhow::Result<(Scene, LiveSession)> {
    let (scene, handle) = real_time::join(ticket, user, &options(plan), &|| !stop.is_set())?;
    Ok((scene, LiveSession::fixed(handle)))
}

fn options(plan: &Plan) -> RealTimeOptions {
    RealTimeOptions {
        duration_s: plan.duration_s,
        recording: plan.recording.clone(),
        impairment: plan.impairment.clone(),
        devices: plan.devices.clone(),
        limits: plan.limits,
    }
}

/// A server that is gone for so many looks does not come back as the same session.
const LOOKS_FOR_THE_SERVER: u32 = 60;
/// A browser that watches keeps a session going for this long from look to look, s.
const WATCHED_S: f64 = 2.0;

/// Shows the session until it ends or `stop` is set. With `base`, its settings can be predicted and, where all hosts are
/// in this process, changed. Says what happened, and which scene it was in the end.
pub(crate) fn watch(
    live: LiveSession,
    base: Option<Base>,
    plan: &Plan,
    stop: &Stop,
    output: &Output,
) -> anyhow::Result<(Summary, Scene)> {
    let live = Arc::new(live);
    live.device_notes().iter().for_each(|note| tell!("note: {note}"));
    let viewer = match plan.viewer {
        Some(address) => start_viewer(Show::Live(Arc::clone(&live), base), address, "join it", output),
        None => None,
    };
    let progress = plan.duration_s.map(|_| Progress::new("running", Shown::Bar));
    let mut warned = false;
    let mut looks_without_server = 0;
    let mut growth = RecordingGrowth::default();
    while !live.has_ended() {
        // A session that can be changed tells its pages itself; its users read there what has happened.
        if !live.may_change() || viewer.is_none() {
            for news in live.take_news() {
                tell!("note: {news}");
                viewer.iter().for_each(|viewer| viewer.tell(&news));
            }
        }
        tell_failures(&live, viewer.as_ref());
        looks_without_server = if live.has_lost_the_server() { looks_without_server + 1 } else { 0 };
        if looks_without_server == LOOKS_FOR_THE_SERVER {
            live.fail("the server has not come back, and the session is lost");
        }
        if stop.is_set() {
            live.stop();
        }
        if viewer.as_ref().is_some_and(|viewer| viewer.watchers() > 0) {
            live.is_watched(if plan.while_watched { WATCHED_S } else { 0.0 });
        }
        if let Some(file) = &plan.recording {
            growth.look(&numbered_path(file, live.scene().1));
        }
        if let (Some(warning), false) = (live.warning(), warned) {
            warned = true;
            tell!("warning: {warning}");
        }
        if let (Some(progress), Some(duration_s)) = (&progress, plan.duration_s) {
            progress.show(live.elapsed_s() / duration_s);
        }
        thread::sleep(LOOK_PERIOD);
    }
    drop(progress);
    tell_failures(&live, viewer.as_ref());
    // The page shows the last picture until here; its server held the session too.
    drop(viewer);
    let scene = live.scene().0;
    let live = Arc::into_inner(live).context("something still watches the session")?;
    Ok((live.finish(), Arc::unwrap_or_clone(scene)))
}

/// Says at once what has failed, to whoever waits here and to all pages.
fn tell_failures(live: &LiveSession, viewer: Option<&Viewer>) {
    for failure in live.take_failures() {
        tell!("error: {failure}");
        viewer.iter().for_each(|viewer| viewer.tell(&failure));
    }
}

/// Tells of every further gigabyte of a recording: a session may go on for as long as somebody watches.
#[derive(Default)]
struct RecordingGrowth {
    file: PathBuf,
    told_gb: u64,
}

impl RecordingGrowth {
    fn look(&mut self, file: &Path) {
        if self.file != file {
            *self = Self { file: file.to_owned(), told_gb: 0 };
        }
        let gb = file.metadata().map_or(0, |facts| facts.len() / 1_000_000_000);
        if gb > self.told_gb {
            self.told_gb = gb;
            tell!("note: the recording {} has grown to {gb} GB; --no-record runs without", file.display());
        }
    }
}

/// Shows recordings on a page.
pub(crate) fn show_recordings(
    files: Vec<PathBuf>,
    address: SocketAddr,
    output: &Output,
) -> anyhow::Result<Option<Viewer>> {
    Ok(start_viewer(Show::Replay(files), address, "see it", output))
}

/// The page; without one the session goes on.
fn start_viewer(show: Show, address: SocketAddr, what_for: &str, output: &Output) -> Option<Viewer> {
    let predictor = match Analyst::new() {
        Ok(analyst) => Arc::new(analyst),
        Err(error) => {
            tell!("warning: no page: {error}");
            return None;
        }
    };
    match Viewer::start(address, show, predictor) {
        Ok(viewer) => {
            output.say(format_args!("{what_for} on http://{}", viewer.address()));
            if !viewer.address().ip().is_loopback() {
                tell!(
                    "note: anyone who reaches this address can watch the session and move its hands; nothing is encrypted"
                );
            }
            Some(viewer)
        }
        Err(error) => {
            tell!("warning: {error}");
            None
        }
    }
}

/// What a recorded run looked like.
pub(crate) fn trace_of(scene: &Scene, recording: &Path) -> anyhow::Result<Trace> {
    let mut trace = Trace::new(scene);
    for item in RecordingReader::open(recording)? {
        trace.observe(&item?);
    }
    Ok(trace)
}

/// Re-simulates a recording and compares it byte for byte.
pub(crate) fn replay(file: &Path) -> anyhow::Result<Replayed> {
    let progress = Progress::unmeasured("replaying", Shown::Bar);
    let name = || file.display().to_string();
    let recording = RecordingReader::open(file).with_context(name)?;
    cotouch_runtime::replay(recording, |ticks| progress.count(ticks)).with_context(name)
}
