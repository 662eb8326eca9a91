//! Getting the scene from the server, for a newcomer that knows only an address.
//!
//! One part is asked for at a time, again and again until it comes. A question is longer than its answer and the server
//! remembers nothing of it, so that a forged sender address gains nothing.

use arrayvec::ArrayVec;
use cotouch_scene::time::LocalTime;
use xxhash_rust::xxh3::xxh3_64;

use crate::message::{Control, Refusal, SCENE_PART_BYTES, SCENE_REQUEST_PADDING};
use crate::route::Route;
use crate::wire::{PROTOCOL_VERSION, Transmit, WireError, decode_control, encode_control};

/// Longest scene text that is taken, bytes.
const MAX_SCENE_BYTES: u32 = 256 * 1024;

const FIRST_PAUSE_NS: i64 = 50_000_000;
const MAX_PAUSE_NS: i64 = 500_000_000;

/// Why the scene did not come.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneFetchError {
    /// No answer, or another protocol version.
    #[error("{0}")]
    Refused(Refusal),
    /// More than is taken.
    #[error("the server's scene has {0} bytes; 1 to {MAX_SCENE_BYTES} are allowed")]
    Length(u32),
    /// Not what the server's hash says, or not text.
    #[error("the scene that came from the server is damaged")]
    Damaged,
}

/// A download of the scene's text, without socket or clock.
#[derive(Clone, Debug)]
pub struct SceneFetch {
    server: Route,
    id: u64,
    timeout_ns: i64,
    /// Of the whole text, as the server says.
    hash: Option<u64>,
    text: Vec<u8>,
    due: LocalTime,
    pause_ns: i64,
    give_up: LocalTime,
    result: Option<Result<String, SceneFetchError>>,
}

impl SceneFetch {
    /// Asks `server`, from `now` on; gives up when nothing new came for `timeout_ns`. `id` is random: it tells the answers
    /// to this download from others.
    #[must_use]
    pub fn new(server: Route, id: u64, now: LocalTime, timeout_ns: i64) -> Self {
        let (pause_ns, give_up) = (FIRST_PAUSE_NS, now.plus_ns(timeout_ns));
        let text = Vec::new();
        Self { server, id, timeout_ns, hash: None, text, due: now, pause_ns, give_up, result: None }
    }

    /// The text or why there is none, once that is known.
    #[must_use]
    pub const fn result(&self) -> Option<&Result<String, SceneFetchError>> {
        self.result.as_ref()
    }

    /// When to call [`Self::poll_transmit`] at the latest; `None` when done.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<LocalTime> {
        self.result.is_none().then(|| self.due.min(self.give_up))
    }

    /// The next question, if one is due.
    pub fn poll_transmit(&mut self, now: LocalTime) -> Option<Transmit> {
        if self.result.is_some() {
            return None;
        }
        if now >= self.give_up {
            self.result = Some(Err(SceneFetchError::Refused(Refusal::NoAnswer)));
            return None;
        }
        if now < self.due {
            return None;
        }
        self.due = now.plus_ns(self.pause_ns);
        self.pause_ns = (self.pause_ns * 3 / 2).min(MAX_PAUSE_NS);
        let padding = ArrayVec::from([0; SCENE_REQUEST_PADDING]);
        let request = Control::SceneRequest { offset: self.text.len() as u32, padding };
        let bytes = encode_control(self.id, None, &request).expect("a request fits a datagram");
        Some(Transmit { to: self.server, bytes })
    }

    /// Takes a datagram; what is not an answer to this download is ignored.
    pub fn handle_datagram(&mut self, now: LocalTime, from: Route, bytes: &[u8]) {
        if from != self.server || self.result.is_some() {
            return;
        }
        match decode_control(bytes) {
            Ok((header, Control::ScenePart { hash, total, offset, bytes })) if header.session == self.id => {
                self.take_part(now, hash, total, offset, &bytes);
            }
            Err(WireError::Version { found, session, .. }) if session == self.id => {
                let refusal = Refusal::Version { server: found, newcomer: PROTOCOL_VERSION };
                self.result = Some(Err(SceneFetchError::Refused(refusal)));
            }
            _ => {}
        }
    }

    fn take_part(&mut self, now: LocalTime, hash: u64, total: u32, offset: u32, part: &[u8]) {
        if total == 0 || total > MAX_SCENE_BYTES {
            self.result = Some(Err(SceneFetchError::Length(total)));
            return;
        }
        if self.hash.replace(hash).is_some_and(|known| known != hash) {
            // Another server has started there meanwhile.
            self.text.clear();
        }
        let left = (total as usize).saturating_sub(self.text.len());
        if offset as usize != self.text.len() || part.len() != left.min(SCENE_PART_BYTES) {
            return;
        }
        self.text.extend_from_slice(part);
        (self.due, self.pause_ns) = (now, FIRST_PAUSE_NS);
        self.give_up = now.plus_ns(self.timeout_ns);
        if self.text.len() == total as usize {
            let text = std::mem::take(&mut self.text);
            let is_whole = xxh3_64(&text) == hash;
            let text = String::from_utf8(text).ok().filter(|_| is_whole);
            self.result = Some(text.ok_or(SceneFetchError::Damaged));
        }
    }
}
