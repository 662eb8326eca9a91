//! One browser's WebSocket: first what the session is, then the newest snapshot, again and again.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use futures_util::{SinkExt as _, StreamExt as _};
use tokio::sync::OwnedSemaphorePermit;
use tokio::time::{MissedTickBehavior, interval, timeout};

use crate::server::Session;

/// Snapshots go out at this rate at most: what a display shows.
const PICTURE_PERIOD: Duration = Duration::from_micros(16_667);

/// A browser that does not take a message for so long is gone.
const PATIENCE: Duration = Duration::from_secs(10);

/// The page has nothing to say but that it goes; anything longer is not from the page.
pub(crate) const LARGEST_MESSAGE_BYTES: usize = 1024;

/// A page that says more than this in a second is not ours.
const MOST_MESSAGES_PER_S: u32 = 100;

/// Serves one browser until it leaves, misbehaves or sleeps.
pub(crate) async fn serve(socket: WebSocket, session: Arc<Session>, place: OwnedSemaphorePermit) {
    let (mut outgoing, mut incoming) = socket.split();
    let listening = async {
        let mut second = interval(Duration::from_secs(1));
        let mut heard = 0;
        loop {
            tokio::select! {
                _ = second.tick() => heard = 0,
                message = incoming.next() => match message {
                    None | Some(Err(_) | Ok(Message::Close(_))) => return None,
                    Some(Ok(_)) => heard += 1,
                },
            }
            if heard > MOST_MESSAGES_PER_S {
                return Some("too many messages");
            }
        }
    };
    let talking = async {
        let mut message = session.about.message();
        let mut pictures = interval(PICTURE_PERIOD);
        // A picture that a slow browser missed is not made up for.
        pictures.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            match timeout(PATIENCE, outgoing.send(Message::text(message))).await {
                Ok(Ok(())) => {}
                Ok(Err(_)) | Err(_) => return None,
            }
            pictures.tick().await;
            message = match serde_json::to_string(&session.source.latest()) {
                Ok(text) => text,
                Err(error) => {
                    tracing::warn!("a snapshot could not be written as JSON: {error}");
                    return Some("no snapshot");
                }
            };
        }
    };
    let reason: Option<&'static str> = tokio::select! {
        reason = listening => reason,
        reason = talking => reason,
    };
    if let Some(reason) = reason {
        let frame = CloseFrame { code: close_code::POLICY, reason: reason.into() };
        let _ = timeout(PATIENCE, outgoing.send(Message::Close(Some(frame)))).await;
    }
    drop(place);
}
