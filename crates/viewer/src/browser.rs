//! One browser's WebSocket: what it says is heard here, what it is told comes from [`crate::sender`].

use std::future::pending;
use std::sync::Arc;
use std::time::Duration;

use axum::Error;
use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use cotouch_runtime::{PointerHandle, TakeError};
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::names::HostIndex;
use futures_util::stream::SplitStream;
use futures_util::{SinkExt as _, StreamExt as _};
use glam::DVec3;
use tokio::sync::{OwnedSemaphorePermit, mpsc, watch};
use tokio::task::{JoinError, JoinHandle, spawn_blocking};
use tokio::time::{Instant, interval, timeout};

use crate::changes::{Change, Wanted};
use crate::hub::{Hub, Subject};
use crate::predicting::{Ask, Queue};
use crate::protocol::{PageMessage, ServerMessage};
use crate::sender::{self, PATIENCE, PageSender};
use crate::signals::PageSignals;

/// Nothing that a page says is longer.
pub(crate) const LARGEST_MESSAGE_BYTES: usize = 4096;

/// A page that says more than this in a second is not ours.
const MAX_MESSAGES_PER_S: u32 = 200;

/// After so many messages that are none of the page's it is not ours either.
const MAX_BAD_MESSAGES: u32 = 20;

/// A page that holds a hand says where to at least twice a second; after this time its hand is let go of.
const LONGEST_SILENCE: Duration = Duration::from_secs(2);

/// How often that is looked at.
const LOOK_PERIOD: Duration = Duration::from_millis(100);

/// Messages that wait until a slow browser takes them; more are not sent.
const MAX_WAITING: usize = 64;

/// Pictures a second that a browser may ask for.
const RATES_HZ: (f64, f64) = (32.0, 60.0);

/// The ways from one browser to the rest of the server.
pub(crate) struct Connection {
    pub(crate) hub: Arc<Hub>,
    /// The number by which the server tells browsers apart.
    pub(crate) number: u64,
    /// Whether the browser runs on this computer.
    pub(crate) is_here: bool,
    pub(crate) changes: mpsc::Sender<Change>,
    pub(crate) predictions: Arc<Queue>,
}

/// Serves one browser until it leaves, misbehaves or sleeps.
pub(crate) async fn serve(socket: WebSocket, connection: Connection, place: OwnedSemaphorePermit) {
    let (mut outgoing, incoming) = socket.split();
    let (outbox, waiting) = mpsc::channel(MAX_WAITING);
    let signals = PageSignals {
        holds: watch::Sender::new(None),
        rate_hz: watch::Sender::new(RATES_HZ.1),
        answered: watch::Sender::new(0),
    };
    let page = PageSender::new(&connection.hub, connection.is_here, waiting, &signals);
    let listener = PageListener { connection, outbox, signals, held: None, taking: None, bad: 0 };
    let reason = tokio::select! {
        reason = listener.run(incoming) => reason,
        () = sender::run(page, &mut outgoing) => None,
    };
    if let Some((code, reason)) = reason {
        let frame = CloseFrame { code, reason: reason.into() };
        let _ = timeout(PATIENCE, outgoing.send(Message::Close(Some(frame)))).await;
    }
    drop(place);
}

/// Tells a browser for which there is no place that there is none: a page cannot read a refused handshake.
pub(crate) async fn turn_away(mut socket: WebSocket, most: usize) {
    let reason = format!("session full: {most} browsers look at it already");
    let frame = CloseFrame { code: close_code::AGAIN, reason: reason.into() };
    let _ = timeout(PATIENCE, socket.send(Message::Close(Some(frame)))).await;
}

