//! How one session follows another.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Weak};
use std::thread;
use std::time::Duration;

use cotouch_device::ScriptProgress;
use cotouch_scene::scene::Scene;
use cotouch_scene::time::LocalTime;

use super::shared::{ChangeError, Changed, Shared, Starter};
use crate::clock;
use crate::session_handle::{LOOK_PERIOD, SessionHandle};
use crate::snapshot::HostSnapshot;
use crate::start_error::StartError;

/// How often the watcher looks, and for how long a world that has left all bounds stays to be seen: twice as long each
/// time that the same settings end so again, since every session has a recording of its own.
const WATCH_PERIOD: Duration = Duration::from_millis(100);
const DIVERGED_STAYS_NS: i64 = 1_500_000_000;
const MAX_DOUBLINGS: u32 = 6;
/// For how long a session may shake against its force limits while somebody watches, s.
const LONGEST_SATURATION_S: f64 = 5.0;
/// After the scripts are over, their end can be looked at for so long.
const PAUSE_BETWEEN_SCRIPTS_NS: i64 = 3_000_000_000;

impl Shared {
    /// Runs `scene`, which a real network can play, from now on.
    pub(super) fn change(&self, scene: Scene) -> Result<Changed, ChangeError> {
        let starter = self.starter.as_ref().ok_or(ChangeError::Shared)?;
        let _one_at_a_time = self.begin_change();
        self.present().begun_anew = 0;
        // A world that has left all bounds stands still for good, whatever the settings.
        if !self.has_diverged() && self.change_while_running(&scene)? {
            return Ok(Changed::WhileRunning);
        }
        self.restart(scene, starter)?;
        Ok(Changed::ByRestart)
    }

    fn change_while_running(&self, scene: &Scene) -> Result<bool, ChangeError> {
        let mut present = self.present();
        if present.has_ended() {
            return Err(ChangeError::Ended);
        }
        let changed = present.handle.as_ref().is_some_and(|handle| handle.change(scene));
        if changed {
            present.scene = Arc::new(scene.clone());
        }
        Ok(changed)
    }

    /// Begins anew with the scene that runs.
    pub(super) fn again(&self) -> Result<(), ChangeError> {
        let starter = self.starter.as_ref().ok_or(ChangeError::Shared)?;
        let _one_at_a_time = self.begin_change();
        let scene = {
            let mut present = self.present();
            present.begun_anew = 0;
            Scene::clone(&present.scene)
        };
        self.restart(scene, starter)
    }

    fn restart(&self, scene: Scene, starter: &Starter) -> Result<(), ChangeError> {
        self.end_the_present_one()?;
        let (before, number) = {
            let present = self.present();
            (Arc::clone(&present.scene), present.generation + 1)
        };
        let began = match starter(&scene, number) {
            Ok(handle) => {
                self.begin(handle, Arc::new(scene), number);
                Ok(())
            }
            Err(error) => {
                self.go_back(starter, before, number, &error);
                Err(ChangeError::NotStarted(error.to_string()))
            }
        };
        self.present().restarting = false;
        began
    }

    /// Lets go of all devices, and closes the recording. Pictures go on until the last tick, and the last one stays.
    fn end_the_present_one(&self) -> Result<(), ChangeError> {
        {
            let mut present = self.present();
            if present.has_ended() || self.stopping.load(Ordering::SeqCst) {
                return Err(ChangeError::Ended);
            }
            present.restarting = true;
            present.handle.iter().for_each(SessionHandle::stop);
        }
        while !self.present().handle.as_ref().is_none_or(SessionHandle::has_ended) {
            thread::sleep(LOOK_PERIOD / 5);
        }
        let handle = {
            let mut present = self.present();
            if let Some(handle) = &present.handle {
                present.last = handle.snapshot();
            }
            present.handle.take()
        };
        let Some(handle) = handle else { return Ok(()) };
        let told = handle.failures_told();
        let summary = handle.finish();
        let mut present = self.present();
        present.failures.extend(summary.failures.iter().skip(told).cloned());
        present.ended.push((&summary).into());
        present.summary = Some(summary);
        Ok(())
    }

    fn begin(&self, handle: SessionHandle, scene: Arc<Scene>, generation: u32) {
        let mut present = self.present();
        present.last = handle.snapshot();
        (present.scene, present.generation) = (scene, generation);
        // Asked under the lock that a stop takes too: one of the two sees the other.
        if self.stopping.load(Ordering::SeqCst) {
            handle.stop();
        }
        (present.handle, present.paused) = (Some(handle), false);
    }

    /// The settings before did start once. Without them there is no session any more.
    fn go_back(&self, starter: &Starter, before: Arc<Scene>, number: u32, why: &StartError) {
        match starter(&before, number) {
            Ok(handle) => self.begin(handle, before, number),
            Err(again) => {
                let news = format!("the session is over: {why}; with the settings before: {again}");
                let mut present = self.present();
                present.paused = false;
                present.news.push(news);
            }
        }
    }
}

