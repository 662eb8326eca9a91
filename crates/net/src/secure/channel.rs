//! One channel: the keys of a handshake, and which datagrams have come through it.

use std::fmt;

use snow::StatelessTransportState;

use super::frame::{Kind, MAX_SEALED, Sealed, begin_sealed, sealed_length};
use super::noise::TAG_BYTES;
use super::replay::ReplayWindow;
use crate::wire::MAX_DATAGRAM;

/// A channel between two hosts. Its keys are used for one handshake's channel and forgotten with it.
pub(super) struct Channel {
    cipher: StatelessTransportState,
    /// The number by which the other names it to this host.
    pub(super) here: u32,
    /// The number by which this host names it to the other.
    there: u32,
    /// Counter of the next datagram.
    next: u64,
    came: ReplayWindow,
}

/// What came through a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Opened {
    pub(super) kind: Kind,
    /// Bytes of what was said.
    pub(super) length: usize,
    /// Whether nothing sent later has come before.
    pub(super) is_newest: bool,
}

/// Why a sealed datagram was not opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unopened {
    Forged,
    Repeated,
}

impl Channel {
    pub(super) fn new(cipher: StatelessTransportState, here: u32, there: u32) -> Self {
        Self { cipher, here, there, next: 0, came: ReplayWindow::default() }
    }

    /// Seals `said` into `out`; its length, or `None` when it is longer than [`MAX_DATAGRAM`]. Does not allocate.
    pub(super) fn seal(&mut self, kind: Kind, said: &[u8], out: &mut [u8; MAX_SEALED]) -> Option<usize> {
        let mut plain = [0; MAX_DATAGRAM + 1];
        plain.get_mut(..said.len()).filter(|_| said.len() <= MAX_DATAGRAM)?.copy_from_slice(said);
        plain[said.len()] = kind.byte();
        let place = begin_sealed(self.there, self.next, out);
        // At a million datagrams a second the counters last for 580,000 years.
        let length = self.cipher.write_message(self.next, &plain[..=said.len()], place).ok()?;
        self.next += 1;
        Some(sealed_length(length))
    }

    /// Opens a sealed datagram of this channel into the start of `out`. Does not allocate.
    pub(super) fn open(
        &mut self,
        sealed: &Sealed<'_>,
        out: &mut [u8; MAX_SEALED],
    ) -> Result<Opened, Unopened> {
        if !self.came.allows(sealed.counter) {
            return Err(Unopened::Repeated);
        }
        let room = &mut out[..sealed.ciphertext.len() - TAG_BYTES];
        let opened = self.cipher.read_message(sealed.counter, sealed.ciphertext, room);
        let length = opened.map_err(|_| Unopened::Forged)?;
        let is_newest = self.came.mark(sealed.counter);
        let (length, kind) = length.checked_sub(1).map(|last| (last, out[last])).ok_or(Unopened::Forged)?;
        let kind = Kind::of(kind).ok_or(Unopened::Forged)?;
        Ok(Opened { kind, length, is_newest })
    }
}

impl fmt::Debug for Channel {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Channel").field("here", &self.here).finish_non_exhaustive()
    }
}
