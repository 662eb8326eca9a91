//! The layout of datagrams.
//!
//! Every datagram starts with the same 20-byte header, which no later protocol version may change, so that two
//! versions can tell each other apart:
//!
//! | bytes | field |
//! |---|---|
//! | 0..2 | magic `co` |
//! | 2..4 | protocol version |
//! | 4..8 | low half of XXH3-64 over bytes 8 to the end |
//! | 8 | kind |
//! | 9 | sender (host index; 255 before one was assigned) |
//! | 10..12 | zero |
//! | 12..20 | session id (in join, challenge, refusal and scene messages: the newcomer's peer id) |
//!
//! A state datagram goes on with step (u64), sample time (i64, ns of session time), number of entries (u8), three zero
//! bytes, and the entries: tag, index, what else is a byte, then `f64` components in the order of the fields of
//! [`Entry`]; a quaternion is x, y, z, w. A control datagram goes on with one
//! postcard-encoded [`Control`]. All numbers are little-endian; nothing may follow.

use arrayvec::ArrayVec;
use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::limits::{MAX_CHANNEL_VECTORS, MAX_ENTRIES, MAX_USERS};
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::SessionTime;
use glam::{DQuat, DVec3};
use xxhash_rust::xxh3::xxh3_64;
use zerocopy::little_endian::{F64, I64, U16, U32, U64};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

use crate::message::Control;
use crate::packet::{Entry, StatePacket};
use crate::route::Route;

/// Largest datagram, bytes: passes every path with the smallest IPv6 MTU of 1280.
pub const MAX_DATAGRAM: usize = 1200;

/// Version of everything that this crate puts on the wire.
pub const PROTOCOL_VERSION: u16 = 4;

/// Length of the header that every datagram starts with, bytes.
pub const HEADER_BYTES: usize = size_of::<RawHeader>();

const MAGIC: [u8; 2] = *b"co";
const NO_SENDER: u8 = 255;
/// A quaternion further than this from unit length (squared) is refused.
const UNIT_TOLERANCE: f64 = 1e-6;

/// The bytes of one datagram.
pub type DatagramBytes = ArrayVec<u8, MAX_DATAGRAM>;

/// A datagram to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Transmit {
    /// Where the receiver is reached.
    pub to: Route,
    /// The whole datagram, header and checksum included.
    pub bytes: DatagramBytes,
}

/// What a datagram holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DatagramKind {
    /// What a host sampled: a [`StatePacket`].
    State,
    /// What hosts say besides: a [`Control`] message.
    Control,
    /// A link measurement on its way out.
    Probe,
    /// The same on its way back.
    Echo,
    /// First message of a handshake.
    Initiation,
    /// The answer to it.
    Response,
    /// The answer to whoever may not talk to a host.
    Rejection,
}

impl DatagramKind {
    const ALL: [Self; 7] = [
        Self::State,
        Self::Control,
        Self::Probe,
        Self::Echo,
        Self::Initiation,
        Self::Response,
        Self::Rejection,
    ];

    const fn byte(self) -> u8 {
        match self {
            Self::State => 1,
            Self::Control => 2,
            Self::Probe => 3,
            Self::Echo => 4,
            Self::Initiation => 5,
            Self::Response => 6,
            Self::Rejection => 7,
        }
    }
}

/// The start of every datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// What follows after the header.
    pub kind: DatagramKind,
    /// Who sent it; `None` from a newcomer.
    pub sender: Option<HostIndex>,
    /// The session, or the newcomer's id where there is none yet.
    pub session: u64,
}

