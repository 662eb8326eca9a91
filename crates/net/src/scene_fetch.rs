//! Getting the scene from the server, for a newcomer that knows only an address.
//!
//! The first few parts are asked for together, and tell how many there are; then the next few that are missing, again and again until
//! they come. A question is longer than its answer and the server remembers nothing of it, so that a forged sender
//! address gains nothing.

use arrayvec::ArrayVec;
use cotouch_scene::time::LocalTime;
use xxhash_rust::xxh3::xxh3_64;

use crate::message::{Control, Refusal, SCENE_PART_BYTES, SCENE_REQUEST_PADDING};
use crate::route::Route;
use crate::wire::{PROTOCOL_VERSION, Transmit, WireError, decode_control, encode_control};

/// Longest scene text that is taken, bytes.
const MAX_SCENE_BYTES: u32 = 256 * 1024;

/// Most parts that are asked for together.
const ROUND: usize = 16;
/// Parts that are asked for before it is known how many there are: as many as most scenes have.
const FIRST_ROUND: u32 = 8;
const FIRST_PAUSE_NS: i64 = 50_000_000;
/// Longest pause between two rounds, once it is known how long an answer takes; before, a quarter of it.
const MAX_PAUSE_NS: i64 = 2_000_000_000;

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
    since: LocalTime,
    /// What is known once the first part came.
    text: Option<PartialText>,
    /// Numbers of parts that are to be asked for at once.
    round: ArrayVec<u32, ROUND>,
    /// The last one of the round.
    round_end: u32,
    /// When the next round is.
    due: LocalTime,
    pause_ns: i64,
    give_up: LocalTime,
    result: Option<Result<String, SceneFetchError>>,
}

/// A text of which some parts are there.
#[derive(Clone, Debug)]
struct PartialText {
    /// Of the whole, as the server says.
    hash: u64,
    bytes: Vec<u8>,
    has_part: Vec<bool>,
}

impl PartialText {
    fn new(hash: u64, total: usize) -> Self {
        let parts = total.div_ceil(SCENE_PART_BYTES);
        Self { hash, bytes: vec![0; total], has_part: vec![false; parts] }
    }

    /// Takes a part; whether it is one, and news.
    fn take(&mut self, offset: usize, part: &[u8]) -> bool {
        let number = offset / SCENE_PART_BYTES;
        let end = self.bytes.len().min((number + 1) * SCENE_PART_BYTES);
        let is_part = offset.is_multiple_of(SCENE_PART_BYTES) && offset < end && part.len() == end - offset;
        if !is_part || self.has_part[number] {
            return false;
        }
        self.bytes[offset..end].copy_from_slice(part);
        self.has_part[number] = true;
        true
    }

    fn missing(&self) -> impl Iterator<Item = u32> {
        self.has_part.iter().zip(0..).filter(|(has, _)| !**has).map(|(_, number)| number)
    }
}

impl SceneFetch {
    /// Asks `server`, from `now` on; gives up when nothing new came for `timeout_ns`. `id` is random: it tells the answers
    /// to this download from others.
    #[must_use]
    pub fn new(server: Route, id: u64, now: LocalTime, timeout_ns: i64) -> Self {
        Self {
            server,
            id,
            timeout_ns,
            since: now,
            text: None,
            round: ArrayVec::new(),
            round_end: 0,
            due: now,
            pause_ns: FIRST_PAUSE_NS,
            give_up: now.plus_ns(timeout_ns),
            result: None,
        }
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
        if now >= self.due {
            self.begin_round(now);
        }
        let number = self.round.pop_at(0)?;
        let padding = ArrayVec::from([0; SCENE_REQUEST_PADDING]);
        let request = Control::SceneRequest { offset: number * SCENE_PART_BYTES as u32, padding };
        let bytes = encode_control(self.id, None, &request).expect("a request fits a datagram");
        Some(Transmit { to: self.server, bytes })
    }

    /// Asks for the first parts that are missing.
    fn begin_round(&mut self, now: LocalTime) {
        self.due = now.plus_ns(self.pause_ns);
        let max_pause_ns = if self.text.is_some() { MAX_PAUSE_NS } else { MAX_PAUSE_NS / 4 };
        self.pause_ns = (self.pause_ns * 3 / 2).min(max_pause_ns);
        self.round = match &self.text {
            None => (0..FIRST_ROUND).collect(),
            Some(text) => text.missing().take(ROUND).collect(),
        };
        self.round_end = self.round.last().copied().unwrap_or(0);
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
        // Where the hash is another, another server has started there meanwhile.
        let is_first = self.text.as_ref().is_none_or(|text| text.hash != hash);
        if is_first {
            self.text = Some(PartialText::new(hash, total as usize));
        }
        let Some(text) = &mut self.text else { return };
        if text.bytes.len() != total as usize || !text.take(offset as usize, part) {
            return;
        }
        self.give_up = now.plus_ns(self.timeout_ns);
        if is_first {
            // An answer takes about so long; after twice that, it is lost.
            self.pause_ns = (2 * now.since(self.since)).clamp(FIRST_PAUSE_NS, MAX_PAUSE_NS);
        }
        if text.missing().next().is_none_or(|first| first > self.round_end) {
            self.due = now;
        }
        if text.missing().next().is_none() {
            let bytes = std::mem::take(&mut text.bytes);
            let is_whole = xxh3_64(&bytes) == hash;
            let text = String::from_utf8(bytes).ok().filter(|_| is_whole);
            self.result = Some(text.ok_or(SceneFetchError::Damaged));
        }
    }
}
