//! What all browsers that look at one thing share: the session or the recordings, what is known of it, what is news.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::body::Bytes;
use cotouch_runtime::clock;
use cotouch_runtime::hand::Seat;
use cotouch_runtime::live::LiveSession;
use cotouch_scene::time::LocalTime;
use serde_json::Value;
use tokio::sync::{broadcast, watch};
use tokio::time::interval;

use crate::about::about;
use crate::bundle;
use crate::controls::Control;
use crate::lesson::Lesson;
use crate::picture;
use crate::protocol::{ServerMessage, SessionMessage, Settings};
use crate::replays::Replay;
use crate::skin::Skin;

/// How often the session is asked for what seldom changes.
const LOOK_PERIOD: Duration = Duration::from_millis(100);

/// A picture that is no older serves all browsers.
const FRESH_NS: i64 = 8_000_000;

/// News that a slow browser can be behind.
const MOST_NEWS: usize = 32;

/// What browsers look at.
pub(crate) enum Subject {
    Live(Arc<LiveSession>, Box<Lesson>),
    Replay(Vec<Replay>),
}

/// What browsers are told when it changes.
#[derive(Clone, Debug)]
pub(crate) struct Stage {
    pub(crate) session: Arc<Facts>,
    pub(crate) seats: Vec<Seat>,
    pub(crate) settings: Settings,
    pub(crate) note: String,
}

/// What does not change during one session.
#[derive(Debug)]
pub(crate) struct Facts {
    pub(crate) generation: u32,
    pub(crate) controls: Vec<Control>,
    about: Value,
    may_change: bool,
    recordings: Option<Vec<Value>>,
}

impl Facts {
    /// As a browser is told, on the same computer or on another one.
    pub(crate) fn message(&self, is_here: bool) -> ServerMessage {
        ServerMessage::Session(Box::new(SessionMessage {
            version: bundle::version().to_owned(),
            generation: self.generation,
            mode: if self.recordings.is_some() { "replay" } else { "live" },
            about: self.about.clone(),
            controls: self.controls.clone(),
            may_change: is_here && self.may_change,
            recordings: self.recordings.clone().unwrap_or_default(),
        }))
    }
}

/// The newest picture, encoded once for all browsers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Newest {
    pub(crate) generation: u32,
    pub(crate) time_s: f64,
    pub(crate) ended: bool,
    pub(crate) bytes: Bytes,
}

/// See the module.
pub(crate) struct Room {
    pub(crate) subject: Subject,
    pub(crate) stage: watch::Sender<Stage>,
    pub(crate) news: broadcast::Sender<Arc<str>>,
    newest: Mutex<Option<(LocalTime, Newest)>>,
    /// Of the session of that number.
    skin: Mutex<(u32, Option<Arc<Skin>>)>,
}

impl Room {
    pub(crate) fn new(subject: Subject) -> Self {
        let stage = match &subject {
            Subject::Live(live, lesson) => live_stage(live, lesson, None),
            Subject::Replay(replays) => replay_stage(replays),
        };
        Self {
            subject,
            stage: watch::Sender::new(stage),
            news: broadcast::Sender::new(MOST_NEWS),
            newest: Mutex::new(None),
            skin: Mutex::default(),
        }
    }

    /// Tells all browsers.
    pub(crate) fn tell(&self, news: &str) {
        // Fails only where nobody listens.
        let _ = self.news.send(news.into());
    }

    /// The newest picture of the session; a replay has none of its own.
    pub(crate) fn picture(&self) -> Option<Newest> {
        let Subject::Live(live, _) = &self.subject else { return None };
        let now = clock::now();
        let mut newest = lock(&self.newest);
        if let Some((made, newest)) = &*newest
            && now.since(*made) < FRESH_NS
        {
            return Some(newest.clone());
        }
        let (snapshot, generation) = live.snapshot();
        let mut bytes = Vec::with_capacity(1024);
        picture::encode(&snapshot, generation, skin_of(live, generation, &self.skin).as_deref(), &mut bytes);
        let made = Newest { generation, time_s: snapshot.time_s, ended: snapshot.ended, bytes: bytes.into() };
        *newest = Some((now, made.clone()));
        Some(made)
    }

    /// Looks after the session for ever.
    pub(crate) async fn tend(&self) {
        let mut looks = interval(LOOK_PERIOD);
        loop {
            looks.tick().await;
            self.look();
        }
    }

    /// Tells browsers what has changed since the last look.
    pub(crate) fn look(&self) {
        let Subject::Live(live, lesson) = &self.subject else { return };
        if live.may_change() {
            live.take_news().iter().for_each(|news| self.tell(news));
        }
        self.stage.send_if_modified(|stage| {
            let next = live_stage(live, lesson, Some(stage));
            let changed = !Arc::ptr_eq(&next.session, &stage.session)
                || next.seats != stage.seats
                || next.settings != stage.settings
                || next.note != stage.note;
            *stage = next;
            changed
        });
    }
}

/// The skin of session number `generation`'s soft object; none where another session has taken its place.
fn skin_of(live: &LiveSession, generation: u32, kept: &Mutex<(u32, Option<Arc<Skin>>)>) -> Option<Arc<Skin>> {
    let mut kept = lock(kept);
    if kept.0 != generation {
        let (scene, found) = live.scene();
        if found != generation {
            return None;
        }
        *kept = (generation, Skin::of(&scene).map(Arc::new));
    }
    kept.1.clone()
}

/// What there is to tell of a session, given what was told last.
fn live_stage(live: &LiveSession, lesson: &Lesson, last: Option<&Stage>) -> Stage {
    let (scene, generation) = live.scene();
    let last = last.filter(|last| last.session.generation == generation);
    let session = last.map_or_else(
        || {
            let (controls, may_change) = (lesson.controls(), live.may_change());
            Arc::new(Facts { generation, controls, about: about(&scene), may_change, recordings: None })
        },
        |last| Arc::clone(&last.session),
    );
    let (settings, note) = lesson.settings(&session.controls);
    Stage { session, seats: live.seats(), settings, note }
}

fn replay_stage(replays: &[Replay]) -> Stage {
    let facts = Facts {
        generation: 1,
        controls: Vec::new(),
        about: replays.first().map_or(Value::Null, |replay| replay.about.clone()),
        may_change: false,
        recordings: Some(replays.iter().map(Replay::info).collect()),
    };
    Stage { session: Arc::new(facts), seats: Vec::new(), settings: Settings::new(), note: String::new() }
}

pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
