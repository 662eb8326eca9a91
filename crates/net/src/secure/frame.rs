//! The layout of secured datagrams.
//!
//! A first message, its answer and a rejection begin with the header that all versions share ([`crate::wire`]), with the number of
//! the call in place of the session id, so that two versions can tell each other apart. A sealed datagram is
//!
//! | bytes | field |
//! |---|---|
//! | 0..2 | magic `cs` |
//! | 2..6 | the receiver's number of the channel |
//! | 6..14 | counter |
//! | 14.. | ciphertext of what is said and, in its last byte, of what kind that is; then 16 bytes of tag |
//!
//! All numbers are little-endian.

use arrayvec::ArrayVec;
use zerocopy::little_endian::{U32, U64};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

use crate::route::Route;
use crate::wire::{DatagramBytes, DatagramKind, HEADER_BYTES, Header, MAX_DATAGRAM, may_be_datagram, seal};
use cotouch_scene::names::HostIndex;

use super::noise::{FIRST_MESSAGE_BYTES, SECOND_MESSAGE_BYTES, STAMP_BYTES, TAG_BYTES, TicketKeys};

/// Longest sealed datagram, bytes. With the headers of IPv6 and UDP it passes every path with the smallest MTU of 1280.
pub const MAX_SEALED: usize = MAX_DATAGRAM + SEALED_HEAD_BYTES + KIND_BYTES + TAG_BYTES;
const _: () = assert!(MAX_SEALED + 48 <= 1280);

const SEALED_MAGIC: [u8; 2] = *b"cs";
const SEALED_HEAD_BYTES: usize = size_of::<SealedHead>();
const KIND_BYTES: usize = 1;
const INITIATION_BYTES: usize = HEADER_BYTES + FIRST_MESSAGE_BYTES + STAMP_BYTES;
/// What a stamp covers starts behind the checksum.
const STAMPED_FROM: usize = 8;

/// A datagram to send through a transport.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SealedTransmit {
    /// Where the receiver is reached, as the transport knows it.
    pub to: Route,
    /// The whole datagram.
    pub bytes: ArrayVec<u8, MAX_SEALED>,
}

/// What is said through a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A datagram for the layer above.
    Datagram,
    /// Nothing: the caller has the keys.
    Confirmation,
    /// Member to server: where is the host with this key?
    Whereabouts,
    /// Server to member: the host with this key is there, and wants to talk.
    Introduction,
}

impl Kind {
    const ALL: [Self; 4] = [Self::Datagram, Self::Confirmation, Self::Whereabouts, Self::Introduction];

    pub(super) const fn byte(self) -> u8 {
        match self {
            Self::Datagram => 0,
            Self::Confirmation => 1,
            Self::Whereabouts => 2,
            Self::Introduction => 3,
        }
    }

    pub(super) fn of(byte: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.byte() == byte)
    }
}

#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
struct SealedHead {
    magic: [u8; 2],
    channel: U32,
    counter: U64,
}

/// A sealed datagram, before it is opened.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sealed<'a> {
    pub(super) channel: u32,
    pub(super) counter: u64,
    pub(super) ciphertext: &'a [u8],
}

impl<'a> Sealed<'a> {
    /// Reads the head; `None` for what is no sealed datagram.
    pub(super) fn parse(bytes: &'a [u8]) -> Option<Self> {
        let (head, ciphertext) = SealedHead::ref_from_prefix(bytes).ok()?;
        let fits = ciphertext.len() >= KIND_BYTES + TAG_BYTES && bytes.len() <= MAX_SEALED;
        (head.magic == SEALED_MAGIC && fits).then_some(Self {
            channel: head.channel.get(),
            counter: head.counter.get(),
            ciphertext,
        })
    }
}

/// Whether the first bytes and the length are those of a datagram that [`SecureNode::open`](super::SecureNode::open) knows, or of another
/// version of this protocol.
#[must_use]
pub fn may_be_secured(bytes: &[u8]) -> bool {
    Sealed::parse(bytes).is_some() || may_be_datagram(bytes)
}

/// Writes the head of a sealed datagram, and returns where the ciphertext goes.
pub(super) fn begin_sealed(channel: u32, counter: u64, out: &mut [u8; MAX_SEALED]) -> &mut [u8] {
    let head = SealedHead { magic: SEALED_MAGIC, channel: channel.into(), counter: counter.into() };
    let (place, ciphertext) = out.split_at_mut(SEALED_HEAD_BYTES);
    place.copy_from_slice(head.as_bytes());
    ciphertext
}

/// Length of the datagram with so many bytes of ciphertext.
pub(super) const fn sealed_length(ciphertext: usize) -> usize {
    SEALED_HEAD_BYTES + ciphertext
}

/// The first message of call number `call`.
pub(super) fn initiation(
    call: u64,
    first: &[u8; FIRST_MESSAGE_BYTES],
    ticket: &mut TicketKeys,
) -> DatagramBytes {
    let mut bytes = DatagramBytes::new();
    bytes.extend([0; INITIATION_BYTES]);
    bytes[HEADER_BYTES..][..FIRST_MESSAGE_BYTES].copy_from_slice(first);
    let header = Header { kind: DatagramKind::Initiation, sender: None, session: call };
    seal(header, &mut bytes);
    let stamp = ticket.stamp(&bytes[STAMPED_FROM..INITIATION_BYTES - STAMP_BYTES]);
    bytes[INITIATION_BYTES - STAMP_BYTES..].copy_from_slice(&stamp);
    seal(header, &mut bytes);
    bytes
}

/// The Noise message of a first message that a ticket holder has stamped, and the stamp.
pub(super) fn stamped_message<'a>(
    bytes: &'a [u8],
    ticket: &mut TicketKeys,
) -> Result<(&'a [u8], [u8; STAMP_BYTES]), InitiationError> {
    if bytes.len() != INITIATION_BYTES {
        return Err(InitiationError::Form);
    }
    let Some((stamped, stamp)) = bytes.split_last_chunk() else { return Err(InitiationError::Form) };
    if !ticket.has_stamped(&stamped[STAMPED_FROM..], stamp) {
        return Err(InitiationError::WithoutTicket);
    }
    Ok((&stamped[HEADER_BYTES..], *stamp))
}

/// What is wrong with a first message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum InitiationError {
    Form,
    WithoutTicket,
}

/// The answer to call number `call`.
pub(super) fn response(call: u64, second: &[u8; SECOND_MESSAGE_BYTES]) -> DatagramBytes {
    let mut bytes = DatagramBytes::new();
    bytes.extend([0; HEADER_BYTES]);
    bytes.extend(second.iter().copied());
    // Not from a newcomer, so that two versions never answer each other for ever.
    let (kind, sender) = (DatagramKind::Response, Some(HostIndex::FIRST));
    seal(Header { kind, sender, session: call }, &mut bytes);
    bytes
}

/// The answer to a first message that no ticket holder has made, or of another version: a header and nothing else.
pub(super) fn rejection(call: u64) -> DatagramBytes {
    let mut bytes = DatagramBytes::new();
    bytes.extend([0; HEADER_BYTES]);
    let (kind, sender) = (DatagramKind::Rejection, Some(HostIndex::FIRST));
    seal(Header { kind, sender, session: call }, &mut bytes);
    bytes
}