/// Why a connection is closed: a code and words.
type Reason = Option<(u16, &'static str)>;

struct PageListener {
    connection: Connection,
    outbox: mpsc::Sender<ServerMessage>,
    signals: PageSignals,
    held: Option<Held>,
    taking: Option<JoinHandle<Result<PointerHandle, TakeError>>>,
    bad: u32,
}

/// The hand that this browser moves.
struct Held {
    hand: PointerHandle,
    generation: u32,
    last_heard: Instant,
}

impl PageListener {
    /// Hears the browser out. Whatever hand it has then is let go of.
    async fn run(mut self, mut incoming: SplitStream<WebSocket>) -> Reason {
        let mut second = interval(Duration::from_secs(1));
        let mut looks = interval(LOOK_PERIOD);
        let mut heard = 0;
        loop {
            tokio::select! {
                _ = second.tick() => heard = 0,
                _ = looks.tick() => self.look_after_the_hand(),
                taken = finished(&mut self.taking) => self.take_up(taken),
                message = incoming.next() => {
                    heard += 1;
                    if heard > MAX_MESSAGES_PER_S {
                        return Some((close_code::POLICY, "too many messages: at most 200 a second"));
                    }
                    match message {
                        None | Some(Ok(Message::Close(_))) => return None,
                        Some(Err(error)) => return broken(&error),
                        Some(Ok(message)) => self.hear(message),
                    }
                }
            }
            if self.bad >= MAX_BAD_MESSAGES {
                return Some((close_code::POLICY, "too many messages that are none of this page's"));
            }
        }
    }

    fn hear(&mut self, message: Message) {
        // A browser answers pings by itself, even when its page sleeps.
        if let (Some(held), Message::Text(_)) = (&mut self.held, &message) {
            held.last_heard = Instant::now();
        }
        match message {
            Message::Text(text) => match PageMessage::read(&text) {
                Ok(message) => self.do_as_asked(message),
                Err(why) => self.refuse_message(&why),
            },
            Message::Binary(_) => self.refuse_message("it is not text"),
            Message::Pong(payload) => {
                if let Ok(number) = <[u8; 8]>::try_from(&payload[..]) {
                    self.signals.answered.send_replace(u64::from_le_bytes(number));
                }
            }
            Message::Ping(_) | Message::Close(_) => {}
        }
    }

    fn do_as_asked(&mut self, message: PageMessage) {
        match message {
            PageMessage::Take { user } => self.take(user),
            PageMessage::Leave {} => self.let_go(),
            PageMessage::Point { targets_m } => self.point(&targets_m),
            PageMessage::Rate { hz } => {
                self.signals.rate_hz.send_replace(hz.clamp(RATES_HZ.0, RATES_HZ.1));
            }
            PageMessage::Set { settings } => self.change(Wanted::Settings(settings)),
            PageMessage::Again {} => self.change(Wanted::Again),
            PageMessage::Predict { id, settings, whole, margin, map } => {
                let (browser, asker) = (self.connection.number, self.outbox.clone());
                let told = Vec::new();
                self.connection.predictions.put(Ask {
                    browser,
                    id,
                    settings,
                    whole,
                    margin,
                    map,
                    asker,
                    told,
                });
            }
        }
    }

    fn take(&mut self, user: HostIndex) {
        let Subject::Live(live, _) = &self.connection.hub.subject else {
            return self.refuse("take", "a recording has no hands that can be taken");
        };
        if self.taking.is_some() {
            return self.refuse("take", "another hand is being taken");
        }
        if self.held.as_ref().is_some_and(|held| held.hand.user == user) {
            return self.tell_what_is_held();
        }
        // One browser moves one hand.
        self.held = None;
        self.signals.holds.send_replace(None);
        let live = Arc::clone(live);
        self.taking = Some(spawn_blocking(move || live.take(user)));
    }

    /// What came of taking a hand.
    fn take_up(&mut self, taken: Result<Result<PointerHandle, TakeError>, JoinError>) {
        self.taking = None;
        match taken {
            Ok(Ok(hand)) => {
                let generation = self.connection.hub.state.borrow().session.generation;
                self.held = Some(Held { hand, generation, last_heard: Instant::now() });
            }
            Ok(Err(error)) => self.refuse("take", &error.to_string()),
            Err(error) => self.refuse("take", &format!("the hand could not be taken: {error}")),
        }
        self.tell_what_is_held();
        self.connection.hub.look();
    }

    fn let_go(&mut self) {
        self.held = None;
        self.tell_what_is_held();
        self.connection.hub.look();
    }

    /// Lets go of a hand whose session is over, or whose page has fallen silent.
    fn look_after_the_hand(&mut self) {
        let Some(held) = &self.held else { return };
        if held.generation != self.connection.hub.state.borrow().session.generation {
            self.let_go();
        } else if held.last_heard.elapsed() > LONGEST_SILENCE {
            self.let_go();
            let text = "The hand was let go of: nothing was heard from this page for 2 seconds.".to_owned();
            self.tell(ServerMessage::News { text });
        }
    }

    fn point(&mut self, targets_m: &[[f64; 3]]) {
        if targets_m.len() > MAX_FINGERS {
            return self.refuse_message("a hand has at most 4 fingers");
        }
        // Words that were on their way when the hand was lost are no mistake of the page.
        let Some(held) = &mut self.held else { return };
        let targets = targets_m.iter().copied().map(DVec3::from).collect();
        let is_over = || self.connection.hub.state.borrow().session.generation != held.generation;
        if !held.hand.point(&targets) && is_over() {
            self.let_go();
        }
    }

    fn change(&self, wanted: Wanted) {
        let Subject::Live(live, _) = &self.connection.hub.subject else {
            return self.refuse("set", "a recording cannot be changed");
        };
        if !self.connection.is_here {
            return self.refuse("set", "only a browser on the computer that runs the session may change it");
        }
        if !live.may_change() {
            return self
                .refuse("set", "a session that several computers share cannot be changed while it runs");
        }
        let change = Change { wanted, asker: self.outbox.clone() };
        if self.connection.changes.try_send(change).is_err() {
            self.refuse("set", "too many changes wait already");
        }
    }

    fn tell_what_is_held(&self) {
        let held = self.held.as_ref().map(|held| (held.hand.user, held.hand.spring));
        self.signals.holds.send_replace(held.map(|(user, _)| user));
        let spring = held.map(|(_, spring)| spring);
        self.tell(ServerMessage::Taken {
            user: held.map(|(user, _)| user),
            stiffness_n_per_m: spring.map_or(0.0, |spring| spring.stiffness_n_per_m),
            damping_n_s_per_m: spring.map_or(0.0, |spring| spring.damping_n_s_per_m),
        });
    }

    fn refuse_message(&mut self, why: &str) {
        self.bad += 1;
        self.refuse("message", &format!("the server does not understand this page: {why}"));
    }

    fn refuse(&self, what: &'static str, why: &str) {
        self.tell(ServerMessage::Refused { what, why: why.to_owned() });
    }

    fn tell(&self, message: ServerMessage) {
        if self.outbox.try_send(message).is_err() {
            tracing::debug!("browser {} takes no messages", self.connection.number);
        }
    }
}

/// Waits for the task, if there is one.
async fn finished<T>(task: &mut Option<JoinHandle<T>>) -> Result<T, JoinError> {
    match task {
        Some(task) => task.await,
        None => pending().await,
    }
}

/// A connection that broke needs no reason; a message that is too long does.
fn broken(error: &Error) -> Reason {
    let is_too_long = error.to_string().contains("too long");
    is_too_long.then_some((close_code::SIZE, "a message is too long: at most 4096 bytes"))
}
