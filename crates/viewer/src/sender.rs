//! What one browser is told: what the session is, who is there, what is news, and the newest picture again and again.
//!
//! Pictures do not pile up on a slow way: with a picture goes a ping, one at a time, and while its answer takes long no more
//! pictures are sent.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::ws::{Message, WebSocket};
use cotouch_runtime::{HeldBy, Seat};
use cotouch_scene::names::HostIndex;
use futures_util::SinkExt as _;
use futures_util::stream::SplitSink;
use tokio::sync::{broadcast, mpsc, watch};
use tokio::time::{Instant, Interval, MissedTickBehavior, interval, timeout};

use crate::hub::{Hub, Newest, PageState};
use crate::protocol::{SeatInfo, ServerMessage};
use crate::setting::Settings;
use crate::signals::PageSignals;

/// A browser that takes nothing for so long is gone.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);

/// While a ping is unanswered for longer than this, no picture is sent: so old can the newest one on the way be.
const MAX_ON_THE_WAY: Duration = Duration::from_millis(250);

/// A picture that has not changed is sent again so seldom.
const REPEAT_PERIOD: Duration = Duration::from_secs(1);

type Outgoing = SplitSink<WebSocket, Message>;

/// The browser is gone.
struct Gone;

pub(crate) struct PageSender {
    hub: Arc<Hub>,
    is_here: bool,
    waiting: mpsc::Receiver<ServerMessage>,
    holds: watch::Receiver<Option<HostIndex>>,
    rate_hz: watch::Receiver<f64>,
    answered: watch::Receiver<u64>,
    state: watch::Receiver<PageState>,
    news: broadcast::Receiver<Arc<str>>,
    told: SentToPage,
    pings: Pings,
}

/// What the browser knows already.
#[derive(Default)]
struct SentToPage {
    generation: Option<u32>,
    seats: Option<Vec<SeatInfo>>,
    settings: Option<(Settings, String, &'static str)>,
    picture: Option<(Newest, Instant)>,
}

/// The ping that is on its way.
#[derive(Default)]
struct Pings {
    sent: u64,
    unanswered_since: Option<Instant>,
}

impl PageSender {
    pub(crate) fn new(
        hub: &Arc<Hub>,
        is_here: bool,
        waiting: mpsc::Receiver<ServerMessage>,
        signals: &PageSignals,
    ) -> Self {
        Self {
            hub: Arc::clone(hub),
            is_here,
            waiting,
            holds: signals.holds.subscribe(),
            rate_hz: signals.rate_hz.subscribe(),
            answered: signals.answered.subscribe(),
            state: hub.state.subscribe(),
            news: hub.news.subscribe(),
            told: SentToPage::default(),
            pings: Pings::default(),
        }
    }
}

/// Tells the browser everything until it is gone.
pub(crate) async fn run(mut page: PageSender, outgoing: &mut Outgoing) {
    let mut pictures = beat(*page.rate_hz.borrow());
    let _: Result<(), Gone> = async {
        page.tell_the_state(outgoing).await?;
        loop {
            tokio::select! {
                biased;
                Some(message) = page.waiting.recv() => say(outgoing, &message).await?,
                Ok(()) = page.state.changed() => page.tell_the_state(outgoing).await?,
                Ok(()) = page.holds.changed() => page.tell_the_seats(outgoing).await?,
                news = page.news.recv() => page.tell_the_news(news, outgoing).await?,
                Ok(()) = page.rate_hz.changed() => pictures = beat(*page.rate_hz.borrow()),
                _ = pictures.tick() => page.show(outgoing).await?,
            }
        }
    }
    .await;
}

/// A picture that a slow browser missed is not made up for.
fn beat(rate_hz: f64) -> Interval {
    let mut beat = interval(Duration::from_secs_f64(1.0 / rate_hz));
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    beat
}

impl PageSender {
    /// What the session is, what it is set to and who is there, as far as the browser does not know that.
    async fn tell_the_state(&mut self, outgoing: &mut Outgoing) -> Result<(), Gone> {
        let state = self.state.borrow_and_update().clone();
        if self.told.generation != Some(state.session.generation) {
            self.told.generation = Some(state.session.generation);
            // A page begins anew with a session, and waits to be told what that is set to.
            self.told.settings = None;
            say(outgoing, &state.session.message(self.is_here)).await?;
        }
        let settings = (state.settings, state.note, state.paused);
        if !state.session.controls.is_empty() && self.told.settings.as_ref() != Some(&settings) {
            self.told.settings = Some(settings.clone());
            say(
                outgoing,
                &ServerMessage::Settings { settings: settings.0, note: settings.1, paused: settings.2 },
            )
            .await?;
        }
        self.tell_the_seats(outgoing).await
    }