/// Why bytes are not a datagram of this protocol, or do not fit one.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WireError {
    /// Not ours at all.
    #[error("the datagram does not start with the magic bytes of cotouch")]
    Magic,
    /// Ours, of another version.
    #[error("the datagram is of protocol version {found}; this program speaks version {PROTOCOL_VERSION}")]
    Version {
        /// The version that the datagram says to be of.
        found: u16,
        /// The session field, which every version has: it tells a newcomer that the answer is meant for it.
        session: u64,
        /// Whether it says to come from a host that has no index yet, and so asks for an answer.
        from_newcomer: bool,
    },
    /// The checksum does not fit the content.
    #[error("the datagram's checksum is wrong: it was damaged on the way")]
    Checksum,
    /// The length does not fit the content.
    #[error("the datagram has {found} bytes where {expected} were expected")]
    Length {
        /// Bytes of the datagram.
        found: usize,
        /// Bytes that its content asks for, or that are allowed.
        expected: usize,
    },
    /// No such kind of datagram, or another than was asked for.
    #[error("datagram kind {0} is not expected here")]
    Kind(u8),
    /// A sender that no session has.
    #[error("the datagram's sender is host number {0}; a session has at most {MAX_USERS} hosts")]
    Sender(u8),
    /// Bytes that must be zero are not.
    #[error("reserved bytes of the datagram are not zero")]
    Reserved,
    /// The packet announces more entries than are allowed.
    #[error("the state packet announces {0} entries; at most {MAX_ENTRIES} are allowed")]
    EntryCount(u8),
    /// An entry has a tag that stands for nothing.
    #[error("entry tag {0} is unknown")]
    EntryTag(u8),
    /// An entry holds a NaN or an infinity.
    #[error("entry {entry} of the state packet holds a number that is not finite")]
    NotFinite {
        /// Which entry, from 0.
        entry: usize,
    },
    /// An orientation that is none.
    #[error("entry {entry} of the state packet holds a quaternion that is not of unit length")]
    NotUnit {
        /// Which entry, from 0.
        entry: usize,
    },
    /// A peer that no session has.
    #[error(
        "entry {entry} of the state packet is for host number {found}; a session has at most {MAX_USERS} hosts"
    )]
    Recipient {
        /// Which entry, from 0.
        entry: usize,
        /// The host's number, from 0.
        found: u8,
    },
    /// Not a control message.
    #[error("the control message cannot be read: {0}")]
    Control(postcard::Error),
}

#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
struct RawHeader {
    magic: [u8; 2],
    version: U16,
    checksum: U32,
    kind: u8,
    sender: u8,
    reserved: [u8; 2],
    session: U64,
}

/// Where the checksummed part starts.
const CHECKED_FROM: usize = 8;

#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
struct RawState {
    step: U64,
    sample_time_ns: I64,
    count: u8,
    reserved: [u8; 3],
}

#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
struct RawMotion {
    position: [F64; 3],
    orientation: [F64; 4],
    linear: [F64; 3],
    angular: [F64; 3],
}

#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
struct RawWrench {
    force: [F64; 3],
    torque: [F64; 3],
}

#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
struct RawChannel {
    to: u8,
    vectors: [[F64; 3]; 2 * MAX_CHANNEL_VECTORS],
}

const TAG_HAND: u8 = 1;
const TAG_OBJECT: u8 = 2;
const TAG_FORCE: u8 = 3;
const TAG_CHANNEL: u8 = 4;
/// Tag and index in front of every entry.
const ENTRY_HEAD_BYTES: usize = 2;

/// A state packet does not outgrow a datagram, whatever is in it.
const _: () = assert!(
    HEADER_BYTES + size_of::<RawState>() + MAX_ENTRIES * (ENTRY_HEAD_BYTES + size_of::<RawMotion>())
        <= MAX_DATAGRAM
        && size_of::<RawChannel>() <= size_of::<RawMotion>()
);

/// Writes `packet` as a datagram at the start of `out` and returns its length. Does not allocate.
///
/// # Errors
/// [`WireError::Length`] when `out` is too short; [`MAX_DATAGRAM`] bytes always suffice.
pub fn encode_state(
    session: u64,
    sender: HostIndex,
    sample_time: SessionTime,
    packet: &StatePacket,
    out: &mut [u8],
) -> Result<usize, WireError> {
    let mut writer = Writer { at: HEADER_BYTES, out };
    writer.put(&RawState {
        step: packet.step.into(),
        sample_time_ns: sample_time.0.into(),
        count: packet.entries.len() as u8,
        reserved: [0; 3],
    })?;
    for entry in &packet.entries {
        encode_entry(entry, &mut writer)?;
    }
    let length = writer.at;
    seal(Header { kind: DatagramKind::State, sender: Some(sender), session }, &mut out[..length]);
    Ok(length)
}

fn encode_entry(entry: &Entry, writer: &mut Writer<'_>) -> Result<(), WireError> {
    match entry {
        Entry::Hand { point, pose, twist } => {
            writer.put(&[TAG_HAND, *point])?;
            writer.put(&raw_motion(pose, twist))
        }
        Entry::Object { object, pose, twist } => {
            writer.put(&[TAG_OBJECT, *object])?;
            writer.put(&raw_motion(pose, twist))
        }
        Entry::Force { point, wrench } => {
            writer.put(&[TAG_FORCE, *point])?;
            writer.put(&RawWrench { force: raw_vector(wrench.force), torque: raw_vector(wrench.torque) })
        }
        Entry::Channel { to, object, vectors } => {
            writer.put(&[TAG_CHANNEL, *object])?;
            writer.put(&RawChannel { to: to.0, vectors: vectors.map(raw_vector) })
        }
    }
}

