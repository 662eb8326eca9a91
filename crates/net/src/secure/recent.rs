//! First messages that were taken lately, so that one that is sent again and again costs no key exchange.

use std::collections::VecDeque;

use super::noise::STAMP_BYTES;

/// So many are remembered.
const MAX_STAMPS: usize = 256;

/// The stamps of the newest first messages; each is as good as its message, which nobody else can stamp.
#[derive(Debug)]
pub(super) struct RecentStamps(VecDeque<[u8; STAMP_BYTES]>);

impl RecentStamps {
    pub(super) fn new() -> Self {
        Self(VecDeque::with_capacity(MAX_STAMPS))
    }

    pub(super) fn contains(&self, stamp: &[u8]) -> bool {
        self.0.iter().any(|known| known == stamp)
    }

    /// Remembers a stamp, and forgets the oldest of too many.
    pub(super) fn remember(&mut self, stamp: [u8; STAMP_BYTES]) {
        if self.0.len() == MAX_STAMPS {
            self.0.pop_front();
        }
        self.0.push_back(stamp);
    }
}
