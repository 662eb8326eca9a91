//! Changes of the running session, one at a time; of what comes meanwhile the newest wins.

use std::sync::Arc;

use cotouch_runtime::LiveSession;
use tokio::sync::mpsc;

use crate::hub::{Hub, Subject};
use crate::lesson::Lesson;
use crate::protocol::ServerMessage;
use crate::setting::Settings;

/// What a browser wants changed.
pub(crate) struct Change {
    pub(crate) wanted: Wanted,
    pub(crate) asker: mpsc::Sender<ServerMessage>,
}

pub(crate) enum Wanted {
    Settings(Settings),
    Again,
}

/// Changes that wait for the one that is being made.
pub(crate) const MAX_WAITING: usize = 64;

/// Makes changes as they are asked for, until nobody can ask any more.
pub(crate) async fn make(hub: Arc<Hub>, mut asked: mpsc::Receiver<Change>) {
    while let Some(first) = asked.recv().await {
        let mut changes = vec![first];
        while let Ok(next) = asked.try_recv() {
            changes.push(next);
        }
        let working = Arc::clone(&hub);
        let made = tokio::task::spawn_blocking(move || working.make(&changes)).await;
        if let Err(panic) = made {
            tracing::error!("a change of the session failed: {panic}");
        }
        hub.look();
    }
}

impl Hub {
    fn make(&self, changes: &[Change]) {
        let Subject::Live(live, lesson) = &self.subject else { return };
        let refuse = |change: &Change, why: &str| {
            // A browser that has gone does not mind.
            let _ = change.asker.try_send(ServerMessage::Refused { what: "set", why: why.to_owned() });
        };
        let mut merged = Settings::new();
        for change in changes {
            let Wanted::Settings(settings) = &change.wanted else { continue };
            let mut more = merged.clone();
            more.extend(settings.clone());
            match self.try_out(live, lesson, &more) {
                Ok(()) => merged = more,
                Err(why) => refuse(change, &why),
            }
        }
        if !merged.is_empty()
            && let Err(why) = self.change(live, lesson, &merged)
        {
            changes.iter().for_each(|change| refuse(change, &why));
        }
        let wants_again = changes.iter().filter(|change| matches!(change.wanted, Wanted::Again));
        for change in wants_again.take(1) {
            if let Err(why) = live.again() {
                refuse(change, &why.to_string());
            }
        }
    }

    /// Whether these settings can be had, or why not.
    fn try_out(&self, live: &LiveSession, lesson: &Lesson, settings: &Settings) -> Result<(), String> {
        let present = lesson.present().ok_or("nothing of this session can be set")?;
        let controls = self.state.borrow().session.controls.clone();
        present.with(settings, &controls, live).map(|_| ())
    }

    fn change(&self, live: &LiveSession, lesson: &Lesson, settings: &Settings) -> Result<(), String> {
        let before = lesson.present().ok_or("nothing of this session can be set")?;
        let controls = self.state.borrow().session.controls.clone();
        let (next, _) = before.with(settings, &controls, live)?;
        let scene = next.scene.clone();
        // First what is set: whoever finds the next session must find its controls too.
        lesson.replace(next);
        live.change(scene).map(|_| ()).map_err(|error| {
            lesson.replace(before);
            error.to_string()
        })
    }
}