/// Reads a state datagram: its header, its sample time and the packet. Does not allocate.
///
/// # Errors
/// Every way in which the bytes can be wrong; see [`WireError`].
pub fn decode_state(bytes: &[u8]) -> Result<(Header, SessionTime, StatePacket), WireError> {
    let (header, body) = open(bytes)?;
    if header.kind != DatagramKind::State {
        return Err(WireError::Kind(header.kind.byte()));
    }
    let (sample_time, packet) = decode_state_body(body)?;
    Ok((header, sample_time, packet))
}

pub(crate) fn decode_state_body(body: &[u8]) -> Result<(SessionTime, StatePacket), WireError> {
    let mut reader = Reader { rest: body, length: HEADER_BYTES + body.len() };
    let raw: &RawState = reader.take()?;
    if usize::from(raw.count) > MAX_ENTRIES {
        return Err(WireError::EntryCount(raw.count));
    }
    if raw.reserved != [0; 3] {
        return Err(WireError::Reserved);
    }
    let mut entries = ArrayVec::new();
    for index in 0..usize::from(raw.count) {
        entries.push(decode_entry(index, &mut reader)?);
    }
    reader.finish()?;
    Ok((SessionTime(raw.sample_time_ns.get()), StatePacket { step: raw.step.get(), entries }))
}

fn decode_entry(entry: usize, reader: &mut Reader<'_>) -> Result<Entry, WireError> {
    let &[tag, index] = reader.take::<[u8; ENTRY_HEAD_BYTES]>()?;
    match tag {
        TAG_HAND => {
            let (pose, twist) = motion(entry, reader.take()?)?;
            Ok(Entry::Hand { point: index, pose, twist })
        }
        TAG_OBJECT => {
            let (pose, twist) = motion(entry, reader.take()?)?;
            Ok(Entry::Object { object: index, pose, twist })
        }
        TAG_FORCE => {
            let raw: &RawWrench = reader.take()?;
            let wrench = Wrench { force: vector(raw.force), torque: vector(raw.torque) };
            if !wrench.is_finite() {
                return Err(WireError::NotFinite { entry });
            }
            Ok(Entry::Force { point: index, wrench })
        }
        TAG_CHANNEL => {
            let raw: &RawChannel = reader.take()?;
            let vectors = raw.vectors.map(vector);
            if usize::from(raw.to) >= MAX_USERS {
                return Err(WireError::Recipient { entry, found: raw.to });
            }
            if !vectors.iter().all(|vector| vector.is_finite()) {
                return Err(WireError::NotFinite { entry });
            }
            Ok(Entry::Channel { to: HostIndex(raw.to), object: index, vectors })
        }
        _ => Err(WireError::EntryTag(tag)),
    }
}

fn motion(entry: usize, raw: &RawMotion) -> Result<(Pose, Twist), WireError> {
    let orientation = DQuat::from_array(raw.orientation.map(F64::get));
    let pose = Pose { position: vector(raw.position), orientation };
    let twist = Twist { linear: vector(raw.linear), angular: vector(raw.angular) };
    let finite = pose.position.is_finite() && twist.linear.is_finite() && twist.angular.is_finite();
    if !finite || !orientation.is_finite() {
        return Err(WireError::NotFinite { entry });
    }
    // Written so that an overflowing square is refused too.
    let deviation = (orientation.length_squared() - 1.0).abs();
    if deviation <= UNIT_TOLERANCE { Ok((pose, twist)) } else { Err(WireError::NotUnit { entry }) }
}

fn raw_motion(pose: &Pose, twist: &Twist) -> RawMotion {
    RawMotion {
        position: raw_vector(pose.position),
        orientation: pose.orientation.to_array().map(F64::new),
        linear: raw_vector(twist.linear),
        angular: raw_vector(twist.angular),
    }
}

fn raw_vector(vector: DVec3) -> [F64; 3] {
    vector.to_array().map(F64::new)
}

fn vector(raw: [F64; 3]) -> DVec3 {
    DVec3::from_array(raw.map(F64::get))
}

/// The datagram of a control message.
///
/// # Errors
/// [`WireError::Control`] when it does not fit; no message that this crate makes is so long.
pub fn encode_control(
    session: u64,
    sender: Option<HostIndex>,
    control: &Control,
) -> Result<DatagramBytes, WireError> {
    let mut bytes = DatagramBytes::from([0; MAX_DATAGRAM]);
    let used = postcard::to_slice(control, &mut bytes[HEADER_BYTES..]).map_err(WireError::Control)?.len();
    bytes.truncate(HEADER_BYTES + used);
    seal(Header { kind: DatagramKind::Control, sender, session }, &mut bytes);
    Ok(bytes)
}

