//! What all browsers that look at one thing share: the session or the recordings, what is known of it, what is news.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::body::Bytes;
use cotouch_runtime::{LiveSession, Seat, clock};
use cotouch_scene::time::LocalTime;
use serde_json::Value;
use tokio::sync::{broadcast, watch};
use tokio::time::interval;

use crate::about::about;
use crate::bundle;
use crate::control::Control;
use crate::lesson::Lesson;
use crate::lock::lock;
use crate::picture;
use crate::protocol::{ServerMessage, SessionMessage};
use crate::replays::ShownRecording;
use crate::setting::Settings;
use crate::skin::Skin;

/// How often the session is asked for what seldom changes.
const LOOK_PERIOD: Duration = Duration::from_millis(100);

/// A picture that is no older serves all browsers.
const FRESH_NS: i64 = 8_000_000;

/// News that a slow browser can be behind.
const MAX_NEWS: usize = 32;

/// What browsers look at.
pub(crate) enum Subject {
    Live(Arc<LiveSession>, Box<Lesson>),
    Replay(Vec<ShownRecording>),
}

/// What browsers are told when it changes.
#[derive(Clone, Debug)]
pub(crate) struct PageState {
    pub(crate) session: Arc<SessionFacts>,
    pub(crate) seats: Vec<Seat>,
    pub(crate) settings: Settings,
    pub(crate) note: String,
    /// Why the session is stopped, where it is; else empty.
    pub(crate) paused: &'static str,
}

/// What does not change during one session.
#[derive(Debug)]
pub(crate) struct SessionFacts {
    pub(crate) generation: u32,
    pub(crate) controls: Vec<Control>,
    about: Value,
    may_change: bool,
    recordings: Option<Vec<Value>>,
}

impl SessionFacts {
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

/// What all browsers share: the subject, its state, its news, its newest picture.
pub(crate) struct Hub {
    pub(crate) subject: Subject,
    pub(crate) state: watch::Sender<PageState>,
    pub(crate) news: broadcast::Sender<Arc<str>>,
    newest: Mutex<Option<(LocalTime, Newest)>>,
    /// Of the session of that number.
    skin: Mutex<(u32, Option<Arc<Skin>>)>,
}

impl Hub {
    pub(crate) fn new(subject: Subject) -> Self {
        let state = match &subject {
            Subject::Live(live, lesson) => live_state(live, lesson, None),
            Subject::Replay(replays) => replay_state(replays),
        };
        Self {
            subject,
            state: watch::Sender::new(state),
            news: broadcast::Sender::new(MAX_NEWS),
            newest: Mutex::new(None),
            skin: Mutex::default(),
        }
    }

    /// Tells a sentence to all browsers.
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

    /// Looks at the session for ever.
    pub(crate) async fn watch(&self) {
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
        self.state.send_if_modified(|state| {
            let next = live_state(live, lesson, Some(state));
            let changed = !Arc::ptr_eq(&next.session, &state.session)
                || next.seats != state.seats
                || next.settings != state.settings
                || next.note != state.note
                || next.paused != state.paused;
            *state = next;
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
fn live_state(live: &LiveSession, lesson: &Lesson, last: Option<&PageState>) -> PageState {
    let (scene, generation) = live.scene();
    let last = last.filter(|last| last.session.generation == generation);
    let session = last.map_or_else(
        || {
            let (controls, may_change) = (lesson.controls(), live.may_change());
            Arc::new(SessionFacts {
                generation,
                controls,
                about: about(&scene),
                may_change,
                recordings: None,
            })
        },
        |last| Arc::clone(&last.session),
    );
    let (settings, note) = lesson.settings(&session.controls);
    PageState { session, seats: live.seats(), settings, note, paused: live.paused().unwrap_or_default() }
}

fn replay_state(replays: &[ShownRecording]) -> PageState {
    let facts = SessionFacts {
        generation: 1,
        controls: Vec::new(),
        about: replays.first().map_or(Value::Null, |replay| replay.about.clone()),
        may_change: false,
        recordings: Some(replays.iter().map(ShownRecording::info).collect()),
    };
    PageState {
        session: Arc::new(facts),
        seats: Vec::new(),
        settings: Settings::new(),
        note: String::new(),
        paused: "",
    }
}