/// Why the watcher of a session does something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Occasion {
    /// A world that has left all bounds stands still for good.
    LeftBounds,
    /// Somebody's finger has shaken against its limits for a while.
    Saturated,
    /// All scripts are over, and no pointer moves a hand.
    ScriptsOver,
}

/// Watches a session in the background. Where somebody watches: a world that has left all bounds begins anew, after a moment in
/// which that can be seen, and so does a session whose scripts are over; one that shakes against its limits is stopped. One
/// that is stopped waits until `ends_at`, and for as long as somebody watches.
pub(super) fn watch(shared: &Arc<Shared>, ends_at: Option<LocalTime>) {
    let shared = Arc::downgrade(shared);
    let watcher = thread::Builder::new().name("live session".to_owned());
    // Without the thread a lesson has a button to begin again.
    let _: std::io::Result<_> = watcher.spawn(move || watch_while_there(&shared, ends_at));
}

fn watch_while_there(shared: &Weak<Shared>, ends_at: Option<LocalTime>) {
    let mut seen: Option<(u32, Occasion, LocalTime)> = None;
    loop {
        thread::sleep(WATCH_PERIOD);
        let Some(shared) = shared.upgrade() else { return };
        shared.end_what_nobody_begins_anew(ends_at);
        // Where nobody watches, what happened is to stand in the summary.
        let is_watched = shared.present().watched_until > clock::now();
        let (occasion, generation) = shared.occasion();
        let Some(occasion) = occasion.filter(|_| is_watched) else {
            seen = None;
            continue;
        };
        let since = match seen {
            Some((of, same, since)) if (of, same) == (generation, occasion) => since,
            _ => clock::now(),
        };
        seen = Some((generation, occasion, since));
        if clock::now().since(since) >= shared.patience_ns(occasion) {
            shared.act_on(occasion, generation);
            seen = None;
        }
    }
}

impl Shared {
    /// What there is to do something about, in which session.
    fn occasion(&self) -> (Option<Occasion>, u32) {
        let present = self.present();
        let occasion = present.handle.as_ref().filter(|_| !present.restarting).and_then(occasion);
        (occasion, present.generation)
    }

    fn has_diverged(&self) -> bool {
        self.occasion().0 == Some(Occasion::LeftBounds)
    }

    fn patience_ns(&self, occasion: Occasion) -> i64 {
        match occasion {
            Occasion::LeftBounds => DIVERGED_STAYS_NS << self.present().begun_anew.min(MAX_DOUBLINGS),
            Occasion::Saturated => 0,
            Occasion::ScriptsOver => PAUSE_BETWEEN_SCRIPTS_NS,
        }
    }

    fn act_on(&self, occasion: Occasion, generation: u32) {
        match occasion {
            Occasion::LeftBounds => {
                self.begin_anew_after(
                    generation,
                    1,
                    "the objects had left all bounds; the session has begun anew",
                );
            }
            Occasion::ScriptsOver => {
                self.begin_anew_after(generation, 0, "the scripts were over; the session has begun anew");
            }
            Occasion::Saturated => self.pause(generation),
        }
    }

    /// `counted` is 1 where that is not to happen often.
    fn begin_anew_after(&self, generation: u32, counted: u32, why: &str) {
        let Some(starter) = &self.starter else { return };
        let _one_at_a_time = self.begin_change();
        let scene = {
            let mut present = self.present();
            if present.generation != generation {
                return;
            }
            present.begun_anew += counted;
            Scene::clone(&present.scene)
        };
        let news = match self.restart(scene, starter) {
            Ok(()) => why.to_owned(),
            Err(ChangeError::Ended) => return,
            Err(error) => error.to_string(),
        };
        self.present().news.push(news);
    }

    /// Lets go of all devices, and waits.
    fn pause(&self, generation: u32) {
        let _one_at_a_time = self.begin_change();
        if self.present().generation != generation || self.end_the_present_one().is_err() {
            return;
        }
        let mut present = self.present();
        present.paused = !self.stopping.load(Ordering::SeqCst);
        present.restarting = false;
    }

    fn end_what_nobody_begins_anew(&self, ends_at: Option<LocalTime>) {
        let now = clock::now();
        let mut present = self.present();
        let is_over = ends_at.is_some_and(|ends_at| ends_at < now) && present.waits_until < now;
        present.paused &= !is_over;
    }
}

/// What there is to do something about in a running session.
fn occasion(handle: &SessionHandle) -> Option<Occasion> {
    let snapshot = handle.snapshot();
    let hosts = &snapshot.hosts;
    if hosts.iter().any(|host| host.diverged) {
        return Some(Occasion::LeftBounds);
    }
    if snapshot.now.saturated_s >= LONGEST_SATURATION_S {
        return Some(Occasion::Saturated);
    }
    let is = |progress: ScriptProgress| move |host: &HostSnapshot| host.script == progress;
    let is_over =
        hosts.iter().any(is(ScriptProgress::Over)) && !hosts.iter().any(is(ScriptProgress::Running));
    is_over.then_some(Occasion::ScriptsOver)
}