/// Reads a control datagram.
///
/// # Errors
/// Every way in which the bytes can be wrong; see [`WireError`].
pub fn decode_control(bytes: &[u8]) -> Result<(Header, Control), WireError> {
    let (header, body) = open(bytes)?;
    if header.kind != DatagramKind::Control {
        return Err(WireError::Kind(header.kind.byte()));
    }
    Ok((header, decode_control_body(body)?))
}

pub(crate) fn decode_control_body(body: &[u8]) -> Result<Control, WireError> {
    let (control, rest) = postcard::take_from_bytes(body).map_err(WireError::Control)?;
    if rest.is_empty() {
        return Ok(control);
    }
    let found = HEADER_BYTES + body.len();
    Err(WireError::Length { found, expected: found - rest.len() })
}

/// Checks everything about a datagram that does not depend on its kind; returns the header and what follows it.
///
/// # Errors
/// Magic, version, checksum, kind, sender, length.
pub fn open(bytes: &[u8]) -> Result<(Header, &[u8]), WireError> {
    if bytes.len() > MAX_DATAGRAM {
        return Err(WireError::Length { found: bytes.len(), expected: MAX_DATAGRAM });
    }
    let (raw, body) = RawHeader::ref_from_prefix(bytes)
        .map_err(|_| WireError::Length { found: bytes.len(), expected: HEADER_BYTES })?;
    if raw.magic != MAGIC {
        return Err(WireError::Magic);
    }
    if raw.checksum.get() != checksum(bytes) {
        return Err(WireError::Checksum);
    }
    let session = raw.session.get();
    if raw.version.get() != PROTOCOL_VERSION {
        let from_newcomer = raw.sender == NO_SENDER;
        return Err(WireError::Version { found: raw.version.get(), session, from_newcomer });
    }
    let kind = DatagramKind::ALL
        .into_iter()
        .find(|kind| kind.byte() == raw.kind)
        .ok_or(WireError::Kind(raw.kind))?;
    if raw.reserved != [0; 2] {
        return Err(WireError::Reserved);
    }
    let sender = match raw.sender {
        NO_SENDER => None,
        host if usize::from(host) < MAX_USERS => Some(HostIndex(host)),
        host => return Err(WireError::Sender(host)),
    };
    Ok((Header { kind, sender, session }, body))
}

/// Whether it is as long as a datagram, and begins and is sound as one of any version.
pub(crate) fn may_be_datagram(bytes: &[u8]) -> bool {
    (HEADER_BYTES..=MAX_DATAGRAM).contains(&bytes.len())
        && bytes.starts_with(&MAGIC)
        && bytes[4..CHECKED_FROM] == checksum(bytes).to_le_bytes()
}

/// Writes the header, whose checksum covers all that already stands behind it. `datagram` holds at least a header.
pub(crate) fn seal(header: Header, datagram: &mut [u8]) {
    let mut raw = RawHeader {
        magic: MAGIC,
        version: PROTOCOL_VERSION.into(),
        checksum: 0.into(),
        kind: header.kind.byte(),
        sender: header.sender.map_or(NO_SENDER, |host| host.0),
        reserved: [0; 2],
        session: header.session.into(),
    };
    datagram[..HEADER_BYTES].copy_from_slice(raw.as_bytes());
    raw.checksum = checksum(datagram).into();
    datagram[..HEADER_BYTES].copy_from_slice(raw.as_bytes());
}

/// UDP's own 16-bit sum misses one damaged datagram in 65,536, and is optional on IPv4.
fn checksum(datagram: &[u8]) -> u32 {
    xxh3_64(&datagram[CHECKED_FROM..]) as u32
}

struct Writer<'a> {
    out: &'a mut [u8],
    at: usize,
}

impl Writer<'_> {
    fn put(&mut self, value: &(impl IntoBytes + Immutable)) -> Result<(), WireError> {
        let bytes = value.as_bytes();
        let (found, expected) = (self.out.len(), self.at + bytes.len());
        let target = self.out.get_mut(self.at..expected).ok_or(WireError::Length { found, expected })?;
        target.copy_from_slice(bytes);
        self.at = expected;
        Ok(())
    }
}

struct Reader<'a> {
    rest: &'a [u8],
    /// Of the whole datagram.
    length: usize,
}

impl<'a> Reader<'a> {
    fn take<T: FromBytes + KnownLayout + Immutable + Unaligned>(&mut self) -> Result<&'a T, WireError> {
        let (value, rest) = T::ref_from_prefix(self.rest).map_err(|_| WireError::Length {
            found: self.length,
            expected: self.length - self.rest.len() + size_of::<T>(),
        })?;
        self.rest = rest;
        Ok(value)
    }

    fn finish(self) -> Result<(), WireError> {
        match self.rest.len() {
            0 => Ok(()),
            extra => Err(WireError::Length { found: self.length, expected: self.length - extra }),
        }
    }
}