    async fn tell_the_seats(&mut self, outgoing: &mut Outgoing) -> Result<(), Gone> {
        let mine = *self.holds.borrow_and_update();
        let seats: Vec<SeatInfo> = self.state.borrow().seats.iter().map(|seat| seen_by(seat, mine)).collect();
        if self.told.seats.as_ref() == Some(&seats) {
            return Ok(());
        }
        self.told.seats = Some(seats.clone());
        say(outgoing, &ServerMessage::Seats { seats }).await
    }

    async fn tell_the_news(
        &mut self,
        news: Result<Arc<str>, broadcast::error::RecvError>,
        outgoing: &mut Outgoing,
    ) -> Result<(), Gone> {
        // A browser that was too slow misses the oldest.
        let Ok(text) = news else { return Ok(()) };
        say(outgoing, &ServerMessage::News { text: text.to_string() }).await
    }

    /// Sends the newest picture, unless the browser has it or is behind.
    async fn show(&mut self, outgoing: &mut Outgoing) -> Result<(), Gone> {
        if self.pings.are_behind(*self.answered.borrow())? {
            return Ok(());
        }
        let Some(newest) = self.hub.picture() else { return self.ping(outgoing).await };
        // Pictures of a session that the browser was not told of come after it was.
        if self.told.generation != Some(newest.generation) || self.has(&newest) {
            return Ok(());
        }
        send(outgoing, Message::Binary(newest.bytes.clone())).await?;
        self.told.picture = Some((newest, Instant::now()));
        self.ping(outgoing).await
    }

    /// Whether the browser got this picture a moment ago.
    fn has(&self, newest: &Newest) -> bool {
        let is_same = |last: &Newest| {
            (last.generation, last.time_s.to_bits(), last.ended)
                == (newest.generation, newest.time_s.to_bits(), newest.ended)
        };
        self.told.picture.as_ref().is_some_and(|(last, at)| is_same(last) && at.elapsed() < REPEAT_PERIOD)
    }

    async fn ping(&mut self, outgoing: &mut Outgoing) -> Result<(), Gone> {
        let Some(number) = self.pings.next() else { return Ok(()) };
        send(outgoing, Message::Ping(number.to_le_bytes().to_vec().into())).await
    }
}

impl Pings {
    /// Whether what was sent takes long to arrive; `answered` is the last number that came back.
    fn are_behind(&mut self, answered: u64) -> Result<bool, Gone> {
        let Some(since) = self.unanswered_since else { return Ok(false) };
        if answered == self.sent {
            self.unanswered_since = None;
            return Ok(false);
        }
        if since.elapsed() > PATIENCE {
            return Err(Gone);
        }
        Ok(since.elapsed() > MAX_ON_THE_WAY)
    }

    /// The number of the next ping, unless one is on its way.
    fn next(&mut self) -> Option<u64> {
        if self.unanswered_since.is_some() {
            return None;
        }
        self.unanswered_since = Some(Instant::now());
        self.sent += 1;
        Some(self.sent)
    }
}

/// A seat in the eyes of the browser that moves the hand of `mine`.
fn seen_by(seat: &Seat, mine: Option<HostIndex>) -> SeatInfo {
    let by = match seat.by {
        HeldBy::Script => "script",
        HeldBy::Pointer if mine == Some(seat.user) => "you",
        HeldBy::Pointer => "browser",
        HeldBy::Elsewhere => "elsewhere",
        HeldBy::Nobody => "free",
    };
    SeatInfo { user: seat.user, name: seat.name.clone(), by }
}

async fn say(outgoing: &mut Outgoing, message: &ServerMessage) -> Result<(), Gone> {
    match serde_json::to_string(message) {
        Ok(text) => send(outgoing, Message::text(text)).await,
        Err(error) => {
            tracing::warn!("a message could not be written as JSON: {error}");
            Ok(())
        }
    }
}

async fn send(outgoing: &mut Outgoing, message: Message) -> Result<(), Gone> {
    match timeout(PATIENCE, outgoing.send(message)).await {
        Ok(Ok(())) => Ok(()),
        Ok(Err(_)) | Err(_) => Err(Gone),
    }
}
