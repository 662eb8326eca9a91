//! One thread that asks the predictor for all browsers: of every browser the newest question only. Where one answer takes
//! long, its rest waits until everybody has the first part of theirs.

use std::collections::VecDeque;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use serde_json::Value;
use tokio::sync::mpsc;

use crate::hub::{Hub, Subject};
use crate::lesson;
use crate::lock::lock;
use crate::predictor::{Answer, Predictor, Question};
use crate::protocol::{MapAxes, ServerMessage};
use crate::setting::Settings;

/// The predictor is to leave the processors to haptic loops.
const NICENESS: i32 = 10;

/// A question that a browser has asked.
pub(crate) struct Ask {
    /// The number of the browser that asked.
    pub(crate) browser: u64,
    pub(crate) id: u32,
    pub(crate) settings: Settings,
    pub(crate) whole: bool,
    pub(crate) margin: bool,
    pub(crate) map: Option<MapAxes>,
    pub(crate) asker: mpsc::Sender<ServerMessage>,
    /// Which parts of the answer it has had: see [`part`].
    pub(crate) told: Vec<&'static str>,
}

/// The thread. Dropping it gives up what it works on.
pub(crate) struct Predicting {
    queue: Arc<Queue>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
pub(crate) struct Queue {
    waiting: Mutex<Waiting>,
    more: Condvar,
}

#[derive(Default)]
struct Waiting {
    asks: VecDeque<Ask>,
    over: bool,
}

impl Predicting {
    pub(crate) fn start(hub: Arc<Hub>, predictor: Arc<dyn Predictor>) -> io::Result<Self> {
        let queue = Arc::new(Queue::default());
        let asked = Arc::clone(&queue);
        let thread = thread::Builder::new().name("predictor".to_owned()).spawn(move || {
            // Where the system does not allow that, it is only less polite. Threads that this one starts follow it.
            let _ = rustix::process::nice(NICENESS);
            while let Some(ask) = asked.next() {
                if let Some(rest) = answer(ask, &asked, &hub, predictor.as_ref()) {
                    asked.put_back(rest);
                }
            }
        })?;
        Ok(Self { queue, thread: Some(thread) })
    }

    pub(crate) fn queue(&self) -> Arc<Queue> {
        Arc::clone(&self.queue)
    }
}

impl Drop for Predicting {
    fn drop(&mut self) {
        lock(&self.queue.waiting).over = true;
        self.queue.more.notify_all();
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

impl Queue {
    /// Puts a question in, in place of an older one of the same browser.
    pub(crate) fn put(&self, ask: Ask) {
        let mut waiting = lock(&self.waiting);
        match waiting.asks.iter_mut().find(|other| other.browser == ask.browser) {
            Some(older) => *older = ask,
            None => waiting.asks.push_back(ask),
        }
        drop(waiting);
        self.more.notify_one();
    }

    /// The question that has waited longest; nothing when it is over.
    fn next(&self) -> Option<Ask> {
        let mut waiting = lock(&self.waiting);
        while !waiting.over {
            if let Some(ask) = waiting.asks.pop_front() {
                return Some(ask);
            }
            waiting = self.more.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
        None
    }

    /// Puts a question in again whose answer had to wait for others', unless its browser has a newer one.
    fn put_back(&self, ask: Ask) {
        let mut waiting = lock(&self.waiting);
        if !waiting.asks.iter().any(|other| other.browser == ask.browser) {
            waiting.asks.push_back(ask);
        }
    }

    /// Whether this is the newest question of a browser that still listens.
    fn wants(&self, browser: u64, asker: &mpsc::Sender<ServerMessage>) -> bool {
        let waiting = lock(&self.waiting);
        let is_newest = !waiting.asks.iter().any(|other| other.browser == browser);
        is_newest && !waiting.over && !asker.is_closed()
    }

    /// Whether a browser waits that has had nothing of its answer yet.
    fn has_new(&self) -> bool {
        lock(&self.waiting).asks.iter().any(|ask| ask.told.is_empty())
    }
}

/// Answers; gives back the question when others' first answers are more urgent than the rest of this one.
fn answer(mut ask: Ask, queue: &Queue, hub: &Hub, predictor: &dyn Predictor) -> Option<Ask> {
    // A browser that takes no messages does not want this one either.
    let tell = |message| drop(ask.asker.try_send(message));
    let (question, note) = match question(&ask, hub) {
        Ok(question) => question,
        Err(why) => {
            tell(ServerMessage::Refused { what: "predict", why });
            return None;
        }
    };
    let had_verdict = AtomicBool::new(!ask.told.is_empty());
    let gives_way = AtomicBool::new(false);
    let wanted = || {
        if had_verdict.load(Ordering::Relaxed) && queue.has_new() {
            gives_way.store(true, Ordering::Relaxed);
        }
        !gives_way.load(Ordering::Relaxed) && queue.wants(ask.browser, &ask.asker)
    };
    let told = &mut ask.told;
    let mut tell_part = |answer: Answer| {
        let part = part(&answer);
        if !told.contains(&part) && wanted() {
            told.push(part);
            tell(message(ask.id, answer, note.as_deref()));
            had_verdict.store(true, Ordering::Relaxed);
        }
    };
    let ask_it = AssertUnwindSafe(|| predictor.predict(&question, &wanted, &mut tell_part));
    if catch_unwind(ask_it).is_err() {
        let why = "the analysis failed; what it said is on the program's standard error".to_owned();
        tell(ServerMessage::Failed { id: ask.id, what: "verdict", why });
        return None;
    }
    gives_way.into_inner().then_some(ask)
}

/// Which part of the answer that is.
fn part(answer: &Answer) -> &'static str {
    match answer {
        Answer::Verdict(_) => "verdict",
        Answer::Margin(_) => "margin",
        Answer::Map(_) => "map",
        Answer::Failed(what, _) => what,
    }
}

/// What is asked, and what the session would do differently; or why that cannot be asked.
fn question(ask: &Ask, hub: &Hub) -> Result<(Question, Option<String>), String> {
    let nothing = || "nothing can be predicted here: where the scene comes from is not known".to_owned();
    let Subject::Live(live, lesson) = &hub.subject else { return Err(nothing()) };
    let present = lesson.present().ok_or_else(nothing)?;
    let controls = hub.state.borrow().session.controls.clone();
    let (wanted, controls) = present.with(&ask.settings, &controls, live)?;
    if let Some(axes) = &ask.map {
        lesson::check_map(axes, &controls)?;
    }
    let (scene, note) = live.as_it_would_run(&wanted.scene);
    let map = ask.map.clone().filter(|_| !ask.told.contains(&"map"));
    Ok((Question { scene, whole: ask.whole, margin: ask.margin, map }, note))
}

fn message(id: u32, answer: Answer, note: Option<&str>) -> ServerMessage {
    match answer {
        Answer::Verdict(verdict) => ServerMessage::Verdict { id, verdict: with_warning(verdict, note) },
        Answer::Margin(margin) => ServerMessage::Margin { id, margin },
        Answer::Map(map) => ServerMessage::Map { id, map },
        Answer::Failed(what, why) => ServerMessage::Failed { id, what, why },
    }
}

/// A verdict about something else than what was asked for says so.
fn with_warning(mut verdict: Value, note: Option<&str>) -> Value {
    if let (Some(note), Some(Value::Array(warnings))) = (note, verdict.get_mut("warnings")) {
        warnings.push(note.into());
    }
    verdict
}
