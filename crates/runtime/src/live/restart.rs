//! How one session follows another.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Weak};
use std::thread;
use std::time::Duration;

use cotouch_scene::scene::Scene;
use cotouch_scene::time::LocalTime;

use super::shared::{ChangeError, Changed, Shared, Starter};
use crate::clock;
use crate::session_handle::{LOOK_PERIOD, SessionHandle};
use crate::start_error::StartError;

/// How often the watcher looks, and for how long a world that has left all bounds stays to be seen: twice as long each
/// time that the same settings end so again, since every session has a recording of its own.
const WATCH_PERIOD: Duration = Duration::from_millis(100);
const DIVERGED_STAYS_NS: i64 = 1_500_000_000;
const MAX_DOUBLINGS: u32 = 6;

impl Shared {
    /// Runs `scene`, which a real network can play, from now on.
    pub(super) fn change(&self, scene: Scene) -> Result<Changed, ChangeError> {
        let starter = self.starter.as_ref().ok_or(ChangeError::Shared)?;
        let _one_at_a_time = self.begin_change();
        self.present().begun_anew = 0;
        // A world that has left all bounds stands still for good, whatever the settings.
        let has_diverged = self.has_diverged().0;
        if !has_diverged && self.change_while_running(&scene)? {
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
        let summary = handle.map(SessionHandle::finish);
        let mut present = self.present();
        match &summary {
            Some(Ok(summary)) => present.ended.push(summary.into()),
            Some(Err(error)) => {
                let news = error.to_string();
                present.news.push(news);
            }
            None => {}
        }
        present.summary = summary.or(present.summary.take());
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
        present.handle = Some(handle);
    }

    /// The settings before did start once. Without them there is no session any more.
    fn go_back(&self, starter: &Starter, before: Arc<Scene>, number: u32, why: &StartError) {
        match starter(&before, number) {
            Ok(handle) => self.begin(handle, before, number),
            Err(again) => {
                let news = format!("the session is over: {why}; with the settings before: {again}");
                self.present().news.push(news);
            }
        }
    }
}

/// Watches a session in the background: a world that has left all bounds stands still for good, so the session begins
/// anew, if somebody watches, after a moment in which that can be seen.
pub(super) fn watch(shared: &Arc<Shared>) {
    let shared = Arc::downgrade(shared);
    let watcher = thread::Builder::new().name("live session".to_owned());
    // Without the thread a lesson has a button to begin again.
    let _: std::io::Result<_> = watcher.spawn(move || watch_while_there(&shared));
}

fn watch_while_there(shared: &Weak<Shared>) {
    let mut seen: Option<(u32, LocalTime)> = None;
    loop {
        thread::sleep(WATCH_PERIOD);
        let Some(shared) = shared.upgrade() else { return };
        let (diverged, generation) = shared.has_diverged();
        // Where nobody watches, what happened is to stand in the summary.
        let diverged = diverged && shared.present().watched_until > clock::now();
        seen = match seen.filter(|(of, _)| diverged && *of == generation) {
            Some((_, since)) if clock::now().since(since) >= shared.diverged_stays_ns() => {
                shared.begin_anew_after(generation);
                None
            }
            Some(seen) => Some(seen),
            None => diverged.then(|| (generation, clock::now())),
        };
    }
}

impl Shared {
    fn has_diverged(&self) -> (bool, u32) {
        let present = self.present();
        let runs = present.handle.as_ref().filter(|_| !present.restarting);
        let diverged = runs.is_some_and(|handle| handle.snapshot().hosts.iter().any(|host| host.diverged));
        (diverged, present.generation)
    }

    fn diverged_stays_ns(&self) -> i64 {
        DIVERGED_STAYS_NS << self.present().begun_anew.min(MAX_DOUBLINGS)
    }

    fn begin_anew_after(&self, generation: u32) {
        let Some(starter) = &self.starter else { return };
        let _one_at_a_time = self.begin_change();
        let scene = {
            let mut present = self.present();
            if present.generation != generation {
                return;
            }
            present.begun_anew += 1;
            Scene::clone(&present.scene)
        };
        let news = match self.restart(scene, starter) {
            Ok(()) => "the objects had left all bounds; the session has begun anew".to_owned(),
            Err(ChangeError::Ended) => return,
            Err(error) => error.to_string(),
        };
        self.present().news.push(news);
    }
}
