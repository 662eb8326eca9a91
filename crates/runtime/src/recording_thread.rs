//! The thread that takes the haptic thread's items to the recording.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_scene::to_toml;

use crate::clock;
use crate::control::Control;
use crate::exchange::{RECORD_RING_BYTES, RecordConsumer, RecordProducer, record_ring};
use crate::failures::{Failures, catch};
use crate::priority::HELPER_STACK_BYTES;
use crate::recorder::{RecordError, Recorder, RecordingHeader};
use crate::summary::Summary;

/// Items wait in the rings for so long; a ring holds several seconds.
const DRAIN_PERIOD: Duration = Duration::from_millis(20);

/// A recording under way.
pub(crate) struct RecordingThread {
    path: PathBuf,
    /// Gives nothing where writing has failed, which was told then.
    thread: JoinHandle<Option<Recorder>>,
}

impl RecordingThread {
    /// Starts a recording of `hosts` at `path`, and gives each host's end; nothing when there is no path. When it cannot be
    /// written on, the session is told, and goes on without.
    pub(crate) fn start(
        scene: &Scene,
        hosts: &[HostIndex],
        path: Option<&Path>,
        control: &Arc<Control>,
    ) -> Result<(Option<Self>, Vec<RecordProducer>), RecordError> {
        let Some(path) = path else { return Ok((None, Vec::new())) };
        let recorder = Recorder::create(path, &header(scene, clock::unix_now_ns()))?;
        let (producers, consumers) = hosts.iter().map(|&host| record_ring(host, RECORD_RING_BYTES)).unzip();
        let (file, control) = (path.to_owned(), Arc::clone(control));
        let thread = thread::Builder::new()
            .name("recorder".to_owned())
            .stack_size(HELPER_STACK_BYTES)
            .spawn(move || {
                let drained = catch(|| drain_to_the_end(recorder, consumers, &control));
                let kept = drained.and_then(|drained| drained.map_err(|error| error.to_string()));
                kept.map_err(|why| control.failures.tell(without_recording(&file, &why))).ok()
            })
            .map_err(|source: io::Error| RecordError::Create { path: path.to_owned(), source })?;
        Ok((Some(Self { path: path.to_owned(), thread }), producers))
    }

    /// Waits until everything is written, closes the file with what came of the run, and gives its path; nothing where it could
    /// not be written to its end, which is told. All producers must be gone, or the haptic thread abandoned.
    pub(crate) fn finish(self, summary: &Summary, failures: &Failures) -> Option<String> {
        let recorder = self.thread.join().ok().flatten()?;
        match recorder.finish(facts(summary)) {
            Ok(_) => Some(self.path.display().to_string()),
            Err(error) => {
                failures.tell(error.to_string());
                None
            }
        }
    }
}

/// What a recording of `scene` says first.
pub(crate) fn header(scene: &Scene, epoch_unix_ns: u64) -> RecordingHeader {
    let fact = |key: &str, value: String| (key.to_owned(), value);
    RecordingHeader {
        cotouch_version: env!("CARGO_PKG_VERSION").to_owned(),
        scene_toml: to_toml(scene),
        control_hz: scene.rates.control_hz,
        epoch_unix_ns,
        facts: BTreeMap::from([
            fact("scene", scene.name.clone()),
            fact("users", scene.session.users.to_string()),
        ]),
    }
}

/// What came of a run, for the end of its recording.
pub(crate) fn facts(summary: &Summary) -> BTreeMap<String, String> {
    BTreeMap::from([
        ("duration_s".to_owned(), summary.duration_s.to_string()),
        ("stable".to_owned(), summary.stable.to_string()),
        ("verdict".to_owned(), summary.verdict.in_words().to_owned()),
        ("ticks".to_owned(), summary.haptic.ticks.to_string()),
        ("missed".to_owned(), summary.haptic.missed.to_string()),
    ])
}

/// What a person is told when a recording ends before its session.
fn without_recording(file: &Path, why: &str) -> String {
    let file = file.display();
    format!("the session goes on without a recording; {file} stays readable up to here: {why}")
}

fn drain_to_the_end(
    mut recorder: Recorder,
    mut rings: Vec<RecordConsumer>,
    control: &Control,
) -> Result<Recorder, RecordError> {
    loop {
        // Asked before draining: what was left before the last producer went is drained once more. An abandoned haptic thread keeps
        // its producers.
        let ended =
            rings.iter().all(RecordConsumer::is_abandoned) || control.abandoned.load(Ordering::Acquire);
        for ring in &mut rings {
            ring.drain(&mut recorder);
        }
        recorder.poll(clock::now())?;
        if ended {
            return Ok(recorder);
        }
        thread::sleep(DRAIN_PERIOD);
    }
}
