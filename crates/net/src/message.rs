//! The control messages that hosts exchange, and the reasons for which a newcomer is turned away.

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_USERS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::Rate;
use serde::{Deserialize, Serialize};

use crate::route::Route;
use crate::text::Text;

/// Most bytes of a scene in one [`Control::ScenePart`].
pub(crate) const SCENE_PART_BYTES: usize = 1000;

/// Padding of a [`Control::SceneRequest`], bytes: more than the longest answer has beyond its own fields.
pub(crate) const SCENE_REQUEST_PADDING: usize = 1024;

/// One life of one host: a random number that a host draws when it starts, so that one that died and came back is told apart from
/// the old one. All members know it, and it proves nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PeerId(pub u64);

/// What hosts say to each other besides states.
#[expect(
    clippy::large_enum_variant,
    reason = "a message lives for one datagram, and a box would be an allocation"
)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Control {
    /// Newcomer to server; repeated until answered. With `cookie` 0 it is answered by a challenge.
    Join(Join),
    /// Server to newcomer: repeat the join with this cookie, to show that you receive by the route that you send from.
    Challenge {
        /// A hash of route, id and a secret of the server.
        cookie: u64,
    },
    /// Server to newcomer: you are in.
    Welcome {
        /// The session's id, from now on in every header.
        session: u64,
        /// The host index that the newcomer has from now on.
        host: HostIndex,
        /// The id of the server, by which the newcomer knows it from now on.
        server: PeerId,
    },
    /// Server to newcomer, or to a host that was replaced.
    Refuse(Refusal),
    /// Server to a host, repeated until acknowledged: who is in the session, and when it starts.
    Roster(Roster),
    /// The answer to a roster.
    RosterReceived {
        /// Which roster it was.
        revision: u32,
    },
    /// Between any two hosts that exchange state; greeting, keep-alive and first half of a clock exchange.
    Ping {
        /// The id of the sender: which life of it this is.
        id: PeerId,
        /// When it was sent, ns of the sender's clock (t1).
        sent_ns: i64,
        /// Whether the sender's clock is agreed upon, so that the session may start.
        ready: bool,
    },
    /// The answer to a ping.
    Pong {
        /// The id of the answering host.
        id: PeerId,
        /// Of the ping (t1).
        sent_ns: i64,
        /// When the ping arrived, ns of the answering host's clock (t2).
        received_ns: i64,
        /// When the answer was sent, ns of the answering host's clock (t3).
        answered_ns: i64,
    },
    /// The sender leaves; repeated until acknowledged.
    Leave {
        /// The id of the sender: which life of it this is.
        id: PeerId,
        /// Why it leaves, in words for people.
        reason: Text,
    },
    /// The answer to a leave.
    LeaveReceived,
    /// Someone without the scene asks for a part of its text. The padding makes the question as long as the answer.
    SceneRequest {
        /// First byte that is asked for.
        offset: u32,
        /// Zeros, as many as an answer has bytes beyond its own fields.
        padding: ArrayVec<u8, SCENE_REQUEST_PADDING>,
    },
    /// A part of the scene's text.
    ScenePart {
        /// Of the whole text, XXH3-64: parts with different hashes are not of the same scene.
        hash: u64,
        /// Bytes of the whole text.
        total: u32,
        /// Of the first byte here.
        offset: u32,
        /// The bytes of the text from there on.
        bytes: ArrayVec<u8, SCENE_PART_BYTES>,
    },
}

/// What a newcomer says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Join {
    /// From the challenge; 0 at first.
    pub cookie: u64,
    /// Hash of the newcomer's scene.
    pub scene_hash: u64,
    /// The newcomer's haptic rate.
    pub control_hz: Rate,
    /// The newcomer's network rate.
    pub network_hz: Rate,
    /// The user that it wants to be; `None` for any that is free.
    pub name: Option<Text>,
    /// Zeros: a join is at least as long as its answer, so that a forged sender address gains nothing.
    pub padding: ([u8; 32], [u8; 32]),
}

/// Who is in the session, and when it starts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Roster {
    /// Grows with every change.
    pub revision: u32,
    /// Instant of tick 0 on the server's clock, ns; `None` until enough hosts are there.
    pub origin_ns: Option<i64>,
    /// Everyone but the server.
    pub hosts: ArrayVec<RosterEntry, MAX_USERS>,
}

/// One host of the roster.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RosterEntry {
    /// The index of the host.
    pub host: HostIndex,
    /// The id of its present life.
    pub id: PeerId,
    /// Where the server reaches it.
    pub route: Route,
}

/// Why a host may not take part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The newcomer speaks another version of the protocol.
    #[error(
        "the server speaks protocol version {server}, this program speaks version {newcomer}; install the same version of cotouch on both"
    )]
    Version {
        /// The version that the server speaks.
        server: u16,
        /// The version that the newcomer speaks.
        newcomer: u16,
    },
    /// The newcomer has another scene.
    #[error(
        "the scenes differ (hash {server:016x} on the server, {newcomer:016x} here); both must use the same scene with the same --set values"
    )]
    Scene {
        /// The hash of the server's scene, XXH3-64.
        server: u64,
        /// The hash of the newcomer's scene, XXH3-64.
        newcomer: u64,
    },
    /// The newcomer runs at other rates.
    #[error("the rates differ: the server's are {control_hz} Hz control and {network_hz} Hz network")]
    Rates {
        /// The server's haptic rate.
        control_hz: Rate,
        /// The server's network rate.
        network_hz: Rate,
    },
    /// Every user of the scene is there.
    #[error("the session is full: all {users} users are present")]
    Full {
        /// Users of the scene.
        users: u8,
    },
    /// The user is there already.
    #[error("user {name:?} is already present")]
    NameTaken {
        /// The name that was asked for.
        name: Text,
    },
    /// The scene has no such user.
    #[error("the scene has no user {name:?}")]
    UnknownName {
        /// The name that was asked for.
        name: Text,
    },
    /// Someone else joined under the same name after this host had fallen silent.
    #[error("another host has joined under this user's name")]
    Replaced,
    /// The server is leaving.
    #[error("the server is closing the session")]
    Closing,
    /// Nobody answered (never sent: the newcomer's own conclusion).
    #[error(
        "no answer from the server; is `cotouch serve` running there, and does the address have the right port?"
    )]
    NoAnswer,
    /// The newcomer was let go of for what it sent.
    #[error("the server has expelled this host: {reason}")]
    Expelled {
        /// What it sent.
        reason: Text,
    },
    /// The server's time cannot be (never sent: the newcomer's own conclusion).
    #[error(
        "the server says that the session began over a year ago, or begins in over a minute, which cannot be"
    )]
    Time,
}
